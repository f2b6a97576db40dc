"""Functions of the user in generated files: the texts that are needed, each once, and what is called."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from symdyn.errors import SymdynError
from symdyn.tape.external import UserFunction
from symdyn.tape.tape import Tape

_DEFINED = re.compile(r"^[ \t]*static\s+int\s+(\w+)\s*\(\s*const\s+double\s*\*\s*\w+\s*,\s*double\s*\*\s*\w+\s*\)\s*\{",
                      re.MULTILINE)
_WAYS = {"c": "c=", "numpy": "python="}
# Backends whose texts are those of another.
_TEXTS = {"python": "numpy"}


@dataclass(frozen=True)
class UserCall:
    """A function that is called: by which name, `call`; its own name in its text, `entry`; numbers of arguments and results."""

    call: str
    entry: str
    signature: str
    n_in: int
    n_out: int


@dataclass(frozen=True)
class UserText:
    """Lines of a text, the functions in it that are called, names of those in C that nothing calls, and parts of the runtime in C
    that it calls."""

    lines: tuple[str, ...]
    functions: tuple[UserCall, ...]
    spare: tuple[str, ...]
    parts: tuple[str, ...] = ()

    @property
    def entries(self) -> str:
        """Names of the functions in the text, with commas between."""
        return ", ".join(f.entry for f in self.functions)


def called(tape: Tape) -> tuple[UserFunction, ...]:
    """Functions that a tape calls, by name. Raises SymdynError for two that differ and have one name."""
    result: dict[str, UserFunction] = {}
    for node in tape.arrays.chosen(tape.arrays.does("call")):
        function = node.args[0]
        if isinstance(function, UserFunction) and result.setdefault(function.label, function) != function:
            raise SymdynError(f"two functions that differ are called {function.label}: {result[function.label].signature} "
                              f"and {function.signature}; give one of them another name")
    return tuple(function for _, function in sorted(result.items()))


def texts(functions: Sequence[UserFunction], backend: str, name: str) -> list[UserText]:
    """Their texts in the language of a backend; what stands in one text stays together.

    name   of the mechanism, which names of the file begin with
    Raises SymdynError for a function without a text for the backend, and for a name that the file has already.
    """
    backend = _TEXTS.get(backend, backend)
    together: dict[str, list[UserFunction]] = {}
    for f in functions:
        text = f.text(backend)
        if text is None:
            way = f"pass {_WAYS.get(backend, f'texts={{{backend!r}: ...}}')} to sd.External, or " if f.given else ""
            there = ", ".join(b for b, _ in f.texts)
            raise SymdynError(f"{f.signature} has no text for the backend {backend}, only for {there}; {way}take another backend")
        if f.label.startswith(f"{name}_"):
            raise SymdynError(f"the function {f.label} may have a name of the generated files of {name}; take one that does "
                              f"not begin with {name}_")
        together.setdefault(text, []).append(f)
    result = []
    for text, group in together.items():
        calls = [UserCall(f.name, f.numbers.__name__ if backend == "numpy" and f.numbers else f.label, f.signature,
                          len(f.arguments), f.n_out) for f in group]
        spare = [n for n in dict.fromkeys(_DEFINED.findall(text)) if n not in [f.label for f in group]]
        parts = dict.fromkeys(part for f in group for part in f.parts)
        result.append(UserText(tuple(text.splitlines()), tuple(calls), tuple(spare), tuple(parts)))
    return result



def header(functions: Sequence[UserFunction]) -> list[str]:
    """Lines for the head of a file."""
    lines = [f"  {f.signature} -> {f.n_out}" for f in functions]
    return ["Functions of the user, with the number of their results:", *lines] if lines else []
