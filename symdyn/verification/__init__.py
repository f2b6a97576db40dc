"""Proves equations of motion sound without a reference: identities that must hold at any state, at 30 digits.

Identities that exact algebra proves with products of few terms are proved, for every state, and are not evaluated. These depend
on the equations alone, not on time or the machine. The others are checked at random states:

A check is a function of a Sample that returns its residual, or None where it does not apply; a new formulation joins by
naming its quantities alike, a new check by one line in CHECKS, or in CONSTRAINED.

A residual above the tolerance of its check has one of three causes, distinguished by measurement. Digits were lost in an
ill-conditioned state: with more digits the residual falls below the tolerance. Constants of the description were rounded to
doubles, such as the entries of a rotation matrix: the residual is as large as the residual that a change of each of these
constants by half a unit of its last place makes, the condition of the identity included. Otherwise the equations are wrong.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath

from symdyn.counting import counted
from symdyn.exact.mechanism import proved_quickly
from symdyn.formulation.equations import Equations
from symdyn.kinds import whole
from symdyn.tape.node import SPEED, Node
from symdyn.verification import identities as holds
from symdyn.verification import reactions
from symdyn.verification.sample import ENLARGED, Sample
from symdyn.verification.states import samples as samples_of
from symdyn.verification.user_functions import checks_of_user_functions, without_digits

# Digits that are added where a residual is above its tolerance, and seeds of the changes of constants within their rounding.
MORE_DIGITS = 25
ROUNDINGS = (1, 2, 3)
# Tolerance, by the largest residual that rounding makes over these seeds. A residual r of another cause adds no more than
# r MARGIN / ENLARGED to it, so that it is found.
MARGIN = 20.0


@dataclass(frozen=True)
class Check:
    """One identity: its largest residual over all states, relative to the size of its terms, and what is allowed.

    proved   by exact algebra, for every state and all parameters; the residual is then zero, and no state is evaluated
    """

    name: str
    residual: float | None
    tolerance: float
    remark: str = ""
    proved: bool = False

    @property
    def passed(self) -> bool | None:
        """None where the check does not apply."""
        return None if self.residual is None else bool(self.residual <= self.tolerance)


@dataclass(frozen=True)
class Verification:
    """All checks of one set of equations; prints as a table, with a note on what is known to fewer digits."""

    name: str
    states: int
    checks: tuple[Check, ...]
    note: str = ""

    @property
    def passed(self) -> bool:
        return all(check.passed is not False for check in self.checks)

    def __str__(self) -> str:
        proved = sum(c.proved for c in self.checks)
        sampled = sum(c.residual is not None for c in self.checks) - proved
        lines = [f"{self.name}: {counted(proved, 'identity', 'identities')} proved by exact algebra, {sampled} verified at "
                 f"{counted(self.states, 'random state')}"]
        for c in self.checks:
            verdict = "proved" if c.proved else {True: "ok", False: "FAIL", None: "-"}[c.passed]
            figure = "" if c.residual is None or c.proved else f"{c.residual:9.1e}  (allowed {c.tolerance:.0e})"
            lines.append(f"  {verdict:7}{c.name:62}{figure}{'  ' + c.remark if c.remark else ''}".rstrip())
        return "\n".join([*lines, f"  {self.note}"] if self.note else lines)

    def __repr__(self) -> str:
        return str(self)


CHECKS: tuple[tuple[str, Callable[[Sample], float | None], float], ...] = (
    ("M_tilde is symmetric", holds.symmetric, 1e-25),
    ("M_tilde is positive definite", holds.positive_definite, 0.0),
    ("M_tilde u_dot + k_tilde = F_tilde", holds.equations_hold, 1e-20),
    ("inverse dynamics of the accelerations gives zero", holds.inverse_of_forward, 1e-20),
    ("recursions in spatial vectors, as pages of links show them, give the same", holds.pages_of_links, 1e-20),
    ("rate of energy equals power of the loads", holds.energy_balance, 1e-20),
    ("kinetic energy is quadratic in u with M_tilde", holds.kinetic_energy_quadratic, 1e-20),
    ("J u is the rate of the positions and rotations", holds.jacobian_of_positions, 1e-15),
    ("Coriolis matrix times u is k_tilde", holds.coriolis_times_speeds, 1e-20),
    ("rate of M_tilde less twice the Coriolis matrix is skew", holds.coriolis_is_skew_with_mass_rate, 1e-20),
)
# In the place of those of the same functions, and after them, where there are constraints.
CONSTRAINED: tuple[tuple[str, Callable[[Sample], float | None], float], ...] = (
    ("M_tilde is positive definite along the motions that are left", holds.positive_definite, 0.0),
    ("M_tilde u_dot + k_tilde + C_r^T lam = F_tilde", holds.equations_hold, 1e-15),
    ("inverse dynamics of the accelerations gives -C_r^T lam", holds.inverse_of_forward, 1e-15),
    ("rate of energy equals power of the loads", holds.energy_balance, 1e-15),
    ("C_r u_dot = F_d", holds.constraints_hold, 1e-15),
    ("C_dot = C_r u + C_t", holds.constraint_rates, 1e-20),
    ("C_dot is the rate of C", holds.constraint_rates_are_derivatives, 1e-15),
    ("C_ddot = 0 along the motion", holds.constraints_stay, 1e-13),
    ("statements and numeric algorithm solve the whole system", holds.whole_system, 1e-12),
    ("reactions, loads and weight move every body", reactions.move_every_body, 1e-10),
    ("reactions do no work along what their joints allow", reactions.do_no_work, 1e-13),
)


# Claims of symdyn.exact.mechanism that together imply a check.
_SOLVED, _FULFILLED = "the accelerations solve the equations of motion", "the accelerations fulfil C_r u_dot = F_d"
_NEWTON_EULER = "Newton-Euler: inverse dynamics is M_tilde u_dot + k_tilde - F_tilde"
PROVED_BY: Mapping[Callable[[Sample], float | None], tuple[str, ...]] = {
    holds.symmetric: ("M_tilde is symmetric",),
    holds.equations_hold: (_SOLVED,),
    holds.inverse_of_forward: (_SOLVED, _NEWTON_EULER),
    holds.energy_balance: (_SOLVED, _NEWTON_EULER, "rate of energy is the power of the loads"),
    holds.kinetic_energy_quadratic: ("M_tilde is the second derivative of the kinetic energy by the speeds",),
    holds.jacobian_of_positions: ("J u is the rate of positions and rotations",),
    holds.coriolis_times_speeds: ("Coriolis matrix times u is k_tilde",),
    holds.coriolis_is_skew_with_mass_rate: ("rate of M_tilde less twice the Coriolis matrix is skew",),
    holds.constraints_hold: (_FULFILLED,),
    holds.constraint_rates: ("C_dot is C_r u + C_t",),
    holds.constraint_rates_are_derivatives: ("C_dot is the rate of C",),
    holds.constraints_stay: (_FULFILLED, "C_r u_dot - F_d is the rate of C_dot"),
}


# Digits that states and residuals are computed to; more take hours.
MOST_DIGITS = 10_000


def checks_of(equations: Equations) -> list[tuple[str, Callable[[Sample], float | None], float]]:
    """The checks for equations, without those of backends."""
    if not equations.constraints:
        return list(CHECKS)
    instead = {check: (name, check, tolerance) for name, check, tolerance in CONSTRAINED}
    shared = [instead.pop(row[1], row) for row in CHECKS]
    return [*shared, *instead.values()]


def verify(equations: Equations, states: int = 5, digits: int = 30, params: Mapping[Any, float] | None = None,
           seed: int = 1) -> Verification:
    """Check equations at random states: coordinates, speeds, states, inputs in [-1, 1], t in [0, 1].

    params   numbers for parameters (by symbol or name); others take their default, else a number in [0.5, 1.5]; then
             the mass matrix need not be positive definite and is not tested for it
    With constraints the states are consistent ones near the initial state, to all digits, and speeds are projected.
    Returns a Verification; its `passed` is False if a check failed. Raises SymdynError where no states are found.
    """
    from symdyn.runtime.building.compiler import find_compiler

    whole(states, "the number of states")
    whole(digits, "digits", 1, MOST_DIGITS)
    samples = samples_of(equations, states, digits, params, seed)
    checks = checks_of(equations)
    proved = _proved(equations)
    backends = {"numpy": "NumPy", "c": "C"} if find_compiler() is not None else {"numpy": "NumPy"}
    results = [Check(name, 0.0, tolerance, proved=True) if check in proved else judged(samples, name, check, tolerance)
               for name, check, tolerance in checks]
    further = [(f"{called} module agrees with the tape, over the condition", holds.backend_agrees(backend), 1e-13)
               for backend, called in backends.items()]
    for name, check, tolerance in [*further, *checks_of_user_functions(equations, backends)]:
        known = _known(samples, check)
        results.append(Check(name, max(known, default=None), tolerance, "" if known else "does not apply"))
    return Verification(f"{equations.name} ({equations.formulation})", states, tuple(results), without_digits(equations))


def _proved(equations: Equations) -> set[Callable[[Sample], float | None]]:
    """Checks that exact algebra proves. The check of the kinetic energy needs a mass matrix without speeds besides its claim."""
    claims = proved_quickly(equations, {name for names in PROVED_BY.values() for name in names})
    result = {check for check, names in PROVED_BY.items() if claims.issuperset(names)}
    if holds.kinetic_energy_quadratic in result and depends_on(equations.quantity("M_tilde").ravel(), SPEED):
        result.remove(holds.kinetic_energy_quadratic)
    return result


def depends_on(entries: Iterable[Any], kind: int) -> bool:
    """Whether an entry depends on leaves of a kind, such as speeds."""
    return any(isinstance(e, Node) and e.mask & kind for e in entries)


def judged(samples: Sequence[Sample], name: str, check: Callable[[Sample], float | None], tolerance: float) -> Check:
    """An identity at all samples, with more digits or a larger tolerance where its condition demands them (see above)."""
    known = _known(samples, check)
    if not known or check is holds.positive_definite:
        remark = "" if known else ("parameters without numbers" if check is holds.positive_definite else "does not apply")
        return Check(name, max(known, default=None), tolerance, remark)
    residual, allowed, remark = max(known), tolerance, ""
    if residual > allowed:
        samples = [s.sharper(MORE_DIGITS) for s in samples]
        residual, remark = max(_known(samples, check)), f"with {samples[0].digits} digits"
    if residual > allowed:
        rounded = [s.rounded(seed) for seed in ROUNDINGS for s in samples]
        allowed = max(tolerance, MARGIN / ENLARGED * max(_known(rounded, check)))
        remark = "constants are rounded to doubles"
    return Check(name, residual, allowed, remark if residual <= allowed else "")


def _known(samples: Sequence[Sample], check: Callable[[Sample], float | None]) -> list[float]:
    """Residuals at the samples where the check applies."""
    result = []
    for s in samples:
        with mpmath.workdps(s.digits + 5):
            result.append(check(s))
    return [r for r in result if r is not None]
