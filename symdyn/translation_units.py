"""Texts in C that are one file and can also be compiled as several units, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

# The line that a further unit begins with, and what follows it where other mechanisms have the same unit.
MARK = "// ==== Translation unit"
SHARED = f"{MARK}, the same for all mechanisms of these sizes"


@dataclass(frozen=True)
class TranslationUnit:
    """A text that compiles by itself; shared: other mechanisms have the same."""

    text: str
    shared: bool = False


def joined(units: Sequence[TranslationUnit]) -> str:
    """One text; `translation_units` gives them again."""
    return units[0].text + "".join(f"{SHARED if unit.shared else MARK}\n{unit.text}" for unit in units[1:])


def translation_units(text: str) -> list[TranslationUnit]:
    """The units of a text, the first without a mark."""
    units: list[TranslationUnit] = []
    lines: list[str] = []
    shared = False
    for line in text.splitlines(keepends=True):
        if line.rstrip("\n") in (MARK, SHARED):
            units.append(TranslationUnit("".join(lines), shared))
            lines, shared = [], line.rstrip("\n") == SHARED
        else:
            lines.append(line)
    return [*units, TranslationUnit("".join(lines), shared)]
