"""Equations of SymPy's mechanics as equations of symdyn's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, TypeAlias

import sympy as sp

from symdyn.errors import ArgumentError
from symdyn.formulation.by_hand.matrices import GivenMatrices, from_matrices
from symdyn.formulation.printed.independent_speeds import MotionEquations
from symdyn.shown import shown
from symdyn.sympy_mechanics.kane import of_kane
from symdyn.sympy_mechanics.lagrange import of_lagrange
from symdyn.sympy_mechanics.options import Options
from symdyn.sympy_mechanics.plain import of_matrices

if TYPE_CHECKING:
    from sympy.physics.mechanics import KanesMethod, LagrangesMethod

    from symdyn.given import Named, Numbers, Scalar, Vector

    Plain: TypeAlias = tuple[Sequence[sp.Expr] | sp.MatrixBase, Sequence[sp.Expr] | sp.MatrixBase, sp.MatrixBase,
                             Sequence[sp.Expr] | sp.MatrixBase]
    Derived: TypeAlias = KanesMethod | LagrangesMethod | Plain


def from_sympy(equations: Derived, name: str = "system", defaults: Numbers | None = None, initial: Numbers | None = None,
               units: Named[str] | None = None, states: Mapping[sp.Expr, Scalar] | None = None,
               outputs: Mapping[str, Scalar | Vector] | None = None, kinematics: Sequence[sp.Expr] | None = None,
               duration: float = 10.0) -> MotionEquations:
    """Equations of motion that SymPy has derived, as equations of symdyn's: they compile, simulate, linearize, print.

    equations    a KanesMethod after kanes_equations(...), a LagrangesMethod after form_lagranges_equations(), or (q, u, M, f) of
                 M u' = f: columns of dynamicsymbols, a matrix and a column
    name         of files and functions; defaults: numbers for parameters; initial: for coordinates, speeds, states and inputs at
                 the start; units: symbol -> text such as "m"; duration: usual time of simulation, s
    states       extra states z(t) with their rates, such as activations of muscles
    outputs      named outputs: expressions in coordinates, speeds, states, inputs and t, or columns of these
    kinematics   of (q, u, M, f): expressions that are zero, linear in q' and u; default: u = q'

    Coordinates and speeds keep their names and order; other functions of time become inputs, and motions where the equations have
    their derivatives; symbols become parameters. Dependent speeds stay in the state: accelerations follow with multipliers, and
    configuration and velocity constraints are enforced along the motion. Forces that auxiliary speeds bring in are outputs under
    their names. Nothing is inverted or simplified: the matrices are recorded on a tape, each equal step once.

    Returns MotionEquations, with constraints AugmentedEquations. Raises ArgumentError for other objects; ModelError with all
    faults: for equations that are not formed yet, functions without a value, symbols of one name, mass matrices that are not
    symmetric or are singular, constraints that contradict each other. Warns (ModelWarning) of angular velocities that contradict
    orientations.

    >>> from sympy.physics.mechanics import dynamicsymbols, LagrangesMethod
    >>> q, (m, l, g) = dynamicsymbols("q"), sp.symbols("m l g")
    >>> pendulum = LagrangesMethod(m * l**2 * q.diff()**2 / 2 + m * g * l * sp.cos(q), [q])
    >>> eom = pendulum.form_lagranges_equations()
    >>> eq = sd.from_sympy(pendulum, defaults={m: 1, l: 1, g: 9.81})
    >>> eq.M_tilde, eq.F_tilde
    (Matrix([[l**2*m]]), Matrix([[-g*l*m*sin(q)]]))
    """
    for what, given_as in (("states", states), ("outputs", outputs)):
        if given_as is not None and not isinstance(given_as, Mapping):
            raise ArgumentError(f"{what} is {shown(given_as)}; pass a mapping, such as {{z: rate}} for states, "
                                "{'tip': expression} for outputs")
    given = given_matrices(equations, Options(name, defaults, initial, units, duration, dict(states or {}), dict(outputs or {})),
                           kinematics)
    return from_matrices(given)


def given_matrices(equations: Derived, options: Options, kinematics: Sequence[sp.Expr] | None = None) -> GivenMatrices:
    """Matrices of equations of SymPy's. Raises ArgumentError and ModelError as from_sympy does."""
    from sympy.physics.mechanics import KanesMethod, LagrangesMethod

    if isinstance(equations, (tuple, list)) and len(equations) == 4:
        q, u, mass, forcing = equations
        return of_matrices(q, u, mass, forcing, kinematics, options)
    if kinematics is not None:
        raise ArgumentError(f"kinematics belong to plain equations (q, u, M, f); a {type(equations).__name__} has its own, leave "
                            "them out")
    if isinstance(equations, KanesMethod):
        return of_kane(equations, options)
    if isinstance(equations, LagrangesMethod):
        return of_lagrange(equations, options)
    kind = type(equations).__name__
    raise ArgumentError(f"from_sympy was given {shown(equations)} of type {kind}; pass a KanesMethod, a LagrangesMethod, or "
                        "(q, u, M, f) with M u' = f" + {
                            "System": "; of a sympy.physics.mechanics.System form_eoms() makes its eom_method, and "
                                      "sd.from_system takes its bodies and joints over",
                            "JointsMethod": "; form_eoms() makes its method"}.get(kind, ""))
