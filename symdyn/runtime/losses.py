"""Losses of a motion: an integral over time and a cost at the end, as expressions or as functions that give their derivatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symdyn.errors import ArgumentError, EvaluationError, UnsupportedExpression
from symdyn.real_numbers import real
from symdyn.runtime.contradicted import contradiction, message
from symdyn.runtime.raised import called
from symdyn.shown import shown

if TYPE_CHECKING:
    import sympy as sp

    from symdyn.given import Scalar
    from symdyn.runtime.module import Module
    from symdyn.tape.node import Node
    from symdyn.tape.tape import Tape

    LossFunction = Callable[[float, np.ndarray, np.ndarray], tuple[float, np.ndarray] | tuple[float, np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Loss:
    """Cost of a motion: the integral of `integral` over time, and `end` at its end.

    Each is an expression of coordinates, speeds, extra states, inputs, parameters, sd.t and entries of outputs, which are called
    "height" or "tip[0]"; or a function of (t, x, p), with x = [q; u; z] and p the parameters in the module's order, that returns
    its value and its derivatives by x (n_x,) and by p (n_p,), of which the last may be left out where it is zero; or None. A
    function sees no inputs; write what depends on them as an expression. Its derivatives are compared with a difference once.

    >>> import symdyn as sd
    >>> angle = sd.coordinates("angle")
    >>> loss = sd.Loss(integral=angle**2, end=10 * angle.dot**2)

    Raises ArgumentError where both are None.
    """

    integral: Scalar | LossFunction | None = None
    end: Scalar | LossFunction | None = None

    def __post_init__(self) -> None:
        if self.integral is None and self.end is None:
            raise ArgumentError("sd.Loss needs an integral, an end, or both: expressions, or functions of (t, x, p)")


class Costs(NamedTuple):
    """Values (n,), and derivatives by x (n, n_x) and by what a gradient is by (n, n_by); None: these are zero."""

    values: np.ndarray
    by_x: np.ndarray
    by: np.ndarray | None


class Surfaces(NamedTuple):
    """Expressions that pass zero where a cost may jump, (n, k), and its derivatives by the time, x and what a gradient is by,
    (n, k, 1 + n_x + n_by)."""

    values: np.ndarray
    slopes: np.ndarray


@dataclass(frozen=True)
class Cost:
    """A function of times (n,), states (n, n_x) and inputs (n, n_in) that gives a cost and its derivatives.

    smooth     whether it is known to have no kink
    surfaces   where it may jump, of the same arguments; None: nowhere, or that is not known
    known      whether all places where it may jump are those
    """

    of: Callable[[np.ndarray, np.ndarray, np.ndarray], Costs]
    smooth: bool
    surfaces: Callable[[np.ndarray, np.ndarray, np.ndarray], Surfaces] | None = None
    known: bool = True

    def __call__(self, t: np.ndarray, x: np.ndarray, inputs: np.ndarray) -> Costs:
        return self.of(t, x, inputs)


# Operations of which expressions have no kink wherever they are defined.
_SMOOTH = frozenset({"leaf", "pi", "neg", "add", "sub", "mul", "div", "sin", "cos", "tan", "exp", "sinh", "cosh", "tanh", "atan"})


def cost_of(module: Module, what: str, given: Any, by: Sequence[str], p: np.ndarray, compared: bool = True) -> Cost:
    """The function of what was given, an expression or a function of the user.

    by         parameters and inputs
    compared   whether the derivatives of a function are compared with a difference, once
    Raises ArgumentError for what is neither an expression of the module's names nor a function.
    """
    if callable(given) and not hasattr(given, "free_symbols"):
        return _of_function(module, what, given, by, p, compared)
    return _of_expression(module, what, given, by, p)


def _of_function(module: Module, what: str, given: Callable[..., Any], by: Sequence[str], p: np.ndarray, compared: bool) -> Cost:
    n_x, n_p = module.metadata.sizes.x, len(p)
    indices = [module.metadata.parameters.index(name) if name in module.metadata.parameters else -1 for name in by]

    def one(t: float, x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        returned = called(given, t, x, f"{module.name}: the function for {what} of the loss", (t, x.copy(), p.copy()))
        try:
            value, by_x, *rest = returned
            by_p = real(rest[0] if rest else np.zeros(n_p))
            result = float(value), real(by_x), np.append(by_p, 0.0)
            if result[1].shape != (n_x,) or by_p.shape != (n_p,) or len(rest) > 1:
                raise ValueError
        except (TypeError, ValueError):
            raise ArgumentError(f"{module.name}: the function for {what} of the loss returned {shown(returned)} at t = {t:.6g}; "
                                f"needed are its value, its derivatives by the {n_x} states and, unless they are zero, by the "
                                f"{n_p} parameters") from None
        return result

    def check(t: float, x: np.ndarray, by_x: np.ndarray, by_p: np.ndarray) -> None:
        name = f"{module.name}: the function for {what} of the loss"
        for by, at, row, value in (("the state", x, by_x, lambda changed: given(t, changed, p.copy())[0]),
                                   ("the parameters", p, by_p, lambda changed: given(t, x.copy(), changed)[0])):
            slopes = contradiction(value, at, row[None, :])
            if slopes is not None:
                raise ArgumentError(message(name, slopes, t, by))

    checked: list[float] = []  # the time at which its derivatives were compared with differences, the first one

    def all_rows(t: np.ndarray, x: np.ndarray, inputs: np.ndarray) -> Costs:
        rows = [one(float(tk), xk) for tk, xk in zip(t, x, strict=True)]
        if compared and not checked and rows:
            checked.append(float(t[0]))
            check(float(t[0]), x[0], rows[0][1], rows[0][2][:n_p])
        return _finite(module, what, t, Costs(np.array([r[0] for r in rows]), np.array([r[1] for r in rows]),
                                              np.array([r[2][indices] for r in rows]).reshape(len(rows), len(by))))

    return Cost(all_rows, smooth=False, known=False)


def _of_expression(module: Module, what: str, given: Any, by: Sequence[str], p: np.ndarray) -> Cost:
    import sympy as sp

    from symdyn.tape.floats import evaluate_rows

    metadata = module.metadata
    try:
        expression = sp.sympify(given, strict=True)
    except (sp.SympifyError, TypeError):
        raise ArgumentError(f"{module.name}: {what} of the loss is {shown(given)}; pass an expression of coordinates, speeds, "
                            "inputs, parameters and sd.t, or a function of (t, x, p) that returns its value and its "
                            "derivatives") from None
    known = output_names(module)
    outputs = _Outputs(module, [k for k, name in enumerate(known) if name in {str(s) for s in expression.free_symbols}], by, p)
    tape, jumping = _differentiated(f"{module.name}: {what} of the loss", expression, metadata.x, metadata.inputs,
                                    metadata.parameters, known, tuple(by), tuple(outputs.names))
    fixed = dict(zip(metadata.parameters, p.tolist(), strict=True))

    def at(t: np.ndarray, x: np.ndarray, inputs: np.ndarray) -> dict[str, Any]:
        return {"t": t, **dict(zip(metadata.x, x.T, strict=True)), **dict(zip(metadata.inputs, inputs.T, strict=True)), **fixed,
                **outputs.values(t, x, inputs)}

    def all_rows(t: np.ndarray, x: np.ndarray, inputs: np.ndarray) -> Costs:
        result = evaluate_rows(tape, at(t, x, inputs), len(t))
        values, rows = result["values"].reshape(len(t)), result["slopes"].reshape(len(t), -1)
        if outputs.names:
            rows = outputs.folded(rows[:, None, :], t, x, inputs)[:, 0, 1:]
        others = rows[:, x.shape[1]:] if rows.shape[1] > x.shape[1] else None
        return _finite(module, what, t, Costs(values, rows[:, :x.shape[1]], others))

    def surfaces(t: np.ndarray, x: np.ndarray, inputs: np.ndarray) -> Surfaces:
        assert jumping is not None
        result = evaluate_rows(jumping, at(t, x, inputs), len(t))
        slopes = result["slopes"]
        if outputs.names:
            slopes = outputs.folded(slopes[:, :, 1:], t, x, inputs) + np.pad(slopes[:, :, :1], (
                (0, 0), (0, 0), (0, x.shape[1] + len(by))))
        return Surfaces(result["surfaces"], slopes)

    return Cost(all_rows, smooth=all(map(_is_smooth, tape.steps)), surfaces=None if jumping is None else surfaces)


def output_names(module: Module) -> tuple[str, ...]:
    """Names of all entries of the outputs: "height" of a number, "tip[0]" and "frame[0,1]" of arrays."""
    return tuple(f"{name}[{','.join(map(str, index))}]" if shape else name
                 for name, shape in module.metadata.outputs for index in product(*map(range, shape)))


class _Outputs:
    """Outputs of a module that an expression holds, by their indices among all entries, with their derivatives from its code."""

    def __init__(self, module: Module, indices: Sequence[int], by: Sequence[str], p: np.ndarray) -> None:
        self.module, self.indices, self.p = module, list(indices), p
        known = output_names(module)
        self.names, self.n_y = [known[k] for k in indices], len(known)
        given = (*module.metadata.inputs, *module.metadata.parameters)
        columns = {name: k for k, name in enumerate(given)}
        self.by = [columns[name] for name in by]

    def values(self, t: np.ndarray, x: np.ndarray, inputs: np.ndarray) -> dict[str, np.ndarray]:
        if not self.names:
            return {}
        rows = self.module.evaluate("outputs", t, x, self.p, inputs).reshape(len(t), -1)
        return dict(zip(self.names, rows[:, self.indices].T, strict=True))

    def folded(self, slopes: np.ndarray, t: np.ndarray, x: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """From slopes (n, k, ...) by the state, by the others and by these outputs to those by the time, which these outputs
        make, by the state and by the others, (n, k, 1 + n_x + n_by)."""
        n = len(t)
        J: Any = self.module.jacobian(t, x, self.p, inputs, ["t", "x", "inputs", "params"], "outputs")
        part = lambda rows: np.asarray(rows).reshape(n, self.n_y, np.shape(rows)[-1])[:, self.indices]
        others = np.concatenate([part(J.inputs), part(J.params)], axis=2)[:, :, self.by]
        along = np.concatenate([np.asarray(J.t).reshape(n, self.n_y, 1)[:, self.indices], part(J.x), others], axis=2)
        result = slopes[:, :, slopes.shape[2] - len(self.indices):] @ along
        result[:, :, 1:] += slopes[:, :, :slopes.shape[2] - len(self.indices)]
        return np.asarray(result)


@lru_cache(maxsize=64)  # an optimizer asks for the gradient of one loss many times
def _differentiated(what: str, expression: sp.Expr, states: Sequence[str], inputs: Sequence[str], parameters: Sequence[str],
                    outputs: Sequence[str], by: Sequence[str], used: Sequence[str]) -> tuple[Tape, Tape | None]:
    """An expression, and its derivatives by the states and, unless these are all zero, by others, and then by the outputs that it
    uses; the surfaces where it may jump with their derivatives, None without one. what: how messages call it."""
    from symdyn.tape import node as kinds
    from symdyn.tape.differentiate import reverse
    from symdyn.tape.jumps import jumps
    from symdyn.tape.node import is_zero
    from symdyn.tape.recorder import Recorder
    from symdyn.tape.sympy_bridge import record_expression
    from symdyn.tape.tape import Tape

    recorder = Recorder()
    names = {"t": kinds.TIME, **dict.fromkeys(states, kinds.STATE), **dict.fromkeys(inputs, kinds.INPUT),
             **dict.fromkeys(parameters, kinds.PARAMETER), **dict.fromkeys(used, kinds.STATE)}
    leaves = {name: recorder.leaf(name, kind) for name, kind in names.items()}
    unknown = sorted(str(s) for s in expression.free_symbols if str(s) not in leaves)
    if unknown:
        raise ArgumentError(f"{what} has {', '.join(unknown)}, which is no state, input or parameter here; there are "
                            f"{', '.join(dict.fromkeys((*names, *outputs)))}"
                            + ("; make what it says of bodies outputs, system.add_output, and name these"
                               if any("(" in name for name in unknown) else ""))
    try:
        value = record_expression(recorder, expression, {s: leaves[str(s)] for s in expression.free_symbols})
    except UnsupportedExpression as error:
        raise ArgumentError(f"{what}: {error}; write it in coordinates and speeds, or pass a function of (t, x, p) that returns "
                            "its value and its derivatives") from None
    slopes = reverse(recorder, value, [leaves[name] for name in (*states, *by, *used)])
    if not used and all(map(is_zero, slopes[len(states):])):
        slopes = slopes[:len(states)]
    costs = Tape.of(recorder, values=np.array([value], dtype=object), slopes=np.array(slopes, dtype=object))
    result = [jump.surface for jump in jumps(recorder, [value])]
    if not result:
        return costs, None
    rows = [reverse(recorder, surface, [leaves[name] for name in ("t", *states, *by, *used)]) for surface in result]
    return costs, Tape.of(recorder, surfaces=np.array(result, dtype=object), slopes=np.array(rows, dtype=object))


def _is_smooth(node: Node) -> bool:
    """Whether an operation has no kink; whole powers have none."""
    from symdyn.tape.node import Node

    if node.op == "pow":
        return not isinstance(node.args[1], Node) and node.args[1] == int(node.args[1])
    return node.op in _SMOOTH


def _finite(module: Module, what: str, t: np.ndarray, costs: Costs) -> Costs:
    """Raises EvaluationError where a value or a derivative is not finite."""
    slope = "has a derivative that is"
    for kind, rows in (("is", costs.values[:, None]), (slope, costs.by_x), (slope, costs.by)):
        if rows is None:
            continue
        bad = ~np.isfinite(rows).all(axis=1)
        if bad.any():
            index = int(bad.argmax())
            wrong = rows[index][~np.isfinite(rows[index])][0]
            raise EvaluationError(f"{module.name}: {what} of the loss {kind} {wrong:g} at t = {t[index]:.6g} s")
    return costs
