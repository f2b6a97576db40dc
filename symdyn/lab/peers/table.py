"""Measurements, as text and as JSON."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

from symdyn.lab.peers.benchmark import Row
from symdyn.lab.peers.models import Bound

_NOTHING = "-"
# Heading of a group of columns, then of each of its columns with its width.
_COLUMNS = (
    ("", (("model", 23),)),
    ("symdyn", (("formulation", 12), ("ops", 6), ("leanest", 8), ("prologue", 9), ("chain", 6), ("ns", 7))),
    ("CasADi ops", (("baked", 8), ("runtime", 8))),
    ("CasADi ns", (("baked", 8), ("runtime", 8), ("hoisted", 8))),
    ("Pinocchio", (("ns", 11),)),
    ("ratio of times", (("symdyn/CasADi", 15), ("Pinocchio/symdyn", 18))),
)
_WIDTHS = [width for _, group in _COLUMNS for _, width in group]

LEGEND = """\
ops: + - * / sqrt sin cos of one evaluation that depend on the state; leanest: the same of the formulation that has the
fewest, the fastest being taken; prologue: those that depend on parameters only; chain: the longest that wait for each
other. CasADi: C of Pinocchio's articulated-body algorithm, parameters baked in as numbers, given at run time, or given at
run time with what depends on them alone computed before. symdyn/CasADi: times, parameters at run time."""


def heading() -> str:
    """The lines above the rows."""
    above = "".join(f"{title:>{sum(width for _, width in group)}}" for title, group in _COLUMNS)
    return f"{above}\n{_aligned([text for _, group in _COLUMNS for text, _ in group])}  bound"


def line(row: Row) -> str:
    """The row, its bound and the verdict."""
    counts, times = row.casadi_operations, row.times
    cells = [row.model, row.formulation, row.operations, row.leanest, row.prologue, row.chain, _ns(times.get("symdyn")),
             counts.get("casadi baked"), counts.get("casadi runtime"),
             *[_ns(times.get(f"casadi {form}")) for form in ("baked", "runtime", "hoisted")], _ns(times.get("pinocchio")),
             _ratio(row.over("symdyn", "casadi runtime"), 2), _ratio(row.over("pinocchio", "symdyn"), 1)]
    return f"{_aligned([_NOTHING if cell is None else str(cell) for cell in cells])}  {verdict(row)}".rstrip()


def _aligned(cells: Sequence[str]) -> str:
    """Cells in columns, the first to the left."""
    return "".join(f"{cell:<{width}}" if k == 0 else f"{cell:>{width}}" for k, (cell, width) in enumerate(
        zip(cells, _WIDTHS, strict=True)))


def verdict(row: Row) -> str:
    """The bound, then MET or MISSED with what is missed; a peer that is missing misses no bound."""
    bound, missed = bound_text(row.bound), row.misses()
    if not bound:
        return ""
    if missed:
        return f"{bound}  MISSED: {'; '.join(missed)}"
    unknown = [row.bound.ratio is not None and row.over("symdyn", "casadi runtime") is None,
               row.bound.pinocchio is not None and row.over("pinocchio", "symdyn") is None]
    return f"{bound}  MET" + (", as far as it could be measured" if any(unknown) else "")


def bound_text(bound: Bound) -> str:
    """A bound in words; empty if there is none."""
    parts = [(bound.operations, "leanest <= {}"), (bound.ratio, "symdyn/CasADi <= {:.2f}"),
             (bound.pinocchio, "Pinocchio/symdyn >= {:.1f}")]
    return ", ".join(text.format(value) for value, text in parts if value is not None)


def record(row: Row) -> dict[str, Any]:
    """The row for JSON."""
    ratios = {"symdyn_over_casadi_runtime": row.over("symdyn", "casadi runtime"),
              "symdyn_over_casadi_hoisted": row.over("symdyn", "casadi hoisted"),
              "symdyn_over_casadi_baked": row.over("symdyn", "casadi baked"),
              "pinocchio_over_symdyn": row.over("pinocchio", "symdyn")}
    return {**dataclasses.asdict(row), "ratios": ratios, "missed": row.misses()}


def _ns(value: float | None) -> str | None:
    return None if value is None else f"{value:.0f}"


def _ratio(value: float | None, digits: int) -> str | None:
    return None if value is None else f"{value:.{digits}f}"
