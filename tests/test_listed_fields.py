"""Docstrings list fields and arguments that exist: a name that was changed is changed where it is explained, too."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping

from tests.package_trees import definitions, package_trees

# Two spaces at least stand between the names of a row and their meaning.
ROW = re.compile(r"(\w+(?:, \w+)*) {2,}\S")


def arguments(function: ast.FunctionDef) -> set[str]:
    every = function.args
    return {one.arg for one in (*every.posonlyargs, *every.args, *every.kwonlyargs, every.vararg, every.kwarg) if one}


def own_fields(node: ast.ClassDef) -> Iterator[str]:
    """Names that a class annotates, assigns or takes, and its properties."""
    for inner in ast.walk(node):
        if isinstance(inner, ast.Name | ast.Attribute) and isinstance(inner.ctx, ast.Store):
            yield inner.id if isinstance(inner, ast.Name) else inner.attr
        elif isinstance(inner, ast.FunctionDef) and inner.name == "__init__":
            yield from arguments(inner)
        elif isinstance(inner, ast.FunctionDef) and inner.decorator_list:
            yield inner.name


def fields(node: ast.ClassDef, classes: Mapping[str, list[ast.ClassDef]]) -> set[str]:
    """With those of the classes of the package with the names of its bases."""
    bases = {base.id for base in node.bases if isinstance(base, ast.Name)} & set(classes) - {node.name}
    return set(own_fields(node)).union(*(fields(each, classes) for base in bases for each in classes[base]))


def stale(trees: Mapping[str, ast.Module]) -> list[str]:
    """Names in lists of docstrings that the class or function lacks. A list with none of its names is about something else."""
    classes: dict[str, list[ast.ClassDef]] = {}
    for tree in trees.values():
        for node in definitions(tree):
            if isinstance(node, ast.ClassDef):
                classes.setdefault(node.name, []).append(node)
    result = []
    for path, tree in trees.items():
        for node in definitions(tree):
            text = (ast.get_docstring(node) or "").partition(">>>")[0]
            listed = [name for line in text.splitlines() if (row := ROW.match(line)) for name in row[1].split(", ")]
            if listed:
                existing = fields(node, classes) if isinstance(node, ast.ClassDef) else arguments(node)
                missing = [name for name in listed if name not in existing]
                result += [f"{path}: {node.name} has no {name}" for name in missing if len(missing) < len(listed)]
    return result


def test_listed_fields_exist() -> None:
    assert stale(package_trees()) == []


def test_a_stale_field_is_found() -> None:
    """In a class and a function; fields of a base class, attributes and properties exist, and other lists are left alone."""
    text = '''
class Base:
    length: float

class Rod(Base):
    """A rod.

    length   in m
    mass     in kg
    bent, stiffness   gone
    """
    def __init__(self): self.mass = 1
    @property
    def bent(self): return True

def weigh(rod, *, gravity):
    """Weigh.

    rod    to weigh
    g      gone
    """

def other():
    """A table.

    red    a colour
    """
'''
    assert stale({"rod.py": ast.parse(text)}) == ["rod.py: Rod has no stiffness", "rod.py: weigh has no g"]
