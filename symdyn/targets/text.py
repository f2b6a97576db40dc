"""The text of a function for another library, and the module it makes."""

from __future__ import annotations

import hashlib
import linecache
import sys
from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import Any

from symdyn.arguments import some
from symdyn.backend.right_side import RightSide
from symdyn.backend.source import Source, render
from symdyn.collector import collector_paused
from symdyn.errors import UnsupportedExpression
from symdyn.formulation.equations import Equations
from symdyn.formulation.names import BY, Derivative, derivative_named
from symdyn.functions import groups
from symdyn.functions.content import content_of
from symdyn.functions.tapes import all_columns_of, has_function

# The dialect, and its template for each library.
DIALECT = "python"
TARGETS = {"casadi": "casadi.py.jinja", "jax": "jax.py.jinja", "torch": "torch.py.jinja"}


def source_for(equations: Equations, target: str, names: Sequence[str] | None = None,
               specialize: Mapping[Any, float] | None = None) -> Source:
    """One file for a library, with the named functions and their derivatives.

    target   "casadi", "jax" or "torch"; names: default the standard ones that the formulation has
    Raises SymdynError for an unknown function or parameter, and for a function of the user without a text in Python.
    """
    bound = some(specialize, [p.name for p in equations.symbols.parameters], "specialize", equations.name)
    functions = groups.written(equations, names, None)
    with collector_paused():
        derivatives = [Derivative(name, by).name for name in functions for by in BY if differentiable(equations, name, by)]
        content = content_of(equations, [*functions, *derivatives], False, bound, RightSide(), all_columns_of)
        return render(content, DIALECT, standalone=False, right_side=RightSide(integrated=False), only=(TARGETS[target],))


def differentiable(equations: Equations, name: str, by: str) -> bool:
    """Whether the derivatives of a function by a group of arguments are emitted with it: not where a function of the user has
    none."""
    whole = Derivative(name, by).name
    try:
        return derivative_named(name) is None and has_function(equations, whole) and all_columns_of(
            equations, whole, RightSide()) is not None
    except UnsupportedExpression:
        return False


def module_for(source: Source, target: str) -> ModuleType:
    """The module that a file for a library makes, in memory.

    It is imported, once for the same text: CasADi does not keep what its functions call, which must stay as long as they may.
    """
    text = next(iter(source.files.values()))
    name = f"symdyn_{target}_{source.metadata.name}_{hashlib.sha256(text.encode()).hexdigest()[:12]}"
    if name not in sys.modules:
        path = f"<{source.metadata.name} for {target}>"
        module = ModuleType(name)
        linecache.cache[path] = (len(text), None, text.splitlines(keepends=True), path)
        exec(compile(text, path, "exec"), module.__dict__)
        sys.modules[name] = module
    return sys.modules[name]
