"""Comparison of printed equations with their generated code, at random states.

    python -m symdyn.lab.printed [--states N] [--simplify SECONDS] [--most OPERATIONS]

The mechanisms have speeds with names of their own, coordinates that depend on others and on the time, custom joints,
quasi-velocities and constraints. Every quantity that has an explicit form, and is not too long for one, is printed, evaluated
with numbers for the symbols of the equations alone, and compared with the function that is generated for it. Exit code 1: a
symbol that the equations do not have, or a difference of more than BOUND of the largest entry.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import sympy as sp

import symdyn as sd
from symdyn.errors import UnsupportedExpression
from symdyn.formulation.equations import Equations

BOUND = 1e-9
# Operations of a quantity that is printed.
MOST = 200
# Derivatives along directions and of weighted sums: directions and weights are no symbols.
DIRECTIONAL = ("unknowns", "adjoint")
# Other quantities that take more arguments than a state, accelerations, inputs and parameters.
OTHERS = ("variation", "second_variation", "outputs_variation", "residual", "rhs_baumgarte", "jacobian_x_baumgarte", "balance",
          "stiffness", "damping", "N_dot", "reactions_by_lam", "rhs_variation", "rhs_variation_by_matrix", "corrected_variation",
          "outputs_sensitivity", "events_variation", "event_resets_variation", "carried_variation")


def named() -> sd.System:
    """A pendulum on a cart with speeds of their own names, a damper that is written with a derivative, and an output."""
    x, theta = sd.coordinates("x theta")
    v, omega = sd.speeds("v omega")
    m, l, c = sd.parameters("m l c")
    F = sd.inputs("F")
    system = sd.System("named", gravity=[0, -9.81, 0])
    cart = system.add_body("cart", mass=2 * m)
    bob = system.add_body("bob", mass=m, inertia=[0, 0, m * l**2 / 3], com=[0, -l, 0])
    system.add_joint(sd.Prismatic("rail", system.ground, cart, x, axis=[1, 0, 0], speed=v))
    system.add_joint(sd.Revolute("pivot", cart, bob, theta, speed=omega))
    system.add_joint_force("rail", F - c * x.diff(sd.t))
    system.add_joint_force("pivot", -c * omega * sp.Abs(theta.dot))
    system.add_output("tip", x.dot + l * omega * sp.cos(theta))
    return system.set_defaults({m: 1.2, l: 0.7, c: 0.3})


def dependent() -> sd.System:
    """A gear, a mimic, an absolute angle and a given motion."""
    q, phi = sd.coordinates("q phi")
    w = sd.speeds("w")
    system = sd.System("dependent", gravity=[0.5, -9.81, 0])
    parent = system.ground
    for k, expression in enumerate((q, phi - q, sp.UnevaluatedExpr(q), sp.sin(2 * sd.t) - 2 * q)):
        body = system.add_body(f"b{k}", mass=1 + k, inertia=[0.1, 0.2, 0.3], com=[0.4, 0.1, 0])
        speed = w if k == 0 else None
        system.add_joint(sd.Revolute(f"j{k}", parent, body, expression, speed=speed, parent_point=[k and 1, 0, 0]))
        parent = body
    system.add_coordinate(phi)
    system.add_joint_force("j1", -0.3 * (phi - q).diff(sd.t))
    return system


def custom() -> sd.System:
    """A bead on a wire and a body on a surface, with named speeds."""
    x, a, b = sd.coordinates("x a b")
    v, va, vb = sd.speeds("v va vb")
    system = sd.System("custom", gravity=[0, 0, -9.81])
    bead = system.add_body("bead", mass=1, inertia=[0.1, 0.2, 0.3])
    system.add_joint(sd.Custom("wire", system.ground, bead, [x], position=[x, x**2 / 2, sp.sin(x)], speeds=[v]))
    disc = system.add_body("disc", mass=2, inertia=[0.2, 0.3, 0.4], com=[0.1, 0, 0.2])
    system.add_joint(sd.Custom("surface", bead, disc, [a, b], position=[a, b, a * b / 3], speeds=[va, vb]))
    system.add_joint_force("wire", -0.2 * v - x)
    return system


def quasi() -> sd.System:
    """A body with its angular velocity as speeds, by Euler angles, and one by Euler parameters."""
    system = sd.System("quasi", gravity=[0, 0, -9.81])
    top = system.add_body("top", mass=1, inertia=[0.1, 0.2, 0.3], com=[0.1, 0.2, 0.3])
    system.add_joint(sd.Spherical("ball", system.ground, top, sd.coordinates("psi theta phi"), sd.EulerAngles("ZYX", "body"),
                                  speeds=sd.speeds("p q r")))
    rod = system.add_body("rod", mass=1, inertia=[0.1, 0.2, 0.3], com=[0.2, 0, 0])
    system.add_joint(sd.Spherical("tip", top, rod, sd.coordinates("e0:4"), sd.EulerParameters(), parent_point=[0.3, 0.1, 0]))
    return system


def constrained() -> sd.System:
    """Named speeds and constraints in coordinates, in speeds and with the time."""
    x, y, theta = sd.coordinates("x y theta")
    v, w, omega = sd.speeds("v w omega")
    system = sd.System("constrained", gravity=[0, -9.81])
    skate = system.add_body("skate", mass=2, inertia=0.3, com=[0.2, 0.1])
    system.add_joint(sd.Planar("plane", system.ground, skate, [x, y, theta], speeds=[v, w, omega]))
    system.add_constraint(y.dot * sp.cos(theta) - x.dot * sp.sin(theta), "edge")
    system.add_constraint(theta - sp.sin(sd.t) - x / 5, "steered")
    return system


SYSTEMS: dict[str, Callable[[], Equations]] = {
    **{f"{make.__name__} {form}": lambda make=make, form=form: getattr(make(), form)()  # type: ignore[misc]
       for make in (named, dependent, custom, quasi) for form in ("embedding", "recursive")},
    "constrained augmented": lambda: constrained().augmented(), "named augmented": lambda: named().augmented()}


@dataclass(frozen=True)
class Comparison:
    """Comparison of one quantity: symbols that the equations do not have, and the largest difference relative to the largest
    entry."""

    name: str
    strange: tuple[str, ...]
    error: float

    @property
    def passed(self) -> bool:
        return not self.strange and self.error <= BOUND


def compare(equations: Equations, states: int = 3, simplify: bool = False, most: int = MOST, seed: int = 1
            ) -> Iterator[Comparison]:
    """Every quantity that has an explicit form, of those of no more than so many operations: printed ones grow without limit."""
    s = equations.symbols
    rng = np.random.default_rng(seed)
    moving = [*s.coordinates, *s.speeds, *s.states]
    given = [sd.t, *moving, *s.inputs, *s.parameters, *equations.accelerations]
    drawn = [rng.uniform(0.1, 0.9, len(given)) for _ in range(states)]
    for numbers in drawn:
        _normalize(equations, moving, numbers)
    for name in equations.quantities:
        if name in OTHERS or name.startswith(DIRECTIONAL) or equations.tape(name).operations > most:
            continue
        try:
            explicit = equations.explicit(name, simplify)
        except UnsupportedExpression:  # by a numeric algorithm
            continue
        value = sp.Matrix(list(explicit) if isinstance(explicit, sp.MatrixBase) else [explicit])
        if not len(value):
            continue
        strange = value.atoms(sp.Symbol) - set(given)
        if strange:
            yield Comparison(name, tuple(sorted(map(str, strange))), np.inf)
            continue
        printed, generated = sp.lambdify(given, value, "numpy", cse=True), equations.lambdify(name)
        yield Comparison(name, (), max(_apart(printed(*numbers), _generated(equations, generated, numbers)) for numbers in drawn))


def _normalize(equations: Equations, moving: list[Any], numbers: np.ndarray) -> None:
    """Euler parameters of length 1."""
    for group in equations.unit_groups:
        at = [1 + moving.index(q) for q in group]
        numbers[at] /= np.linalg.norm(numbers[at])


def _generated(equations: Equations, function: Callable[..., np.ndarray], numbers: np.ndarray) -> np.ndarray:
    s = equations.symbols
    sizes = [1, len(s.coordinates), len(s.speeds) + len(s.states), len(s.inputs), len(s.parameters), len(s.speeds)]
    t, q, u, inputs, params, ud = np.split(numbers, np.cumsum(sizes)[:-1])
    return np.asarray(function(q, u, params, t=float(t[0]), inputs=inputs, ud=ud), dtype=float)


def _apart(one: Any, other: np.ndarray) -> float:
    a, b = np.ravel(np.asarray(one, dtype=float)), np.ravel(other)
    size = float(np.abs(b).max(initial=0.0))
    return float(np.abs(a - b).max(initial=0.0)) / max(size, 1e-12) if a.shape == b.shape else np.inf


def main() -> int:
    """Print the largest difference of each mechanism, and what does not agree."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--states", type=int, default=3, help="random states of each mechanism")
    parser.add_argument("--simplify", type=float, default=0.0, help="compare simplified forms, by so many seconds a quantity")
    parser.add_argument("--most", type=int, default=MOST, help="operations of a quantity that is printed")
    arguments = parser.parse_args()
    failed = 0
    for title, make in SYSTEMS.items():
        equations = make()
        if arguments.simplify:
            equations = replace(equations, simplify_seconds=arguments.simplify)
        result = list(compare(equations, arguments.states, arguments.simplify > 0, most=arguments.most))
        wrong = [c for c in result if not c.passed]
        failed += len(wrong)
        largest = max(c.error for c in result)
        print(f"{title}: {len(result)} quantities, largest difference {largest:.1e}, {len(wrong)} do not agree")
        for c in wrong:
            print(f"    {c.name}: {', '.join(c.strange) or f'{c.error:.1e}'}")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
