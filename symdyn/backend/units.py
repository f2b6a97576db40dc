"""Divides the text of a mechanism in C into translation units that compilers take side by side.

A template marks its stretches by lines: `//: base`, what every unit needs; `//: head`, what functions of the model need besides;
`//: piece`, one of these functions; `//: unit`, a unit of its own; `//: shared`, one that needs the base only and that other
mechanisms have, too.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from symdyn.translation_units import TranslationUnit, joined

# Lines of functions that make a unit of the model worth the start of a compiler, and most units of these.
LEAST_LINES, MOST_UNITS = 350, 8
_MARK = re.compile(r"^//: (\w+)\n", re.MULTILINE)
_SOLVER = "SYMDYN_SOLVER "
_GUARD = "SYMDYN_WHOLE_FILE"


def whole(text: str) -> str:
    """The text as one unit."""
    return re.sub(r"\n{3,}", "\n\n", _MARK.sub("", text))


def divided(text: str) -> str:
    """The text as several units, marked for `translation_units`; as one unit it compiles, too."""
    heading, *rest = _MARK.split(text)
    stretches = list(zip(rest[::2], rest[1::2], strict=True))
    base = "".join(t for kind, t in stretches if kind == "base")
    head = "".join(t for kind, t in stretches if kind == "head")
    pieces = [t for kind, t in stretches if kind == "piece"]
    declared = "".join(f"{line};\n" for piece in pieces for line in _signatures(piece))
    first, *others = _packed(pieces)
    solvers = [t for kind, t in stretches if kind == "shared"]
    prototypes = "".join(f"{line};\n" for t in solvers for line in _signatures(t) if line.startswith(_SOLVER))
    units = [TranslationUnit(f"{heading}{base}{head}\n{prototypes}{declared}{first}#define {_GUARD}\n")]
    units += [TranslationUnit(f"{_guarded(base + head)}{prototypes}{declared}{piece}") for piece in others]
    units += [TranslationUnit(f"{_guarded(base)}{t}", True) for t in solvers]
    return joined(units)


def _guarded(text: str) -> str:
    return f"#if !defined({_GUARD})\n{text}#endif\n"


def _signatures(piece: str) -> Iterator[str]:
    """Functions that a piece defines, but static ones."""
    for line in piece.splitlines():
        if line.endswith(") {") and re.match(r"[A-Z_a-z]", line) and not re.match(r".*\bstatic\b", line):
            yield line[:-2]


def _packed(pieces: Sequence[str]) -> list[str]:
    """Pieces in units of about the same number of lines, the longest ones first."""
    lines = [piece.count("\n") for piece in pieces]
    n = max(1, min(MOST_UNITS, sum(lines) // LEAST_LINES))
    bins: list[list[int]] = [[] for _ in range(n)]
    for k in sorted(range(len(pieces)), key=lambda k: -lines[k]):
        min(bins, key=lambda held: sum(lines[j] for j in held)).append(k)
    return ["".join(pieces[k] for k in sorted(held)) for held in bins if held]
