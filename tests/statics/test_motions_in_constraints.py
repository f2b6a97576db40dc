"""Linear equations where a motion moves what constraints hold: against a joint that follows it, differences, and simulations."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

import symdyn as sd
from symdyn.errors import ArgumentError

NAMES = ("z", "z_dot", "z_ddot")


def carts(how: str) -> sd.System:
    """A cart that follows z, and one of mass 2 behind a spring 10 and a damper 0.5."""
    x1, x2 = sd.coordinates("x1 x2")
    z = sd.motions("z")
    system = sd.System("carts", gravity=[0, 0])
    first, second = system.add_body("first", 1.0), system.add_body("second", 2.0)
    by_joint = how != "constraint"
    place = z if by_joint else x1
    system.add_joint(sd.Prismatic("drive", "ground", first, place, axis=[1, 0]))
    if not by_joint:
        system.add_constraint(x1 - z, "follows")
    system.add_joint(sd.Prismatic("slide", "ground", second, x2, axis=[1, 0]))
    system.add_joint_force("slide", -10 * (x2 - place) - 0.5 * (x2.dot - place.dot))
    for name, value in (("x1", sd.position(first)), ("v1", sd.velocity(first)), ("a1", sd.acceleration(first)),
                        ("a2", sd.acceleration(second))):
        system.add_output(name, value[0])
    return system


@pytest.mark.parametrize("how", ["joint", "constraint", "absolute"])
def test_a_spring_on_a_driven_cart_takes_its_value_and_rate(how: str) -> None:
    system = carts(how)
    module = (system.augmented(coordinates="absolute") if how == "absolute" else system.augmented()).compile(backend="numpy")
    linear = module.linearize(module.equilibrium(), hold=())
    assert linear.states == ("x2", "x2_dot")
    np.testing.assert_allclose(linear.A, [[0, 1], [-5, -0.25]], atol=1e-12)
    np.testing.assert_allclose(linear.B, [[0, 0, 0], [5, 0.25, 0]], atol=1e-12)
    np.testing.assert_allclose(linear.D, [[1, 0, 0], [0, 1, 0], [0, 0, 1], [5, 0.25, 0]], atol=1e-12)
    np.testing.assert_array_equal(linear.to_scipy().B, linear.B)


def winch() -> sd.System:
    """A load on a rope of the length z, with air drag."""
    x, y = sd.coordinates("x y")
    z = sd.motions("z")
    system = sd.System("winch", gravity=[0, -9.81])
    load = system.add_body("load", 2.0)
    system.add_joint(sd.Planar("plane", "ground", load, [x, y, 0]))
    system.add_constraint(sd.distance("ground", load) - z, "rope")
    system.add_force(load, [-0.3 * sd.velocity(load)[0], -0.3 * sd.velocity(load)[1]])
    lag = sd.coordinates("lag")
    system.add_state(lag, y - lag + 0.2 * x.dot)
    for k, name in enumerate("xy"):
        system.add_output("p" + name, sd.position(load)[k])
        system.add_output("v" + name, sd.velocity(load)[k])
        system.add_output("a" + name, sd.acceleration(load)[k])
    return system


def swing() -> sd.System:
    """A pendulum below a cart that follows z: in absolute coordinates the cart is on constraints."""
    a = sd.coordinates("a")
    z = sd.motions("z")
    system = sd.System("swing", gravity=[0, -9.81])
    cart, load = system.add_body("cart", 1.0, 0.1), system.add_body("load", 2.0, 0.1, com=[0.1, -0.4])
    system.add_joint(sd.Prismatic("drive", "ground", cart, z**2 + z, axis=[0.8, 0.6]))
    system.add_joint(sd.Revolute("pin", cart, load, a))
    system.add_joint_force("pin", -0.3 * a.dot)
    system.add_output("moment", sd.reaction("drive")[1])
    system.add_output("v", sd.velocity(load, [0.1, 0.2])[1])
    return system


def four_bar() -> sd.System:
    """A four-bar whose crank follows z, with a pendulum on its coupler."""
    b, c, d = sd.coordinates("b c d")
    z = sd.motions("z")
    system = sd.System("four_bar", gravity=[0, -9.81])
    crank, coupler = system.add_body("crank", 1.0, 0.1, com=[0.15, 0]), system.add_body("coupler", 1.0, 0.2, com=[0.5, 0])
    rocker, hung = system.add_body("rocker", 1.5, 0.2, com=[0.4, 0]), system.add_body("hung", 0.5, 0.05, com=[0, -0.3])
    system.add_joint(sd.Revolute("motor", "ground", crank, z))
    system.add_joint(sd.Revolute("elbow", crank, coupler, b, parent_point=[0.3, 0]))
    system.add_joint(sd.Revolute("pivot", "ground", rocker, c, parent_point=[1.0, 0]))
    system.add_joint(sd.Revolute("hook", coupler, hung, d, parent_point=[0.4, 0.1]))
    system.close_loop(sd.Revolute("knee", coupler, rocker, parent_point=[1.0, 0], child_point=[0.8, 0]))
    system.add_joint_force("hook", -0.2 * d.dot)
    system.initial = {b: 0.7, c: 1.6, d: -0.5}
    system.add_output("torque", sd.reaction("motor")[0])
    system.add_output("a", sd.acceleration(hung)[0])
    return system


def ball() -> sd.System:
    """A body on a spherical joint, whose speeds are no rates, held by springs, with a point on a height that follows z."""
    p = sd.coordinates("p0 p1 p2 p3")
    z = sd.motions("z")
    system = sd.System("ball", gravity=[0, 0, -9.81])
    body = system.add_body("body", 1.0, np.diag([0.1, 0.2, 0.15]), com=[0.3, 0.1, 0.2])
    system.add_joint(sd.Spherical("socket", "ground", body, p, orientation=sd.EulerParameters()))
    tip = sd.position(body, [0.1, 0.5, 0])
    system.add_force(body, [-20 * tip[0], 20 * (0.5 - tip[1]), 0], point=[0.1, 0.5, 0])
    system.add_constraint(sd.position(body, [0.6, 0.1, 0])[2] - 0.3 * z, "height")
    system.add_output("a", sd.acceleration(body, [0.2, 0.1, 0.3])[0])
    system.add_output("v", sd.velocity(body, [0.2, 0.1, 0.3])[1])
    return system


def sleigh() -> sd.System:
    """A blade that slides along itself but for a sideways speed of z_dot."""
    x, y, a = sd.coordinates("x y a")
    z = sd.motions("z")
    system = sd.System("sleigh", gravity=[0, 0])
    body = system.add_body("body", 1.0, 0.2, com=[0.3, 0])
    system.add_joint(sd.Planar("plane", "ground", body, [x, y, a]))
    sideways = -sp.sin(a) * x.dot + sp.cos(a) * y.dot
    system.add_constraint(sideways - z.dot + 0.1 * z * a.dot, "blade")
    system.add_joint_force("plane", [0, -3 * y, -0.4 * a.dot])
    system.add_output("a", sd.acceleration(body)[1])
    return system


MECHANISMS = {"winch": winch, "swing": swing, "four_bar": four_bar, "ball": ball, "sleigh": sleigh}
STATES = {"winch": ({"x": 0.3, "y": -1.0, "x_load": 0.3, "y_load": -1.0}, {"x_dot": 0.4}),
          "swing": ({}, {}), "four_bar": ({}, {"d_dot": 0.6}),
          "ball": ({"p0": 0.9, "p1": 0.3, "p2": -0.3, "p3": 0.1}, {}), "sleigh": ({"a": 0.3}, {"a_dot": 0.5, "x_dot": 1.0})}
START = {"winch": 1.1, "four_bar": 0.9}


@functools.cache
def built(name: str, form: str) -> Any:
    system = MECHANISMS[name]()
    return system.augmented(**({"coordinates": "absolute"} if form == "absolute" else {})).compile(backend="numpy")


def differences(module: Any, linear: Any, values: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """B and D by central differences of rates and outputs at states on the constraints, the independent ones kept."""
    metadata, h = module.metadata, 1e-5
    n_q, n_u = metadata.sizes.q, metadata.sizes.u
    kept = [n for n in linear.states if n in metadata.q or n in metadata.u]
    whole = [metadata.u.index(n.removesuffix("_dot") + "_dot") for n in linear.coordinates]

    def at(name: str, change: float) -> np.ndarray:
        inputs = values | {name: values[name] + change}
        q, u = module.consistent(linear.x[:n_q], linear.x[n_q:n_q + n_u], keep=kept, inputs=inputs)
        x = np.concatenate([q, u, linear.x[n_q + n_u:]])
        rates, outputs = module.rhs(0.0, x, inputs=inputs), module.outputs(0.0, x, inputs=inputs)
        picked = [metadata.x.index(n) for n in linear.states[len(whole):]]
        return np.concatenate([u[whole], rates[picked], [float(outputs[n]) for n in linear.outputs]])

    columns = np.array([(at(n, h) - at(n, -h)) / (2 * h) for n in NAMES]).T
    return columns[:len(linear.states)], columns[len(linear.states):]


@pytest.mark.every_value
@pytest.mark.parametrize("moving", [False, True], ids=["still", "moving"])
@pytest.mark.parametrize(("name", "form"), [("winch", "relative"), ("winch", "absolute"), ("swing", "absolute"),
                                            ("four_bar", "relative"), ("four_bar", "absolute"), ("sleigh", "relative")])
def test_columns_of_motions_are_differences_at_states_on_the_constraints(name: str, form: str, moving: bool) -> None:
    module = built(name, form)
    values = dict(zip(NAMES, (START.get(name, 0.2), 0.7 * moving, -0.9 * moving), strict=True))
    q, u = ({n: v for n, v in each.items() if n in module.metadata.x} for each in STATES[name])
    state = module.consistent(q, u if moving else {}, inputs=values)
    linear = module.linearize(state, inputs=values)
    B, D = differences(module, linear, values)
    assert np.abs(D).max() > 0.1
    np.testing.assert_allclose(linear.B, B, atol=2e-7 * max(1.0, np.abs(B).max()))
    np.testing.assert_allclose(linear.D, D, atol=2e-7 * max(1.0, np.abs(D).max()))


def response(linear: Any, amplitude: float, w: float, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Outputs of the linear equations from x' = 0 with amplitude sin(w t), (n_t, n_y), and their derivatives by the start."""
    def change(t: float) -> np.ndarray:
        return amplitude * np.array([np.sin(w * t), w * np.cos(w * t), -w**2 * np.sin(w * t)])

    def outputs(x0: np.ndarray, driven: float) -> np.ndarray:
        run = solve_ivp(lambda t, x: linear.A @ x + driven * linear.B @ change(t), (times[0], times[-1]), x0, t_eval=times,
                        rtol=1e-10, atol=1e-13)
        return np.array([linear.C_out @ x + driven * linear.D @ change(t) for t, x in zip(times, run.y.T, strict=True)])

    n = len(linear.A)
    by_start = np.array([outputs(row, 0.0).ravel() for row in np.eye(n)]).T
    return outputs(np.zeros(n), 1.0), by_start


@pytest.mark.parametrize(("name", "form"), [("winch", "relative"), ("swing", "absolute"), ("four_bar", "relative"),
                                            ("ball", "relative")])
def test_small_motions_give_the_outputs_of_simulations(name: str, form: str) -> None:
    module, w, amplitude = built(name, form), 2.3, 1e-4
    z0, times = START.get(name, 0.2), np.linspace(0, 1, 9)
    q = {n: v for n, v in STATES[name][0].items() if n in module.metadata.q}
    rest = module.equilibrium(inputs={"z": z0}, start=q)
    linear = module.linearize(rest, hold=())

    def outputs(sign: float) -> np.ndarray:
        a = sign * amplitude

        def z(t: float) -> tuple[float, float, float]:
            return z0 + a * np.sin(w * t), a * w * np.cos(w * t), -a * w**2 * np.sin(w * t)

        start = module.consistent(rest.q, rest.u, inputs={"z": z})
        run = module.simulate(times, *start, inputs={"z": z}, rtol=1e-12, atol=1e-13)
        assert run.success, run.message
        return np.array([run.outputs[n] for n in linear.outputs]).T

    found = (outputs(1.0) - outputs(-1.0)) / 2
    own, by_start = response(linear, amplitude, w, times)
    # The start is the nearest one on the constraints: its independent speeds are those of that state.
    x0 = np.linalg.lstsq(by_start, (found - own).ravel(), rcond=None)[0]
    left = found.ravel() - own.ravel() - by_start @ x0
    assert by_start.shape[1] < len(left) / 2
    assert np.abs(left).max() < 1e-5 * np.abs(found).max()


def test_a_motion_that_the_constraints_do_not_let_it_follow_has_no_columns() -> None:
    x = sd.coordinates("x")
    z = sd.motions("z")
    system = sd.System("stuck", gravity=[0, 0])
    body = system.add_body("body", 1.0)
    system.add_joint(sd.Prismatic("slide", "ground", body, x, axis=[1, 0]))
    system.add_constraint(x - z, "follows")
    module = system.augmented().compile(backend="numpy")
    linear = module.linearize({"x": 1.0}, inputs={z: 1.0}, fixed={"x": 1.0})
    assert linear.A.shape == (0, 0)
    with pytest.raises(ArgumentError, match=r"stuck: B and D are requested where the constraints do not let the mechanism follow "
                                            r"changes of z, z_dot, z_ddot"):
        linear.B  # noqa: B018
    assert "do not let the mechanism follow" in linear.describe()
