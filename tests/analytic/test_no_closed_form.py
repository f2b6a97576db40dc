"""Systems without equilibria in closed form or without linear equations are reported, and those that only look like it are
solved."""

from __future__ import annotations

from typing import Any

import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import SymdynError

m, g, k, c, d, length, outer, rest, amplitude, rate = sd.parameters("m g k c d l M R A Omega", positive=True)
x, theta, s, zeta = sd.coordinates("x theta s zeta")


def slider(force: Any) -> Any:
    system = sd.System("slider", planar=True)
    body = system.add_body("body", mass=m)
    system.add_joint(sd.Prismatic("rail", system.ground, body, axis=[1, 0], coordinate=x))
    system.add_joint_force("rail", force)
    return system.embedding()


def test_the_time_in_the_equations_leaves_no_state_of_rest() -> None:
    for equations in (slider(-k * x + amplitude * sp.cos(rate * sd.t)), shaken()):
        with pytest.raises(SymdynError, match="the time stands in its equations, so that a state of rest at one time is none"):
            equations.equilibria()


def shaken() -> Any:
    system = sd.System("shaken", gravity=[0, -g])
    system.move_ground([amplitude * sp.sin(rate * sd.t), 0])
    bob = system.add_body("bob", mass=m, com=[0, -length])
    system.add_joint(sd.Revolute("hinge", system.ground, bob, coordinate=theta))
    return system.embedding()


def test_dry_friction_has_no_points_of_rest() -> None:
    with pytest.raises(SymdynError, match=r"sign\(x_dot\) jumps where a speed passes zero: dry friction holds a whole range"):
        slider(-k * x - d * sp.sign(x.dot)).equilibria()


@pytest.mark.parametrize(("force", "what"), [
    (-k * x - d * sp.sign(x.dot), "where x_dot passes its value (in sign)"),
    (-k * sp.Abs(x), "where x passes its value (in abs)"),
    (sp.Piecewise((-k * x, x > 0), (-c * x, True)), "where x passes its value (in select)"),
    (sp.Max(0, -k * x), "where x passes its value (in max)")])
def test_kinks_and_jumps_at_the_state_have_no_linear_equations(force: Any, what: str) -> None:
    with pytest.raises(SymdynError) as found:
        slider(force).linearized()
    assert "the equations have a kink or a jump at this state, " in str(found.value) and what in str(found.value)


def test_the_same_functions_are_linearized_where_they_are_smooth() -> None:
    assert sp.zeros(1) == slider(-k * x - d * sp.Abs(x.dot) * x.dot).linearized().C  # drag at rest
    assert sp.Matrix([[k * length]]) == slider(-k * x * sp.Abs(length + x)).linearized().K
    piecewise = slider(sp.Piecewise((-k * x, x > 0), (-c * x, True)))
    assert sp.Matrix([[k]]) == piecewise.linearized(about={x: 1}).K and sp.Matrix([[c]]) == piecewise.linearized(about={x: -1}).K


def test_divisors_of_what_was_eliminated() -> None:
    """A bar that swings, with a slider on a spring along it."""
    system = sd.System("bar", gravity=[0, -g])
    bar, bob = system.add_body("bar", mass=outer, com=[0, -length]), system.add_body("bob", mass=m)
    system.add_joint(sd.Revolute("hinge", system.ground, bar, coordinate=theta))
    system.add_joint(sd.Prismatic("rail", bar, bob, axis=[0, -1], coordinate=s))
    system.add_joint_force("rail", -k * (s - rest))
    equations = system.embedding()
    found = equations.equilibria()
    assert len(found) == 4 and all(point.proved for point in found)
    potential = equations.V + k * (s - rest) ** 2 / 2
    for point in found:
        values = {q: e.subs({outer: 0.1, m: 2, g: 9.81, k: 30, length: 0.4, rest: 0.2}) for q, e in point.values.items()}
        numbers = {outer: 0.1, m: 2, g: 9.81, k: 30, length: 0.4, rest: 0.2}
        for q in (theta, s):
            assert abs(sp.N(potential.diff(q).subs(numbers).subs(values))) < 1e-10


def test_extra_states_are_shown_with_what_they_couple() -> None:
    system = sd.System("servo", planar=True)
    body = system.add_body("body", mass=m)
    system.add_joint(sd.Prismatic("rail", system.ground, body, axis=[1, 0], coordinate=x))
    system.add_state(zeta, x - c * zeta)
    system.add_joint_force("rail", -k * x - d * zeta)
    linear = system.embedding().linearized()
    assert "x'_dot = A x' of x' = [eta; eta_dot; zeta]\n  A = [[0, 1, 0], [-k/m, 0, -d/m], [1, 0, -c]]" in str(linear)
    assert r"\zeta" in linear._repr_latex_() and r"\frac{d}{m}" in linear._repr_latex_()


def test_a_state_that_is_none_of_equilibrium() -> None:
    with pytest.raises(SymdynError, match="the state is no equilibrium: -1 would have to be zero"):
        print(slider(1 - k * x).linearized())
    nearly = slider(0.3 - 3 * x).linearized(about={x: 0.1})
    assert nearly.conditions == () and sp.Matrix([[3]]) == nearly.K


def test_points_of_a_set_are_not_listed_besides_it() -> None:
    y = sd.coordinates("y")
    system = sd.System("skate", planar=True)
    blade = system.add_body("blade", mass=m, inertia=d)
    system.add_joint(sd.Planar("plane", system.ground, blade, [x, y, theta]))
    system.add_constraint(y.dot * sp.cos(theta) - x.dot * sp.sin(theta))
    [found] = system.augmented().equilibria()
    assert set(found.free) == {x, y, theta} and list(found.values.values()) == [0]


def test_conditions_that_never_hold() -> None:
    system = sd.System("two", planar=True)
    second = sd.coordinates("y")
    for name, q in (("one", x), ("other", second)):
        body = system.add_body(name, mass=m)
        system.add_joint(sd.Prismatic(f"rail_{name}", system.ground, body, axis=[1, 0], coordinate=q))
        system.add_joint_force(f"rail_{name}", -k * q - (d * q.dot if name == "one" else 0))
    stability = system.embedding().linearized().characteristic().routh_hurwitz()
    assert str(stability) == repr(stability) == ("no asymptotic stability for any values of the parameters: 0 would have to be "
                                                 "positive")


def test_claims_at_states_where_what_is_compared_is_not_real() -> None:
    symbol = sp.Symbol("x")
    assert not sd.prove(sp.Max(sp.log(symbol), symbol), symbol).refuted


def test_multipliers_at_singular_positions_are_free() -> None:
    """A rod whose middle and end are guided: at its dead point the guide's force is any."""
    system = sd.systems.get("slider_crank")
    found = system.augmented().equilibria()
    assert len(found) == 2 and all([str(s) for s in point.free] == ["lambda1"] for point in found)


def test_a_spring_to_an_axis_has_no_polynomial_conditions() -> None:
    z = sd.coordinates("z")
    system = sd.System("cylinder", gravity=[0, 0, -g])
    body = system.add_body("body", mass=m, inertia=[c, c, d])
    system.add_joint(sd.Cylindrical("joint", system.ground, body, coordinates=[theta, z], axis=[0, 0, 1]))
    system.add_spring_damper(system.ground, body, point_b=[length, 0, 0], stiffness=k, length=rest)
    with pytest.raises(SymdynError, match="which is no polynomial; use module"):
        system.embedding().equilibria()


def test_linear_equations_where_an_expression_divides_by_zero() -> None:
    system = sd.System("puck", planar=True)
    arm, puck = system.add_body("arm"), system.add_body("puck", mass=m)
    system.add_joint(sd.Revolute("turn", system.ground, arm, coordinate=theta))
    system.add_joint(sd.Prismatic("slide", arm, puck, axis=[1, 0], coordinate=s))
    system.add_spring_damper(system.ground, puck, stiffness=k, length=rest)
    equations = system.embedding()
    with pytest.raises(SymdynError, match="linear equations were requested at a state where an expression divides by zero"):
        equations.linearized()
    linear = equations.linearized({s: rest})
    assert sp.Matrix([[0, 0], [0, k]]) == linear.K and linear.conditions == ()
