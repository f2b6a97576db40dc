"""Puts C files that include each other into one text: each once, where it is first included, its switches resolved."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

from symdyn.errors import SymdynError

_INCLUDE = re.compile(r'#include (?:"(?P<file>[\w./]+)"|(?P<macro>\w+))$')
_CONDITION = re.compile(r"#(?P<word>if|ifdef|ifndef|else|elif|endif)\b *(?P<rest>.*)$")


class Parts:
    """Parts of a text that is rendered once. The comment at the head of a file stands where its own text begins, behind what it
    includes, and not at all in front of includes alone.

    read      file name -> text
    switches  macro -> whether it is on; conditions of these alone are resolved, all others stay for the C preprocessor
    """

    def __init__(self, read: Callable[[str], str], switches: Mapping[str, bool]) -> None:
        self._read = read
        self._switches = dict(switches)
        self._included: set[str] = set()

    def text(self, name: str, **files: str) -> str:
        """The text of a file with what it includes, without files that earlier calls gave.

        files   macro -> text, for `#include MACRO`
        Raises SymdynError for a macro without a text and for a condition that is not closed.
        """
        if name in self._included:
            return ""
        self._included.add(name)
        lines: list[str] = []
        head, source = _head(self._read(name).splitlines())
        # Whether the lines of each open condition are kept; None: it stays as it is written.
        open_conditions: list[bool | None] = []
        for line in source:
            condition = _CONDITION.match(line)
            if condition and self._resolved(condition, open_conditions):
                continue
            if False in open_conditions or line == "#pragma once":
                continue
            include = _INCLUDE.match(line)
            if include:
                lines += self._lines_of(name, include, files)
                continue
            if head and line.strip():
                lines += ["", *head, ""]
                head = []
            lines.append(line)
        if open_conditions:
            raise SymdynError(f"{name}: #if without #endif; close the condition")
        return _spaced(lines)

    @property
    def another(self) -> Parts:
        """Parts of another text, with the same switches, in which none stands so far."""
        return Parts(self._read, self._switches)

    def _lines_of(self, name: str, include: re.Match[str], files: Mapping[str, str]) -> list[str]:
        if include["file"]:
            text = self.text(include["file"], **files)
        elif include["macro"] in files:
            text = files[include["macro"]]
        else:
            raise SymdynError(f"{name}: {include[0]}, but there is no text of {include['macro']}; pass one")
        return ["", *text.splitlines(), ""] if text.strip() else []

    def _resolved(self, condition: re.Match[str], open_conditions: list[bool | None]) -> bool:
        """Whether a line is part of a condition that is resolved here."""
        word, names = condition["word"], set(re.findall(r"[A-Za-z_]\w*", condition["rest"]))
        if word == "if" and names and names <= self._switches.keys():
            open_conditions.append(self._holds(condition["rest"]))
            return True
        if word in ("if", "ifdef", "ifndef"):
            open_conditions.append(None)
            return False
        here = open_conditions[-1]
        if word == "endif":
            open_conditions.pop()
        elif here is not None:
            open_conditions[-1] = not here
        return here is not None

    def _holds(self, text: str) -> bool:
        """The value of an expression of switches with !, && and ||, without parentheses."""
        return any(all(self._is_on(factor.strip()) for factor in term.split("&&")) for term in text.split("||"))

    def _is_on(self, factor: str) -> bool:
        return self._switches[factor.removeprefix("!")] != factor.startswith("!")


def _head(lines: list[str]) -> tuple[list[str], list[str]]:
    """The comment that a file begins with, if it is about all of it, and the other lines."""
    n = next((k for k, line in enumerate(lines) if not line.startswith("//")), len(lines))
    about_all = n < len(lines) and (not lines[n] or lines[n].startswith(("#pragma once", "#ifndef", "#include")))
    return (lines[:n], lines[n:]) if about_all else ([], lines)


def _spaced(lines: list[str]) -> str:
    """Lines with at most one empty one in a row, none at the ends."""
    text = re.sub(r"\n{3,}", "\n\n", "\n".join(lines)).strip("\n")
    return f"{text}\n"
