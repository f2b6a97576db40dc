"""The docstrings of symdyn as reStructuredText.

In the source a docstring is plain text: paragraphs, aligned lists of arguments,

    direction  1: only upwards through zero,
               -1: only downwards

formulas that are indented, and examples. Here lists become definitions, formulas literal blocks, and the characters that
reStructuredText would read as markup are escaped.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from sphinx.application import Sphinx

# A name, or several, then at least two spaces, then what it is.
ITEM = re.compile(r"(\S+(?: \S+)*?) {2,}(\S.*)")
EXAMPLE = ">>>"
CODE = re.compile("`[^`]+`")
MARKUP = re.compile(r"([\\*|`]|_\b|\b_)")


def paragraph(text: str) -> str:
    """Plain text: `code` stays code, what would be markup does not."""
    pieces = re.split(f"({CODE.pattern})", text)
    return "".join(f"``{piece[1:-1]}``" if CODE.fullmatch(piece) else MARKUP.sub(r"\\\1", piece) for piece in pieces)


def blocks(lines: list[str]) -> Iterator[list[str]]:
    """Runs of lines without an empty one."""
    block: list[str] = []
    for line in [*lines, ""]:
        if line.strip():
            block.append(line.rstrip())
        elif block:
            yield block
            block = []


def converted(lines: list[str]) -> list[str]:
    """reStructuredText of a docstring's lines."""
    result: list[str] = []
    for block in blocks(lines):
        if block[0].lstrip().startswith(EXAMPLE):
            indent = len(block[0]) - len(block[0].lstrip())
            result += [*[line[indent:] for line in block], ""]
        elif all(line.startswith("    ") for line in block):
            result += ["::", "", *block, ""]
        else:
            result += _with_items(block)
    return result


def _with_items(block: list[str]) -> list[str]:
    """A paragraph, an aligned list, or the first followed by the second; formulas within it that are indented."""
    first = next((k for k, line in enumerate(block) if ITEM.fullmatch(line)), len(block))
    result = _paragraphs(block[:first])
    name = ""
    texts: list[str] = []
    for line in [*block[first:], ""]:
        item = ITEM.fullmatch(line)
        if item or not line or not line.startswith(" "):
            if name:
                result += [paragraph(name), f"    {paragraph(' '.join(texts))}", ""]
            name, texts = "", []
        if item:
            name, texts = item[1], [item[2]]
        elif line.startswith(" "):
            texts.append(line.strip())
        elif line:  # a sentence after the list
            result += [paragraph(line), ""]
    return result


def _paragraphs(block: list[str]) -> list[str]:
    result: list[str] = []
    plain: list[str] = []
    for line in [*block, ""]:
        formula = line.startswith("    ")
        if plain and (formula or not line):
            result += [paragraph(" ".join(plain)), ""]
            plain = []
        if formula:
            result += ["::", "", line, ""]
        elif line:
            plain.append(line.strip())
    return result


def convert(app: Sphinx, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    """Replaces the lines of a docstring."""
    lines[:] = converted(lines)


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("autodoc-process-docstring", convert)
    return {"parallel_read_safe": True}
