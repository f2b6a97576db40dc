"""Gaps, normals and rows of contacts against brute force: the nearest of many points, and differences along a motion."""

import pickle
from collections.abc import Callable
from functools import cache
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp
from scipy.interpolate import CubicSpline, NdBSpline, RectBivariateSpline
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

import symdyn as sd
from symdyn.errors import ModelError, SimulationWarning
from symdyn.model.contacts.grid import grid_spline_of, line_spline_of
from symdyn.pipeline import emit
from symdyn.runtime.integrating.contacts import numbers
from tests.helpers import swept

Shapes = sd.contacts
X, Y = sp.symbols("X Y")


@cache
def two_bodies(name: str) -> Any:
    """A free body a in contact with a body b that slides and turns."""
    planar = name.endswith("curve")
    system = sd.System("two", planar=planar)
    a, b = (system.add_body(body, mass=2.0, inertia=0.3 if planar else [0.3, 0.4, 0.5], com=[0.1, 0.2, 0.0]) for body in "ab")
    if planar:
        system.add_joint(sd.Planar("free", system.ground, a))
        system.add_joint(sd.Planar("other", system.ground, b))
    else:
        system.add_joint(sd.Free("free", system.ground, a, orientation=sd.EulerParameters()))
        system.add_joint(sd.Cylindrical("other", system.ground, b, axis=[0.6, 0, 0.8], parent_point=[0.1, 0.2, 0.3]))
    system.add_contact(sd.Contact("touch", "a", "b", shape=ROUGH.get(name) or CASES[name][0],
                                  friction=0 if name.startswith("box") else 0.5))
    return system.embedding().compile(backend="numpy")


def rotations(module: Any, x: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Position and rotation of a and b."""
    frames = module.evaluate("frames", 0.0, x)
    return [(row[:3], row[3:].reshape(3, 3)) for row in frames]


def circle(radius: float, axis: np.ndarray, center: np.ndarray) -> np.ndarray:
    turned = Rotation.align_vectors([axis], [[0, 0, 1]])[0].as_matrix()
    angles = np.linspace(0, 2 * np.pi, 60_001)
    return center + radius * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles]) @ turned.T


def above(points: np.ndarray, normal: np.ndarray, point: np.ndarray) -> float:
    return float(((points - point) @ normal).min())


def near(points: np.ndarray, point: np.ndarray) -> float:
    return float(np.linalg.norm(points - point, axis=1).min())


def far(points: np.ndarray, point: np.ndarray) -> float:
    return float(np.linalg.norm(points - point, axis=1).max())


AXIS, CENTER = np.array([0.0, 0.6, 0.8]), np.array([0.1, -0.2, 0.3])
NORMAL, POINT = np.array([1.0, 2.0, 2.0]) / 3, np.array([0.2, 0.1, -0.4])
PLANE = Shapes.Plane([1, 2, 2], POINT.tolist())
CASES: dict[str, tuple[Any, Callable[..., float]]] = {
    "point": ((Shapes.Point(CENTER.tolist()), PLANE), lambda p: above(p(CENTER[None]), NORMAL, POINT)),
    "sphere": ((Shapes.Sphere(0.2, CENTER.tolist()), PLANE), lambda p: above(p(CENTER[None]), NORMAL, POINT) - 0.2),
    "disc": ((Shapes.Disc(0.3, AXIS.tolist(), CENTER.tolist()), PLANE),
             lambda p: above(p(circle(0.3, AXIS, CENTER)), NORMAL, POINT)),
    "torus": ((Shapes.Torus(0.3, 0.05, AXIS.tolist(), CENTER.tolist()), PLANE),
              lambda p: above(p(circle(0.3, AXIS, CENTER)), NORMAL, POINT) - 0.05),
    "cylinder": ((Shapes.Cylinder(0.3, 1.0, AXIS.tolist(), CENTER.tolist()), PLANE),
                 lambda p: above(p(circle(0.3, AXIS, CENTER + AXIS / 2)), NORMAL, POINT)),
    "spheres": ((Shapes.Sphere(0.2, CENTER.tolist()), Shapes.Sphere(0.1, POINT.tolist())),
                lambda p: float(np.linalg.norm(p(CENTER[None])[0] - POINT)) - 0.3),
    "disc and sphere": ((Shapes.Disc(0.3, AXIS.tolist(), CENTER.tolist()), Shapes.Sphere(0.1, POINT.tolist())),
                        lambda p: near(p(circle(0.3, AXIS, CENTER)), POINT) - 0.1),
    "torus and sphere": ((Shapes.Torus(0.3, 0.05, AXIS.tolist(), CENTER.tolist()), Shapes.Sphere(0.1, POINT.tolist())),
                         lambda p: near(p(circle(0.3, AXIS, CENTER)), POINT) - 0.15),
    "cylinder and sphere": ((Shapes.Cylinder(0.3, 1.0, AXIS.tolist(), CENTER.tolist()), Shapes.Sphere(0.1, POINT.tolist())),
                            lambda p: near(p(circle(0.3, AXIS, CENTER + AXIS / 2)), POINT) - 0.1),
    "torus in a bore": ((Shapes.Torus(0.3, 0.05, AXIS.tolist(), CENTER.tolist()), Shapes.Bore(2.0, POINT.tolist())),
                        lambda p: 1.95 - far(p(circle(0.3, AXIS, CENTER)), POINT)),
    "box and sphere": ((Shapes.Box([0.2, 0.4, 0.6], CENTER.tolist()), Shapes.Sphere(0.1, POINT.tolist())),
                       lambda p: near(p(CENTER[None] - [[0.1, 0.2, 0.3]]), POINT) - 0.1),
    "box": ((Shapes.Box([0.2, 0.4, 0.6], CENTER.tolist()), PLANE),
            lambda p: above(p(CENTER[None] - [[0.1, 0.2, 0.3]]), NORMAL, POINT)),
}
# Others have these shapes in other pairs.
OFTEN = "point", "torus", "cylinder", "disc and sphere", "torus in a bore", "box"
WAVES = sp.sin(X) * Y / 3
GRID = np.linspace(-3, 3, 13)
SPLINE = RectBivariateSpline(GRID, GRID, np.sin(GRID)[:, None] * GRID / 3)
ROUGH: dict[str, Any] = {
    "curve": (Shapes.Point([0.2, 0.1]), Shapes.Curve(sp.sin(X) / 3, X)),
    "circle on a curve": (Shapes.Sphere(0.3, [0.2, 0.1]), Shapes.Curve(sp.sin(X) / 3, X)),
    "surface": (Shapes.Point([0.2, 0.1, 0.3]), Shapes.Surface(WAVES, X, Y)),
    "sphere on a surface": (Shapes.Sphere(0.3, [0.2, 0.1, 0.3]), Shapes.Surface(WAVES, X, Y)),
    "sphere on a spline": (Shapes.Sphere(0.3, [0.2, 0.1, 0.3]), Shapes.Surface(SPLINE, X, Y)),
    "disc on a surface": (Shapes.Disc(0.3, AXIS.tolist(), CENTER.tolist()), Shapes.Surface(WAVES, X, Y)),
    "torus on a spline": (Shapes.Torus(0.3, 0.05, AXIS.tolist(), CENTER.tolist()), Shapes.Surface(SPLINE, X, Y))}


def state(module: Any, seed: int) -> np.ndarray:
    stream = np.random.default_rng(seed)
    x = stream.uniform(-0.7, 0.7, module.metadata.sizes.x)
    if module.metadata.unit_groups:
        x[3:7] /= np.linalg.norm(x[3:7])
    return x


@pytest.mark.parametrize("name", swept(CASES, *OFTEN))
def test_gap_is_that_of_the_nearest_point(name: str) -> None:
    distance, module = CASES[name][1], two_bodies(name)
    for seed in range(3):
        x = state(module, seed)
        (p_a, R_a), (p_b, R_b) = rotations(module, x)
        gap = numbers(module, 0.0, x, module.default_parameters, ()).gap[0]
        assert gap == pytest.approx(distance(lambda at, a=(p_a, R_a), b=(p_b, R_b): (at @ a[1].T + a[0] - b[0]) @ b[1]), abs=1e-9)


@pytest.mark.parametrize("name", swept([*CASES, *ROUGH], *OFTEN, "curve", "circle on a curve", "surface", "torus on a spline"))
def test_rows_are_the_rate_of_the_gap_and_the_metric_of_the_mass_matrix(name: str) -> None:
    """The first row by differences of the gap along the motion, D = J M^-1 J^T by differences of the rows by the speeds."""
    module = two_bodies(name)
    p, n_q = module.default_parameters, module.metadata.sizes.q
    x = state(module, 5)
    if name in ROUGH:  # scaled by its gradient the gap is the distance to first order: onto the surface
        for _ in range(30):
            at = numbers(module, 0.0, x, p, ())
            x[:n_q] -= at.coordinates[:, 0] * at.gap[0] / at.D[0, 0]
            if module.metadata.unit_groups:
                x[3:7] /= np.linalg.norm(x[3:7])
    at = numbers(module, 0.0, x, p, ())
    rate = module.rhs(0.0, x)
    h = 1e-6

    def gap(step: float) -> float:
        moved = x + step * rate
        return float(numbers(module, 0.0, moved, p, ()).gap[0])

    assert at.slip[0] == pytest.approx((gap(h) - gap(-h)) / (2 * h), abs=1e-8)
    columns = []
    for k in range(n_q, len(x)):
        step = np.zeros(len(x))
        step[k] = 1.0
        columns.append(numbers(module, 0.0, x + step, p, ()).slip - at.slip)
    J = np.array(columns).T
    M = module.mass_matrix(0.0, x)
    assert np.allclose(at.D, J @ np.linalg.solve(M, J.T), rtol=1e-10, atol=1e-10)
    assert np.allclose(at.speeds, np.linalg.solve(M, J.T), rtol=1e-10, atol=1e-10)
    later, sooner = (numbers(module, 0.0, x + s * h * rate, p, ()).slip for s in (1, -1))
    assert np.allclose(at.free, (later - sooner) / (2 * h), atol=1e-7)


def test_pair_of_forces_does_no_work_but_against_slip_and_keeps_momentum() -> None:
    """Two spheres that hit each other with friction keep their momenta and lose energy."""
    system = sd.System("spheres")
    for name, mass in (("a", 1.0), ("b", 3.0)):
        body = system.add_body(name, mass=mass, inertia=[0.004 * mass] * 3)
        system.add_joint(sd.Free(f"free_{name}", system.ground, body, orientation=sd.EulerParameters()))
    pair = (Shapes.Sphere(0.1), Shapes.Sphere(0.2))
    system.add_contact(sd.Contact("touch", "a", "b", shape=pair, friction=0.3, restitution=0.7))
    module = system.compile()
    start = np.array([-1, 0.1, 0.05, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0], dtype=float)
    solution = module.simulate((0, 1), q=start, u=[3, 0, 0, 1, 2, 3, 0, 0, 0, -1, 0, 2], rtol=1e-12)
    touch = solution.contacts["touch"]
    assert len(touch.impacts.t) == 1
    v_a, v_b, w_a, w_b = solution.u[:, :3], solution.u[:, 6:9], solution.u[:, 3:6], solution.u[:, 9:]
    assert np.abs(np.diff(v_a + 3 * v_b, axis=0)).max() < 1e-12
    R_a, R_b = (Rotation.from_quat(solution.q[:, [k + 1, k + 2, k + 3, k]]) for k in (3, 10))
    spins = 0.004 * (R_a.apply(w_a) + 3 * R_b.apply(w_b))
    angular = np.cross(solution.q[:, :3], v_a) + 3 * np.cross(solution.q[:, 7:10], v_b) + spins
    assert np.abs(np.diff(angular, axis=0)).max() < 1e-11
    assert touch.impacts.after[0, 0] == pytest.approx(-0.7 * touch.impacts.before[0, 0], rel=1e-12)
    impulse = touch.impacts.impulse[0]
    assert np.linalg.norm(impulse[1:]) <= 0.3 * impulse[0] * (1 + 1e-9)
    assert solution.energy[-1] < solution.energy[0]


def test_a_road_given_as_a_spline_is_that_of_its_polynomials() -> None:
    """Where a point that falls on it turns back is a zero of SciPy's own spline, also beyond its ends."""
    along = np.linspace(-1, 1, 9)
    road = CubicSpline(along, 0.2 * np.sin(3 * along))
    system = sd.System("road", gravity=[0, -10])
    body = system.add_body("body", mass=1.0, inertia=0.1)
    system.add_joint(sd.Planar("free", system.ground, body, sd.coordinates("x y theta")))
    system.add_contact(sd.Contact("sole", body, system.ground, shape=(Shapes.Point(), Shapes.Curve(road, X)), restitution=0.5))
    module = system.compile()
    for x, speed in ((-0.9, 3.0), (0.2, -1.0), (0.9, 1.0)):
        found = module.simulate((0, 0.6), q=[x, 1.0, 0], u=[speed, 0, 0], rtol=1e-12).contacts["sole"].impacts.t[0]
        expected = brentq(lambda t, x=x, speed=speed: 1 - 5 * t**2 - road(x + speed * t), 0.2, 0.6, xtol=1e-14)
        assert found == pytest.approx(expected, abs=1e-12)


def wheel(pair: Any, **law: Any) -> Any:
    """A circle of radius 0.2 m that touches the ground by a pair of shapes."""
    system = sd.System("circle", gravity=[0, -9.81])
    body = system.add_body("body", mass=1.0, inertia=0.016)
    system.add_joint(sd.Planar("free", system.ground, body, sd.coordinates("x y theta")))
    system.add_contact(sd.Contact("touch", body, system.ground, shape=pair, **law))
    return system.embedding().compile()


def ball(pair: Any, **law: Any) -> sd.System:
    system = sd.System("ball", gravity=[0, 0, -9.81])
    body = system.add_body("body", mass=1.0, inertia=[0.016, 0.016, 0.02])
    system.add_joint(sd.Free("free", system.ground, body, orientation=sd.EulerParameters()))
    system.add_contact(sd.Contact("touch", body, system.ground, shape=pair, **law))
    return system


BOWL = 2 - sp.sqrt(4 - X**2)
SPHERE = Shapes.Sphere(0.2)
SAME = {
    "a circle in a bowl": (Shapes.Curve(BOWL, X), Shapes.Bore(2, [0, 2]), {"friction": 0.05, "restitution": 0.5}, [-0.9, 0.9, 0]),
    "a circle on a hill": (Shapes.Curve(-BOWL, X), Shapes.Sphere(2, [0, -2]), {"friction": 0.3},
                           [0.1, np.sqrt(2.2**2 - 0.1**2) - 2, 0]),
    "a circle on a slope": (Shapes.Curve(-X / 3, X), Shapes.Plane([1 / 3, 1]), {"friction": 0.3, "restitution": 0.5}, [0, 1, 0])}


@pytest.mark.parametrize("name", swept(SAME, "a circle in a bowl"))
def test_a_circle_on_a_curve_moves_as_on_the_shape_that_the_curve_is(name: str) -> None:
    curve, shape, law, start = SAME[name]
    runs = [wheel((SPHERE, other), **law).simulate((0, 1), q=start, rtol=1e-11) for other in (curve, shape)]
    assert len(runs[0].contacts["touch"].impacts.t) == len(runs[1].contacts["touch"].impacts.t)
    assert np.abs(runs[0].x - runs[1].x).max() < 1e-9
    assert np.abs(runs[0].contacts["touch"].force - runs[1].contacts["touch"].force).max() < 1e-8


def test_shapes_in_space_move_on_surfaces_as_on_the_shapes_that_these_are() -> None:
    """A ball in a bowl; a tyre that falls on a slope, given as a spline over a grid and as a plane."""
    bowl = Shapes.Surface(2 - sp.sqrt(4 - X**2 - Y**2), X, Y)
    rolls: dict[str, Any] = {"q": [-0.9, 0.1, 0.9, 1, 0, 0, 0], "u": [0, 0.5, 0, 0, 0, 3.0], "rtol": 1e-11}
    round_ones = (bowl, Shapes.Bore(2, [0, 0, 2]))
    runs = [ball((SPHERE, other), friction=0.3).compile().simulate((0, 0.5), **rolls) for other in round_ones]
    assert [mode for _, mode in runs[0].contacts["touch"].switches] == ["open", "sticking"]
    assert np.abs(runs[0].x - runs[1].x).max() < 1e-9
    spline = RectBivariateSpline(GRID, GRID, GRID[:, None] / 5 + GRID / 10)
    falls: dict[str, Any] = {"q": [0, 0, 0.4, np.cos(0.4), np.sin(0.4), 0, 0], "u": [0, 0.5, 0, 3, 2, 1], "rtol": 1e-11}
    others = (Shapes.Plane([-1 / 5, -1 / 10, 1]), Shapes.Surface(spline, X, Y))
    tyre = Shapes.Torus(0.15, 0.05)
    plane, run = [ball((tyre, other), friction=0.3).compile().simulate((0, 0.4), **falls) for other in others]
    assert plane.contacts["touch"].mode[-1] != "open"
    assert np.abs(run.x - plane.x).max() < 1e-10


def test_a_road_keeps_the_energy_of_what_slides_on_it_and_its_module_travels() -> None:
    """Without friction; the road is a spline, whose third derivative jumps at its knots, and the module a copy."""
    along = np.linspace(-3, 3, 16)
    module = wheel((SPHERE, Shapes.Curve(CubicSpline(along, 0.1 * np.cos(2 * along)), X)))
    module = pickle.loads(pickle.dumps(module))
    solution = module.simulate((0, 2), q=[0.2, 0.35, 0], u=[1, 0, 0], rtol=1e-11)
    closed = solution.contacts["touch"].mode == "sliding"
    assert closed[-1] and closed.sum() > 500
    assert np.ptp(solution.energy[closed]) < 1e-8
    assert np.abs(solution.contacts["touch"].gap[closed]).max() < 1e-9


def on_a_cam(pair: Any) -> sd.System:
    """A roller that moves freely in the plane, and a cam that turns."""
    system = sd.System("cam", gravity=[0, -9.81])
    roller, cam = (system.add_body(name, mass=1.0, inertia=inertia) for name, inertia in (("roller", 0.016), ("cam", 0.1)))
    system.add_joint(sd.Planar("free", system.ground, roller, sd.coordinates("x y theta")))
    system.add_joint(sd.Revolute("turn", system.ground, cam, sd.coordinates("phi")))
    system.add_contact(sd.Contact("touch", roller, cam, shape=pair, friction=0.3, restitution=0.2))
    return system


OFF, SIZE = 0.1, 0.5
ECCENTRIC = OFF * sp.cos(X) + sp.sqrt(SIZE**2 - OFF**2 * sp.sin(X)**2)


@cache
def on_the_cam(shape: Any, cam: Any) -> np.ndarray:
    """A motion of a roller or a point on a cam that turns."""
    start: dict[str, Any] = {"q": {"x": 0.05, "y": 1.0, "phi": 0.3}, "u": {"phi_dot": 2.0}, "rtol": 1e-9}
    solution = on_a_cam((shape, cam)).embedding().compile().simulate((0, 0.6), **start)
    assert [mode for _, mode in solution.contacts["touch"].switches] == ["open", "sticking"]
    return np.asarray(solution.x)


CIRCLE = Shapes.Sphere(SIZE, (OFF, 0))


@pytest.mark.parametrize("shape", swept([SPHERE, Shapes.Point()], SPHERE))
def test_a_cam_is_the_eccentric_circle_that_it_describes(shape: Any) -> None:
    assert np.abs(on_the_cam(shape, Shapes.Cam(ECCENTRIC, X)) - on_the_cam(shape, CIRCLE)).max() < 1e-8


def test_a_cam_given_as_a_periodic_spline_is_that_of_its_expression() -> None:
    turn = np.linspace(0, 2 * np.pi, 201)
    values = sp.lambdify(X, ECCENTRIC)(turn)
    values[-1] = values[0]
    spline = Shapes.Cam(CubicSpline(turn, values, bc_type="periodic"), X)
    assert np.abs(on_the_cam(SPHERE, spline) - on_the_cam(SPHERE, CIRCLE)).max() < 2e-6  # of the interpolation


@pytest.mark.parametrize("shape", [Shapes.Point(), SPHERE])
def test_the_gap_above_a_cam_is_the_distance_to_first_order(shape: Any) -> None:
    """All around an eccentric circle, whose normal is up to 37 degrees away from the way to the axis of the cam."""
    off, size, distance = 0.3, 0.5, 1e-4
    module = wheel((shape, Shapes.Cam(off * sp.cos(X) + sp.sqrt(size**2 - off**2 * sp.sin(X)**2), X)))
    away = size + distance + (0.2 if shape == SPHERE else 0)
    for angle in np.linspace(0, 2 * np.pi, 12):
        x = np.array([off + away * np.cos(angle), away * np.sin(angle), 0, 0, 0, 0])
        assert numbers(module, 0.0, x, module.default_parameters, ()).gap[0] == pytest.approx(distance, rel=1e-3)


TYRE = Shapes.Torus(0.15, 0.05)
SOFT: dict[str, Any] = {"law": "compliant", "friction": 0.3,
                        "compliance": Shapes.Compliance(2000.0, dissipation=0.2, located=True)}


@pytest.mark.filterwarnings("error::symdyn.errors.SimulationWarning")
@pytest.mark.parametrize("name", swept(SAME, "a circle in a bowl"))
def test_a_circle_deep_in_a_curve_moves_as_in_the_shape_that_the_curve_is(name: str) -> None:
    curve, shape, _, start = SAME[name]
    runs = [wheel((SPHERE, other), **SOFT).simulate((0, 1), q=start, rtol=1e-11) for other in (curve, shape)]
    gaps = [run.contacts["touch"].gap for run in runs]
    assert gaps[1].min() < -0.03
    assert np.abs(runs[0].x - runs[1].x).max() < 1e-8
    assert np.abs(gaps[0] - gaps[1])[gaps[1] < 0].max() < 1e-8


@pytest.mark.filterwarnings("error::symdyn.errors.SimulationWarning")
@pytest.mark.parametrize("shape", swept([SPHERE, Shapes.Disc(0.2), TYRE], TYRE))
def test_shapes_deep_in_a_surface_move_as_in_the_bowl_that_it_is(shape: Any) -> None:
    bowl = Shapes.Surface(2 - sp.sqrt(4 - X**2 - Y**2), X, Y)
    q, u = [-0.9, 0.1, 0.9, np.cos(0.5), np.sin(0.5), 0, 0], [0, 0.5, 0, 0, 1.0, 3.0]
    others = (bowl, Shapes.Bore(2, [0, 0, 2]))
    runs = [ball((shape, other), **SOFT).compile().simulate((0, 0.5), q, u, rtol=1e-11) for other in others]
    assert runs[1].contacts["touch"].gap.min() < -0.03
    assert np.abs(runs[0].x - runs[1].x).max() < 1e-8


@pytest.mark.sweep
def test_a_circle_deep_in_a_cam_moves_as_in_the_eccentric_circle_that_it_is() -> None:
    pairs = [(SPHERE, Shapes.Cam(ECCENTRIC, X)), (SPHERE, Shapes.Sphere(SIZE, [OFF, 0]))]
    runs = [wheel(pair, **SOFT).simulate((0, 0.6), q=[0.05, 1.0, 0], rtol=1e-11) for pair in pairs]
    assert runs[1].contacts["touch"].gap.min() < -0.03
    assert np.abs(runs[0].x - runs[1].x).max() < 1e-8


BENT = {"a point in a parabola": Shapes.Curve(X**2, X),
        "a point in a spline": Shapes.Curve(CubicSpline(GRID, GRID**2), X),
        "a circle in a parabola": Shapes.Curve(X**2, X),
        "a point on a cam": Shapes.Cam(1 + sp.cos(2 * X) / 5, X),
        "a circle on a cam": Shapes.Cam(1 + sp.cos(2 * X) / 5, X),
        "a point in a surface": Shapes.Surface(X**2 + Y**2 / 2, X, Y),
        "a torus in a surface": Shapes.Surface(X**2 + Y**2 / 2, X, Y)}


@pytest.mark.parametrize("name", swept(BENT, "a point in a spline", "a circle in a parabola", "a point on a cam",
                                        "a point in a surface"))
def test_what_is_deep_in_a_bent_shape_keeps_its_energy(name: str) -> None:
    """Kinetic and potential energy with that of the depth d, 2/5 k d^(5/2); the shape is fixed to a body that swings."""
    space, stiffness = name.endswith("surface"), 2000.0
    system = sd.System("bent", gravity=[0.3, 0, -9.81] if space else [0.3, -9.81])
    body, bent = (system.add_body(kind, mass=m, inertia=[0.2 * m, 0.3 * m, 0.1 * m] if space else 0.1 * m)
                  for kind, m in (("body", 1.0), ("bent", 20.0)))
    system.add_joint(sd.Free("free", system.ground, body) if space else sd.Planar("free", system.ground, body))
    system.add_joint(sd.Revolute("swing", system.ground, bent))
    inside = [0.05, 0.02, 0.01] if space else [0.05, 0.02]
    shape = (Shapes.Point(inside) if "point" in name else Shapes.Torus(0.15, 0.05, [0, 1, 0.2], inside) if "torus" in name
             else Shapes.Sphere(0.2, inside))
    law = {"law": "compliant", "compliance": Shapes.Compliance(stiffness)}
    system.add_contact(sd.Contact("touch", body, bent, shape=(shape, BENT[name]), **law))
    module = system.embedding().compile()
    q = [0.3, 0.1, 0.6, 0.1, 0.2, 0.3, 0] if space else [0.3, 1.6 if "cam" in name else 0.7, 0.3, 0]
    u = [0.5, 0.3, 0, 0.2, 0.1, 0.3, 0.4] if space else [0.2, 0, 0.5, 0.4]
    solution = module.simulate((0, 0.6), q=q, u=u, rtol=1e-10)
    depth = np.maximum(0, -solution.contacts["touch"].gap)
    energy = solution.energy + 2 / 5 * stiffness * depth**2.5
    assert depth.max() > 0.05
    assert np.ptp(energy) < 2e-6
    k = int(depth.argmax())
    in_numpy = system.compile(backend="numpy").rhs(solution.t[k], solution.x[k])
    assert in_numpy == pytest.approx(module.rhs(solution.t[k], solution.x[k]), rel=1e-9, abs=1e-9)
    step = 1e-6 * np.eye(len(q) + len(u))
    slopes = [(module.rhs(0.0, solution.x[k] + d) - module.rhs(0.0, solution.x[k] - d)) / 2e-6 for d in step]
    assert np.allclose(module.jacobian(0.0, solution.x[k]).x, np.transpose(slopes), rtol=1e-5, atol=1e-4)


def test_what_is_wider_than_a_hollow_is_reported_where_it_touches_twice() -> None:
    module = wheel((SPHERE, Shapes.Curve(sp.sqrt(X**2 + sp.Rational(1, 10000)), X)))
    start = [-0.5, 1.2, 0]
    with pytest.warns(SimulationWarning, match="contact touch is closed, and its shape touches in another place, too"):
        stopped = module.simulate((0, 2), q=start, rtol=1e-9)
    assert abs(stopped["x"][-1]) < 1e-3 and stopped["x"][-2] < 0


def ramp(order: int) -> sd.External:
    name = f"ramp_{order}"
    text = f"static int {name}(const double *in, double *out) {{ out[0] = {order} ? {order} < 2 : in[0]; return 0; }}"
    return sd.External(name, ["x"], c=text, derivative=ramp(order + 1) if order < 3 else None)


RAMP = ramp(0)


@pytest.mark.parametrize(("cam", "message"), [
    (Shapes.Cam(1 + sp.cos(X) / 9, 3), r"the angle of a Cam is 3; pass the symbol"),  # type: ignore[arg-type]
    (Shapes.Cam(1 + X / 9, X), r"the radius X/9 \+ 1 of a Cam has not the period 2 pi; write it by sines and cosines"),
    (Shapes.Cam(X * sd.t, X), r"the radius depends on t; a Cam is fixed to its body: write it by X and parameters"),
    (Shapes.Cam(CubicSpline([0, 3, 6], [1, 2, 1]), X), r"the spline of a Cam goes from 0 to 6 rad and from 1 to 1 m; pass one")])
def test_cams_that_cannot_be_are_rejected(cam: Any, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        wheel((SPHERE, cam))
    with pytest.raises(ModelError, match="a Cam belongs to a planar system; pass a Surface"):
        ball((SPHERE, cam)).check()


@pytest.mark.parametrize(("graph", "message"), [
    (Shapes.Surface(X * sd.t, X, Y), r"contact 'touch': the height depends on t; a Surface is fixed to its body"),
    (Shapes.Surface(sp.Mod(X, 3), X, Y), r"the height Mod\(X, 3\) has no slope everywhere; leave out what jumps"),
    (Shapes.Surface(X, X, X), r"the abscissa of a Surface is X, X; pass the symbols that its height is written in"),
    (Shapes.Surface("X", X, Y), r"height is the text 'X'; text is never evaluated"),
    (Shapes.Surface(RAMP(X), X, Y),
     r"the height calls ramp_.\(x\), which a round shape does not go with")])
def test_heights_that_cannot_be_are_rejected(graph: Any, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        ball((SPHERE, graph)).check()


def test_languages_that_a_touching_point_has_no_text_for_are_reported() -> None:
    equations = ball((SPHERE, Shapes.Surface(WAVES, X, Y))).embedding()
    with pytest.raises(sd.SymdynError, match=r"touching_touch\(c_x, c_y, radius\) has no text for the backend fortran"):
        emit(equations, "fortran", ["rhs"])


def test_a_spline_over_a_grid_is_that_of_scipy() -> None:
    """Its values and derivatives, in doubles and in 30 digits, also by NdBSpline; beyond its ends the polynomials go on."""
    stream = np.random.default_rng(1)
    rough = RectBivariateSpline(np.linspace(-1, 2, 9), np.linspace(0, 1, 7), stream.normal(size=(9, 7)), kx=3, ky=2)
    function = grid_spline_of("road", rough)
    assert function is not None
    x, y = stream.uniform(-1, 2, 20), stream.uniform(0, 1, 20)
    for orders in ((0, 0), (1, 0), (0, 1), (2, 1)):
        expected = rough(x, y, *orders, grid=False)
        assert np.abs(function.rows([x, y, *orders])[:, 0] - expected).max() < 1e-11
        exact = function.precise(mpmath.mp, [mpmath.mpf(x[0]), mpmath.mpf(y[0]), *orders])[0]
        assert float(exact) == pytest.approx(expected[0], abs=1e-12)
    knots, coefficients = rough.get_knots(), rough.get_coeffs().reshape(9, 7)
    other = NdBSpline(knots, coefficients, (3, 2))
    again = grid_spline_of("road", other)
    assert again is not None and again.texts == function.texts
    assert function.rows([3.0, 0.5, 0, 0])[0] == pytest.approx(other([[3.0, 0.5]])[0], rel=1e-12)
    assert grid_spline_of("road", CubicSpline([0, 1, 2], [0, 1, 0])) is None


def test_a_spline_of_many_pieces_is_that_of_scipy() -> None:
    stream = np.random.default_rng(2)
    rough = CubicSpline(np.cumsum(stream.uniform(0.1, 1, 40)), stream.normal(size=40))
    function, x = line_spline_of("road", rough), stream.uniform(-1, 25, 50)
    for order in range(4):
        assert np.abs(function.rows([x, order])[:, 0] - rough(x, order)).max() <= 1e-13 * np.abs(rough(x, order)).max()
        exact = function.precise(mpmath.mp, [mpmath.mpf(x[0]), order])[0]
        assert float(exact) == pytest.approx(float(rough(x[0], order)), rel=1e-12)
