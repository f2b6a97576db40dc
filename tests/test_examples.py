"""Examples in docstrings: each class, function, method and property of the reference has one that gives what it says."""

from __future__ import annotations

import doctest
import functools
import importlib
import inspect
import itertools
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.formulation.equations import Equations
from symdyn.runtime.module import Module
from symdyn.runtime.solutions.solution import Solution

REFERENCE = Path(__file__).parents[1] / "docs" / "reference"
ENTRY = re.compile(r"^\.\. auto(\w+):: (\S+)\n((?: +:\S.*\n?)*)", re.MULTILINE)
# Members without an underscore that other parts of symdyn call, and that the reference leaves out.
LEFT_OUT = {"Convention.faults", "Equations.validity_checks", "Fit.of", "Module.following", "Module.motions_at", "Module.library",
            "Samples.record", "Solution.input_slopes", "Table.beyond", "Table.pieces"}


class Entry(NamedTuple):
    """Request of a line of the reference's pages to autodoc: its kind, what it is about, and its options."""

    kind: str
    path: str
    options: dict[str, tuple[str, ...]]


def entries() -> Iterator[Entry]:
    for page in sorted(REFERENCE.glob("*.rst")):
        for kind, path, lines in ENTRY.findall(page.read_text(encoding="utf-8")):
            options = {name: tuple(value.replace(",", " ").split()) for name, value in re.findall(r":([\w-]+):(.*)", lines)}
            yield Entry(kind, path, options)


def resolved(path: str) -> Any:
    """A module, or what it has under a dotted name."""
    names = path.split(".")
    for k in range(len(names), 0, -1):
        try:
            found = importlib.import_module(".".join(names[:k]))
        except ModuleNotFoundError:
            continue
        return functools.reduce(getattr, names[k:], found)
    raise ModuleNotFoundError(path)


def documented() -> Iterator[tuple[str, Any]]:
    """The names of the reference, as autodoc lists them, with the objects that have their docstrings."""
    for kind, path, options in entries():
        thing = resolved(path)
        if kind != "module":
            yield path, thing
        if "members" in options:
            yield from _members(path, thing, options)


def _members(path: str, owner: Any, options: dict[str, tuple[str, ...]]) -> Iterator[tuple[str, Any]]:
    module = inspect.ismodule(owner)
    names = options["members"] or (getattr(owner, "__all__", None) if module else None) or _own(owner, options)
    for name in names:
        thing = inspect.getattr_static(owner, name)
        if name.startswith("_") or name in options.get("exclude-members", ()) or not _behaves(thing):
            continue
        if module and not options["members"] and "imported-members" not in options and thing.__module__ != path:
            continue
        yield f"{path}.{name}", thing
        if module and inspect.isclass(thing):
            yield from _members(f"{path}.{name}", thing, {**options, "members": ()})


def _own(owner: Any, options: dict[str, tuple[str, ...]]) -> list[str]:
    """Names that a module or class defines, and those that it inherits from the classes before the one that is named."""
    if "inherited-members" not in options:
        return list(vars(owner))
    up_to = {"object", *options["inherited-members"]} - {owner.__name__}
    classes = itertools.takewhile(lambda one: one.__name__ not in up_to, owner.__mro__)
    return list(dict.fromkeys(name for one in classes for name in vars(one)))


def _behaves(thing: Any) -> bool:
    kinds = property, functools.cached_property, staticmethod, classmethod
    return isinstance(thing, kinds) or inspect.isfunction(thing) or inspect.isclass(thing)


def _raised(thing: Any) -> bool:
    return inspect.isclass(thing) and issubclass(thing, BaseException)


# Errors and warnings are raised, not called, and need no examples; those that are there are tested, too.
PUBLIC = {name: thing for name, thing in documented() if not _raised(thing) or ">>>" in (inspect.getdoc(thing) or "")}


def _methods(owner: type) -> dict[str, Any]:
    """Methods and properties of a class without an underscore, its own and those that it inherits; no fields."""
    fields = getattr(owner, "__dataclass_fields__", {})
    things = {name: inspect.getattr_static(owner, name) for name in dir(owner) if not name.startswith("_") and name not in fields}
    return {f"{owner.__name__}.{name}": thing for name, thing in things.items() if _behaves(thing)}


MAIN = (sd.System, Equations, Module, Solution)
METHODS = {name: thing for owner in MAIN for name, thing in _methods(owner).items()}
# Some methods of these classes, which other parts call, are left out of the reference.
EXAMPLES = PUBLIC | {name: thing for name, thing in METHODS.items() if all(thing is not one for one in PUBLIC.values())}
# Their examples need an extra that the suite does not ask for.
NEED_AN_EXTRA = {"Equations.to_jax", "Equations.to_torch"}


def test_every_method_of_the_main_classes_has_an_example_that_runs() -> None:
    parser = doctest.DocTestParser()
    runs = {name for name, thing in METHODS.items()
            if any(doctest.SKIP not in one.options for one in parser.get_examples(inspect.getdoc(thing) or ""))}
    assert len(METHODS) > 140 and set(METHODS) - runs == NEED_AN_EXTRA


def test_the_reference_has_every_public_name() -> None:
    """The names are those of the package and of the classes whose members it lists; so that what has an example here is all that
    users call."""
    things = [id(resolved(name)) for name, _ in documented()]
    named = {name: getattr(sd, name) for name in sd.__all__}
    assert [name for name, thing in named.items() if _behaves(thing) and id(thing) not in things] == []
    listed = {path: resolved(path) for kind, path, options in entries() if kind == "class" and "members" in options}
    assert {sd.System, Equations, Module, Solution} < set(listed.values())
    missing = {f"{owner.__name__}.{name}" for path, owner in listed.items() for name, thing in vars(owner).items()
               if _behaves(thing) and not name.startswith("_") and f"{path}.{name}" not in PUBLIC}
    assert missing <= LEFT_OUT
    left_out = {name for _, _, options in entries() for name in options.get("exclude-members", ())}
    # Frames and rates have entries of their own, below the module's.
    assert left_out - {"Frame", "rate"} == {name.partition(".")[2] for name in LEFT_OUT}


@pytest.fixture(autouse=True)
def _apart(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))


def example(name: str) -> doctest.DocTest:
    known = {"sd": sd, "np": np, "sp": sp}
    return doctest.DocTestParser().get_doctest(inspect.getdoc(EXAMPLES[name]) or "", known, name, None, 0)


# The binary of an FMU has headers.
@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.native] * name.endswith(".to_fmu"))
                                  for name in EXAMPLES])
def test_an_example_gives_what_it_says(name: str) -> None:
    shown = example(name)
    assert shown.examples, f"{name} has no example"
    said: list[str] = []
    doctest.DocTestRunner(verbose=False).run(shown, out=said.append)
    assert not said, "".join(said)
