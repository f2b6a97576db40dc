"""The tree of a model in numbers: floats, or mpmath's numbers with any digits, so that every recursion runs on them as it is."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import sympy as sp

from symdyn.errors import ArgumentError, EvaluationError, ModelError
from symdyn.formulation.algebra import TapeAlgebra
from symdyn.formulation.loads.measured import Measured
from symdyn.formulation.loads.recorded import Applied, Loads
from symdyn.formulation.textbook.doubles import Doubles
from symdyn.formulation.textbook.rates import Rates, apparent_rates
from symdyn.formulation.textbook.scalars import on_scalars
from symdyn.formulation.textbook.values import taken
from symdyn.formulation.trees.chosen_speeds import algebra_of
from symdyn.formulation.trees.tree import Tree, build
from symdyn.model.record import Model
from symdyn.model.symbols import time
from symdyn.shown import name_of
from symdyn.spatial.vectors import vector
from symdyn.tape.evaluate import evaluate
from symdyn.tape.node import Node
from symdyn.tape.tape import Tape, reachable


@dataclass(frozen=True)
class Numbers:
    """A tree at one state; its algebra stands in for the tape.

    applied   all loads but gravity: a wrench (force, moment about the origin, link axes) for each link, and the forces along
              the joints' speeds
    """

    tree: Tree
    applied: Applied


class NumericTree:
    """The tree of a model, derived once, in numbers at as many states as wanted; `aligned` as for tree.build.

    Constraints and closed loops are no part of a tree.
    """

    def __init__(self, model: Model, aligned: bool = False) -> None:
        self.model = model
        self.algebra = algebra_of(model)
        recorder = self.algebra.recorder
        self.tree = build(model, self.algebra, aligned)
        self.algebra.measured = Measured(self.tree)
        loads = Loads(self.tree)
        if loads.implicit:
            listed = ", ".join(map(str, loads.implicit))
            raise ModelError([f"{listed}: loads that depend on accelerations or reactions, which numbers of a tree at one state "
                              "do not have; use the equations"], model.name)
        self.applied = loads.applied()
        self.rates = apparent_rates(self.tree)
        result: dict[Any, None] = {}
        on_scalars(self._records, result.setdefault)
        entries = [e for e in result if isinstance(e, Node)]
        self.checks = [(node, recorder.checks[node]) for node in reachable(entries) if node in recorder.checks]
        self.nodes = [*entries, *[node for node, _ in self.checks]]
        self._doubles = Doubles(self.nodes)

    def at(self, q: Any = None, u: Any = None, params: Any = None, t: Any = 0, inputs: Any = None, states: Any = None,
           digits: int | None = None) -> Numbers:
        """The tree at coordinates q, speeds u, parameters, time t (s), inputs and extra states.

        Each is a mapping from symbols or names to numbers, or a sequence in the order of the model; what is left out takes the
        model's default or initial value, inputs and states without one zero.
        digits   None for floats; else mpmath's numbers with so many decimal digits
        Raises ArgumentError for values that do not fit, EvaluationError at gimbal lock and the like.
        """
        model = self.model
        extra = [z.symbol for z in model.states]
        resting = {**dict.fromkeys([*model.inputs, *extra], 0), **model.initial}
        values: dict[str, Any] = {}
        for what, symbols, given, known in (
                ("q", model.coordinates, q, model.initial), ("u", model.speeds, u, model.initial), ("t", (time,), [t], {}),
                ("params", model.parameters, params, model.defaults), ("inputs", model.inputs, inputs, resting),
                ("states", extra, states, resting)):
            defaults = {s.name: v for s, v in known.items()}
            values.update(taken(given, [s.name for s in symbols], what, defaults, model.name))
        number = self._numbers(self.nodes, values, digits, self._doubles)
        for node, reason in self.checks:
            if not number(node) > 0:
                raise EvaluationError(f"{model.name}: {reason}")
        tree, applied, rates = on_scalars(self._records, number)
        stand_in: Any = NumericAlgebra(self, values, digits, rates)
        return Numbers(replace(tree, algebra=stand_in), applied)

    def value(self, expression: Any, values: Mapping[str, Any], digits: int | None) -> Any:
        """An expression of the model's symbols as a number, for values by name."""
        e = self.algebra.expression(expression)
        nodes = [e] if isinstance(e, Node) else []
        return self._numbers(nodes, values, digits, Doubles(nodes))(e)

    @property
    def _records(self) -> tuple[Tree, Applied, Rates]:
        return self.tree, self.applied, self.rates

    def _numbers(self, nodes: Sequence[Node], values: Mapping[str, Any], digits: int | None,
                 doubles: Doubles) -> Callable[[Any], Any]:
        """Conversion of these nodes, and of exact numbers, to numbers."""
        convert: Callable[[Any], Any] = float
        if digits is None:
            result = doubles.at(values)
        else:
            with mpmath.workdps(digits + 5):
                values = {name: _big(v) for name, v in values.items()}
            results = evaluate(Tape.of(self.algebra.recorder, nodes=vector(*nodes), one=1), values, digits)
            result, one = list(results["nodes"]), results["one"][()]
            convert = lambda e: one * e.numerator / e.denominator
        known = dict(zip(nodes, result, strict=True))
        return lambda e: known[e] if isinstance(e, Node) else e if isinstance(e, int) else convert(Fraction(e))


class NumericAlgebra:
    """Stands in for the tape in a tree of numbers: names and headings go nowhere."""

    def __init__(self, numeric: NumericTree, values: Mapping[str, Any], digits: int | None, rates: Rates) -> None:
        self.numeric, self.values, self.digits = numeric, values, digits
        self.rounding = float(TapeAlgebra.rounding) if digits is None else 64 * 10.0 ** -digits
        self.apparent_rates = rates

    def section(self, title: str) -> AbstractContextManager[None]:
        return nullcontext()

    def name(self, name: str, value: Any) -> Any:
        return value

    vector = name

    def positive(self, value: Any, reason: str) -> Any:
        """The value. Raises EvaluationError with the reason if it is not positive, as generated code reports it."""
        if not value > 0:
            raise EvaluationError(f"{self.numeric.model.name}: {reason}")
        return value

    def divisor(self, value: Any, least: Any, reason: str) -> Any:
        """The value. Raises EvaluationError with the reason if it is not above `least`."""
        self.positive(value - least, reason)
        return value

    def expression(self, e: Any) -> Any:
        """An expression of the model's symbols as a number."""
        return self.numeric.value(e, self.values, self.digits)

    def constants(self, values: Iterable[Any]) -> np.ndarray:
        return vector(*[self.expression(e) for e in values])

    def matrix(self, values: sp.MatrixBase) -> np.ndarray:
        return self.constants(values).reshape(values.shape)


def numeric_tree(model: Model, values: Mapping[Any, Any], digits: int | None = None) -> Tree:
    """The tree of a model in numbers, once; values: symbol or name -> number, also for t (default 0).

    For several states, and for the loads, make a NumericTree. Raises as NumericTree.at.
    """
    rest = {name_of(key): value for key, value in values.items()}
    groups: dict[str, Any] = {}
    for what, symbols in (("q", model.coordinates), ("u", model.speeds), ("params", model.parameters),
                          ("inputs", model.inputs), ("states", [z.symbol for z in model.states])):
        groups[what] = {s.name: rest.pop(s.name) for s in symbols if s.name in rest}
    t = rest.pop(time.name, 0)
    if rest:
        raise ArgumentError(f"{model.name}: there is no {', '.join(map(repr, rest))}")
    return NumericTree(model).at(**groups, t=t, digits=digits).tree


def _big(value: Any) -> Any:
    """A fraction as mpmath's number, which it does not take over itself."""
    return mpmath.mpf(value.numerator) / value.denominator if isinstance(value, Fraction) else value
