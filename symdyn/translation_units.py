"""Texts in C that are one file and can also be compiled as several units, side by side."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

# The line that a further unit begins with.
_MARK = re.compile(r"^// ==== Translation unit(?P<shared> shared)?(?: (?P<level>-O\d))?\n", re.MULTILINE)


@dataclass(frozen=True)
class TranslationUnit:
    """A text that compiles by itself.

    shared   other mechanisms have the same
    level    the option of its optimization, if it is not that of all
    """

    text: str
    shared: bool = False
    level: str = ""


def joined(units: Sequence[TranslationUnit]) -> str:
    """One text; `translation_units` gives them again."""
    marks = (f"// ==== Translation unit{' shared' * unit.shared}{f' {unit.level}' * bool(unit.level)}\n" for unit in units[1:])
    return units[0].text + "".join(mark + unit.text for mark, unit in zip(marks, units[1:], strict=True))


def translation_units(text: str) -> list[TranslationUnit]:
    """The units of a text, the first without a mark."""
    first, *rest = _MARK.split(text)
    further = zip(rest[::3], rest[1::3], rest[2::3], strict=True)
    return [TranslationUnit(first), *(TranslationUnit(text, bool(shared), level or "") for shared, level, text in further)]
