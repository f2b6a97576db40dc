"""Where the entries of a TOML text are: the line of every key and of every element of an array of tables."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence

_HEADER = re.compile(r"\s*(\[\[|\[)\s*([^\[\]]+?)\s*\]\]?\s*(?:#.*)?$")
_KEY = re.compile(r"""\s*((?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*')(?:\s*\.\s*(?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*'))*)\s*=""")
# Texts, of which those of several lines come first, comments, brackets.
_INSIDE = re.compile(r'"""(?:\\.|.)*?"""|\'\'\'.*?\'\'\'|"(?:\\.|[^"\\\n])*"|\'[^\'\n]*\'|#[^\n]*|[\[\]{}]', re.DOTALL)

Path = tuple[str | int, ...]


def lines_of(text: str) -> dict[Path, int]:
    """Path of an entry -> its line, from 1. The text is TOML."""
    result: dict[Path, int] = {}
    counts: dict[Path, int] = {}
    table: Path = ()
    free = _free_lines(text)
    for number, line in enumerate(text.split("\n"), 1):
        if number not in free:
            continue
        header = _HEADER.match(line)
        key = _KEY.match(line)
        if header:
            table = _words(header[2])
            if header[1] == "[[":
                counts[table] = counts.get(table, -1) + 1
                table = (*table, counts[table])
            result[table] = number
        elif key:
            result[(*table, *_words(key[1]))] = number
    return result


def line_of(lines: dict[Path, int], path: Sequence[str | int]) -> int:
    """The line of an entry, or of the nearest one that holds it; 1 of what is in no line."""
    whole = tuple(path)
    return next((lines[whole[:n]] for n in range(len(whole), 0, -1) if whole[:n] in lines), 1)


def _words(text: str) -> Path:
    """The keys of a dotted key."""
    content = tomllib.loads(f"{text} = 0")
    words: list[str | int] = []
    while isinstance(content, dict):
        (word, content), = content.items()
        words.append(word)
    return tuple(words)


def _free_lines(text: str) -> set[int]:
    """Lines that begin outside of texts and of brackets that are open."""
    free, depth, at, number = {1}, 0, 0, 1
    for result in [*_INSIDE.finditer(text), None]:
        end = len(text) if result is None else result.start()
        for _ in range(text.count("\n", at, end)):
            number += 1
            if depth <= 0:
                free.add(number)
        if result is None:
            break
        token = result[0]
        number += token.count("\n")
        depth += {"[": 1, "{": 1, "]": -1, "}": -1}.get(token, 0)
        at = result.end()
    return free
