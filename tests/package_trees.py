"""Syntax trees of the package, which tests of its text look through: reading them takes two seconds, and going through all of
them another."""

from __future__ import annotations

import ast
import functools
from collections.abc import Iterator, Mapping
from pathlib import Path

import symdyn

PACKAGE = Path(symdyn.__file__).parent


@functools.cache
def package_trees() -> Mapping[str, ast.Module]:
    """By the path in the package."""
    return {path.relative_to(PACKAGE).as_posix(): ast.parse(path.read_text(encoding="utf-8"))
            for path in sorted(PACKAGE.rglob("*.py"))}


def definitions(tree: ast.AST) -> Iterator[ast.ClassDef | ast.FunctionDef]:
    """Classes and functions of a file, also those inside of others; expressions, which are most of a tree, are left out."""
    for name in ("body", "orelse", "finalbody", "handlers", "cases"):
        for inner in getattr(tree, name, ()) if isinstance(tree, ast.stmt | ast.mod | ast.excepthandler | ast.match_case) else ():
            if isinstance(inner, ast.ClassDef | ast.FunctionDef):
                yield inner
            yield from definitions(inner)
