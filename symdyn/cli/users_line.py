"""The line of a user's file that raised while a motion was computed, in a copy of its text in a generated module."""

from __future__ import annotations

import ast
from pathlib import Path


def users_line(path: Path, cause: BaseException | None) -> str:
    """Addition to the message: a line with the file, the number of the line and what is there; empty where the text is not of
    this file."""
    from symdyn.runtime.raised import location_of

    location = location_of(cause) if cause is not None else None
    if location is None or not path.is_file():
        return ""
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef) and node.name == location.name:
            first = min([node.lineno, *[decorator.lineno for decorator in node.decorator_list]])
            number = first + location.line - 1
            if number <= len(lines) and lines[number - 1].strip() == location.text:
                return f"\n  {path}, line {number}: {location.text}"
    return ""
