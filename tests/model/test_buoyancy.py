"""Buoyancy of boxes against the pressure on their faces, its own potential, and the hydrostatics of a barge."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import EvaluationError, ModelError
from symdyn.formulation.algebra import TapeAlgebra
from symdyn.spatial.vectors import dot, vector
from symdyn.tape import Recorder, Tape
from symdyn.tape.differentiate import forward, jacobian
from symdyn.tape.evaluate import evaluate
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.node import COORDINATE, PARAMETER

RHO, G = 1025.0, 9.80665
WEIGHT = RHO * G
BARGE = {"boxes": [sd.Box((40, 40, 10), (0, 0, 1))], "without": [sd.Box((10, 10, 10), (0, 0, 1))]}  # origin 4 m over the keel
CATAMARAN = {"boxes": [sd.Box((30, 4, 6), (1, -8, 0)), sd.Box((30, 5, 6), (1, 8, 0)), (2, 3, 4)],
             "without": [sd.Box((3, 2, 1), (2, 8, 1))]}
POSE = ["x", "y", "z", "phi", "theta", "psi"]


@dataclass
class Site:
    """A body at x, y, z with roll, pitch and yaw, all leaves of a tape."""

    algebra: TapeAlgebra
    R: np.ndarray
    p: np.ndarray
    gravity: Any

    @classmethod
    def of(cls, gravity: Any = (0, 0, -G), parameters: tuple[sp.Symbol, ...] = ()) -> Site:
        recorder = Recorder()
        algebra = TapeAlgebra(recorder, {s: recorder.leaf(s.name, PARAMETER) for s in parameters})
        x, y, z, *angles = (recorder.leaf(name, COORDINATE) for name in POSE)
        (s1, c1), (s2, c2), (s3, c3) = ((recorder.sin(a), recorder.cos(a)) for a in angles)
        R = np.array([[c3 * c2, c3 * s2 * s1 - s3 * c1, c3 * s2 * c1 + s3 * s1],
                      [s3 * c2, s3 * s2 * s1 + c3 * c1, s3 * s2 * c1 - c3 * s1], [-s2, c2 * s1, c2 * c1]], dtype=object)
        return cls(algebra, R, vector(x, y, z), algebra.constants(gravity))

    @property
    def leaves(self) -> list[Any]:
        return [self.algebra.recorder.leaf(name, COORDINATE) for name in POSE]

    def tape(self, **values: Any) -> Tape:
        return Tape.of(self.algebra.recorder, **{name: np.array(v, dtype=object) for name, v in values.items()})


def poses(n: int, seed: int) -> dict[str, np.ndarray]:
    """Any attitude, in the water more or less."""
    rng = np.random.default_rng(seed)
    return {"x": rng.normal(size=n), "y": rng.normal(size=n), "z": rng.uniform(-12, 12, n), "phi": rng.uniform(-3, 3, n),
            "theta": rng.uniform(-1.5, 1.5, n), "psi": rng.uniform(-3, 3, n)}


def recorded(loads: dict[str, Any], **options: Any) -> tuple[Site, Tape]:
    """Wrench, potential, checked part, and attitude of a body that floats."""
    site = Site.of()
    action = sd.Buoyancy("hull", **loads, density=RHO, **options).act(site)  # type: ignore[arg-type]
    f, n = action.elastic
    return site, site.tape(f=f, n=n, V=[action.potential], part=[action.validity_checks[0].value], R=site.R, p=site.p)


# -- the pressure on the faces

NODES, WEIGHTS = np.polynomial.legendre.leggauss(3)


def pressure(R: np.ndarray, height: float, size: np.ndarray, center: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Force and moment about the body's origin, body axes, of the pressure on the six faces of a box, by Gauss' rule in two
    directions, split where the water line crosses."""
    force, moment = np.zeros(3), np.zeros(3)
    for axis, side in itertools.product(range(3), (-1, 1)):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        corner, normal = center.astype(float).copy(), np.zeros(3)
        corner[axis] += side * size[axis] / 2
        normal[axis] = side
        start, along = -(height + R[2] @ corner), -R[2]
        for a, wa in zip(*pieces(size[i], [(-start - s * along[j] * size[j] / 2) / along[i] for s in (-1, 1)]), strict=True):
            b, wb = pieces(size[j], [(-start - along[i] * a) / along[j]])
            at = np.tile(corner, (len(b), 1))
            at[:, i] += a
            at[:, j] += b
            push = -WEIGHT * np.outer(np.maximum(start + along[i] * a + along[j] * b, 0.0) * wa * wb, normal)
            force += push.sum(axis=0)
            moment += np.cross(at, push).sum(axis=0)
    return force, moment


def pieces(length: float, cuts: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights between the ends of an edge and the cuts on it."""
    ends = np.array(sorted([-length / 2, length / 2, *(c for c in cuts if abs(c) < length / 2)]))
    half = np.diff(ends)[:, None] / 2
    return (ends[:-1, None] + half * (1 + NODES)).ravel(), (half * WEIGHTS).ravel()


@pytest.mark.parametrize("loads", [BARGE, CATAMARAN], ids=["barge", "catamaran"])
def test_pressure_on_the_faces(loads: dict[str, Any]) -> None:
    """Walls of holes push the other way. Sunk and dry ones are among the attitudes, and capsized ones."""
    n = 30
    _, tape = recorded(loads)
    found = evaluate_rows(tape, poses(n, 5), n)
    assert (found["R"][:, 2, 2] < -0.3).sum() > 3 and (found["part"] == 0).sum() + (found["part"] == 1).sum() < n - 10
    for k in range(n):
        force, moment = np.zeros(3), np.zeros(3)
        for sign, box in [*((1, b) for b in loads["boxes"]), *((-1, b) for b in loads["without"])]:
            size, center = (box.size, box.center) if isinstance(box, sd.Box) else (box, (0, 0, 0))
            f, m = pressure(found["R"][k], found["p"][k, 2], np.array(size), np.array(center))
            force, moment = force + sign * f, moment + sign * m
        size = np.linalg.norm(force) + WEIGHT
        assert np.linalg.norm(found["f"][k] - force) < 1e-10 * size
        assert np.linalg.norm(found["n"][k] - moment) < 1e-10 * size * 10


def test_it_pushes_up_through_the_centroid() -> None:
    n = 40
    _, tape = recorded(BARGE)
    found = evaluate_rows(tape, poses(n, 6), n)
    volume = 15000 * found["part"][:, 0]
    for k in range(n):
        f = found["R"][k] @ found["f"][k]
        assert np.abs(f - [0, 0, WEIGHT * volume[k]]).max() < 1e-14 * WEIGHT * 15000
        assert abs(found["n"][k] @ found["R"][k, 2]) < 1e-14 * WEIGHT * 15000 * 20  # nothing turns it about the vertical


# -- potential and derivatives


def test_the_wrench_is_minus_the_gradient_of_the_potential() -> None:
    """At any attitude, with any parameters, and its rate by the pose is a symmetric matrix."""
    L, c, rho, g = sd.parameters("L c rho g")
    site = Site.of(gravity=(0, 0, -g), parameters=(L, c, rho, g))
    action = sd.Buoyancy("hull", [sd.Box((L, 2 * L, 1 + c), (c, -c, L / 5)), (2, 1, c)], rho, without=[(L / 3, 1, c)]).act(site)
    recorder, leaves = site.algebra.recorder, site.leaves
    f, n = action.elastic
    gradient = jacobian(recorder, [action.potential], leaves, "forward")[0]
    forces = []
    for leaf in leaves:
        p_dot = np.array(forward(recorder, site.p, {leaf: 1}), dtype=object)
        S = site.R.T @ np.array(forward(recorder, site.R.ravel(), {leaf: 1}), dtype=object).reshape(3, 3)
        forces.append(dot(site.R @ f, p_dot) + dot(n, vector(S[2, 1], S[0, 2], S[1, 0])))
    second = jacobian(recorder, forces, leaves, "forward")
    tape = site.tape(gradient=gradient, forces=forces, second=second)
    rng = np.random.default_rng(0)
    for _ in range(6):
        values = {**dict(zip(POSE, rng.uniform(-1, 1, 6), strict=True)), "L": 3.0, "c": 0.7, "rho": RHO, "g": G}
        values["phi"] = rng.uniform(-3, 3)
        found = evaluate(tape, values, 40)
        assert any(found["forces"]) and max(abs(found["gradient"] + found["forces"])) < 1e-30
        assert abs(found["second"] - found["second"].T).max() < 1e-30


def test_first_and_second_derivatives_by_pose_and_parameters() -> None:
    """Derivatives of all components at once along a line through pose and parameters, by differences with 60 digits."""
    L, rho = sd.parameters("L rho")
    site = Site.of(parameters=(L, rho))
    action = sd.Buoyancy("hull", [sd.Box((L, 4, 3), (0, L / 7, 0)), sd.Box((1, 1, L), (0, 5, 0))], rho).act(site)
    recorder = site.algebra.recorder
    values = [*action.elastic[0], *action.elastic[1], action.potential]
    rates = dict(zip([*site.leaves, site.algebra.leaves[L]], [2, 1, -1, 3, -2, 1, 4], strict=True))
    first = forward(recorder, values, rates)
    second = forward(recorder, first, rates)
    tape = site.tape(value=values, first=first, second=second)
    for start in ({"z": 0.3, "phi": 0.4, "theta": -0.2, "L": 5.0}, {"z": 1.2, "phi": 2.2, "theta": 0.7, "L": 8.0}):
        at = {"x": 0.0, "y": 0.0, "psi": 0.5, **start}
        h = mpmath.mpf(10) ** -20
        with mpmath.workdps(60):
            moved = [evaluate(tape, {"rho": RHO, **{leaf.args[1]: mpmath.mpf(at[leaf.args[1]]) + k * h * rate
                                                    for leaf, rate in rates.items()}}, 60) for k in (-1, 0, 1)]
            for low, high in (("value", "first"), ("first", "second")):
                wanted = (moved[2][low] - moved[0][low]) / (2 * h)
                assert max(abs(wanted - moved[1][high])) < 1e-25 * max(abs(wanted))


def test_hydrostatics_of_the_upright_barge() -> None:
    """Water plane 1500 m^2 with 212500 m^4 about each axis; afloat at a draft of 4 m: 6000 m^3, centroid 2 m below."""
    site, _ = recorded(BARGE)
    action = sd.Buoyancy("hull", **BARGE, density=RHO, gravity=G).act(site)
    z, phi, theta = (site.leaves[k] for k in (2, 3, 4))
    recorder = site.algebra.recorder
    gradient = [forward(recorder, [action.potential], {by: 1})[0] for by in (z, phi, theta)]
    K = jacobian(recorder, gradient, [z, phi, theta], "forward")
    found = evaluate_rows(site.tape(K=K, f=action.elastic[0], n=action.elastic[1]), dict.fromkeys(POSE, 0.0), 1)
    roll = WEIGHT * (212500 - 6000 * 2)
    assert WEIGHT * 212500 == 2136010953.125 and WEIGHT * 1500 == 15077724.375
    np.testing.assert_allclose(found["K"][0], np.diag([15077724.375, roll, roll]), rtol=1e-14, atol=1e-5)
    np.testing.assert_allclose(found["f"][0], [0, 0, WEIGHT * 6000], rtol=1e-14)
    np.testing.assert_allclose(found["n"][0], [0, 0, 0], atol=1e-6)


@pytest.mark.parametrize(("z", "part", "stiffness"), [(4.0, 0.0, 1), (-6.0, 1.0, 1), (4.1, 0.0, 0), (-6.1, 1.0, 0)])
def test_keel_or_deck_in_the_water_plane(z: float, part: float, stiffness: int) -> None:
    """Where the water only just reaches the box, it has its water plane; further off, none."""
    site = Site.of()
    action = sd.Buoyancy("hull", **BARGE, density=RHO).act(site)
    lift = forward(site.algebra.recorder, [action.elastic[0][2]], {site.leaves[2]: 1})
    tape = site.tape(rate=lift, part=[w.value for w in action.validity_checks], f=action.elastic[0])
    found = evaluate_rows(tape, {**dict.fromkeys(POSE, 0.0), "z": z}, 1)
    assert found["part"][0].tolist() == [part, part]
    np.testing.assert_allclose(found["rate"], [[-stiffness * WEIGHT * 1500]], rtol=1e-14)
    np.testing.assert_allclose(found["f"], [[0, 0, WEIGHT * part * 15000]], rtol=1e-14)


def test_validity_checks() -> None:
    site = Site.of()
    low, high = sd.Buoyancy("hull", **BARGE, density=RHO, name="hull's").act(site).validity_checks
    assert low.label == "immersed part of hull's" and 0 < low.least < 1e-6 and low.most == np.inf
    assert high.least == -np.inf and 1 - 1e-6 < high.most < 1
    assert low.message.format(value=0.0) == ("hull's: the box has left the water: the immersed part of its volume is 0.0")
    assert "it is under water altogether: it sinks" in high.message.format(value=1.0)
    found = evaluate_rows(site.tape(part=[low.value, high.value]), {**dict.fromkeys(POSE, 0.0), "z": -1.0}, 1)
    assert found["part"][0].tolist() == [0.5, 0.5]


# -- in a system


def floating(**options: Any) -> sd.System:
    s = sd.System("barge", gravity=[0, 0, -sp.Float(G)])
    rho = sd.parameters("rho")
    s.add_body("hull", mass=RHO * 6000, com=[0, 0, -1], inertia=[7.5e8, 7.3e8, 1.4e9])
    s.add_joint(sd.Free("free", s.ground, "hull", sd.coordinates("x y z psi theta phi")))
    s.add_load(sd.Buoyancy("hull", **BARGE, density=rho, **options))
    s.set_defaults({rho: RHO})
    return s


@pytest.fixture(scope="module")
def module() -> Any:
    return floating().embedding().compile(backend="c")


def test_a_barge_at_rest_stays(module: Any) -> None:
    assert np.abs(module.rhs(0.0, np.zeros(12))).max() < 1e-12


def test_a_wild_motion_keeps_its_energy(module: Any) -> None:
    """Thrown from 60 degrees, out of the water and under it."""
    solution = module.simulate((0, 40), q=[0, 0, 6, 0.3, 0.2, 1.05], u=[1, 0, -3, 0, 0.3, 0.5], rtol=1e-12)
    assert solution.success and np.ptp(solution.q[:, 2]) > 10
    energy = np.array([module.energy(q, u) for q, u in zip(solution.q, solution.u, strict=True)])
    assert np.abs(energy.sum(axis=1) - energy[0].sum()).max() < 1e-8 * np.abs(energy).max()


def test_units_and_parameters(module: Any) -> None:
    assert list(module.metadata.parameters) == ["rho"] and module.metadata.units["rho"] == "kg/m^3"


# -- what bad input gets


@pytest.mark.parametrize(("options", "words"), [
    ({"boxes": []}, r"there are no boxes; pass boxes=\[sd.Box"),
    ({"boxes": 3}, "boxes is 3; pass a list of sd.Box"),
    ({"boxes": [5]}, r"boxes\[0\] is 5; pass sd.Box"),
    ({"boxes": [(1, 2)]}, r"boxes\[0\]: size has 2 components"),
    ({"boxes": [sd.Box((1, -2, 3))]}, r"boxes\[0\]: size is \[1, -2, 3\] m; each edge must have a positive length"),
    ({"boxes": [sd.Box((1, 2, 3), (0, np.nan, 0))]}, r"boxes\[0\]: center, component 2"),
    ({"without": [sd.Box((1, 0, 3))]}, r"without\[0\]: size is"),
    ({"density": 0}, r"density is 0 kg/m\^3; it must be positive"),
    ({"density": "water"}, "density is the text 'water'"),
    ({"gravity": -9.81}, r"gravity is -9.81\d* m/s\^2; it must be positive"),
    ({"boxes": [(4, 4, 4), sd.Box((4, 4, 4), (3, 0, 0))]},
     r"boxes\[0\] and boxes\[1\] overlap by 16 m\^3, which would count twice"),
    ({"without": [sd.Box((2, 2, 2), (2, 0, 0))]}, r"4 m\^3 of the 8 m\^3 of without\[0\] are outside the boxes"),
])
def test_faults(options: dict[str, Any], words: str) -> None:
    s = sd.System("float", gravity=[0, 0, -9.81])
    s.add_body("hull", mass=1, inertia=[1, 1, 1])
    s.add_joint(sd.Free("free", s.ground, "hull"))
    s.add_load(sd.Buoyancy("hull", **{"boxes": [(4, 4, 4)], "density": 1000, **options}))
    with pytest.raises(ModelError, match="buoyancy on hull: " + words):
        s.check()


def test_a_parameter_that_is_no_length() -> None:
    L = sd.parameters("L")
    s = sd.System("float", gravity=[0, 0, -9.81])
    s.add_body("hull", mass=1, inertia=[1, 1, 1])
    s.add_joint(sd.Free("free", s.ground, "hull"))
    s.add_load(sd.Buoyancy("hull", [(1, 1, L)], density=1000))
    module = s.recursive().compile(backend="numpy")
    assert np.isfinite(module.rhs(0.0, np.zeros(12), {"L": 2.0})).all()
    with pytest.raises(EvaluationError, match="a box has an edge without a positive length"):
        module.rhs(0.0, np.zeros(12), {"L": -2.0})


def test_boxes_that_touch_and_boxes_of_parameters_are_no_fault() -> None:
    L = sd.parameters("L")
    for boxes in ([(4, 4, 4), sd.Box((4, 4, 4), (4, 0, 0))], [(L, 1, 1), (1, 1, 1)], sd.Box((1, 2, 3))):
        assert not sd.Buoyancy("hull", boxes, density=1, without=[(0.5, 0.5, 0.5)]).faults
    assert not sd.Buoyancy("hull", [sd.Box((2, 4, 4), (-1, 0, 0)), sd.Box((2, 4, 4), (1, 0, 0))], 1, without=[(1, 1, 1)]).faults


@pytest.mark.parametrize("gravity", [(0, 9.81, 0), (0, 0, 0), (0, 0, 9.81), (0.1, 0, -9.81)])
def test_gravity_must_point_down(gravity: Any) -> None:
    site = Site.of(gravity=gravity)
    with pytest.raises(ModelError, match=r"buoyancy on hull: .* components must be \[0, 0, -g\]"):
        sd.Buoyancy("hull", [(1, 1, 1)], 1).act(site)
    f, _ = sd.Buoyancy("hull", [(1, 1, 1)], 1, gravity=9.81).act(site).elastic
    assert f[2] is not None


def test_that_the_crossed_moment_is_about_the_origin() -> None:
    """Far from the boxes: the moment is the arm crossed with the force."""
    site = Site.of()
    f, n = sd.Buoyancy("hull", [sd.Box((2, 2, 2), (100, -50, 0))], RHO).act(site).elastic
    found = evaluate_rows(site.tape(f=f, n=n), {**dict.fromkeys(POSE, 0.0), "z": -1.0}, 1)
    np.testing.assert_allclose(found["n"][0], np.cross([100, -50, 0], found["f"][0]), rtol=1e-14, atol=1e-6)


def test_forces_print_volume_and_moments_as_functions() -> None:
    z = sd.coordinates("z")
    m, L, rho, g = sd.parameters("m L rho g", positive=True)
    system = sd.System("raft", gravity=[0, 0, -g])
    raft = system.add_body("raft", mass=m)
    system.add_joint(sd.Prismatic("heave", system.ground, raft, axis=[0, 0, 1], coordinate=z))
    system.add_load(sd.Buoyancy(raft, [sd.Box([L, L, L])], rho))
    V = sp.Function("V")
    assert sp.expand(system.embedding().F_tilde[0] - (rho * g * L**3 * V(-z, 0, 0, -L) - m * g)) == 0
