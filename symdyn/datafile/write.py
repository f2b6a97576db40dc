"""A System as a text in TOML."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import sympy as sp

from symdyn.datafile.forms import BEAM, DRAWN, ORIENTATIONS, PLAIN, SHAPES, SYMBOLS, TABLES, Form
from symdyn.datafile.texts import dummies, number_or_text
from symdyn.errors import ArgumentError, ModelError
from symdyn.model.faults import Faults
from symdyn.model.points import Point
from symdyn.model.symbols import Coordinate, GivenMotion, Input, Speed, time
from symdyn.model.system import System
from symdyn.shown import shown

FORMAT = 1
_ROTATIONS = ("parent_rotation", "child_rotation", "rotation")
_BARE = re.compile(r"[A-Za-z0-9_-]+")
# Lists of no more characters stand in one line.
_WIDE = 110


def write_system(system: System, path: str | Path | None = None) -> str:
    """The text, which is written into a file as well where a path is given. Raises ModelError, ArgumentError."""
    if path is not None and (not isinstance(path, (str, Path)) or not str(path).endswith(".toml")):
        raise ArgumentError(f"to_toml: path is {shown(path)}; pass the path of a file that ends in .toml")
    system.check()
    text = _Writer(system).text()
    if path is not None:
        try:
            Path(path).write_text(text, encoding="utf-8")
        except OSError as error:
            raise ModelError([f"to_toml: {path} cannot be written: {error.strerror or error}"]) from None
    return text


class _Writer:
    """The values of a system as values of TOML; what has no words is collected."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.faults: list[str] = []
        self.symbols: dict[str, sp.Symbol] = {}
        self.used: dict[str, sp.Symbol] = {}

    def text(self) -> str:
        """All of the file."""
        s = self.system
        self._declare()
        elements = {table: [self._element(table, e) for e in listed] for table, listed in (
            ("bodies", s.bodies), ("joints", s.joints), ("loops", s.loops), ("loads", s.loads), ("contacts", s.contacts),
            ("contact_groups", s.contact_groups))}
        elements |= {"states": [{"symbol": self._name(z.symbol), "rate": self._expression(z.rate, f"the rate of {z.symbol}")}
                                for z in s.states],
                     "constraints": [{"name": c.name, "expression": self._expression(c.expression, f"constraint {c.name}")}
                                     for c in s.constraints],
                     "outputs": [self._output(o) for o in s.outputs], "events": [self._event(e) for e in s.events],
                     "shapes": [self._shape(d) for d in s.shapes]}
        head: dict[str, Any] = {"format": FORMAT, "name": s.name, "planar": bool(s.planar),
                                "gravity": self._expressions(s.gravity, "gravity"), "duration": float(s.duration)}
        if s.declared is not None:
            head["parameter_order"] = [self._name(p) for p in s.declared]
        if s.extra_coordinates:
            head["extra_coordinates"] = [self._name(q) for q in s.extra_coordinates]
        if s.ground_motion is not None:
            q = s.ground_motion.coordinates
            head["ground_motion"] = {"position": self._expressions(q[:3], "the position of the ground"),
                                     "angles": self._expressions(q[3:], "the angles of the ground"),
                                     "sequence": vars(s.ground_motion)["orientation"].sequence}
        if s.chosen_speeds:
            head["chosen_speeds"] = {u.name: self._expression(e, f"the speed {u}") for u, e in s.chosen_speeds.items()}
        tables = self._numbers()
        if self.faults:
            raise ModelError(self.faults, s.name)
        return _laid_out(head, tables, elements)

    # -- symbols

    def _declare(self) -> None:
        """All symbols of the description by name."""
        for e in _expressions_in(vars(self.system), set()):
            for symbol in e.atoms(sp.Symbol):
                if not isinstance(symbol, sp.Dummy) and symbol != time:
                    self._take(symbol)

    def _take(self, symbol: sp.Symbol) -> None:
        kind = type(symbol).__name__
        base = symbol
        if kind in ("Rate", "Acceleration"):
            name = symbol.name.removesuffix("_dot" if kind == "Rate" else "_ddot")
            base = self.symbols.get(name) or Coordinate(name, **symbol._assumptions_orig)
        elif kind in ("GivenRate", "GivenAcceleration"):
            name = symbol.name.removesuffix("_dot" if kind == "GivenRate" else "_ddot")
            base = self.symbols.get(name) or GivenMotion(name, **symbol._assumptions_orig)
        elif kind == "Quantity":
            for point in symbol.measure.points:
                for e in point:
                    for inner in e.atoms(sp.Symbol):
                        self._take(inner)
            return
        known = self.symbols.get(base.name)
        if known is None or (kind in ("Coordinate", "Speed") and type(known) is Coordinate):
            self.symbols[base.name] = base
        elif known != base and base is symbol:
            self.faults.append(f"{base.name} is the name of two symbols, or of one with different assumptions; a data file has "
                               "one symbol of a name: give one of them another")

    def _name(self, symbol: Any) -> str:
        return str(symbol.name)

    def _numbers(self) -> dict[str, dict[str, dict[str, Any]]]:
        """Tables of symbols, with numbers and units; those of other names (rates, speeds of joints) stand in tables of their
        own."""
        s = self.system
        tables: dict[str, dict[str, dict[str, Any]]] = {name: {} for name in (*SYMBOLS, "initial", "units")}
        for name, symbol in self.symbols.items():
            tables[table_of(symbol)][name] = {k: bool(v) for k, v in symbol._assumptions_orig.items()}
        for what, numbers in (("default", s.defaults), ("initial", s.initial), ("unit", s.units)):
            for key, value in numbers.items():
                name = key if isinstance(key, str) else str(getattr(key, "name", None) or getattr(key, "func", key))
                owner = table_of(self.symbols[name]) if name in self.symbols else None
                taken = str(value) if what == "unit" else self._double(value, f"the {what} value of {name}")
                if owner is not None and what in SYMBOLS[owner]:
                    tables[owner][name][what] = taken
                elif what == "default":
                    tables["parameters"].setdefault(name, {})["default"] = taken
                else:
                    tables["initial" if what == "initial" else "units"][name] = taken  # type: ignore[assignment]
        return tables

    def _double(self, value: Any, what: str) -> float:
        number = float(value)
        if not math.isfinite(number):
            self.faults.append(f"{what} is {value}; a data file holds finite numbers")
        return number

    # -- values

    def _expression(self, e: Any, what: str) -> Any:
        faults = Faults()
        taken = faults.expression(e, what)
        if not faults:
            try:
                return number_or_text(taken, self.symbols | dummies([taken]), what)
            except ModelError as error:
                faults.extend(error.faults)
        self.faults += faults
        return 0

    def _expressions(self, values: Any, what: str) -> list[Any]:
        entries = values.tolist() if isinstance(values, np.ndarray) else list(values)
        return [self._expression(e, what) for e in entries]

    def _rows(self, matrix: Any, what: str) -> list[Any]:
        rows = matrix.tolist() if hasattr(matrix, "tolist") else [list(row) for row in matrix]
        if len(rows) == len(rows[0]) and len(rows) > 1 and all(e == 0 for i, row in enumerate(rows) for k, e in enumerate(row)
                                                              if i != k):
            return [self._expression(row[k], what) for k, row in enumerate(rows)]
        return [self._expressions(row, what) for row in rows]

    def _element(self, table: str, element: Any) -> dict[str, Any]:
        forms = TABLES[table]
        form = forms[0] if len(forms) == 1 else next((f for f in forms if type(element) is f.kind), None)
        if form is None:
            self.faults.append(f"{table}: {shown(element)} is of the kind {type(element).__name__}, which data files have no "
                               f"words for; they have {', '.join(f.word for f in forms)}")
            return {}
        return self._fields(form, element, len(forms) > 1)

    def _fields(self, form: Form, element: Any, typed: bool) -> dict[str, Any]:
        label = getattr(element, "name", None) or getattr(element, "label", None) or form.word
        result: dict[str, Any] = {"type": form.word} if typed else {}
        for argument, entry in form.entries.items():
            value = form.value(element, argument)
            if value is None:
                continue
            taken = self._value(entry.kind, value, f"{form.word} {label}: {argument}")
            default = None if entry.default is None else self._value(entry.kind, entry.default, "")
            if entry.required or not ((taken == default and type(taken) is type(default)) or _usual(argument, taken)
                                      or taken in ([], "")):
                result[argument] = taken
        return result

    def _value(self, kind: str, value: Any, what: str) -> Any:
        def named(owner: Any) -> str:
            return str(getattr(owner, "name", owner))

        simple: dict[str, Callable[[], Any]] = {
            "text": lambda: str(value), "flag": lambda: bool(value), "body": lambda: named(value), "joint": lambda: named(value),
            "expression": lambda: self._expression(value, what), "expressions": lambda: self._expressions(value, what),
            "values": lambda: self._expressions(value, what), "thrust": lambda: self._expression(value, what),
            "vector": lambda: self._expressions(value, what), "matrix": lambda: self._rows(value, what),
            "symbol": lambda: named(value), "symbols": lambda: [named(s) for s in value], "texts": lambda: list(value),
            "whole": lambda: int(value), "boxes": lambda: [self._fields(PLAIN["boxes"], box, False) for box in value],
            "friction": lambda: self._friction(value, what), "bodies": lambda: [named(b) for b in value],
            "shape": lambda: self._pair(value), "spheres": lambda: [self._plain(one) for one in value],
            "planes": lambda: [self._plain(one) for one in value],
            "orientation": lambda: self._orientation(value), "beam": lambda: _beam(value),
            "compliance": lambda: self._fields(PLAIN["compliance"], value, False),
            "bristles": lambda: self._fields(PLAIN["bristles"], value, False)}
        return simple[kind]()

    def _friction(self, value: Any, what: str) -> Any:
        if not isinstance(value, tuple):
            return self._expression(value, what)
        static, kinetic = self._expressions(value, what)
        return static if static == kinetic else [static, kinetic]

    def _plain(self, shape: Any) -> dict[str, Any]:
        return self._fields(next(f for f in SHAPES if f.kind is type(shape)), shape, True)

    def _pair(self, value: Any) -> Any:
        return [self._plain(one) for one in value] if isinstance(value, tuple) else [self._plain(value)]

    def _orientation(self, value: Any) -> dict[str, Any]:
        angles, parameters = ORIENTATIONS
        return {"type": parameters.__name__} if isinstance(value, parameters) else {
            "type": angles.__name__, "sequence": value.sequence, "speeds": value.speeds}

    def _output(self, output: Any) -> dict[str, Any]:
        what, value = f"output {output.name}", output.value
        if isinstance(value, Point):
            return {"name": output.name, "quantity": value.quantity, "body": str(getattr(value.body, "name", value.body)),
                    "point": self._expressions(value.at, what)}
        if isinstance(value, tuple):
            return {"name": output.name, "values": self._expressions(value, what)}
        return {"name": output.name, "value": self._expression(value, what)}

    def _event(self, event: Any) -> dict[str, Any]:
        what = f"event {event.name}"
        result = {"name": event.name, "value": self._expression(event.value, what), "direction": event.direction,
                  "stop": event.stop, "reset": {s.name: self._expression(e, f"{what}: reset of {s}") for s, e in event.reset}}
        return {k: v for k, v in result.items() if v not in (0, False, {}) or k == "value"}

    def _shape(self, drawn: Any) -> dict[str, Any]:
        kind = drawn.about["kind"]
        if kind not in DRAWN:
            self.faults.append(f"{drawn.what}: a shape of the kind {kind} has no words in a data file; draw it in Python")
            return {}
        result = {"body": str(getattr(drawn.body, "name", drawn.body)), "kind": kind, "color": drawn.color,
                  **{k: v for k, v in drawn.about.items() if k != "kind"},
                  **{name: [self._expressions(row, drawn.what) for row in rows] for name, rows in drawn.values.items()}}
        return {k: v for k, v in result.items() if v is not None}


def table_of(symbol: sp.Symbol) -> str:
    """The table of a file that declares a symbol."""
    kinds = ((Speed, "speeds"), (Coordinate, "coordinates"), (GivenMotion, "motions"), (Input, "inputs"))
    return next((table for kind, table in kinds if isinstance(symbol, kind)), "parameters")


def _usual(argument: str, taken: Any) -> bool:
    """Whether an inertia is that of a point mass, or a rotation none."""
    return (argument == "inertia" and taken == [0, 0, 0]) or (argument in _ROTATIONS and taken == [1, 1, 1])


def _beam(beam: Any) -> dict[str, Any]:
    values = {name: getattr(beam, name) for name in BEAM}
    return {name: v.tolist() if isinstance(v, np.ndarray) else list(v) if isinstance(v, tuple) else
            v if isinstance(v, str) else float(v) for name, v in values.items()}


def _expressions_in(value: Any, seen: set[int]) -> Iterable[sp.Basic]:
    """All expressions in the attributes of objects, containers within containers."""
    if isinstance(value, sp.MatrixBase):
        yield from value
    elif isinstance(value, sp.Basic):
        yield value
    elif isinstance(value, (str, bytes, np.ndarray, type)) or value is None or id(value) in seen:
        return
    elif isinstance(value, Mapping):
        for key, one in value.items():
            yield from _expressions_in(key, seen)
            yield from _expressions_in(one, seen)
    elif isinstance(value, (Sequence, set, frozenset)):
        for one in value:
            yield from _expressions_in(one, seen)
    elif type(value).__module__.startswith("symdyn.model"):
        seen.add(id(value))
        kept = {k: v for k, v in vars(value).items() if k not in _DERIVED} if hasattr(value, "__dict__") else {}
        yield from _expressions_in(kept, seen)


# Attributes of elements that follow from others.
_DERIVED = {"transform", "given_frame", "frame", "given_origin", "origin", "faults", "doubts", "rigid_contacts",
            "compliant_contacts", "lowered_groups", "_faults", "_warned"}


# -- layout

def _laid_out(head: Mapping[str, Any], tables: Mapping[str, Mapping[str, Any]],
              elements: Mapping[str, list[dict[str, Any]]]) -> str:
    scalars = [f"{key} = {_toml(value)}" for key, value in head.items()]
    parts = ["\n".join(["# A mechanism for symdyn.", *scalars])]
    for table, entries in tables.items():
        if entries:
            rows = [f"{_key(name)} = {_toml(_short(value))}" for name, value in entries.items()]
            parts.append("\n".join([f"[{table}]", *rows]))
    for table, listed in elements.items():
        for element in listed:
            parts.append("\n".join([f"[[{table}]]", *(f"{_key(k)} = {_toml(v)}" for k, v in element.items())]))
    return "\n\n".join(parts) + "\n"


def _short(value: Any) -> Any:
    """A number alone where a symbol has nothing else."""
    only = list(value) if isinstance(value, dict) else []
    return value[only[0]] if only in (["default"], ["initial"]) else value


def _key(name: str) -> str:
    return name if _BARE.fullmatch(name) else json.dumps(name, ensure_ascii=False)


def _toml(value: Any) -> str:
    """A value of TOML in one line, or a list with a line for each entry."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, int):
        return str(value)
    if isinstance(value, Mapping):
        inner = ", ".join(f"{_key(k)} = {_toml(v)}" for k, v in value.items())
        return f"{{{inner}}}"
    entries = [_toml(v) for v in value]
    whole = f"[{', '.join(entries)}]"
    if len(whole) <= _WIDE or not any(isinstance(v, (list, dict)) for v in value):
        return whole
    return "[\n" + "".join(f"    {e},\n" for e in entries) + "]"

