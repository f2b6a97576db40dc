"""The numbers and names that stand in attributes; whatever is wrong with them is collected with its line."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable
from pathlib import Path

from symdyn.shown import shown
from symdyn.urdf.document import Element

_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
Triple = tuple[float, float, float]
# Nothing in metres, kilograms or radians is larger, and squares of such numbers are finite still.
LARGEST = 1e100


class FileFaults(list[str]):
    """Faults of a file, each with its line; what is faulty is replaced by something harmless, so that reading goes on."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.path = path

    def at(self, line: int, fault: str) -> None:
        """A fault that stands in a line."""
        self.append(f"{self.path}:{line}: {fault}")

    def name(self, element: Element, attribute: str, what: str) -> str:
        """A name, "" if it is missing or empty."""
        name = element.attributes.get(attribute, "").strip()
        if not name:
            self.at(element.line, f"{what} has no {attribute}; write <{element.tag} {attribute}=\"...\">")
        return name

    def number(self, element: Element, attribute: str, what: str, default: float | None = None) -> float:
        """One number; default: what stands for a missing attribute, which is a fault without."""
        numbers = self._numbers(element, attribute, what, 1, None if default is None else (default,))
        return numbers[0]

    def triple(self, element: Element | None, attribute: str, what: str, default: Triple) -> Triple:
        """Three numbers; default: where the element or its attribute is missing."""
        if element is None:
            return default
        x, y, z = self._numbers(element, attribute, what, 3, default)
        return x, y, z

    def _numbers(self, element: Element, attribute: str, what: str, n: int, default: tuple[float, ...] | None) -> list[float]:
        text = element.attributes.get(attribute)
        wanted = "a number" if n == 1 else f"{n} numbers"
        if text is None:
            if default is None:
                self.at(element.line, f"{what}: <{element.tag}> has no {attribute}; give it {wanted}")
            return list(default or [0.0] * n)
        words = text.split()
        values = [float(word) for word in words if _NUMBER.fullmatch(word)]
        if len(values) == len(words) == n and all(abs(v) <= LARGEST for v in values):
            return values
        about = "; it looks like xacro, so run the file through xacro first" if "${" in text or "$(" in text else ""
        how = ", finite and written out" if len(values) < len(words) or len(words) != n else f" of {LARGEST:.0e} at most"
        self.at(element.line, f"{what}: {attribute} of <{element.tag}> is {shown(text[:100])}; give {wanted}{how}{about}")
        return list(default or [0.0] * n)


def nearest(name: str, known: Iterable[str]) -> str:
    """A hint at the name that may have been meant, or ""."""
    near = difflib.get_close_matches(name, list(known), n=1)
    return f"; did you mean {shown(near[0])}?" if near else ""
