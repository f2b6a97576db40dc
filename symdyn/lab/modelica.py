"""Agreement of Modelica models with the C module: python -m symdyn.lab.modelica

A line a mechanism: the largest and the median difference of the rates of the states at random states from those of the C module,
relative to the largest rate, without stabilization. Models are parsed by pymoca's grammar of Modelica, and their equations are
computed here on rows of states. With --test, Rumoca compiles the test that is written with a model, and simulates it.
"""

from __future__ import annotations

import argparse
import importlib
import operator
import tempfile
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.special import erf

import symdyn as sd
from symdyn.errors import UnsupportedExpression
from symdyn.runtime.module import Module

STATES = 1000
_BINARY: Mapping[str, Callable[..., Any]] = {
    "+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv, "^": operator.pow, "<": operator.lt,
    "<=": operator.le, ">": operator.gt, ">=": operator.ge, "and": np.logical_and, "or": np.logical_or}
_FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    **{name: getattr(np, name) for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "sign", "abs",
                                            "floor", "ceil")},
    **{name: getattr(np, f"arc{name[1:]}") for name in ("asin", "acos", "atan", "atan2")},
    **{f"symdyn_{name}": getattr(np, f"arc{name[1:]}") for name in ("asinh", "acosh", "atanh")}, "symdyn_erf": erf,
    "min": np.minimum, "max": np.maximum, "noEvent": lambda condition: condition}


class Computed:
    """The variables of a parsed model on rows of states: each by its equation, when it is requested.

    known   name -> values of states, inputs, the time, and of parameters that are not at their defaults
    Values that need a numeric algorithm are NaN.
    """

    def __init__(self, parsed: Any, known: Mapping[str, Any]) -> None:
        self.values = dict(known)
        self.definitions: dict[str, Any] = {}
        self.rates: dict[str, Any] = {}
        for name, symbol in parsed.symbols.items():
            given = symbol.class_modification.arguments if symbol.class_modification is not None else ()
            for argument in given:
                if argument.value.component.name == "value":
                    self.definitions[name] = argument.value.modifications[0]
        for equation in parsed.equations:
            if type(equation).__name__ != "Equation":
                continue
            left = equation.left
            if getattr(left, "operator", "") == "der":
                self.rates[left.operands[0].name] = equation.right
            elif not any(index != [None] for index in getattr(left, "indices", [[None]])):
                self.definitions[left.name] = equation.right

    def rate(self, state: str) -> Any:
        """The derivative of a state by time."""
        return self.of(self.rates[state])

    def variable(self, name: str) -> Any:
        """The values of a variable."""
        if name not in self.values:
            self.values[name] = self.of(self.definitions[name])
        return self.values[name]

    def of(self, expression: Any) -> Any:
        """The values of an expression."""
        kind = type(expression).__name__
        if kind == "Primary":
            return expression.value
        if kind == "ComponentRef":
            whole = self.variable(expression.name)
            return whole[int(expression.indices[0][0].value) - 1] if expression.indices != [[None]] else whole
        if kind == "IfExpression":
            return self._chosen(expression)
        word = expression.operator if isinstance(expression.operator, str) else expression.operator.name
        if word in ("zeros", "symdyn_saddle", "symdyn_multipliers"):
            return np.full((int(expression.operands[0].value), 1), np.nan)
        given = [self.of(operand) for operand in expression.operands]
        if word == "not":
            return np.logical_not(given[0])
        if len(given) == 1 and word in ("-", "+"):
            return -given[0] if word == "-" else given[0]
        return (_BINARY.get(word) or _FUNCTIONS[word])(*given)

    def _chosen(self, expression: Any) -> Any:
        result = self.of(expression.expressions[-1])
        for condition, value in zip(reversed(expression.conditions), reversed(expression.expressions[:-1]), strict=True):
            result = np.where(self.of(condition), self.of(value), result)
        return result


def computed(module: Module, text: str, x: np.ndarray, t: Any = 0.0, inputs: Any = ()) -> np.ndarray:
    """The rates of a model at rows of states (n, n_x), without stabilization. Raises pymoca's errors of syntax.

    The names of its variables have to be those of the mechanism.
    """
    parser: Any = importlib.import_module("pymoca.parser")
    parsed = parser.parse(text).classes[text.partition("\nmodel ")[2].split()[0]]
    names = module.metadata.x
    known = {**dict(zip(names, x.T, strict=True)), **dict(zip(module.metadata.inputs, np.asarray(inputs).T, strict=True)),
             "time": t, "baumgarte": 0.0}
    model = Computed(parsed, known)
    with np.errstate(all="ignore"):
        return np.array([np.broadcast_to(model.rate(name), len(x)) for name in names]).T


def compared(module: Module, text: str, states: int = STATES) -> tuple[np.ndarray, int]:
    """Differences of the rates at random states from those of the module, each by its largest entry, and at how many states only
    one of both has a result."""
    metadata = module.metadata
    rng = np.random.default_rng(1)
    start = np.array([metadata.initial.get(n, 0.0) for n in metadata.x])
    t = rng.uniform(0, 2, states)
    x = start + 0.3 * rng.normal(size=(states, len(start)))
    inputs = rng.normal(size=(states, len(metadata.inputs)))
    result = computed(module, text, x, t, inputs)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        wanted = module.evaluate("rhs", t, x, np.array(module.default_parameters), inputs)
    there = np.isfinite(result).all(axis=1), np.isfinite(wanted).all(axis=1)
    both = there[0] & there[1]
    errors = np.abs(result - wanted)[both].max(axis=1) / np.maximum(np.abs(wanted[both]).max(axis=1), 1e-300)
    return errors, int((there[0] != there[1]).sum())


def simulated(text: str, name: str, end: float, dt: float, tolerance: float = 1e-9) -> Any:
    """A motion of a model by Rumoca. Raises its errors, also where an assertion fails."""
    rumoca: Any = importlib.import_module("rumoca")
    config = rumoca.SimConfig(solver="bdf", rtol=tolerance, atol=tolerance)
    return rumoca.Session().loads(text, model=name).simulate((0, end), dt=dt, config=config)


def run(arguments: Sequence[str] | None = None) -> None:
    """Print a line for each mechanism of the catalogue."""
    parser = argparse.ArgumentParser(prog="python -m symdyn.lab.modelica")
    parser.add_argument("--test", action="store_true", help="simulate the written tests by Rumoca: up to minutes each")
    parser.add_argument("names", nargs="*", default=[name for name in sd.systems.names() if not sd.systems.get(name).contacts],
                        help="default: all of the catalogue without rigid contacts, whose impacts are found in Python")
    chosen = parser.parse_args(arguments)
    for name in chosen.names:
        system = sd.systems.get(name)
        module = (system.augmented() if system.loops or system.constraints else system.embedding()).compile(backend="c")
        with tempfile.TemporaryDirectory() as folder:
            try:
                model, test = (path.read_text(encoding="utf-8") for path in module.to_modelica(folder))
            except UnsupportedExpression as error:
                print(f"{name:36} {error}")
                continue
        errors, apart = compared(module, model)
        passed = ""
        if chosen.test:
            simulated(model + test, test.partition("\nmodel ")[2].split()[0], 1e-6, 1e-6)
            passed = "  its test passes"
        print(f"{name:36} largest {errors.max():.1e}  median {np.median(errors):.1e}  states with one result only {apart}"
              f"{passed}", flush=True)


if __name__ == "__main__":
    run()
