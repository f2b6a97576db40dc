"""Numeric algorithms that do without the rest of the package: generated Python modules hold the text of these files as it is.

Names begin with symdyn_, as those of the C next to them (templates/c/runtime/symdyn_*.h), which takes the same steps in the same
order: tests/tape/test_algorithms.py compares both bit by bit. Functions have no types, as in generated modules.
"""

from __future__ import annotations

from importlib import resources


def text_of(name: str) -> str:
    """The constants and functions of a file of this folder, without its heading and imports."""
    lines = resources.files(__name__).joinpath(f"{name}.py").read_text(encoding="utf-8").splitlines(keepends=True)
    first = next(k for k, line in enumerate(lines) if line.startswith(("#", "SYMDYN_", "def ")))
    return "".join(lines[first:]).strip()
