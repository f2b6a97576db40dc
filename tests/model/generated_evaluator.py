"""Generated code of a tape, for the tests of what a model calls."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from symdyn.backend.right_side import RightSide
from symdyn.backend.source import Content, render
from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.building.library import CLibrary, PythonLibrary
from symdyn.tape import Tape


def evaluator_of(tape: Tape, inputs: Sequence[str], backend: str) -> Any:
    """Function that evaluates the only output of a tape from its inputs, compiled by a backend; skips the test where C has no
    compiler."""
    (name,) = tape.outputs
    groups: dict[str, Sequence[str]] = {group: [] for group in ("q", "u", "z", "ud", "inputs", "p")}
    content = Content(name, "test", {name: tape}, {name: name}, {**groups, "inputs": inputs}, {}, {}, {})
    source = render(content, backend, standalone=False, right_side=RightSide(integrated=False))
    text = next(iter(source.files.values()))
    library: Any
    if backend == "numpy":
        library = PythonLibrary.from_source(text, name)
    else:
        compiler = find_compiler()
        if compiler is None:
            pytest.skip("no C compiler here")
        library = CLibrary(text, source.metadata, compiler)
    evaluator = library.evaluator(name)
    evaluator.set_params(np.zeros(0))
    return evaluator
