"""The docstrings of symdyn as reStructuredText.

In the source a docstring is plain text: paragraphs, aligned lists of arguments,

    direction  1: only upwards through zero,
               -1: only downwards

formulas that are indented, and examples. Here lists become definitions, formulas literal blocks, and the characters that
reStructuredText would read as markup are escaped. Classes that symdyn makes, and users only receive, have the sentence and the
example first, their fields last, and no constructor.
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
# Classes whose objects are results.
MADE = {"Module", "Solution", "Equations", "Linearization", "Campbell", "Carried", "Rest", "Equilibrium", "RootLocus", "Modes",
        "PeriodicMotion", "Regulator", "Response", "Stability", "Ensemble", "Fit", "Identification", "Optimum", "View",
        "MotionEquations", "AugmentedEquations", "BatchSolution", "DeviceArray", "Equilibria", "Mode", "Actuation"}
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
            result += [".. code-block:: text", "", *block, ""]
        else:
            result += _with_items(block)
    return result


def _with_items(block: list[str]) -> list[str]:
    """A paragraph, an aligned list, or the first followed by the second; formulas within it that are indented."""
    first = next((k for k, line in enumerate(block) if ITEM.fullmatch(line)), len(block))
    result = _paragraphs(block[:first])
    name = ""
    texts: list[str] = []
    after: list[str] = []  # sentences below items
    for line in [*block[first:], ""]:
        item = ITEM.fullmatch(line)
        if name and not line.startswith(" "):
            result += [paragraph(name), f"    {paragraph(' '.join(texts))}", ""]
            name, texts = "", []
        if item or not line:
            result += _paragraphs(after)
            after = []
        if item:
            name, texts = item[1], [item[2]]
        elif name:
            texts.append(line.strip())
        else:
            after.append(line)
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
            result += [".. code-block:: text", "", line, ""]
        elif line:
            plain.append(line.strip())
    return result


def convert(app: Sphinx, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    """Replaces the lines of a docstring."""
    if what == "class" and name.rpartition(".")[2] in MADE:
        lines[:] = with_fields_last(lines)
    lines[:] = converted(lines)


def with_fields_last(lines: list[str]) -> list[str]:
    """The paragraphs and the example, then the lists of what an object holds."""
    held, others = [], []
    for block in blocks(lines):
        example = block[0].lstrip().startswith(EXAMPLE)
        (held if not example and any(ITEM.fullmatch(line) for line in block) else others).append(block)
    return [line for block in [*others, *held] for line in (*block, "")]


def without_constructor(app: Sphinx, what: str, name: str, thing: Any, options: Any, signature: str | None,
                        returns: str | None) -> tuple[str, None] | None:
    """No arguments of classes that users do not construct."""
    return ("", None) if what == "class" and name.rpartition(".")[2] in MADE else None


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("autodoc-process-docstring", convert)
    app.connect("autodoc-process-signature", without_constructor)
    return {"parallel_read_safe": True}
