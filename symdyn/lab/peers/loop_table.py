"""Measurements of a closed loop, as text and as JSON."""

from __future__ import annotations

import dataclasses
from typing import Any

from symdyn.lab.peers.four_bar import BOUND, DEMAND, PUBLISHED, LoopRow

LEGEND = """\
casadi: C of the whole matrix [[M, C_r^T], [C_r, 0]] solved with symbols by CasADi's solve, QR or LDL^T; kane: C of SymPy's
KanesMethod, dependent speeds eliminated, symbolic LU, no multipliers; pinocchio: constraintDynamics in C++. Parameters at
run time; hoisted: what depends on them alone computed before. ratio: time of symdyn with multipliers over it."""


def loop_lines(row: LoopRow) -> list[str]:
    """A line of each program, the verdict, and what symdyn's time means where the peers were published."""
    ours = row.times["symdyn with multipliers"]
    lines = [f"{row.model}, {row.formulation}: accelerations and multipliers of a closed loop",
             f"{'':26}{'ops':>6}{'us':>8}{'ratio':>8}"]
    lines += [f"{name:26}{row.operations.get(name, '-'):>6}{time / 1e3:>8.4f}{ours / time:>8.2f}"
              for name, time in row.times.items()]
    lines.append(f"symdyn with multipliers / fastest of casadi and kane <= {BOUND:.2f}  {loop_verdict(row)}")
    scaled = [f"{value / 1e3:.3f} us by {name} ({PUBLISHED[name] / 1e3:g} us)" for name, value in row.scaled().items()]
    if scaled:
        lines += [f"symdyn with multipliers on the machine of the published times, wanted to be less than {DEMAND / 1e3:g} us:",
                  f"  {', '.join(scaled)}"]
    return lines


def loop_verdict(row: LoopRow) -> str:
    """MET or MISSED with what is missed; rivals that are missing miss no bound."""
    if row.ratio is None:
        return "not measured"
    missed = row.misses()
    complete = row.fastest("casadi") and row.fastest("kane")
    return f"MISSED: {'; '.join(missed)}" if missed else f"MET: {row.ratio:.2f}" + (
        "" if complete else ", as far as it could be measured")


def loop_record(row: LoopRow) -> dict[str, Any]:
    """The row for JSON."""
    return {**dataclasses.asdict(row), "bound": BOUND, "ratio": row.ratio, "scaled": row.scaled(), "missed": row.misses()}
