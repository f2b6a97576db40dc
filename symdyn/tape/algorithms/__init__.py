"""Numeric algorithms that do without the rest of the package: generated Python modules hold the text of these files as it is.
Those of elements, such as mooring lines, are in symdyn.model.algorithms.

Names begin with symdyn_, as those of the C next to them (templates/c/runtime/symdyn_*.h), which takes the same steps in the same
order: tests/tape/test_algorithms.py compares both bit by bit. Functions have no types, as in generated modules.
"""

from __future__ import annotations

from importlib import resources


def text_of(module: str) -> str:
    """The constants and functions of such a file, by its name as a module, without its heading and imports."""
    package, _, name = module.rpartition(".")
    lines = resources.files(package).joinpath(f"{name}.py").read_text(encoding="utf-8").splitlines(keepends=True)
    first = next(k for k, line in enumerate(lines) if line.startswith(("#", "SYMDYN_", "def ")))
    return "".join(lines[first:]).strip()
