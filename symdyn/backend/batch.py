"""Functions on vectors, a state in each lane: the same statements as those of one state, so the same rounding."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from symdyn.backend.columns import Columns
from symdyn.backend.dialect import Dialect, read_dialect
from symdyn.backend.function import Function
from symdyn.backend.program import Program, build
from symdyn.tape.ops import OPERATIONS
from symdyn.tape.tape import Tape

_WITHOUT_FUNCTION = ("add", "sub", "mul", "div", "neg", "guard", "call", "item", "pi")
_NUMBERS = {"pow": 2, "atan2": 2, "min": 2, "max": 2, "and": 2, "or": 2, "select": 3}
_COMPARISONS = {"lt": "a < b", "le": "a <= b", "gt": "a > b", "ge": "a >= b", "eq": "a == b", "ne": "a != b"}
_PREFIX = "symdyn_each_"


@dataclass(frozen=True)
class LaneFunction:
    """An operation in every lane: its name, the letters of its arguments, and what it computes of numbers."""

    name: str
    arguments: tuple[str, ...]
    value: str


@dataclass(frozen=True)
class Batch:
    """Functions on vectors, by name, and the operations that they use, for a template."""

    functions: Mapping[str, Function]
    operations: tuple[LaneFunction, ...]


def batch_of(folder: Path, scalar: Dialect, program: Program, tapes: Mapping[str, Tape], titles: Mapping[str, str],
             leaves: Mapping[str, tuple[str, int]], singular_fallback: Mapping[str, Tape], columns: Mapping[str, Columns],
             names: Sequence[str] = ("rhs",)) -> Batch:
    """Functions of a program on vectors.

    folder   of the backend; the dialect of vectors is in `batch` in it
    Where the program tries one way first, this is that way: lanes where it fails are computed one by one.
    """
    available = _lane_functions(scalar)
    dialect = read_dialect(folder / "batch")
    dialect = replace(dialect, operations={
        op: f"{f.name}({', '.join(f'VECTOR({{{k}}})' for k in range(len(f.arguments)))})" for op, f in available.items()})
    built = build(dialect, tapes, titles, leaves, singular_fallback=singular_fallback, like=program,
                  columns={name: those for name, those in columns.items() if name in names}, vectors=dialect).functions
    functions = {f.name: _whole(f.regular or f) for f in built if f.name in names}
    text = "\n".join(line for function in functions.values() for way in function.with_called for part in way.stretches
                     for lines in (part.loads, part.results, *[s.lines for s in part.sections]) for line in lines)
    used = set(re.findall(rf"\b{_PREFIX}\w+", text))
    return Batch(functions, tuple(f for f in available.values() if f.name in used))


def _whole(function: Function) -> Function:
    """A function with the parts of those that it calls as its own."""
    return replace(function, parts=(*[part for called in function.calls for part in called.parts], *function.parts), calls=())


def _lane_functions(scalar: Dialect) -> dict[str, LaneFunction]:
    result = {}
    for op in OPERATIONS:
        if op in _WITHOUT_FUNCTION:
            continue
        letters = ("a", "b", "c")[:2 if op in _COMPARISONS else _NUMBERS.get(op, 1)]
        text = scalar.operations.get(op) or _COMPARISONS.get(op) or f"{op}({', '.join(letters)})"
        result[op] = LaneFunction(f"{_PREFIX}{op}", letters, text.format(*letters))
    return result
