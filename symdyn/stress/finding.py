"""Results of comparing generated code with 32 digits, and the rows that report them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from symdyn.stress.record import DEGRADE, FAIL, PASS, Row, within
from symdyn.stress.system_under_test import SystemUnderTest

BOUND = ("decimal digits beyond twice the first-order bound of rounding errors: every operation rounds once, and what that does "
         "to each result follows from one pass backwards through the operations")


@dataclass(frozen=True)
class Aside:
    """States that are set aside, next to lost rank or singular to the last digit: how many have lost more digits than the
    condition explains, the most, and the least condition of these; of all of them the digits beyond the first-order bound, at how
    many a divisor is but rounding error, and, at others without a bound, the digits by which accelerations miss their equations
    beyond what is due."""

    states: int = 0
    most: float = -np.inf
    least: float = np.inf
    beyond: float = -np.inf
    noise: int = 0
    imbalance: float = -np.inf


@dataclass(frozen=True)
class Finding:
    """Finding about a function's values: the most decimal digits lost beyond what is due (plain: with a system that is solved in
    plain numbers), how many states were rejected and the least condition there; the states next to lost rank and the singular
    ones; of the others the digits beyond the first-order bound of rounding errors, and at how many of them none is known."""

    name: str
    digits: float
    plain: float
    rejected: int = 0
    least_rejected: float = np.inf
    near: Aside = Aside()
    singular: Aside = Aside()
    beyond: float = -np.inf
    unknown: int = 0

    @property
    def verdict(self) -> str:
        return PASS if self.digits <= 0 else DEGRADE if self.plain <= 0 else FAIL


def judged(check: str, system: str, done: str, result: Sequence[Finding]) -> Row:
    """The row of digits that functions lose beyond what the condition costs: every function is judged by itself, and the worst
    verdict counts. Within the condition of plain numbers it is said so."""
    origin = ("decimal digits lost beyond log10(condition of inputs and of what is solved, scaled) + log10(longest chain of "
              "operations), each of which may round once")
    verdict = max((f.verdict for f in result), key=(PASS, DEGRADE, FAIL).index)
    alike = [f for f in result if f.verdict == verdict]
    worst = max(alike, key=lambda f: f.digits)
    named = ", ".join(f.name for f in alike) if verdict != PASS else worst.name
    if verdict == DEGRADE:
        return Row(check, system, f"{done}; beyond it {named}", worst.digits, 0.0, origin, DEGRADE, "more digits are lost than "
                   "the scaled condition costs, but no more than that of the matrix in plain numbers: inertias of very different "
                   "size meet in one body or joint, and the small ones are what is left of sums")
    place = "nearest to it" if verdict == PASS else "beyond it"
    return within(check, system, f"{done}; {place} {named}", worst.digits, 0.0, origin,
                  "no more digits are lost than the problem itself costs", "digits are lost that the problem does not cost")


def rejections(tested: SystemUnderTest, label: str, result: Sequence[Finding], rejected: int) -> Row:
    """Values that were rejected: right where the system that is solved has no digits left."""
    least = min(f.least_rejected for f in result)
    return Row("rejected states", tested.name, f"{label}: {rejected} values rejected; condition there from {least:.2g}", 1 / least
               if least > 0 else np.inf, 1e-8, "a pivot that vanishes to half of the digits", DEGRADE if least > 1e8 else FAIL,
               "only states are rejected whose equations are singular to half of the digits" if least > 1e8 else
               "states are rejected whose equations are well-conditioned")


def first_order_row(tested: SystemUnderTest, label: str, result: Sequence[Finding], of: str = "functions",
                    states: int = 0) -> Iterator[Row]:
    """The row of errors against what rounding of every operation may do at most, at ordinary states.

    of       what the findings are of;  states: how many there are in all where each has its own, 0 where all share them
    """
    known = [f for f in result if f.beyond > -np.inf]
    noise = ""
    if any(f.unknown for f in result):
        many = f"{sum(f.unknown for f in result)} of {states}" if states else f"up to {max(f.unknown for f in result)}"
        noise = f"; none holds at {many} states, where a divisor loses all but one digit"
    if not known:
        if noise:
            yield Row("first order", tested.name, f"{label}: 0 of {len(result)} {of}{noise}", None, None, "", DEGRADE,
                      "nothing can be said of errors: divisors are nothing but rounding error")
        return
    worst = max(known, key=lambda f: f.beyond)
    beyond = [f.name for f in known if f.beyond > 0]
    place = f"beyond it {', '.join(beyond)}" if beyond else f"nearest to it {worst.name}"
    done = f"{label}: {len(known)} of {len(result)} {of}; {place}"
    others = ", ".join(f.name for f in result if f.beyond == -np.inf and not f.unknown)
    if others:
        done += f"; no bound is known of {others}, which run an algorithm with branches"
    yield within("first order", tested.name, done + noise, worst.beyond, 0.0, BOUND, "errors are those of rounding",
                 "errors are larger than rounding can make them")


def set_aside(tested: SystemUnderTest, result: Sequence[Finding]) -> Iterator[Row]:
    """Rows of states at which the condition does not show what digits are lost: what is, and whether rounding explains it."""
    if any(f.near.states or f.near.beyond > 0 or f.near.imbalance > 0 for f in result):
        yield _aside(tested, "lost rank", [(f.name, f.near) for f in result],
                     "which lie next to a position where constraints lose rank", "the exact multipliers and accelerations grow "
                     "without bound towards such a position; they are smoothed there, so that motions pass it, and what is "
                     "computed is the smooth solution but for rounding")
    if any(f.singular.states or f.singular.beyond > 0 or f.singular.imbalance > 0 for f in result):
        least = min(f.singular.least for f in result)
        yield _aside(tested, "singular states", [(f.name, f.singular) for f in result],
                     f"where the condition of what is solved is {least:.2g} or more", "the mass matrix is singular to the last "
                     "digit, as at gimbal lock: accelerations have no digits there, and a motion that comes there stops and "
                     "names it")


def _aside(tested: SystemUnderTest, check: str, result: Sequence[tuple[str, Aside]], where: str, why: str) -> Row:
    every = [aside for _, aside in result]
    beyond, missed = max(a.beyond for a in every), max(a.imbalance for a in every)
    names = ", ".join(dict.fromkeys(name for name, a in result if a.states or max(a.beyond, a.imbalance) > 0))
    done = (f"{names} at {max(a.states for a in every)} of the states, {where}: up to {max(a.most for a in every):.2g} digits "
            "lost beyond what the condition costs elsewhere")
    if missed > -np.inf:
        done += f"; accelerations without a bound miss their equations by 10^{missed:.2g} of what is due"
    if any(a.noise for a in every):
        done += f"; at {max(a.noise for a in every)} of them a divisor is nothing but rounding error, and no digit is due"
    if max(beyond, missed) == -np.inf:
        return Row(check, tested.name, done, None, None, "", DEGRADE, why)
    good = max(beyond, missed) <= 0
    origin = BOUND if missed == -np.inf else BOUND + "; of accelerations without one what their equations may miss"
    return Row(check, tested.name, done, max(beyond, missed), 0.0, origin, DEGRADE if good else FAIL,
               why if good else "errors are larger than rounding can make them: what is computed is not the solution")
