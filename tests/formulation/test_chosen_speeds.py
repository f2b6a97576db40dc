"""Generalized speeds of the user's choice, against equations in the joints' own speeds, SymPy's Kane and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.lab.sympy_models.rolling import rolling_disc


def in_own_speeds(system: sd.System, chosen: sd.System, Y: sp.Matrix, x: np.ndarray, form: str) -> tuple[np.ndarray, np.ndarray]:
    """x_dot in chosen speeds u = Y(q) v, and what the joints' own speeds v give for it."""
    q = system.check().coordinates
    n = len(q)
    at = dict(zip(q, x[:n], strict=True))
    matrix = np.array(Y.subs(at), dtype=float)
    v = np.linalg.solve(matrix, x[n:])
    own = system.equations().compile(backend="numpy").rhs(0.0, [*x[:n], *v])
    rate = sum((np.array(Y.diff(a).subs(at), dtype=float) * own[k] for k, a in enumerate(q)), np.zeros((n, n)))
    found = getattr(chosen, form)().compile(backend="numpy").rhs(0.0, x)
    return found, np.concatenate([own[:n], matrix @ own[n:] + rate @ v])


@pytest.mark.parametrize("form", ["embedding", "recursive", "augmented"])
def test_accelerations_are_those_in_the_joints_own_speeds(form: str) -> None:
    system, chosen = sd.systems.double_pendulum(), sd.systems.double_pendulum()
    q1, q2 = system.check().coordinates
    u1, u2 = sd.speeds("u1 u2")
    chosen.set_speeds({u1: q1.dot + sp.cos(q2) * q2.dot / 3, u2: sd.angular_velocity(chosen.bodies[1])[2]})
    Y = sp.Matrix([[1, sp.cos(q2) / 3], [1, 1]])
    found, expected = in_own_speeds(system, chosen, Y, np.array([0.3, 0.5, 0.7, -0.2]), form)
    assert found == pytest.approx(expected, rel=1e-12)


def test_absolute_angular_velocities_print_the_textbook_mass_matrix() -> None:
    a, b = sd.coordinates("a b")
    w1, w2 = sd.speeds("w1 w2")
    m, l, g = sd.parameters("m l g")
    system = sd.System("rods", gravity=[0, -g])
    first, second = (system.add_body(name, mass=m, com=[l, 0]) for name in ("first", "second"))
    system.add_joint(sd.Revolute("root", system.ground, first, a))
    system.add_joint(sd.Revolute("elbow", first, second, b, parent_point=[l, 0]))
    system.set_speeds({w1: sd.angular_velocity(first)[2], w2: sd.angular_velocity(second)[2]})
    equations = system.embedding()
    assert equations.M_tilde == sp.Matrix([[2 * l**2 * m, l**2 * m * sp.cos(b)], [l**2 * m * sp.cos(b), l**2 * m]])
    assert equations.k_tilde == sp.Matrix([-l**2 * m * w2**2 * sp.sin(b), l**2 * m * w1**2 * sp.sin(b)])
    assert equations.symbols.units[w1] == "rad/s"
    assert equations.verify(states=2).passed


def sleigh(chosen: bool) -> sd.System:
    """Chaplygin's sleigh."""
    x, y, theta = sd.coordinates("x y theta")
    m, I, a = sd.parameters("m I a")
    v, w = sd.speeds("v w")
    system = sd.System("sleigh", gravity=[0, 0])
    body = system.add_body("body", mass=m, inertia=I, com=[a, 0])
    system.add_joint(sd.Planar("plane", system.ground, body, [x, y, theta]))
    system.add_constraint(y.dot * sp.cos(theta) - x.dot * sp.sin(theta), "blade")
    if chosen:
        system.set_speeds({v: x.dot * sp.cos(theta) + y.dot * sp.sin(theta), w: theta.dot})
    return system.set_defaults({m: 2.0, I: 0.3, a: 0.2})


def test_chaplygins_sleigh_has_no_multipliers() -> None:
    """m v' = m a w^2, (I + m a^2) w' = -m a v w; Neimark and Fufaev, Dynamics of Nonholonomic Systems, chapter III."""
    equations = sleigh(True).equations()
    m, I, a = sp.symbols("m I a")
    v, w = sd.speeds("v w")
    assert equations.constraints == ()
    assert equations.M_tilde == sp.diag(m, I + a**2 * m)
    assert equations.k_tilde == sp.Matrix([-a * m * w**2, a * m * v * w])
    assert equations.verify(states=2).passed
    x, c, s = [0.1, 0.2, 0.5], np.cos(0.5), np.sin(0.5)
    found = equations.compile(backend="numpy").rhs(0.0, [*x, 1.0, 0.7])
    whole = sleigh(False).augmented().compile(backend="numpy").rhs(0.0, [*x, c, s, 0.7])
    assert [*found[:3], found[3]] == pytest.approx([*whole[:3], c * whole[3] + s * whole[4]], rel=1e-13)
    sol = equations.compile().simulate((0, 20), u=[0.5, 1.0], rtol=1e-10)
    assert sol.energy == pytest.approx(sol.energy[0], rel=1e-9)
    with pytest.raises(sd.SymdynError, match="no reactions, cut_loads"):
        equations.quantity("reactions")


def test_a_rolling_disc_in_kanes_speeds() -> None:
    """Six coordinates and three constraints of rolling, in three speeds, against SymPy's Kane."""
    q1, q2, q3, x, y, z = sd.coordinates("q1 q2 q3 x y z")
    u = sd.speeds("u1 u2 u3")
    m, r, g = sd.parameters("m r g")
    system = sd.System("disc", gravity=[0, 0, -g])
    disc = system.add_body("disc", mass=m, inertia=[m * r**2 / 4, m * r**2 / 2, m * r**2 / 4])
    system.add_joint(sd.Free("free", system.ground, disc, [x, y, z, q1, q2, q3], sd.EulerAngles("ZXY")))
    turning, moving = sp.Matrix(sd.angular_velocity(disc)), sp.Matrix(sd.velocity(disc))
    yawed = sp.Matrix([[sp.cos(q1), -sp.sin(q1), 0], [sp.sin(q1), sp.cos(q1), 0], [0, 0, 1]])
    leaning = yawed * sp.Matrix([[1, 0, 0], [0, sp.cos(q2), -sp.sin(q2)], [0, sp.sin(q2), sp.cos(q2)]])
    slip = moving + turning.cross(-r * leaning[:, 2])
    for k in range(3):
        system.add_constraint(slip[k], f"rolling_{k + 1}")
    system.set_speeds(dict(zip(u, leaning.T * turning, strict=True)))
    system.set_defaults({m: 2.0, r: 0.3, g: 9.81})
    compared = sd.from_sympy(rolling_disc().equations, defaults={"m": 2.0, "r": 0.3, "g": 9.81}).compile(backend="numpy")
    module = system.equations().compile(backend="numpy")
    angles, speeds = [0.4, 0.3, 0.2], [0.7, 2.0, -0.4]
    found = module.rhs(0.0, [1.0, 2.0, 0.28, *angles, *speeds])
    assert found[3:] == pytest.approx(compared.rhs(0.0, [*angles, *speeds]), rel=1e-12)


def test_loops_keep_their_multipliers() -> None:
    system, chosen = sd.systems.four_bar(), sd.systems.four_bar()
    q = system.check().coordinates
    u = sd.speeds(f"u1:{len(q) + 1}")
    chosen.set_speeds({a: sum(b.dot for b in q[:k + 1]) for k, a in enumerate(u)})
    first, second = system.augmented().compile(backend="numpy"), chosen.augmented().compile(backend="numpy")
    at, v = first.consistent(u={q[0].dot: 0.8})
    found, expected = second.rhs(0.0, [*at, *np.cumsum(v)]), first.rhs(0.0, [*at, *v])
    assert found == pytest.approx([*expected[:len(q)], *np.cumsum(expected[len(q):])], rel=1e-11)
    assert second.evaluate("lam", 0.0, [*at, *np.cumsum(v)]) == pytest.approx(first.evaluate("lam", 0.0, [*at, *v]), rel=1e-11)
    assert second.evaluate("reactions", 0.0, [*at, *np.cumsum(v)]) == pytest.approx(
        first.evaluate("reactions", 0.0, [*at, *v]), rel=1e-9, abs=1e-9)


def test_speeds_that_depend_on_the_time() -> None:
    system, chosen = sd.systems.pendulum(), sd.systems.pendulum()
    q, = system.check().coordinates
    u = sd.speeds("u")
    chosen.set_speeds({u: 2 * q.dot + sp.sin(sd.t)})
    own = system.embedding().compile(backend="numpy").rhs(0.4, [0.3, 0.5])
    found = chosen.embedding().compile(backend="numpy").rhs(0.4, [0.3, 1.0 + np.sin(0.4)])
    assert found == pytest.approx([own[0], 2 * own[1] + np.cos(0.4)], rel=1e-13)
    assert chosen.embedding().verify(states=2).passed


def faults(system: sd.System, speeds: object) -> str:
    system.set_speeds(speeds)
    with pytest.raises(sd.ModelError) as caught:
        system.equations()
    return str(caught.value)


def test_faults_of_chosen_speeds() -> None:
    make = sd.systems.double_pendulum
    q1, q2 = make().check().coordinates
    u1, u2 = sd.speeds("u1 u2")
    assert "was given 1 speed, the joints have 2; pass as many" in faults(make(), {u1: q1.dot})
    assert "or 2, which fulfil the velocity constraints blade" in faults(sleigh(False), {u1: sd.coordinates("x").dot})
    assert "u1 is not linear in the derivatives" in faults(make(), {u1: q1.dot**2, u2: q2.dot})
    assert "do not determine the derivatives of the coordinates at any state" in faults(make(), {u1: q1.dot, u2: 3 * q1})
    assert "q1, which is a coordinate already" in faults(make(), {q1: q1.dot, u2: q2.dot})
    named = make()
    named.joints[0].speeds = (u1,)
    assert "u1, which is the speed of a joint already" in faults(named, {u1: q1.dot, u2: q2.dot})
    assert "uses the acceleration q1_ddot" in faults(make(), {u1: q1.ddot, u2: q2.dot})
    assert "which no joint and no state drives" in faults(make(), {u1: sd.coordinates("zz").dot, u2: q2.dot})
    assert "pass a mapping from symbols" in faults(make(), [q1])
    assert "'u' as a speed; pass a symbol such as" in faults(make(), {"u": q1.dot})
    assert "given q1_dot as a speed; pass a symbol such as" in faults(make(), {q1.dot: q1.dot, q2.dot: q2.dot})
    absolute = make().set_speeds({u1: q1.dot, u2: q2.dot})
    with pytest.raises(sd.ModelError, match="chosen speeds are those of relative coordinates"):
        absolute.augmented(coordinates="absolute")


def test_speeds_that_are_singular_here_stop_with_the_reason() -> None:
    system = sd.systems.pendulum()
    q, = system.check().coordinates
    u = sd.speeds("u")
    system.set_speeds({u: sp.sin(q) * q.dot})
    with pytest.raises(sd.EvaluationError, match="u do not determine the speeds of the joints here"):
        system.embedding().compile(backend="numpy").rhs(0.0, [0.0, 1.0])


def test_an_empty_choice_takes_it_back() -> None:
    system = sd.systems.pendulum()
    q, = system.check().coordinates
    system.set_speeds({sd.speeds("u"): 2 * q.dot}).set_speeds({})
    assert system.check().speeds == (q.dot,)
