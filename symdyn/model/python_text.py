"""The text of a Python function, which goes into generated modules, and what it needs that is not there."""

from __future__ import annotations

import ast
import builtins
import inspect
import symtable
import textwrap
import types
from collections.abc import Iterator
from typing import Any

import numpy as np

from symdyn.shown import shown


def text_of(function: Any, n: int, given: str, what: str, faults: list[str]) -> str:
    """The text of a function of n arguments: as it stands in its file, or what was given in its place.

    what   how messages call it; what is wrong is added to `faults`
    """
    if not isinstance(function, types.FunctionType) or function.__name__ == "<lambda>":
        kind = "a lambda" if isinstance(function, types.FunctionType) else f"{shown(function)} of type {type(function).__name__}"
        faults.append(f"{what} is {kind}; pass a function that is written with def, whose text goes into generated modules")
        return ""
    what = f"{what} {function.__name__}"
    try:
        text = textwrap.dedent(given or inspect.getsource(function)).strip()
    except (OSError, TypeError):
        faults.append(f"{what}: its text cannot be read, as it is in no file; pass it as python_source=")
        return ""
    try:
        tree = ast.parse(text)
    except SyntaxError as error:
        faults.append(f"{what}: its text is no Python of its own: {error.msg} in line {error.lineno}")
        return ""
    result = [s for s in tree.body if isinstance(s, ast.FunctionDef) and s.name == function.__name__]
    if not result:
        faults.append(f"{what}: its text does not define it; it must hold def {function.__name__}(...)")
        return ""
    taken = result[-1].args
    if len([*taken.posonlyargs, *taken.args]) != n or taken.vararg or taken.kwonlyargs or taken.kwarg or taken.defaults:
        faults.append(f"{what} takes ({ast.unparse(taken)}); it must take {n} argument{'s' * (n > 1)}, without defaults")
    missing = sorted(set(_missing(symtable.symtable(text, what, "exec"))))
    if missing:
        faults.append(f"{what} uses {', '.join(missing)}, which generated modules do not have; it may use its arguments, np and "
                      "what Python has built in: move the rest into it, or pass a text that holds all of it as python_source=")
    if "np" in function.__code__.co_names and function.__globals__.get("np", np) is not np:
        faults.append(f"{what} uses np, which is {shown(function.__globals__['np'])} there, and NumPy in generated modules")
    return text


def _missing(table: symtable.SymbolTable) -> Iterator[str]:
    """Names that a text uses and does not define."""
    own = {s.get_name() for s in table.get_symbols() if s.is_assigned() or s.is_imported()}
    scopes = [table]
    for scope in scopes:
        scopes += scope.get_children()
        for symbol in scope.get_symbols():
            name = symbol.get_name()
            outside = symbol.is_global() or (scope is table and not (symbol.is_assigned() or symbol.is_imported()))
            if symbol.is_referenced() and outside and name not in own and name != "np" and not hasattr(builtins, name):
                yield name
            elif symbol.is_declared_global():
                yield f"global {name}"
