"""Examples in docstrings of what users call: there is one for each, and they give what they say."""

from __future__ import annotations

import doctest
import functools
import inspect
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.formulation.equations import Equations
from symdyn.runtime.module import Module
from symdyn.runtime.solutions.solution import Solution
from symdyn.statics.linearize import Linearization

# Methods that other parts of symdyn call; a Campbell diagram needs a rotor, which tests/runtime/test_campbell.py has.
WITHOUT = {"Module.following", "Module.motions_at", "Module.split_outputs", "Module.unit", "Module.noting", "Module.campbell",
           "Solution.states_and_columns", "Solution.input_slopes"}


def _public() -> Iterator[tuple[str, Any]]:
    for name in sd.__all__:
        thing = getattr(sd, name)
        error = inspect.isclass(thing) and issubclass(thing, Exception)
        if (inspect.isclass(thing) and not error) or inspect.isfunction(thing):
            yield f"sd.{name}", thing
    for owner in (sd.System, Equations, Module, Solution):
        for name, thing in vars(owner).items():
            called = isinstance(thing, (property, functools.cached_property)) or inspect.isfunction(thing)
            if called and not name.startswith("_") and f"{owner.__name__}.{name}" not in WITHOUT:
                yield f"{owner.__name__}.{name}", thing
    for name, thing in vars(Linearization).items():
        if not name.startswith("_") and ">>>" in (inspect.getdoc(thing) or ""):
            yield f"Linearization.{name}", thing


PUBLIC = dict(_public())


@pytest.fixture(autouse=True)
def _apart(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))


# The binary of an FMU has headers.
@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.native] * (name == "Module.to_fmu")) for name in PUBLIC])
def test_an_example_gives_what_it_says(name: str) -> None:
    text = inspect.getdoc(PUBLIC[name]) or ""
    known = {"sd": sd, "np": np, "sp": sp}
    example = doctest.DocTestParser().get_doctest(text, known, name, None, 0)
    assert example.examples, f"{name} has no example"
    said: list[str] = []
    doctest.DocTestRunner(verbose=False).run(example, out=said.append)
    assert not said, "".join(said)
