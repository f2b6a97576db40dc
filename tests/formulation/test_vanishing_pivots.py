"""Positions at which the mass matrix loses rank although masses are positive: those found, their cost, those rejected."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import EvaluationError
from symdyn.formulation.probes.vanishing_pivots import Search, vanishing_pivots
from symdyn.formulation.textbook.forward_dynamics import forward_dynamics
from symdyn.formulation.textbook.numbers import NumericTree
from symdyn.formulation.trees.equations import tree_of
from symdyn.functions.tapes import function_tape
from symdyn.model.orientation import SEQUENCES
from symdyn.stress.attitude import free_body, platform
from symdyn.stress.singular import two_points
from symdyn.systems import get, names
from symdyn.tape.evaluate import evaluate
from tests.helpers import swept

FORMS = ("embedding", "recursive")
BACKENDS = ("c", "numpy")
RIGHT = np.pi / 2
X, Y, Z = [1, 0, 0], [0, 1, 0], [0, 0, 1]


def top(sequence: str = "ZYX", kind: type = sd.Spherical, arms: int = 0, **options: Any) -> sd.System:
    """A body on a joint with Euler angles, and a chain of arms that hang on it."""
    s = sd.System("top", gravity=[0, 0, -9.81])
    body = s.add_body("body", mass=2, inertia=[1, 2, 2.5], com=[0.1, 0.2, 0.3])
    s.add_joint(kind("socket", s.ground, body, orientation=sd.EulerAngles(sequence), **options))
    for k in range(arms):
        arm = s.add_body(f"arm{k}", mass=1 + k, inertia=[0.3, 0.2, 0.1], com=[0.5, 0.1, 0])
        s.add_joint(sd.Revolute(f"hinge{k}", body, arm, axis=(X, Y, Z)[k % 3], parent_point=[0.4, 0.1 * k, 0.2]))
        body = arm
    return s


def gimbal(cart: bool = False, axes: Any = (Z, Y, X)) -> sd.System:
    """The same from hinges: all bodies but the last are rings without mass."""
    s = sd.System("gimbal", gravity=[0, 0, -9.81])
    before: Any = s.ground
    if cart:
        before = s.add_body("cart", mass=1)
        s.add_joint(sd.Prismatic("rail", s.ground, before, axis=X))
    for k, axis in enumerate(axes):
        heavy = {"mass": 2, "inertia": [1.1, 2.3, 2.5], "com": [0.1, 0.2, 0.3]} if k == len(axes) - 1 else {}
        ring = s.add_body(f"ring{k}", **heavy)
        s.add_joint(sd.Revolute(f"hinge{k}", before, ring, sd.coordinates(f"a{k}"), axis=axis))
        before = ring
    if cart:
        arm = s.add_body("arm", mass=1, inertia=[0.1, 0.2, 0.3], com=[0.3, 0, 0.1])
        s.add_joint(sd.Revolute("shoulder", before, arm, axis=[0.6, 0, 0.8], parent_point=[0.2, 0.3, 0.1]))
    return s


def stretched(tip: Any = (0.5, 0.2), mass: float = 0.0) -> sd.System:
    """A rod without mass, and a point mass on another."""
    s = sd.System("stretched", gravity=[0, -9.81])
    upper, lower = s.add_body("upper", mass=mass, com=[0.7, 0]), s.add_body("lower", mass=1.3, com=list(tip))
    s.add_joint(sd.Revolute("shoulder", s.ground, upper, sd.coordinates("a")))
    s.add_joint(sd.Revolute("elbow", upper, lower, sd.coordinates("b"), parent_point=[0.5, 0.2]))
    return s


def found(system: sd.System, **options: Any) -> list[str]:
    tree = tree_of(system.check(), "body")
    return [str(tree.model.speeds[p]) for p in sorted(vanishing_pivots(tree, **options))]


# -- what is found


@pytest.mark.every_value
@pytest.mark.parametrize("sequence", SEQUENCES)
@pytest.mark.parametrize("kind", [sd.Spherical, sd.Free])
def test_the_first_of_three_angles_may_lock(sequence: str, kind: type) -> None:
    first = "q_socket_1_dot" if kind is sd.Spherical else "q_socket_4_dot"
    for arms in (0, 2):
        assert found(top(sequence, kind, arms)) == found(top(sequence, kind, arms), solid=True) == [first]


LONG = "woodpecker_toy", "bicycle", "land_wind_turbine"
# The rate of the first Euler angle of a body that may turn any way.
EULER = {"stewart_platform": "a_dot", **dict.fromkeys(
    ("double_wishbone", "rolling_disc", "bicycle", "floating_wind_turbine", "floating_crane"), "psi_dot")}


@pytest.mark.parametrize("name", swept(names(), *(name for name in names() if name not in LONG)))
def test_mechanisms_of_the_catalogue(name: str) -> None:
    solid = [EULER[name]] if name in EULER else []
    assert found(get(name), solid=True) == solid
    # The cargo is a point, and its rope has a pole where it lies along the first axis of its joint.
    assert found(get(name)) == solid + ["alpha_dot"] * (name == "floating_crane")


def test_what_cannot_lock() -> None:
    assert found(free_body("body")) == found(free_body("parameters")) == found(platform()) == []
    assert found(get("floating_wind_turbine", orientation="parameters")) == []
    assert found(stretched(mass=1.0)) == found(gimbal(axes=(Z, Y))) == found(gimbal(axes=(Z, X))) == []
    for joint in (lambda *ends: sd.Universal("u", *ends), lambda *ends: sd.Cylindrical("u", *ends),
                  lambda *ends: sd.Free("u", *ends, velocity="body"),
                  lambda *ends: sd.Universal("u", *ends, axes=(X, [0.6, 0.8, 0]))):
        s = sd.System("one")
        s.add_joint(joint(s.ground, s.add_body("body", mass=1, inertia=[1, 2, 3], com=[0.1, 0.2, 0.3])))
        assert found(s) == []


def test_links_without_mass() -> None:
    assert found(gimbal()) == found(gimbal(cart=True)) == found(gimbal(), solid=True) == ["a0_dot"]
    assert found(gimbal(axes=(Z, X, Z))) == ["a0_dot"]
    assert found(stretched()) == ["a_dot"]
    assert found(stretched(), solid=True) == []  # what hangs on the massless rod does move, and a constraint may hold it


def test_masses_that_are_parameters() -> None:
    """Those of the default 0 may be none, and the check is there for every value; others are taken to be positive."""
    for default, lost in ((0.0, ["q1_dot"]), (1.0, [])):
        s = two_points()
        s.defaults = {p: default if p.name == "m_1" else value for p, value in s.defaults.items()}
        assert found(s) == lost


def test_a_point_on_a_universal_joint_has_a_pole() -> None:
    s = sd.System("rope")
    s.add_joint(sd.Universal("rope", s.ground, s.add_body("cargo", mass=1, com=[0.1, 0.2, -1]), sd.coordinates("a b")))
    assert found(s) == ["a_dot"] and found(s, solid=True) == []


def test_speeds_of_several_joints() -> None:
    """The second rod keeps its direction while the first turns: that rod feels its own speed first."""
    a, b = sd.coordinates("a b")
    s = sd.System("crossed", gravity=[0, -9.81])
    upper, lower = s.add_body("upper", mass=1, com=[1, 0]), s.add_body("lower", mass=1, com=[1, 0])
    end = s.add_body("end", mass=1, com=[1, 0])
    s.add_joint(sd.Revolute("one", s.ground, upper, a))
    s.add_joint(sd.Revolute("two", upper, lower, -a, parent_point=[1, 0]))
    s.add_joint(sd.Revolute("three", lower, end, b, parent_point=[1, 0]))
    assert found(s) == []


def test_angles_that_follow_others() -> None:
    """The first angle is given, so that the others are all there is; or it is three times another freedom's, which has mass."""
    body = {"mass": 2, "inertia": [1, 2, 2.5]}
    s = sd.System("given")
    s.add_joint(sd.Spherical("ball", s.ground, s.add_body("body", **body), [sd.t, *sd.coordinates("theta phi")],
                             orientation=sd.EulerAngles("ZYX")))
    assert found(s) == []
    s = sd.System("geared")
    x = sd.coordinates("x")
    s.add_joint(sd.Prismatic("rail", s.ground, s.add_body("cart", mass=1), x))
    s.add_joint(sd.Spherical("ball", s.ground, s.add_body("body", **body), [3 * x, *sd.coordinates("theta phi")],
                             orientation=sd.EulerAngles("ZYX")))
    assert found(s) == []


def test_custom_joints_may_lock() -> None:
    """Spherical coordinates: the first one moves nothing at the pole."""
    a, b, r = sd.coordinates("a b r")
    place = [r * sp.cos(a) * sp.sin(b), r * sp.sin(a) * sp.sin(b), r * sp.cos(b)]
    s = sd.System("custom")
    s.add_joint(sd.Custom("made", s.ground, s.add_body("body", mass=1), [a, b, r], position=place, units=["rad", "rad", "m"]))
    assert found(s) == ["a_dot", "b_dot"]


# -- what it costs


def added(system: sd.System, form: str, monkeypatch: pytest.MonkeyPatch, quantity: str = "rhs") -> int:
    """Operations more than without the check."""
    checked = function_tape(getattr(system, form)(), quantity).operations
    with monkeypatch.context() as patch:
        patch.setattr(Search, "vanishing_pivots", lambda search: {})
        return checked - function_tape(getattr(system, form)(), quantity).operations


@pytest.mark.parametrize("form", FORMS)
def test_a_product_and_a_difference_for_each_set_of_angles(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert added(top(), form, monkeypatch) == added(top("ZXZ", sd.Free, 2), form, monkeypatch) == 2
    assert added(get("floating_crane"), form, monkeypatch) == 2
    assert added(free_body("angles"), form, monkeypatch, "jacobian_x") == 2


@pytest.mark.parametrize("name", [*swept(["double_pendulum"]), "n_link_pendulum", *swept(["spatial_chain"]), "puma560",
                                  *swept(["cart_pole"]), "four_bar"])
def test_nothing_for_links_with_mass_and_one_freedom_each(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for form in ("augmented",) if name == "four_bar" else FORMS:
        assert added(get(name), form, monkeypatch) == 0


def test_of_dependent_speeds(monkeypatch: pytest.MonkeyPatch) -> None:
    assert added(get("rolling_disc"), "augmented", monkeypatch) == 2
    assert 2 <= added(get("double_wishbone"), "augmented", monkeypatch) <= 6


# -- speeds that cannot lock


def chain(*inertias: Any) -> sd.System:
    """Links on universal joints, with inertias of their own; None: a point."""
    s = sd.System("chain", gravity=[0, 0, -9.81])
    before: Any = s.ground
    for k, inertia in enumerate(inertias):
        link = s.add_body(f"link{k}", mass=2, inertia=inertia, com=[0.4, 0, 0])
        s.add_joint(sd.Universal(f"joint{k}", before, link, sd.coordinates(f"a{k} b{k}"), axes=(Y, Z), parent_point=[1, 0, 0]))
        before = link
    return s


def test_links_that_are_alike_are_tried_once() -> None:
    a, b, c = sd.parameters("a b c")
    for inertias, tried in ((([a, b, b],) * 5, 1), (([a, b, b], [b, c, c]), 1), (([a, b, b], [a, a, b]), 2),
                            (([a, b, b], [a, b, c], [b, c, c]), 2), (([1, 2, 2], [1, 3, 3], [1, 2, 2]), 2)):
        search = Search(tree_of(chain(*inertias).check(), "body"))
        assert not search.vanishing_pivots()
        assert search.sound == set(range(2 * len(inertias)))
        assert len(search._tried) == tried


def test_a_link_among_others_that_are_alike_may_lock() -> None:
    """A point has a pole where it lies along the first axis of its joint."""
    assert found(chain([1, 2, 2], [1, 2, 2], None)) == ["a2_dot"]
    assert found(chain([1, 2, 2], [1, 2, 2], [1, 2, 2])) == []


@pytest.mark.parametrize("system", [top(arms=2), chain([1, 2, 2], [1, 2, 2], None), get("spatial_chain"), get("puma560")])
def test_pivots_of_sound_speeds_are_positive(system: sd.System) -> None:
    """Even where another one vanishes: what the speeds after each speed leave of its diagonal entry of the mass matrix."""
    equations = system.embedding()
    tree = tree_of(system.check(), "body")
    symbols = equations.symbols
    stream = np.random.default_rng(3)
    for _ in range(3):
        q = {s.name: v for s, v in zip(symbols.coordinates, stream.uniform(-3, 3, len(symbols.coordinates)), strict=True)}
        locked = {"q_socket_2": RIGHT, "b2": RIGHT}
        values = {**{s.name: float(v) for s, v in symbols.defaults.items()}, **q, **{k: v for k, v in locked.items() if k in q}}
        with mpmath.workdps(60):
            M = mpmath.matrix(evaluate(equations.tape("M_tilde"), values, 60)["M_tilde"].tolist())
            pivots = []
            for k in range(len(symbols.speeds)):
                after = M[k + 1:, k + 1:]
                left = (M[k, k + 1:] * mpmath.lu_solve(after, M[k + 1:, k]))[0] if after.rows else 0
                pivots.append(float(M[k, k] - left))
        assert {k for k, pivot in enumerate(pivots) if pivot > 1e-9} == set(tree.sound)
        assert set(range(len(pivots))) - tree.sound == set(tree.vanishing_pivots)


# -- states that are rejected


def module_of(equations: Any, backend: str) -> Any:
    try:
        return equations.compile(backend=backend)
    except sd.CompilerNotFound:
        pytest.skip("no C compiler here")


def exact(equations: Any, x: np.ndarray) -> np.ndarray:
    """Accelerations from M_tilde and the bias at 60 digits."""
    symbols = equations.symbols
    leaves = {s.name: float(v) for s, v in zip((*symbols.coordinates, *symbols.speeds), x, strict=True)}
    values = {**{s.name: float(v) for s, v in symbols.defaults.items()}, **leaves, "t": 0.0}
    found = evaluate(equations.tape("M_tilde", "bias"), values, 60)
    with mpmath.workdps(60):
        solved = mpmath.lu_solve(mpmath.matrix(found["M_tilde"].tolist()), mpmath.matrix([-e for e in found["bias"]]))
    return np.array([float(v) for v in solved])


def states(n_q: int, n_u: int, place: int, values: Any, n: int, seed: int = 1) -> np.ndarray:
    """Random ones with a coordinate at one of the values."""
    rng = np.random.default_rng(seed)
    x = np.column_stack([rng.uniform(-np.pi, np.pi, (n, n_q)), rng.uniform(-2, 2, (n, n_u))])
    x[:, place] = rng.choice(values, n)
    return x


def parametric() -> sd.System:
    s = two_points()
    s.defaults = {p: {"m_1": 0.0, "l": 0.7}.get(p.name, value) for p, value in s.defaults.items()}
    return s


# System, place of the coordinate that brings lock, where it does; what is said.
CASES: dict[str, tuple[Callable[[], sd.System], int, tuple[float, ...], str]] = {
    "top": (top, 1, (RIGHT, -RIGHT, 3 * RIGHT), "the ZYX angles of joint socket are at gimbal lock"),
    "proper": (lambda: top("XZX"), 1, (0.0, np.pi, -np.pi), "the XZX angles of joint socket are at gimbal lock"),
    "free": (lambda: top("YZX", sd.Free, 2), 4, (RIGHT, -RIGHT), "the YZX angles of joint socket are at gimbal lock"),
    "arms": (lambda: top("ZYX", arms=6), 1, (RIGHT, -RIGHT), "the ZYX angles of joint socket are at gimbal lock"),
    "crane": (lambda: get("floating_crane"), 4, (RIGHT, -RIGHT), "the ZYX angles of joint floating are at gimbal lock"),
    "gimbal": (gimbal, 1, (RIGHT, -RIGHT), "at this position it moves nothing that a1_dot, a2_dot do not move already"),
    "cart": (lambda: gimbal(cart=True), 2, (RIGHT, -RIGHT), "at this position it moves nothing that a1_dot, a2_dot"),
    "rods": (stretched, 1, (0.0, np.pi, -np.pi), "at this position it moves nothing that b_dot does not move already"),
    "parameter": (parametric, 1, (0.0, np.pi, -np.pi), "at this position it moves nothing that q2_dot does not move already"),
    "longer": (lambda: stretched((1.0, 0.4)), 1, (0.0, np.pi, -np.pi), "at this position it moves nothing that b_dot does not")}


@pytest.mark.every_value
@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("case", CASES)
def test_states_that_have_no_accelerations_are_rejected(case: str, form: str, backend: str) -> None:
    """Every one is rejected with its reason; at 1e-5 rad from it every one is computed, with the digits that it has left."""
    make, place, values, said = CASES[case]
    system = make()
    equations, reference = getattr(system, form)(), system.embedding()
    module = module_of(equations, backend)
    n_q, n_u = len(equations.symbols.coordinates), len(equations.symbols.speeds)
    for x in states(n_q, n_u, place, values, 60):
        with pytest.raises(EvaluationError, match=f"{module.name}: rhs cannot be evaluated: .*{said}"):
            module.rhs(0.0, x)
    near = states(n_q, n_u, place, values, 10)
    near[:, place] += np.where(np.arange(10) % 2, 1e-5, -1e-5)
    for x, found in zip(near, module.rhs(np.zeros(10), near), strict=True):
        wanted = exact(reference, x)
        np.testing.assert_array_equal(module.rhs(0.0, x), found)
        assert np.linalg.norm(found[n_q:] - wanted) < 1e-3 * np.linalg.norm(wanted)  # condition 1e10 to 1e12


@pytest.mark.filterwarnings("ignore:top. in 1 of 7 motions")
@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("form", FORMS)
def test_only_the_state_concerned_is_rejected(form: str, backend: str) -> None:
    module = module_of(getattr(top(), form)(), backend)
    x = states(3, 3, 1, (0.3,), 7)
    usual = module.rhs(np.zeros(7), x)
    x[4, 1] = RIGHT
    with pytest.raises(EvaluationError, match=r"gimbal lock.*\(row 4 of 7\)"):
        module.rhs(np.zeros(7), x)
    with pytest.warns(sd.SimulationWarning, match=r"1 of 7 motions failed: 4: .*gimbal lock"):
        many = module.simulate_batch(t=np.array([0.0, 0.05]), q=x[:, :3], u=x[:, 3:])
    assert many.success.tolist() == [k != 4 for k in range(7)]
    assert "gimbal lock" in many.messages[4] and np.isfinite(many.x[[0, 1, 2, 3, 5, 6]]).all()
    np.testing.assert_array_equal(usual[0], module.rhs(0.0, x[0]))


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_light_direction_is_not_taken_for_rounding(backend: str) -> None:
    """A rod whose axis is the one that no angle turns about at the lock: at 1e-3 rad from it the pivot is 1e-12 of its entry."""
    s = sd.System("thin")
    rod = s.add_body("rod", mass=1, inertia=[1, 1e-6, 1])
    s.add_joint(sd.Spherical("ball", s.ground, rod, sd.coordinates("psi theta phi"), orientation=sd.EulerAngles("ZYX")))
    for form in FORMS:
        module = module_of(getattr(s, form)(), backend)
        x = np.array([0.1, RIGHT - 1e-3, RIGHT, 0.3, 0.2, 0.1])
        wanted = exact(s.embedding(), x)
        assert np.linalg.norm(module.rhs(0.0, x)[3:] - wanted) < 1e-4 * np.linalg.norm(wanted)


# -- with constraints


def beside_a_cart() -> sd.System:
    s = top("ZYX", sd.Free)
    x = sd.coordinates("x_cart")
    s.add_joint(sd.Prismatic("rail", s.ground, s.add_body("cart", mass=1.5), x, axis=X))
    s.add_constraint(x - sd.t**2 / 10, "held")
    return s


def on_a_rod() -> sd.System:
    s = top("ZYX", sd.Free)
    s.close_loop(sd.Rod("rod", s.ground, s.bodies[0], 2, parent_point=[0, 0, 3], child_point=[0.3, 0.2, 0.1]))
    s.initial = dict(zip(s.check().coordinates, (0.1, 0.2, 1.0, 0.2, 0.3, 0.4), strict=True))
    return s


@pytest.mark.every_value
@pytest.mark.parametrize(("make", "way", "place", "values"), [
    (beside_a_cart, "Schur complement", 4, (RIGHT, -RIGHT)),
    (on_a_rod, "elimination of the dependent speeds", 4, (RIGHT, -RIGHT)),
    (lambda: get("double_wishbone"), "elimination of the dependent speeds", 3, (RIGHT, -RIGHT)),
    (lambda: get("rolling_disc"), "elimination of the dependent speeds", 4, (0.0, np.pi))],
    ids=["Schur", "rod", "wishbone", "disc"])
@pytest.mark.parametrize("backend", BACKENDS)
def test_with_constraints(make: Callable[[], sd.System], way: str, place: int, values: tuple[float, ...], backend: str) -> None:
    """The statements hand over to the numeric algorithm, which finds that nothing holds the angles."""
    equations = make().augmented()
    assert any(note.startswith(f"accelerations by {way}") for note in equations.notes)
    module = module_of(equations, backend)
    x = states(len(equations.symbols.coordinates), len(equations.symbols.speeds), place, values, 40)
    for row in x:
        with pytest.raises(EvaluationError, match=r"neither by mass nor by a constraint; perhaps .* at gimbal lock"):
            module.rhs(0.0, row)


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_constraint_may_hold_the_angle(backend: str) -> None:
    """The first angle is held, and the others have accelerations at the lock as elsewhere: those of the angle as given motion."""
    held, given = top(), sd.System("top", gravity=[0, 0, -9.81])
    held.add_constraint(held.check().coordinates[0] - sd.t / 10, "held")
    body = given.add_body("body", mass=2, inertia=[1, 2, 2.5], com=[0.1, 0.2, 0.3])
    given.add_joint(sd.Spherical("socket", given.ground, body, [sd.t / 10, *sd.coordinates("theta phi")],
                                 orientation=sd.EulerAngles("ZYX")))
    one, two = module_of(held.augmented(), backend), module_of(given.embedding(), backend)
    for x in states(3, 3, 1, (RIGHT, -RIGHT), 20):
        x[[0, 3]] = 0.0, 0.1
        wanted = two.rhs(0.0, x[[1, 2, 4, 5]])[2:]
        np.testing.assert_allclose(one.rhs(0.0, x)[3:], [0, *wanted], rtol=1e-10, atol=1e-10)


# -- the recursion of the lecture's pages, in numbers


@pytest.mark.parametrize("make", [top, gimbal], ids=["top", "gimbal"])
def test_in_floats_and_with_many_digits(make: Callable[[], sd.System]) -> None:
    """In floats the lock is rejected; 50 digits distinguish the float that is nearest to a right angle from it."""
    numeric, equations = NumericTree(make().check()), make().embedding()
    rng = np.random.default_rng(5)
    for _ in range(20):
        q, u = rng.uniform(-1, 1, 3), rng.uniform(-1, 1, 3)
        q[1] = RIGHT
        here = numeric.at(q, u)
        with pytest.raises(EvaluationError, match="moves no inertia along"):
            forward_dynamics(here.tree, here.applied.joint, here.applied.wrenches)
    exactly = numeric.at(q, u, digits=50)
    found = forward_dynamics(exactly.tree, exactly.applied.joint, exactly.applied.wrenches).u_dot
    np.testing.assert_allclose([float(v) for v in found], exact(equations, np.concatenate([q, u])), rtol=1e-12)


# -- what only several links together hold


def points_and_plate(turns: Any, constraint: bool) -> sd.System:
    """A cart, a massless fork, a point mass off the axes of a custom joint of two angles, and a plate that slides on it."""
    x, r, a, b, p1, p2, p3 = sd.coordinates("x r a b p1 p2 p3")
    s = sd.System("plate", gravity=[0, 0, -9.81])
    cart = s.add_body("cart", mass=2, inertia=[0.1, 0.2, 0.3])
    fork = s.add_body("fork")
    point = s.add_body("point", mass=1.5, com=[0.2, 0.3, 0.1])
    plate = s.add_body("plate", mass=1, inertia=[0.1, 0.2, 0.3], com=[0.1, 0, 0])
    s.add_joint(sd.Prismatic("rail", s.ground, cart, x, axis=X))
    s.add_joint(sd.Revolute("fork", cart, fork, r, axis=Y, parent_point=[0.1, 0.2, 0.3]))
    s.add_joint(sd.Custom("turns", fork, point, [a, b], rotation=turns(a, b)))
    s.add_joint(sd.Planar("slide", point, plate, [p1, p2, p3]))
    if constraint:
        s.add_constraint(x - p1 - p3)
    return s


@pytest.mark.parametrize("turns", [pytest.param(lambda a, b: sp.rot_ccw_axis3(a) * sp.rot_ccw_axis1(b), id="zx"), pytest.param(
    lambda a, b: sp.rot_ccw_axis1(a) * sp.rot_ccw_axis2(b), id="xy", marks=pytest.mark.sweep)])
def test_accelerations_where_several_links_together_hold_a_speed(turns: Any) -> None:
    """Against the saddle-point system of the tree's own M_tilde, k_tilde, F_tilde without the constraint."""
    free = points_and_plate(turns, False).embedding()
    equations = points_and_plate(turns, True).augmented()
    assert "r_dot" in found(points_and_plate(turns, True))
    C = np.array([1.0, 0, 0, 0, -1, 0, -1])
    rng = np.random.default_rng(4)
    for _ in range(3):
        q, u = rng.uniform(-0.5, 0.5, 7), rng.uniform(-1, 1, 7)
        q[0], u[0] = q[4] + q[6], u[4] + u[6]
        M, k, F = (free.lambdify(name)(q, u, []) for name in ("M_tilde", "k_tilde", "F_tilde"))
        whole = np.block([[M, C[:, None]], [C[None], np.zeros((1, 1))]])
        wanted = np.linalg.solve(whole, [*(F - k), 0.0])[:7]
        got = equations.lambdify("accelerations")(q, u, [])
        np.testing.assert_allclose(got, wanted, rtol=1e-9, atol=1e-9 * abs(wanted).max())


@pytest.mark.parametrize("form", ["embedding", "recursive", "augmented"])
def test_a_coordinate_that_moves_no_mass_is_rejected_by_every_formulation(form: str) -> None:
    """A load on it would move it by an infinite acceleration."""
    q, p = sd.coordinates("q p")
    s = sd.System("idle", gravity=[0, -9.81, 0])
    arm, pointer = s.add_body("arm", mass=1, inertia=[1, 1, 1]), s.add_body("pointer")
    s.add_joint(sd.Revolute("shoulder", s.ground, arm, q))
    s.add_joint(sd.Revolute("axle", arm, pointer, p, parent_point=[1, 0, 0]))
    s.add_joint_force("axle", sd.inputs("tau"))
    with pytest.raises(sd.ModelError, match="joint 'axle': what it moves has no mass or inertia along p_dot; give body 'poi"):
        getattr(s, form)()
