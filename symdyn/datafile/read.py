"""A System of a data file."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import sympy as sp

from symdyn.datafile.expressions import near
from symdyn.datafile.forms import ASSUMPTIONS, DRAWN, OUTPUT_POINTS, SYMBOLS, TABLES, Form
from symdyn.datafile.lines import lines_of
from symdyn.datafile.values import Values, text_of
from symdyn.datafile.write import FORMAT
from symdyn.errors import ArgumentError, ModelError
from symdyn.model.event import make_event
from symdyn.model.points import Point
from symdyn.model.shapes import Drawn
from symdyn.model.state import State
from symdyn.model.symbols import Coordinate, GivenMotion, Input, Speed
from symdyn.model.system import System
from symdyn.shown import shown

_KINDS: dict[str, type] = {"parameters": sp.Symbol, "coordinates": Coordinate, "speeds": Speed, "inputs": Input,
                           "motions": GivenMotion}
# Elements with entries of their own, and these: those that must be there, and others.
ENTRIES = {"states": (("symbol", "rate"), ()), "constraints": (("expression",), ("name",)),
           "outputs": (("name",), ("value", "values", "quantity", "body", "point")),
           "events": (("name", "value"), ("direction", "stop", "reset")),
           "shapes": (("body", "kind"), ("color", *dict.fromkeys(n for pair in DRAWN.values() for part in pair for n in part)))}
HEAD = ("format", "name", "planar", "gravity", "duration", "parameter_order", "extra_coordinates", "ground_motion",
        "chosen_speeds")
KEYS = (*HEAD, *SYMBOLS, "initial", "units", *TABLES, *ENTRIES)
_QUOTED = re.compile(r"'([^']+)'")


def read_system(path_or_text: str | Path) -> System:
    """The mechanism that a data file describes, as `system.to_toml` writes it; the file is data, and nothing in it is run.

    path_or_text   the path of a TOML file, or its text (whatever has more than one line)

    Expressions stand in quotation marks: numbers, declared symbols, t, pi, + - * / **, SymPy's elementary functions, Piecewise,
    Min, Max, comparisons, `q1.dot`, and points and orientations of bodies such as `position("bob", [0, 1, 0])[1]`. See
    docs/data_files.md for all entries, and `symdyn schema` for a JSON schema that editors complete by.

    Raises ModelError that lists every fault of the file with its line; ArgumentError for what is neither path nor text.

    >>> system = sd.read_system('''
    ... format = 1
    ... name = "pendulum"
    ... planar = true
    ... gravity = [0, "-g"]
    ... [parameters]
    ... m = 1.0
    ... l = {default = 0.5, unit = "m"}
    ... g = 9.81
    ... [coordinates]
    ... q = {initial = 0.1}
    ... [[bodies]]
    ... name = "bob"
    ... mass = "m"
    ... com = [0, "-l"]
    ... [[joints]]
    ... type = "Revolute"
    ... name = "pivot"
    ... parent = "ground"
    ... child = "bob"
    ... coordinate = "q"
    ... ''')
    >>> system.embedding().M_tilde
    Matrix([[l**2*m]])
    """
    if not isinstance(path_or_text, (str, Path)) or "\0" in str(path_or_text):
        raise ArgumentError(f"read_system was given {shown(path_or_text)}; pass the path of a TOML file, or its text")
    try:
        text, source = text_of(path_or_text)
        content = tomllib.loads(text)
    except OSError as error:
        raise ModelError([f"{path_or_text} cannot be read: {error.strerror or error}"]) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        called = "the text" if isinstance(path_or_text, str) and "\n" in path_or_text else path_or_text
        raise ModelError([f"{called} is not TOML: {error}"]) from None
    return _Reader(content, Values(source, lines_of(text))).system()


class _Reader:
    """Builds the system of the content of a file."""

    def __init__(self, content: Mapping[str, Any], values: Values) -> None:
        self.content, self.values = content, values

    def system(self) -> System:
        """The system. Raises ModelError with all faults."""
        v, content = self.values, self.content
        for key in content:
            if key not in KEYS:
                v.fault((key,), f"is no entry of a data file{near(key, list(KEYS))}")
        if content.get("format") != FORMAT:
            result = f"is {shown(content['format'])}" if "format" in content else "is missing"
            v.fault(("format",), f"{result}; this version reads format = {FORMAT}")
        numbers = self._declare()
        v.bodies |= self._names("bodies")
        v.joints |= self._names("joints")
        name = v.text(content.get("name", ""), ("name",))
        order = content.get("parameter_order")
        system = System(name, v.expressions(content["gravity"], ("gravity",)) if "gravity" in content else None,
                        v.flag(content.get("planar", False), ("planar",)),
                        None if order is None else v.value("symbols", order, ("parameter_order",)))
        self._head(system)
        for table, forms in TABLES.items():
            self._each(system, table, lambda one, place, forms=forms: self._element(system, forms, one, place))
        for table, (required, more) in ENTRIES.items():
            self._each(system, table, lambda one, place, table=table, entries=(required, more): self._other(
                system, table, one, place, *entries))
        system.defaults, system.initial, system.units = numbers
        self._check(system)
        return system

    def _names(self, table: str) -> set[str]:
        listed = self.content.get(table, [])
        return {one["name"] for one in listed if isinstance(one, dict) and isinstance(one.get("name"), str)} if isinstance(
            listed, list) else set()

    def _check(self, system: System) -> None:
        """Faults that need the whole mechanism, with the line of the first element that they name."""
        v = self.values
        if not v.faults:
            try:
                system.check()
            except ModelError as error:
                for fault in error.faults:
                    v.at(self._line(fault), fault)
        if v.faults:
            raise ModelError(v.faults, system.name)

    def _line(self, fault: str) -> int:
        named = [place for word in _QUOTED.findall(fault) for place, one in self._elements() if one.get("name") == word]
        return self.values.lines.get(named[0], 1) if named else 1

    def _elements(self) -> list[tuple[tuple[str, int], Mapping[str, Any]]]:
        return [((table, k), one) for table in (*TABLES, *ENTRIES) for k, one in enumerate(self.content.get(table, []))]

    # -- symbols and what stands in front

    def _table(self, name: str) -> Mapping[str, Any]:
        result = self.content.get(name, {})
        if not isinstance(result, dict):
            self.values.fault((name,), f"is {shown(result)}; write a table")
            return {}
        return result

    def _declare(self) -> tuple[dict[Any, float], dict[Any, float], dict[Any, str]]:
        """Declares the symbols; returns their defaults, initial values and units."""
        v = self.values
        defaults: dict[Any, float] = {}
        initial: dict[Any, float] = {}
        units: dict[Any, str] = {}
        for table, kind in _KINDS.items():
            for name, given in self._table(table).items():
                place = (table, name)
                if name == "t" or name in v.symbols:
                    v.fault(place, "is declared already" if name in v.symbols else "is the time, which is declared already")
                    continue
                words = given if isinstance(given, dict) else {SYMBOLS[table][0]: given}
                known = (*SYMBOLS[table], *ASSUMPTIONS)
                for key in [k for k in words if k not in known]:
                    v.fault((*place, key), f"is no entry of a symbol{near(key, [*SYMBOLS[table], 'positive', 'real'])}")
                assumptions = {k: v.flag(words[k], (*place, k)) for k in words if k in ASSUMPTIONS}
                try:
                    symbol = v.symbols[name] = kind(name, **assumptions)
                except ValueError as error:  # assumptions that contradict each other
                    v.fault(place, f"has assumptions that contradict each other: {error}")
                    continue
                for key, numbers in (("default", defaults), ("initial", initial)):
                    if key in words and key in SYMBOLS[table]:
                        numbers[symbol] = v.number(words[key], (*place, key))
                if "unit" in words:
                    units[symbol] = v.text(words["unit"], (*place, "unit"))
        initial |= {name: v.number(given, ("initial", name)) for name, given in self._table("initial").items()}
        units |= {name: v.text(given, ("units", name)) for name, given in self._table("units").items()}
        return defaults, initial, units

    def _head(self, system: System) -> None:
        v, content = self.values, self.content
        if "duration" in content:
            system.duration = v.number(content["duration"], ("duration",))
        if "extra_coordinates" in content:
            system.add_coordinate(*v.value("symbols", content["extra_coordinates"], ("extra_coordinates",)))
        if "ground_motion" in content:
            given, place = self._table("ground_motion"), ("ground_motion",)
            for key in given:
                if key not in ("position", "angles", "sequence"):
                    v.fault((*place, key), "is no entry of ground_motion; there are position, angles, sequence")
            with_defaults: dict[str, Any] = {"position": [0, 0, 0], "angles": [0, 0, 0], "sequence": "ZYX", **given}
            position, angles = (v.expressions(with_defaults[key], (*place, key)) for key in ("position", "angles"))
            try:
                system.move_ground(position, angles, v.text(with_defaults["sequence"], (*place, "sequence")))
            except ModelError as error:
                v.fault(place, str(error))
        if "chosen_speeds" in content:
            system.set_speeds({v.symbol(name, ("chosen_speeds", name)): v.expression(e, ("chosen_speeds", name))
                               for name, e in self._table("chosen_speeds").items()})
        self._own_faults(system, ("gravity",))

    def _own_faults(self, system: System, place: tuple[str | int, ...]) -> None:
        """Faults that the system collected itself get the line of an entry."""
        for fault in system._faults:
            self.values.fault(place, f"has a fault: {fault}")
        system._faults.clear()

    # -- elements

    def _each(self, system: System, table: str, read: Any) -> None:
        listed = self.content.get(table, [])
        if not isinstance(listed, list):
            self.values.fault((table,), f"is {shown(listed)}; write an array of tables, [[{table}]]")
            return
        for k, one in enumerate(listed):
            before = len(self.values.faults)
            read(one, (table, k))
            if len(self.values.faults) > before:
                system._faults.clear()
            self._own_faults(system, (table, k))

    def _element(self, system: System, forms: list[Form], given: Any, place: tuple[str | int, ...]) -> None:
        v = self.values
        form = v.form_of(forms, given, place)
        if form is None:
            return
        method = getattr(system, form.made.__name__, None)
        made = v.made(form, given, place, method or form.made)
        if method is not None or made is None:
            return
        adding: dict[str, Callable[[Any], object]] = {
            "joints": system.add_joint, "loops": system.close_loop, "loads": system.add_load, "contacts": system.add_contact,
            "contact_groups": system.add_contact}
        adding[str(place[0])](made)

    def _other(self, system: System, table: str, given: Any, place: tuple[str | int, ...], required: tuple[str, ...],
               more: tuple[str, ...]) -> None:
        v = self.values
        if not isinstance(given, dict):
            v.fault(place, f"is {shown(given)}; write a table")
            return
        for key in given:
            if key not in (*required, *more):
                v.fault((*place, key), f"is no entry of {table}{near(key, [*required, *more])}")
        missing = [key for key in required if key not in given]
        if missing:
            v.fault(place, f"has no {', '.join(missing)}")
            return
        getattr(self, f"_{table}")(system, given, place)

    def _states(self, system: System, given: Mapping[str, Any], place: Any) -> None:
        v = self.values
        system.states.append(State(v.symbol(given["symbol"], (*place, "symbol")), v.expression(given["rate"], (*place, "rate"))))

    def _constraints(self, system: System, given: Mapping[str, Any], place: Any) -> None:
        v = self.values
        system.add_constraint(v.expression(given["expression"], (*place, "expression")),
                              v.text(given.get("name", ""), (*place, "name")))

    def _outputs(self, system: System, given: Mapping[str, Any], place: Any) -> None:
        v = self.values
        name = v.text(given["name"], (*place, "name"))
        ways = [key for key in ("value", "values", "quantity") if key in given]
        if len(ways) != 1:
            v.fault(place, f"has {' and '.join(ways) or 'no value'}; give one of value, values, quantity")
        elif ways == ["quantity"]:
            quantity = v.text(given["quantity"], (*place, "quantity"))
            if quantity not in OUTPUT_POINTS:
                v.fault((*place, "quantity"), f"is {shown(quantity)}{near(quantity, list(OUTPUT_POINTS))}")
                return
            body = v.value("body", given.get("body"), (*place, "body"))
            system.add_output(name, Point(body, tuple(v.expressions(given.get("point", [0, 0, 0]), (*place, "point"))), quantity))
        else:
            system.add_output(name, v.value("expressions" if ways == ["values"] else "expression", given[ways[0]],
                                            (*place, ways[0])))

    def _events(self, system: System, given: Mapping[str, Any], place: Any) -> None:
        v = self.values
        resets = given.get("reset", {})
        if not isinstance(resets, dict):
            v.fault((*place, "reset"), f'is {shown(resets)}; write a table such as {{v = "-v"}}')
            resets = {}
        made = make_event(system._faults, v.text(given["name"], (*place, "name")),
                          v.expression(given["value"], (*place, "value")),
                          v.whole(given.get("direction", 0), (*place, "direction")) if "direction" in given else 0,
                          v.flag(given.get("stop", False), (*place, "stop")),
                          {self._of_state(name): v.expression(e, (*place, "reset", name)) for name, e in resets.items()})
        if made is not None:
            system.events.append(made)

    def _of_state(self, name: str) -> Any:
        """A symbol of the state by its name, where the file declares it or the coordinate that it is the rate of."""
        base = self.values.symbols.get(name.removesuffix("_dot"))
        return self.values.symbols.get(name) or (base.dot if isinstance(base, Coordinate) else name)

    def _shapes(self, system: System, given: Mapping[str, Any], place: Any) -> None:
        v = self.values
        body, kind = v.value("body", given["body"], (*place, "body")), given["kind"]
        if kind not in DRAWN:
            v.fault((*place, "kind"), f"is {shown(kind)}{near(str(kind), DRAWN)}")
            return
        lengths, others = DRAWN[kind]
        for key in given:
            if key not in ("body", "kind", "color", *lengths, *others):
                v.fault((*place, key), f"is no entry of a shape of the kind {kind}{near(key, [*lengths, *others])}")
        about = {"kind": kind, **({"width": 1.5, "to": None} if kind == "line" else {}),
                 **{key: given[key] for key in others if key in given}}
        rows = {key: tuple(tuple(row) for row in v.value("matrix", given[key], (*place, key)) if isinstance(row, list))
                for key in lengths if key in given}
        system.shapes.append(Drawn(body, f"{kind} of {shown(body)}", given.get("color"), rows, about))
