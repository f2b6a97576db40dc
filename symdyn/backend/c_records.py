"""Mirrors of what the runtime in C declares: its records as ctypes, its codes as numbers, read from the same text."""

from __future__ import annotations

import ctypes
import functools
import re
from typing import Any

from symdyn.errors import SymdynError
from symdyn.folders import templates_folder

_NUMBERS: dict[str, Any] = {"double": ctypes.c_double, "int": ctypes.c_int, "long": ctypes.c_long, "symdyn_time": ctypes.c_double}
_RESULTS: dict[str, Any] = {**_NUMBERS, "void": None}
_RECORD = re.compile(r"typedef struct \{(?P<body>.*?)\} (?P<name>[\w{}. ]+);", re.DOTALL)
_FUNCTION = re.compile(r"(?P<result>\w+) \(\*(?P<name>\w+)\)\((?P<arguments>[^)]*)\)")
_MEMBERS = re.compile(r"(?:const )?(?P<kind>\w+) (?P<names>[\w*, ]+)")
_CODE = re.compile(r"SYMDYN_(\w+) = (-?\d+)")


def _text(file: str) -> str:
    """A file of the templates in C, without comments."""
    return re.sub(r"//.*", "", (templates_folder() / "c" / file).read_text(encoding="utf-8"))


@functools.cache
def fields_of(file: str) -> list[tuple[str, Any]]:
    """Names and types of the members of the only record of a file, in order, as ctypes.Structure takes them.

    Raises SymdynError for a member whose type has no mirror.
    """
    result = _RECORD.search(_text(file))
    if result is None:
        raise SymdynError(f"c/{file} declares no record; declare one with typedef struct")
    fields: list[tuple[str, Any]] = []
    for member in filter(None, (m.strip() for m in result["body"].split(";"))):
        function, members = _FUNCTION.fullmatch(member), _MEMBERS.fullmatch(member)
        if function:
            kinds = [_argument(a.strip()) for a in function["arguments"].split(",")]
            fields.append((function["name"], ctypes.CFUNCTYPE(_RESULTS[function["result"]], *kinds)))
        elif members and (members["kind"] in _NUMBERS or members["names"].startswith("*")):
            for name in (n.strip() for n in members["names"].split(",")):
                fields.append((name.lstrip("*"), ctypes.c_void_p if name.startswith("*") else _NUMBERS[members["kind"]]))
        else:
            raise SymdynError(f"c/{file}: {member} has no mirror in Python; take numbers, pointers to them or functions of them")
    return fields


def codes_of(file: str) -> dict[str, int]:
    """The codes that a file declares, by name without the prefix."""
    return {name: int(value) for name, value in _CODE.findall(_text(file))}


def _argument(text: str) -> Any:
    text = text.removeprefix("const ")
    if text.startswith("void *"):
        return ctypes.c_void_p
    kind = _NUMBERS[text.split()[0]]
    return ctypes.POINTER(kind) if "*" in text else kind
