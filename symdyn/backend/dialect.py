"""A dialect: how the operations of the tape are written in a language; read from a TOML table next to its templates."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import chain, count
from pathlib import Path
from typing import Any

from symdyn.errors import SymdynError
from symdyn.tape.ops import OPERATIONS
from symdyn.tape.reserved import RESERVED

LOADED = ("q", "u", "z", "ud", "inputs", "p", "c")
PARTS = ("whole", "longest", "load", "store")
LOOPS = ("index", "begin", "end", "carried", "assign", "integers", "numbers", "item", "sines")
SINCOS = ("least", "take", "sin", "cos")
CALL = ("take", "item")


@dataclass(frozen=True)
class SinCos:
    """Sines and cosines that are taken all at once, of the angles that need no other sine or cosine.

    least      from how many sines and cosines on this is worth it; fewer are written one by one
    take       one statement a line, with {n} the number of angles and {angles} their values, separated by commas
    sin, cos   what then reads the sine and the cosine of angle {k}
    """

    least: int
    take: str
    sin: str
    cos: str


@dataclass(frozen=True)
class Parts:
    """The division of a long function into parts.

    whole        functions of so many steps are not divided
    longest      steps of a part, at most
    load, store  what reads and what keeps value {k} of those that parts hand on
    """

    whole: int
    longest: int
    load: str
    store: str


@dataclass(frozen=True)
class Loops:
    """The words of a loop over steps that a function repeats; what is handed on stands in the array that parts have.

    index            the variable that counts trips, from 0
    begin, end       lines around the statements of a trip; {n}: the number of trips
    carried, assign  what makes a variable that changes, and what changes it, with {name} and {value}
    integers, numbers   tables with {name} and {values}, an entry for each trip; item: what reads the entry of this trip
    sines            takes all sines and cosines at once, of {n} angles from the first index on; puts them from {sines} and
                     {cosines} on
    """

    index: str
    begin: str
    end: str
    carried: str
    assign: str
    integers: str
    numbers: str
    item: str
    sines: str


@dataclass(frozen=True)
class Call:
    """The call of a numeric algorithm of the tape; its text is the template {function}.*.jinja of the backend.

    take   one statement a line, with {name} of its results, {function}, {sizes} each followed by a comma, {arguments} separated
           by commas, {n_in} and {n_out} the numbers of arguments and results, and {code} to return where it fails
    item   what then reads result {k}
    argument   how one of the arguments is written, with {value}
    continued  what ends a line of arguments that goes on in the next
    """

    take: str
    item: str
    argument: str = "{value}"
    continued: str = ""


class Caseless(set[str]):
    """Names of which those that differ in capitals alone are the same."""

    def __init__(self, names: Iterable[str]) -> None:
        super().__init__(map(str.casefold, names))

    def __contains__(self, name: object) -> bool:
        return super().__contains__(str(name).casefold())

    def add(self, name: str) -> None:
        """Add a name."""
        super().add(name.casefold())


@dataclass(frozen=True)
class Dialect:
    """The words of one language for numbers, operations and assignments.

    operations   op -> format of its arguments {0}, {1}, ...; infix ones are built in where absent
    assign       format of an assignment to a new variable, with {name} and {value}
    load         formats of reading a leaf by kind ("q", "u", ..., "p", "c") with {k} its index
    first        index of the first entry of an array, 0 or 1
    comment      what a comment line begins with
    sincos       sines and cosines taken all at once; None where each is an operation like any other
    call         how numeric algorithms are called; None if the language has none
    parts        how long functions are divided; None if they are not
    loops        how steps that are repeated become loops, which takes parts, too; None if they do not
    read         format of an assignment of what does not depend on a direction, where statements are those of directions
    zeros        a statement that makes all {n} results zero, before the others of many zeros; None: each is stored
    words        what names in this language must not be, besides the words that no language has as names
    caseless     names that differ in capitals alone are the same
    reordered    whether statements stand where few values wait for their uses, without the headings of the derivation
    madd         format of {0}*{1} + {2} in one step; None where a product and a sum are written as they are
    """

    name: str
    operations: dict[str, str]
    assign: str
    load: dict[str, str]
    store: str
    check: str
    comment: str
    literal: str = "{value!r}"
    first: int = 0
    files: dict[str, str] | None = None
    sincos: SinCos | None = None
    madd: str | None = None
    parts: Parts | None = None
    loops: Loops | None = None
    call: Call | None = None
    zeros: str | None = None
    read: str | None = None
    words: tuple[str, ...] = ()
    caseless: bool = False
    reordered: bool = False

    def names(self) -> set[str]:
        """The names that are taken before any is given, as `identifier` looks at them."""
        return Caseless([*RESERVED, *self.words]) if self.caseless else set(self.words)

    def number(self, value: float) -> str:
        """A literal that reads back as exactly this double."""
        return self.literal.format(value=float(value))


def read_dialect(folder: Path) -> Dialect:
    """The dialect of a template folder (dialect.toml). Raises SymdynError naming what is missing or unknown."""
    path = folder / "dialect.toml"
    try:
        table: dict[str, Any] = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise SymdynError(f"the template folder {folder} has no dialect.toml; copy one from the c or numpy templates and "
                          "adapt it") from None
    except tomllib.TOMLDecodeError as error:
        raise SymdynError(f"{path} is not valid TOML: {error}") from error
    missing = [key for key in ("operations", "assign", "load", "store", "check", "comment", "files") if key not in table]
    unknown = [op for op in table.get("operations", {}) if op not in OPERATIONS]
    if missing or unknown:
        faults = [f"missing: {', '.join(missing)}"] * bool(missing) + [f"unknown operations: {', '.join(unknown)}"] * bool(
            unknown)
        raise SymdynError(f"{path} is not a complete dialect; {'; '.join(faults)}")
    _check_formats(path, table)
    fields = {key: table[key] for key in ("operations", "assign", "load", "store", "check", "comment", "literal", "first",
                                          "files", "madd", "zeros", "read", "words", "caseless", "reordered") if key in table}
    return Dialect(folder.name, **fields, sincos=SinCos(**table["sincos"]) if "sincos" in table else None,
                   parts=Parts(**table["parts"]) if "parts" in table else None,
                   loops=Loops(**table["loops"]) if "loops" in table else None,
                   call=Call(**table["call"]) if "call" in table else None)


def _check_formats(path: Path, table: dict[str, Any]) -> None:
    """Raise SymdynError for a format that asks for what it is not given, and for a group that cannot be read."""
    arguments = ("a", "b", "c")
    trials: list[tuple[str, str, dict[str, Any]]] = [
        ("assign", table["assign"], {"name": "a", "value": "b"}), ("store", table["store"], {"k": 0, "value": "a"}),
        ("check", table["check"], {"name": "a", "code": 1}), ("literal", table.get("literal", ""), {"value": 1.0}),
        *[(f"load.{group}", text, {"k": 0}) for group, text in table["load"].items()],
        *[("operations.madd", table["madd"], {}) for _ in range("madd" in table)],
        *[("zeros", table["zeros"], {"n": 1}) for _ in range("zeros" in table)],
        *[("read", table["read"], {"name": "a", "value": "b"}) for _ in range("read" in table)],
        *[(f"operations.{op}", text, {}) for op, text in table["operations"].items()],
        *[(f"files.{template}", text, {"name": "a"}) for template, text in table["files"].items()]]
    faults = [f"load.{group} is missing" for group in LOADED if group not in table["load"]]
    if "sincos" in table:
        sincos = table["sincos"]
        faults += [f"sincos.{key} is missing" for key in SINCOS if key not in sincos]
        faults += [f"sincos.{key} is not known" for key in sincos if key not in SINCOS]
        trials += [(f"sincos.{key}", sincos[key], {"n": 1, "angles": "a"} if key == "take" else {"k": 0})
                   for key in ("take", "sin", "cos") if key in sincos]
    if "parts" in table:
        parts = table["parts"]
        faults += [f"parts.{key} is missing" for key in PARTS if key not in parts]
        faults += [f"parts.{key} is not known" for key in parts if key not in PARTS]
        trials += [(f"parts.{key}", parts[key], {"k": 0, "value": "a"} if key == "store" else {"k": 0})
                   for key in ("load", "store") if key in parts]
    if "loops" in table:
        loops = table["loops"]
        faults += ["loops takes parts, which are missing"] * ("parts" not in table)
        faults += [f"loops.{key} is missing" for key in LOOPS if key not in loops]
        faults += [f"loops.{key} is not known" for key in loops if key not in LOOPS]
        given: dict[str, dict[str, Any]] = {
            "begin": {"n": 1}, "carried": {"name": "a", "value": "b"}, "assign": {"name": "a", "value": "b"},
            "integers": {"name": "a", "values": "1"}, "numbers": {"name": "a", "values": "1.0"}, "item": {"name": "a"},
            "sines": {"n": 1, "sines": 1, "cosines": 2}}
        trials += [(f"loops.{key}", loops[key], given[key]) for key in LOOPS if key in loops and key in given]
    if "call" in table:
        call = table["call"]
        faults += [f"call.{key} is missing" for key in CALL if key not in call]
        faults += [f"call.{key} is not known" for key in call if key not in (*CALL, "argument", "continued")]
        trials += [("call.argument", call["argument"], {"value": "a"}) for _ in range("argument" in call)]
        take = {"name": "r", "function": "f", "sizes": "1, ", "arguments": "a", "n_in": 1, "n_out": 1, "code": 1}
        trials += [(f"call.{key}", call[key], take if key == "take" else {"name": "r", "k": 0}) for key in CALL if key in call]
    for key, text, given in trials:
        try:
            text.format(*arguments if key.startswith("operations.") else (), **given)
        except (LookupError, ValueError) as error:
            wanted = ", ".join(f"{{{name}}}" for name in given) or "{0}, {1}, {2}"
            faults.append(f"{key} = {text!r} cannot be filled in ({error}); it may use {wanted}, and braces are doubled")
    if faults:
        raise SymdynError(f"{path}: {'; '.join(faults)}")


def identifier(name: str, taken: set[str]) -> str:
    """A name that is an identifier in every common language and not taken; adds it to `taken`."""
    base = re.sub(r"\W", "_", name, flags=re.ASCII) or "v"
    if base[0].isdigit() or base.startswith("_"):
        base = f"v{base}"
    candidates = chain((base, f"{base}_"), (f"{base}_{number}" for number in count(2)))
    result = next(candidate for candidate in candidates if candidate not in RESERVED and candidate not in taken)
    taken.add(result)
    return result
