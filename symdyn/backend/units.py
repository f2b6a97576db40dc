"""Divides the text of a mechanism in C into translation units that compilers take side by side.

A template marks its stretches by lines: `//: base`, what every unit needs; `//: head`, what functions of the model need besides;
`//: piece`, one of these functions; `//: shared`, a unit that needs the base only and that other mechanisms have, too, with its
level of optimization if that is not the usual one; `//: common`, what further shared units need besides.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from symdyn.translation_units import TranslationUnit, joined

# Lines of functions that make a unit of the model worth the start of a compiler, and most units of these.
LEAST_LINES, MOST_UNITS = 600, 8
# Units take the level below from so many of these lines on: such texts are statements without loops, which run as fast with it
# (net of 10 x 10 rods: 9.97 in place of 9.71 us) and compile in two thirds of the time.
LONG_LINES, LEVEL_OF_LONG = 30_000, "-O1"
_MARK = re.compile(r"^//: (\w+)(?: (-O\d)?)?\n", re.MULTILINE)
_LINKED = re.compile(r"^SYMDYN_LINKED int symdyn_(?:saddle|multipliers|catenary|cube)\(.*\)(?= \{$)", re.MULTILINE)
# Defined at the ends of units in one file.
_MODEL, _COMMON = "SYMDYN_MODEL_ABOVE", "SYMDYN_COMMON_ABOVE"


def whole(text: str) -> str:
    """The text as one unit."""
    return re.sub(r"\n{3,}", "\n\n", _MARK.sub("", text))


def divided(text: str) -> str:
    """The text as several units, marked for `translation_units`; as one unit it compiles, too."""
    heading, *rest = _MARK.split(text)
    stretches = list(zip(rest[::3], rest[1::3], rest[2::3], strict=True))
    base, head = ("".join(t for kind, _, t in stretches if kind == wanted) for wanted in ("base", "head"))
    pieces = [t for kind, _, t in stretches if kind == "piece"]
    linked = "".join(f"{line};\n" for kind, _, t in stretches if kind == "shared" for line in _LINKED.findall(t))
    first, *others = _packed(pieces)
    declared = linked + "".join(f"{line};\n" for piece in pieces * bool(others) for line in _signatures(piece))
    units = [TranslationUnit(f"{heading}{base}{head}\n{declared}{first}#define {_MODEL}\n")]
    level = LEVEL_OF_LONG if sum(piece.count("\n") for piece in pieces) >= LONG_LINES else ""
    units += [TranslationUnit(f"{_unless(_MODEL, base + head)}{declared}{piece}", level=level) for piece in others]
    common = ""
    for kind, level, t in stretches:
        if kind == "common":
            common = t
        elif kind == "shared":
            before = _unless(_MODEL, base) + (_unless(_COMMON, common) if common else "")
            units.append(TranslationUnit(f"{before}{t}{f'#define {_COMMON}' if common else ''}\n", True, level or ""))
    return joined(units)


def _unless(macro: str, text: str) -> str:
    """Text that counts unless an earlier unit in the same file has it."""
    return f"#if !defined({macro})\n{text}#endif\n"


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
