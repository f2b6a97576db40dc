"""Linear equations are not made where a law has a kink or a jump, and made where it is smooth, in numbers as in symbols."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ArgumentError, SymdynError

m, k, c, d = sd.parameters("m k c d", positive=True)
x, y = sd.coordinates("x y")
F = sd.inputs("F")
NUMBERS = {m: 2.0, k: 30.0, c: 0.7, d: 0.3}


def slider(force: Any) -> Any:
    system = sd.System("slider", planar=True)
    body = system.add_body("body", mass=m)
    system.add_joint(sd.Prismatic("rail", system.ground, body, axis=[1, 0], coordinate=x))
    system.add_joint_force("rail", force)
    system.defaults = {p: value for p, value in NUMBERS.items() if p in sp.sympify(force).free_symbols | {m}}
    return system.embedding()


# A law, a state, and what breaks there.
LAWS: list[tuple[Any, dict[str, float], str]] = [
    (-k * x - d * sp.sign(x.dot), {}, "x_dot"),
    (-k * x - d * sp.sign(x.dot), {"x_dot": 1.0}, ""),
    (-k * sp.Abs(x), {}, "x"),
    (-k * sp.Abs(x), {"x": 0.01}, ""),
    (-k * x - d * sp.Abs(x.dot), {}, "x_dot"),
    (-k * x - d * sp.Abs(x.dot) * x.dot, {}, ""),
    (sp.Max(0, -k * x), {}, "x"),
    (sp.Max(0, -k * x), {"x": -0.3}, ""),
    (sp.Piecewise((-k * x, x > 0), (-c * x, True)), {}, "x"),
    (sp.Piecewise((-k * x, x > 1), (-k * x + c, True)), {"x": 1.0}, "x"),
    (-1e9 * sp.Max(0, x - 0.1) ** 2 + 1e9 * x, {"x": 0.1}, ""),
    (-k * x + sp.Min(F, d), {"F": 0.3}, "F"),
    (-k * x + sp.Min(F, d), {"F": 0.2}, "")]


@pytest.mark.parametrize(("law", "state", "breaks"), LAWS)
def test_numbers_and_symbols_say_the_same(law: Any, state: dict[str, float], breaks: str) -> None:
    equations = slider(law)
    module = equations.compile(backend="numpy")
    at = {name: value for name, value in state.items() if name != "F"}
    inputs = {"F": state["F"]} if "F" in state else None
    here = {"x": 0.0, "x_dot": 0.0, **at}
    if not breaks:
        linear = module.linearize(here, inputs=inputs)
        step, other = 1e-7, {"F": 0.2, **state}

        def accelerated(q: float, u: float) -> float:
            values = {x: q, x.dot: u, F: other["F"], **NUMBERS}
            return float((law / m).subs(values))

        by_x = (accelerated(here["x"] + step, here["x_dot"]) - accelerated(here["x"] - step, here["x_dot"])) / (2 * step)
        by_u = (accelerated(here["x"], here["x_dot"] + step) - accelerated(here["x"], here["x_dot"] - step)) / (2 * step)
        # The differences are as good as the step times the second derivative.
        assert np.allclose(linear.A[1], [by_x, by_u], rtol=1e-6, atol=1e-6)
        return
    text = f"slider: linear equations were requested, but the equations have a kink or a jump at this state, where {breaks} "
    with pytest.raises(ArgumentError, match=text):
        module.linearize(here, inputs=inputs)
    if "x_dot" not in at:  # in symbols a speed makes it a steady motion
        with pytest.raises(SymdynError, match=f"a kink or a jump at this state, where {breaks} passes its value"):
            equations.linearized(about={name: sp.nsimplify(value) for name, value in state.items()} if not inputs
                                 else {F: d})


def test_verdicts_about_such_states_are_not_decided() -> None:
    module = slider(-k * x - d * sp.sign(x.dot)).compile(backend="numpy")
    rest = module.equilibrium()
    assert rest.verdict == "not decided" and "where x_dot passes its value" in repr(module.stability(rest))
    assert module.stability({"x": 0.0, "x_dot": 0.0}).verdict == "not decided"
    with pytest.raises(ArgumentError, match="there are no eigenvalues here: the equations have a kink or a jump"):
        _ = rest.eigenvalues
    with pytest.raises(ArgumentError, match="where x_dot passes its value"):
        module.linearize(rest)


def test_what_is_held_does_not_count() -> None:
    system = sd.System("two", planar=True)
    for name, q in (("one", x), ("other", y)):
        body = system.add_body(name, mass=m)
        system.add_joint(sd.Prismatic(f"rail_{name}", system.ground, body, axis=[1, 0], coordinate=q))
        system.add_joint_force(f"rail_{name}", -k * q - (d * sp.sign(q.dot) if name == "one" else 0))
    system.defaults = {p: NUMBERS[p] for p in (m, k, d)}
    module = system.embedding().compile(backend="numpy")
    assert np.allclose(module.linearize(fixed={"x": 0.0}).A, [[0, 1], [-15, 0]])
    with pytest.raises(ArgumentError, match="where x_dot passes its value"):
        module.linearize()


def test_edges_under_constraints() -> None:
    """A block on an inclined rail in absolute coordinates, against a stop."""
    system = sd.System("block", planar=True)
    body = system.add_body("body", mass=m)
    system.add_joint(sd.Planar("plane", system.ground, body, [x, y, sd.coordinates("a")]))
    system.add_constraint(y - x)
    system.add_joint_force("plane", [-k * sp.Max(0, x) - c * x, 0, 0])
    system.add_constraint(sd.coordinates("a"))
    system.defaults = {m: 2.0, k: 30.0, c: 0.7}
    module = system.augmented().compile(backend="numpy")
    with pytest.raises(ArgumentError, match="where x passes its value"):
        module.linearize({"x": 0.0, "y": 0.0})
    free = module.linearize({"x": -0.1, "y": -0.1}, coordinates=["x"])
    assert np.allclose(free.A[1], [-0.7 / 4, 0])
    pressed = module.linearize({"x": 0.1, "y": 0.1}, coordinates=["x"])
    assert np.allclose(pressed.A[1], [-30.7 / 4, 0])
