"""Rows of the same motion in a file of results: those that a run goes on with, and those that it carries over for a later one,
since measurements must not be lost where less, or something else, is requested next."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from symdyn.bench import kept
from symdyn.bench.work.record import Key, Row

# Errors of a file that is no file of results.
DAMAGED = (KeyError, TypeError, ValueError, AttributeError)


@dataclass(frozen=True)
class Carried:
    """Rows of earlier runs.

    rows   by fingerprint, which identifies what errors are of and measured by, then by key, each with when it was timed
    done   what the latest run was asked for with this run's fingerprint, if it was done with all of it; else nothing
    """

    rows: Mapping[str, Mapping[Key, Row]] = field(default_factory=dict)
    done: frozenset[Key] = frozenset()

    def kept(self, mark: str, asked: Iterable[Key]) -> dict[Key, Row]:
        """The rows that a run goes on with; none if the latest one was done with all that is requested: it is measured again.

        mark   fingerprint
        """
        keys, known = list(asked), self.rows.get(mark, {})
        return {} if self.done.issuperset(keys) else {key: known[key] for key in keys if key in known}

    def record(self, mark: str, rows: Sequence[Row]) -> dict[str, list[dict[str, Any]]]:
        """As plain data, without what was measured again: rows with a fingerprint."""
        new = {row.key for row in rows}
        left = {m: [row.record() for key, row in known.items() if m != mark or key not in new] for m, known in self.rows.items()}
        return {m: records for m, records in left.items() if records}

    @classmethod
    def of(cls, data: Mapping[str, Any], mark: str = "", timed: str = "") -> Carried:
        """From plain data of a benchmark: what it carries, and its own rows. Raises one of DAMAGED.

        mark    fingerprint of this run;  timed: of rows without one
        """
        rows = {m: {row.key: row for row in map(Row.of, records)} for m, records in data["carried"].items()}
        own = [replace(row, earlier=row.earlier or timed) for row in map(Row.of, data["rows"])]
        rows[data["fingerprint"]] = {**rows.get(data["fingerprint"], {}), **{row.key: row for row in own}}
        finished = data["complete"] and data["fingerprint"] == mark
        return cls(rows, frozenset(_key(one) for one in data["asked"]) if finished else frozenset())


def carried(path: Path | None, motion: str, mark: str) -> Carried:
    """Rows of this motion in a file; nothing where it is damaged or another's.

    motion   fingerprint of motion, machine and code;  mark: of what errors are of besides
    """
    if path is not None:
        with contextlib.suppress(*DAMAGED):
            data = kept.read(path)
            if data["motion"] == motion:
                return Carried.of(data, mark, data["timed"] or "an unknown time")
    return Carried()


def _key(plain: Sequence[Any]) -> Key:
    formulation, method, tolerance, step = plain
    return formulation, method, tolerance, step
