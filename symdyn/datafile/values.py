"""Values of a data file as values of a System, each of the kind that its entry takes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import sympy as sp

from symdyn.datafile.expressions import Wrong, near, parsed
from symdyn.datafile.forms import BEAM, ORIENTATIONS, PLAIN, SHAPES, Form
from symdyn.datafile.lines import Path as Place
from symdyn.datafile.lines import line_of
from symdyn.errors import SymdynError
from symdyn.flexible.modal_body import ModalBody
from symdyn.shown import shown


class Values:
    """Reads values; what is wrong is collected with its line, and something harmless goes on in its place."""

    def __init__(self, source: str, lines: dict[Place, int]) -> None:
        self.source, self.lines = source, lines
        self.faults: list[str] = []
        self.symbols: dict[str, sp.Symbol] = {}
        self.bodies: set[str] = {"ground"}
        self.joints: set[str] = set()

    def fault(self, place: Place, what: str) -> None:
        """A fault of an entry."""
        key = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in place).lstrip(".")
        self.at(line_of(self.lines, place), f"{key} {what}")

    def at(self, line: int, what: str) -> None:
        """A fault of a line."""
        self.faults.append(f"{self.source}:{line}: {what}")

    # -- one kind each

    def value(self, kind: str, given: Any, place: Place) -> Any:
        """A value of a kind of `forms.ARGUMENTS`."""
        readers: dict[str, Callable[[Any, Place], Any]] = {
            "text": self.text, "flag": self.flag, "whole": self.whole, "body": self._known(self.bodies, "body"),
            "joint": self._known(self.joints, "joint"), "expression": self.expression, "expressions": self.expressions,
            "vector": self.expressions, "matrix": self.matrix, "symbol": self.symbol,
            "symbols": lambda v, at: self._each(v, at, self.symbol), "texts": lambda v, at: self._each(v, at, self.text),
            "bodies": lambda v, at: self._each(v, at, self._known(self.bodies, "body")),
            "values": lambda v, at: self.expressions(v, at) if isinstance(v, list) else self.expression(v, at),
            "friction": lambda v, at: tuple(self.expressions(v, at)) if isinstance(v, list) else self.expression(v, at),
            "boxes": lambda v, at: self._each(v, at, lambda one, there: self._plain("boxes", one, there)),
            "shape": self._pair, "spheres": lambda v, at: self._each(v, at, self._shape),
            "planes": lambda v, at: self._each(v, at, self._shape), "orientation": self._orientation, "beam": self._beam,
            "compliance": lambda v, at: self._plain("compliance", v, at),
            "bristles": lambda v, at: self._plain("bristles", v, at), "thrust": self._thrust}
        return readers[kind](given, place)

    def text(self, given: Any, place: Place) -> str:
        """A text."""
        if not isinstance(given, str):
            self.fault(place, f"is {shown(given)}; write a text in quotation marks")
            return ""
        return given

    def flag(self, given: Any, place: Place) -> bool:
        """True or false."""
        if not isinstance(given, bool):
            self.fault(place, f"is {shown(given)}; write true or false")
        return given is True

    def whole(self, given: Any, place: Place) -> int:
        """A whole number."""
        if isinstance(given, bool) or not isinstance(given, int):
            self.fault(place, f"is {shown(given)}; write a whole number")
            return 1
        return given

    def number(self, given: Any, place: Place) -> float:
        """A finite number."""
        if isinstance(given, bool) or not isinstance(given, (int, float)) or not _is_double(given):
            self.fault(place, f"is {shown(given)}; write a finite number")
            return 0.0
        return float(given)

    def expression(self, given: Any, place: Place, more: Mapping[str, sp.Symbol] | None = None) -> sp.Expr:
        """A number, or an expression in quotation marks."""
        if isinstance(given, bool) or not isinstance(given, (int, float, str)) or (
                not isinstance(given, str) and not _is_double(given)):
            self.fault(place, f"is {shown(given)}; write a finite number, or an expression in quotation marks")
        elif isinstance(given, str):
            try:
                return parsed(given, {**self.symbols, **(more or {})})
            except Wrong as wrong:
                self.fault(place, str(wrong))
        else:
            return sp.sympify(given, strict=True)
        return sp.S.Zero

    def expressions(self, given: Any, place: Place) -> list[sp.Expr]:
        """A list of expressions."""
        result: list[sp.Expr] = self._each(given, place, self.expression)
        return result

    def matrix(self, given: Any, place: Place) -> list[Any]:
        """Rows of expressions, or a diagonal."""
        if isinstance(given, list) and any(isinstance(row, list) for row in given):
            return self._each(given, place, self.expressions)
        return self.expressions(given, place)

    def symbol(self, given: Any, place: Place) -> sp.Symbol:
        """A symbol by its name."""
        if not isinstance(given, str) or given not in self.symbols:
            self.fault(place, f"is {shown(given)}; write the name of a declared symbol"
                       f"{near(given, self.symbols) if isinstance(given, str) else ''}")
            return sp.Symbol("symbol")
        return self.symbols[given]

    def _each(self, given: Any, place: Place, reader: Callable[[Any, Place], Any]) -> list[Any]:
        if not isinstance(given, list):
            self.fault(place, f"is {shown(given)}; write a list in brackets")
            return []
        return [reader(one, (*place, k)) for k, one in enumerate(given)]

    def _known(self, known: set[str], what: str) -> Callable[[Any, Place], str]:
        def reader(given: Any, place: Place) -> str:
            if not isinstance(given, str) or given not in known:
                hint = near(given, sorted(known)) if isinstance(given, str) else ""
                self.fault(place, f"is {shown(given)}; there is no such {what} in the file{hint}")
            return str(given)

        return reader

    def _thrust(self, given: Any, place: Place) -> Callable[[sp.Symbol], sp.Expr]:
        speed = sp.Symbol("v_r", real=True)
        law = self.expression(given, place, {"v_r": speed})
        return lambda v: law.xreplace({speed: v})

    # -- tables within entries

    def fields(self, form: Form, given: Mapping[str, Any], place: Place) -> dict[str, Any]:
        """The arguments of a form from the entries of a table, which may hold nothing else but `type`."""
        unknown = [key for key in given if key != "type" and key not in form.entries]
        for key in unknown:
            self.fault((*place, key), f"is no entry of {form.word}{near(key, list(form.entries))}")
        for key, entry in form.entries.items():
            if entry.required and key not in given:
                self.fault(place, f"has no {key}, which {form.word} needs")
        return {key: self.value(form.entries[key].kind, value, (*place, key)) for key, value in given.items()
                if key in form.entries}

    def form_of(self, forms: Sequence[Form], given: Any, place: Place) -> Form | None:
        """The form that a table names by its `type`."""
        if not isinstance(given, dict):
            self.fault(place, f"is {shown(given)}; write a table")
            return None
        if len(forms) == 1:
            return forms[0]
        word, known = given.get("type"), {f.word: f for f in forms}
        if not isinstance(word, str) or word not in known:
            self.fault((*place, "type") if "type" in given else place, f"has the type {shown(word)}{near(str(word), known)}")
            return None
        return known[word]

    def made(self, form: Form, given: Mapping[str, Any], place: Place, maker: Callable[..., Any]) -> Any:
        """Object that a form makes of a table; None, with faults, where it cannot be made."""
        before = len(self.faults)
        arguments = self.fields(form, given, place)
        if any(entry.required and key not in arguments for key, entry in form.entries.items()):
            return None
        if any(arguments[key] is None for key in arguments):
            return None
        try:
            made = maker(**arguments)
        except (SymdynError, TypeError, ValueError, ArithmeticError) as error:
            if len(self.faults) == before:
                self.fault(place, str(error))
            return None
        inner = getattr(made, "faults", None)
        if isinstance(inner, list):
            if len(self.faults) == before:
                for fault in inner:
                    self.at(line_of(self.lines, place), fault)
            inner.clear()
        return made

    def _plain(self, word: str, given: Any, place: Place) -> Any:
        if self.form_of([PLAIN[word]], given, place) is None:
            return None
        return self.made(PLAIN[word], given, place, PLAIN[word].made)

    def _shape(self, given: Any, place: Place) -> Any:
        form = self.form_of(SHAPES, given, place)
        return None if form is None else self.made(form, given, place, form.made)

    def _pair(self, given: Any, place: Place) -> Any:
        result = self._each(given, place, self._shape)
        return tuple(result) if len(result) == 2 else result[0] if result else None

    def _orientation(self, given: Any, place: Place) -> Any:
        angles, parameters = ORIENTATIONS
        if not isinstance(given, dict) or not all(isinstance(v, str) for v in given.values()):
            self.fault(place, f'is {shown(given)}; write {{type = "EulerAngles", sequence = "ZYX", speeds = "rates"}} or '
                       '{type = "EulerParameters"}')
            return None
        rest = {k: v for k, v in given.items() if k != "type"}
        kinds = {angles.__name__: angles, parameters.__name__: parameters}
        try:
            return kinds[given["type"]](**rest)
        except (KeyError, TypeError):
            self.fault(place, f"is {shown(given)}; take the type {' or '.join(kinds)}, the first with sequence and speeds")
        except SymdynError as error:
            self.fault(place, str(error))
        return None

    def _beam(self, given: Any, place: Place) -> ModalBody | None:
        if not isinstance(given, dict) or set(given) != set(BEAM):
            has = sorted(given) if isinstance(given, dict) else []
            self.fault(place, f"has the entries {', '.join(has) or 'none'}; a beam has {', '.join(BEAM)}")
            return None
        try:
            taken: dict[str, Any] = {
                k: v if k in ("name", "length", "m") else tuple(v) if k == "names" else np.array(v, dtype=float)
                for k, v in given.items()}
            n = len(taken["names"])
            shapes = beam_shapes(n, len(taken["X"]))
            wrong = [k for k, shape in shapes.items() if taken[k].shape != shape or not np.isfinite(taken[k]).all()]
            if wrong:
                self.fault(place, f"has {wrong[0]} of the shape {taken[wrong[0]].shape} or with entries that are not finite; it "
                           f"must have {shapes[wrong[0]]} finite numbers for {n} modes")
                return None
            return ModalBody(**taken)
        except (TypeError, ValueError) as error:
            self.fault(place, f"is no beam: {error}")
            return None


def beam_shapes(n: int, k: int) -> dict[str, tuple[int, ...]]:
    """Shapes of the arrays of a beam with n modes and k stations, see ModalBody."""
    return {"e": (3,), "h0": (3,), "H1": (3, n), "H2": (3, n, n), "I0": (3, 3), "I1": (n, 3, 3), "I2": (n, n, 3, 3),
            "Cr0": (3, n), "Cr1": (n, 3, n), "Me": (n, n), "K": (n, n), "D": (n, n), "Psi_tip": (3, n), "Theta_tip": (3, n),
            "S_tip": (n, n), "X": (k,), "Psi": (k, 3, n), "S": (k, n, n)}


def _is_double(value: float) -> bool:
    try:
        return math.isfinite(float(value))
    except OverflowError:
        return False


def text_of(given: str | Path) -> tuple[str, str]:
    """The text of a file, or the text itself where it has more than one line, and what messages call it. Raises OSError,
    UnicodeDecodeError."""
    if isinstance(given, str) and "\n" in given:
        return given, "text"
    return Path(given).read_text(encoding="utf-8"), str(given)
