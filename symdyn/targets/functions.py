"""Functions for CasADi, JAX and PyTorch, made of equations."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from types import ModuleType
from typing import Any

from symdyn.errors import ArgumentError, MissingExtra
from symdyn.formulation.equations import Equations
from symdyn.kinds import text
from symdyn.shown import shown
from symdyn.targets.text import module_for, source_for

# Library -> name in messages, and what installs it.
LIBRARIES = {"casadi": ("CasADi", "opt"), "jax": ("JAX", "jax"), "torch": ("PyTorch", "torch")}
DTYPES = ("float64", "float32")


def library(target: str, wanted: str) -> ModuleType:
    """The imported library. Raises MissingExtra."""
    called, extra = LIBRARIES[target]
    try:
        return importlib.import_module(target)
    except ImportError as error:
        raise MissingExtra(f"{wanted} needs {called} ({error}); pip install 'symdyn[{extra}]'") from None


def made(equations: Equations, target: str, name: str, specialize: Mapping[Any, float] | None) -> ModuleType:
    """The generated module of a function for a library."""
    text(name, "the name of a function", "rhs")
    library(target, f"to_{target}")
    return module_for(source_for(equations, target, [name], specialize), target)


def casadi_function(equations: Equations, name: str, specialize: Mapping[Any, float] | None) -> Any:
    """See Equations.to_casadi."""
    return made(equations, "casadi", name, specialize).function(name)


def dtype_of(dtype: str, called: str) -> str:
    """float64 or float32. Raises ArgumentError."""
    if dtype not in DTYPES:
        raise ArgumentError(f"{called}: dtype is {shown(dtype)}; take one of {', '.join(map(repr, DTYPES))}")
    return dtype


def torch_function(equations: Equations, name: str, dtype: str, specialize: Mapping[Any, float] | None) -> Callable[..., Any]:
    """See Equations.to_torch."""
    dtype_of(dtype, "to_torch")
    return made(equations, "torch", name, specialize).function(name, dtype)  # type: ignore[no-any-return]
