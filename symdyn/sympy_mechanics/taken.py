"""Symbol of symdyn that each function of time in SymPy's equations stands for: coordinates, speeds, inputs, motions, "
"parameters."""

from __future__ import annotations

import keyword
from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

import sympy as sp
from sympy.core.function import AppliedUndef

from symdyn.errors import ModelError
from symdyn.formulation.equations import Symbols
from symdyn.model.faults import NAME, Faults
from symdyn.model.symbols import Coordinate, GivenMotion, Input, Speed, described, parts_of, take_over, time, with_rates
from symdyn.shown import name_of, shown


class Taken:
    """Symbols of equations of SymPy's; fills `faults` while it takes them over.

    same   functions of time, and derivatives of these -> symbols of symdyn, or 0 for what vanishes
    """

    def __init__(self, name: str, coordinates: Iterable[Any], speeds: Iterable[Any] | None, states: Iterable[Any] = ()) -> None:
        self.name, self.faults = name, Faults()
        if not isinstance(name, str) or not name.isidentifier() or keyword.iskeyword(name):
            self.faults.append(f"name is {shown(name)}; pass an identifier such as 'pendulum', it names files and functions")
        self.t = _time()
        self.same: dict[sp.Basic, Any] = {} if self.t == time else {self.t: time}
        given = list(coordinates)
        if not given:
            self.faults.append("there are no coordinates; pass functions of time, made with dynamicsymbols")
        self.faults += [f"coordinate {f} is given {count} times" for f, count in Counter(map(str, given)).items() if count > 1]
        self.coordinates = [self._made(f, Coordinate, "coordinate") for f in dict.fromkeys(given)]
        for f, q in list(self.same.items()):
            if isinstance(q, Coordinate):
                self.same[sp.Derivative(f, self.t)] = q.dot
        if speeds is None:
            self.speeds = [q.dot for q in self.coordinates]
        else:
            self.speeds = [self.same[u] if u in self.same else self._made(u, Speed, "speed") for u in speeds]
        for f, u in list(self.same.items()):
            if u in self.speeds:
                self.same[sp.diff(f, self.t)] = u.dot
        self.accelerations = {u.dot for u in self.speeds}
        self.states = [self._made(z, Speed, "state") for z in states]
        self.inputs: dict[Input, None] = {}
        self.parameters: dict[sp.Symbol, None] = {}
        self._seen: set[sp.Basic] = set()

    def expression(self, value: Any, what: str) -> sp.Expr:
        """A number or an expression; text, which is never evaluated, and anything else is a fault."""
        if not isinstance(value, str):
            try:
                result = sp.sympify(value, strict=True)
            except (sp.SympifyError, TypeError, ValueError):
                result = None
            if isinstance(result, sp.Expr):
                return result
        self.faults.append(f"{what} is {shown(value)}; pass a number or an expression of SymPy's")
        return sp.S.Zero

    def vanishing(self, functions: Iterable[Any]) -> None:
        """Functions of time that are zero, with their derivatives, such as auxiliary speeds."""
        for f in functions:
            self.same |= {f: sp.S.Zero, sp.diff(f, self.t): sp.S.Zero}

    def use(self, what: str, *expressions: Any, without: Iterable[sp.Basic] = (), accelerations: bool = False) -> None:
        """Take the symbols of expressions over; what is no part of equations of motion is a fault.

        what      where they stand, for messages; without: functions and symbols that stand for something else
        accelerations   whether derivatives of speeds may stand there
        """
        self._seen |= set(without)
        known = self.same if accelerations else {f: s for f, s in self.same.items() if s not in self.accelerations}
        result = sorted(_leaves(expressions, self._seen, known), key=lambda e: (str(e), sp.default_sort_key(e)))
        for e in result:
            if e in known or (e in self.same and isinstance(self.same[e], Input)):  # with a derivative that was found before
                continue
            if isinstance(e, sp.Symbol):
                if e.name == "t" and e != time:
                    self.faults.append(f"{what} uses a symbol t with assumptions, which is not the time {self.t}; use one symbol")
                elif e != time:
                    self.parameters[e] = None
            elif isinstance(e, sp.Derivative):
                self._derivative(what, e)
            elif e.args == (self.t,):
                self.same[e] = symbol = Input(e.func.__name__, **e.func._kwargs)
                self.inputs[symbol] = None
            else:
                self.faults.append(f"{what} uses {e}, a function without a value; write it out, or use a function of your own, "
                                   "sd.External")

    def symbols(self, defaults: Mapping[Any, Any] | None, initial: Mapping[Any, Any] | None, units: Mapping[Any, str] | None,
                duration: float) -> Symbols:
        """The symbols of the equations. Raises ModelError with all faults."""
        self._motions()
        inputs = with_rates(self.inputs)
        everything = [*self.coordinates, *self.speeds, *self.states, *self.parameters, *inputs]
        for name, count in Counter(s.name for s in everything).items():
            if count > 1:
                result = " and ".join(described(s) for s in dict.fromkeys(everything) if s.name == name)
                self.faults.append(f"{count} different symbols are named {shown(name)} (by kind or assumptions), {result}; give "
                                   f"them different names")
            if not NAME.fullmatch(name):
                self.faults.append(f"one of the symbols is named {shown(name)}; use letters, digits, spaces and _ . , : + - * / "
                                   f"^ ' # % and brackets")
        state = [*self.coordinates, *self.speeds, *self.states]
        started = [*state, *[i for i in self.inputs if type(i) in (Input, GivenMotion)]]
        numbers = self.faults.numbers(defaults, list(self.parameters), "defaults", "parameter", self._meant)
        start = self.faults.numbers(initial, started, "initial", "coordinate, speed, state or input", self._meant)
        if duration is not None and not (isinstance(duration, (int, float)) and duration > 0):
            self.faults.append(f"duration is {shown(duration)} s; pass a positive number")
        named = {s.name: s for s in everything}
        of_units: dict[sp.Symbol, str] = {}
        if units is not None and not isinstance(units, Mapping):
            self.faults.append(f"units is {shown(units)}; pass a mapping from symbols or names to text such as 'm'")
            units = None
        for key, unit in (units or {}).items():
            symbol = named.get(name_of(take_over(key) if isinstance(key, sp.Basic) else key))
            if symbol is None or not isinstance(unit, str):
                self.faults.append(f"units has {shown(unit)} for {shown(key)}; pass a text such as 'm' for symbols of the "
                                   f"equations: {', '.join(named)}")
            else:
                of_units[symbol] = unit
        if self.faults:
            raise ModelError(list(dict.fromkeys(self.faults)), self.name if isinstance(self.name, str) else "")
        return Symbols(tuple(self.coordinates), tuple(self.speeds), tuple(self.states), tuple(inputs), tuple(self.parameters),
                       numbers, start, of_units, float(duration))

    # -- one by one

    def _made(self, f: Any, kind: type, what: str) -> Any:
        if isinstance(f, AppliedUndef) and f.args == (self.t,):
            symbol = kind(f.func.__name__, **f.func._kwargs)
            self.same[f] = symbol
            return symbol
        if isinstance(f, Coordinate):
            self.same[f] = f
            return f
        self.faults.append(f"{what} {shown(f)} is no function of time; make it with dynamicsymbols, or with sd.coordinates")
        return kind(f"{what}_{len(self.same) + 1}")

    def _derivative(self, what: str, e: sp.Derivative) -> None:
        f, order = e.expr, e.derivative_count
        if f in self.same and self.same[f] == 0:
            self.same[e] = sp.S.Zero
        elif f in self.same and not isinstance(self.same[f], Input):
            self.faults.append(f"{what} uses {e}; equations of motion may use coordinates, speeds, inputs and t there")
        elif not (isinstance(f, AppliedUndef) and f.args == (self.t,) and e.variables == (self.t,) * order):
            self.faults.append(f"{what} uses {e}, which has no value; write it out")
        elif order > 2:
            self.faults.append(f"{what} uses {e}; of an input its value, rate and acceleration are given: use an input of its "
                               f"own for higher derivatives")
        else:
            motion = GivenMotion(f.func.__name__, **f.func._kwargs)
            self.same |= {f: motion, sp.Derivative(f, self.t): motion.dot, sp.Derivative(f, (self.t, 2)): motion.ddot}
            self.inputs = {motion: None, **{i: None for i in self.inputs if i.name != motion.name}}

    def _meant(self, key: sp.Basic) -> sp.Basic:
        """The symbol that stands for a function of time; any other symbol as it is."""
        return self.same.get(key, key)

    def _motions(self) -> None:
        """Inputs in the order of their names, each motion once."""
        self.inputs = dict.fromkeys(sorted(self.inputs, key=lambda i: i.name))


def _time() -> Any:
    from sympy.physics.vector import dynamicsymbols

    return dynamicsymbols._t


def _leaves(expressions: Iterable[Any], seen: set[sp.Basic], known: Mapping[sp.Basic, Any]) -> set[sp.Basic]:
    """Symbols, functions without a value and derivatives in expressions and matrices; what was seen, or is known, is left out."""
    result: set[sp.Basic] = set()
    waiting = [part for e in expressions for part in (list(e) if isinstance(e, sp.MatrixBase) else [e])]
    while waiting:
        part = waiting.pop()
        if part in seen or part in known:
            continue
        seen.add(part)
        if isinstance(part, (sp.Symbol, AppliedUndef, sp.Derivative)):
            result.add(part)
        else:
            waiting.extend(part.args)
    return result


def functions_of_time(*expressions: Any) -> set[sp.Basic]:
    """The functions of time in expressions and matrices, such as q(t)."""
    t = _time()
    every = [part for e in expressions for part in (list(e) if isinstance(e, sp.MatrixBase) else [e])]
    return {part for part in parts_of(*every) if isinstance(part, AppliedUndef) and part.args == (t,)}
