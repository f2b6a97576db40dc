"""Functions of the user in C and Python that generated code calls."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import sympy as sp

from symdyn.errors import ModelError
from symdyn.model.faults import Faults
from symdyn.model.python_text import text_of
from symdyn.shown import shown
from symdyn.tape.external import UserFunction
from symdyn.tape.reserved import OF_FUNCTIONS

if TYPE_CHECKING:
    from symdyn.given import Scalar

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_HEAD = r"\bstatic\s+(?:inline\s+)?int\s+{}\s*\(\s*const\s+double\s*\*\s*\w+\s*,\s*double\s*\*\s*\w+\s*\)\s*\{{"
# It stands in a C text.
_REASON = re.compile(r"(?!.*\?\?)[^\"\\\x00-\x1f\x7f]+")
# Results and operations that a function has at most.
MOST = 10**9


class External:
    """A function of the user: `F = External("thrust", ["v", "omega"], ...)(v, omega)` is an expression as any other.

    name         an identifier, which C knows the function by; arguments: their names; results: how many
    c            its text in C99: `static int thrust(const double *in, double *out)`, which reads the arguments from `in`, stores
                 the results in `out` and returns 0, or something else where it fails. Nothing is included; the functions of
                 the math library are declared, MADD(a, b, c) is a*b + c. Helpers and tables may stand before it; functions
                 with the same text share it
    python       a function of NumPy arrays of one shape (n,), one argument each, that returns the result, or several as a tuple,
                 NaN where it fails; its text goes into generated modules, so that it may use its arguments, np and what Python
                 has built in, no more
    python_source   the text in place of that in the file, if there is none, or to hold tables and helpers, too
    derivative   another External of the same arguments that gives the derivatives of the results by them, row by row; needed for
                 Jacobians, rates and linearization, and in turn its own derivative for derivatives of those
    precise      f(mp, *arguments) for an mpmath context and its numbers, which proofs and reference vectors are then made with;
                 without it these see the function in floating point
    texts        backend -> text: for "fortran", "julia", "matlab" and "rust" a function of numbers that returns the result, or
                 an array of them; for backends of one's own what their templates take
    reason       what it means where the function fails or a result is not finite; there a simulation stops and reports it
    operations   about how many operations it takes: what counts of it in reports and choices

    All parts of a Piecewise are computed, so that a function must not fail where another part holds.
    Raises ModelError that lists every fault.

    >>> text = "static int square(const double *in, double *out) { out[0] = in[0]*in[0]; return 0; }"
    >>> square = sd.External("square", ["x"], c=text)
    >>> square(sd.coordinates("q"))
    square(q)
    """

    def __init__(self, name: str, arguments: Sequence[str], results: int = 1, *, c: str | None = None,
                 python: Callable[..., object] | None = None, python_source: str = "", derivative: External | None = None,
                 precise: Callable[..., object] | None = None, texts: Mapping[str, str] | None = None, reason: str = "",
                 operations: int = 1) -> None:
        faults = Faults()
        taken = _arguments(name, arguments, results, operations, faults)
        if precise is not None and not callable(precise):
            faults.append(f"{name}: precise is {shown(precise)}; pass a function of an mpmath context and of the arguments")
        if reason and not _REASON.fullmatch(reason):
            faults.append(f"{name}: reason is {shown(reason)}; pass one line without quotation marks, backslashes and ??")
        given = _texts(name, c, texts, faults)
        if python is not None:
            given["numpy"] = text_of(python, len(taken), python_source, f"{name}: the Python function", faults)
        elif not isinstance(python_source, str) or python_source:
            faults.append(f"{name}: python_source is given without python; pass the function itself, too")
        if not given:
            faults.append(f"{name} has no text; pass c=, python= or both")
        below = _derivative(name, derivative, taken, results, faults)
        if faults:
            raise ModelError(list(faults), str(name))
        self.function = UserFunction(
            name=f"symdyn_call_{name}", label=name, arguments=taken, results=results, texts=tuple(sorted(given.items())),
            derivative=below, cost=operations, numbers=python, digits=precise,
            reason=reason or f"the function {name} failed or gave what is not finite")

    def __call__(self, *arguments: Scalar) -> sp.Expr | tuple[sp.Expr, ...]:
        """Its result at these arguments, numbers or expressions; of several results a tuple. Raises ModelError."""
        f = self.function
        if len(arguments) != len(f.arguments):
            raise ModelError([f"{f.signature} was called with {len(arguments)} argument{'s' * (len(arguments) != 1)}"])
        faults = Faults()
        taken = [faults.expression(a, f"{f.label}: argument {n}") for n, a in zip(f.arguments, arguments, strict=True)]
        if faults:
            raise ModelError(list(faults), f.label)
        results: tuple[sp.Expr, ...] = tuple(f.applied(taken))
        return results if f.results > 1 else results[0]

    def __repr__(self) -> str:
        return f"External({self.function.signature}, {self.function.results} result{'s' * (self.function.results > 1)})"


def _arguments(name: Any, arguments: Any, results: Any, operations: Any, faults: Faults) -> tuple[str, ...]:
    """The names of the arguments, once names and numbers have been looked at."""
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        faults.append(f"the name of a function is {shown(name)}; pass letters, digits and underscores that begin with a letter")
    elif name in OF_FUNCTIONS or name.startswith("symdyn_"):
        faults.append(f"a function is called {shown(name)}, a name that generated code or C has already; take another")
    listed = list(arguments) if isinstance(arguments, (list, tuple)) else []
    if not listed or not all(isinstance(a, str) and _NAME.fullmatch(a) for a in listed) or len(set(listed)) < len(listed):
        faults.append(f"{name}: arguments is {shown(arguments)}; pass a list of different names, such as ['v', 'omega']")
        listed = [str(a) for a in listed] or ["v"]
    for what, number in (("results", results), ("operations", operations)):
        if isinstance(number, bool) or not isinstance(number, int) or not 1 <= number <= MOST:
            faults.append(f"{name}: {what} is {shown(number)}; pass a whole number from 1 on, {MOST} at most")
    return tuple(listed)


def _texts(name: Any, c: Any, texts: Any, faults: Faults) -> dict[str, str]:
    """Backend -> text, of C and backends of the user."""
    if not isinstance(texts or {}, Mapping):
        faults.append(f"{name}: texts is {shown(texts)}; pass a dictionary of backends and texts")
        texts = None
    given = {str(backend): text for backend, text in (texts or {}).items()}
    if {"c", "numpy"} & set(given):
        faults.append(f"{name}: texts has {', '.join(sorted({'c', 'numpy'} & set(given)))}; pass python= and c= for NumPy and C")
    if c is not None:
        given["c"] = c
    for backend, text in given.items():
        if not isinstance(text, str) or not text.strip():
            faults.append(f"{name}: its text for the backend {shown(backend)} is {shown(text)}; pass the text of a function")
            given[backend] = ""
    given = {backend: "\n".join(line.rstrip() for line in text.strip().splitlines()) for backend, text in given.items()}
    if given.get("c"):
        if not re.search(_HEAD.format(re.escape(str(name))), given["c"]):
            faults.append(f"{name}: its text in C does not define it; it must hold static int {name}(const double *in, "
                          "double *out) {...}, which returns 0 where it succeeds")
        if re.search(r"^\s*#\s*include\b", given["c"], re.MULTILINE):
            faults.append(f"{name}: its text in C includes a file; leave that out, as functions of the math library are declared")
    return given


def _derivative(name: Any, derivative: Any, arguments: tuple[str, ...], results: Any, faults: Faults) -> UserFunction | None:
    """The function behind the derivative, if it fits."""
    if derivative is None:
        return None
    if not isinstance(derivative, External):
        faults.append(f"{name}: derivative is {shown(derivative)}; pass another sd.External, or None")
        return None
    below = derivative.function
    if len(below.arguments) != len(arguments):
        faults.append(f"{name} takes {len(arguments)} argument{'s' * (len(arguments) > 1)}, its derivative {below.signature} "
                      f"{len(below.arguments)}; both take the same")
    elif isinstance(results, int) and below.results != results * len(arguments):
        faults.append(f"{name}: its derivative {below.signature} gives {below.results} result{'s' * (below.results > 1)}; it "
                      f"must give {results * len(arguments)}: of each of {results} the derivatives by {', '.join(arguments)}")
    return below
