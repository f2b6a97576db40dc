"""Where a round shape touches a curve or a surface: an implicit equation, as a function on the tape with exact derivatives.

The curve is y = f(x), the surface z = f(x, y), n its unit normal. A shape with the centre c reaches furthest against n at
c + l(n): a sphere at l = -r n, a disc at the lowest point of its edge, a torus further by its tube. It touches where

    k(s) = s - c - l(n(s)) = 0

in the components along x (and y). Newton's method finds s, with steps that are halved until |k| falls; derivatives follow by the
implicit function theorem, ds = -(dk/ds)^-1 dk. While the shape is more curved than the hollows of the surface, dk/ds is positive
and there is one solution at every c, however far away it is. Else the shape may touch in several places: points all around it
show whether it reaches lower elsewhere, where Newton's method then begins again.

A shape of a compliant contact may be deeper than the surface. From s on, the same method then finds the point that is nearest to
the deepest one of the shape: the two are apart along n, so that the depth is a distance, whose gradient is the normal.

Source: do Carmo, Differential Geometry of Curves and Surfaces, 1976, section 3.5 (parallel surfaces); Nocedal and Wright,
Numerical Optimization, 2nd ed., section 11.2 (a line search for equations).
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import sympy as sp

from symdyn.errors import UnsupportedExpression
from symdyn.model.contacts.grid import Spline
from symdyn.tape.algorithms.states import symdyn_each
from symdyn.tape.differentiate import forward, jacobian
from symdyn.tape.evaluate import Lenient
from symdyn.tape.external import UserFunction
from symdyn.tape.floats import FUNCTIONS
from symdyn.tape.node import STATE, Node
from symdyn.tape.ops import OPERATIONS
from symdyn.tape.passes import Again
from symdyn.tape.recorder import Recorder
from symdyn.tape.sympy_bridge import record_expression
from symdyn.tape.tape import reachable
from symdyn.tape.walk import Arithmetic, walk

# A step of Newton's method below this part of the size is the last one of doubles: the next would be below their rounding.
CLOSE = 1e-9
# Function that its text in C calls.
PART = "symdyn_touching"


@dataclass(frozen=True)
class Implicit:
    """The equations of a touching point.

    unknowns   s along x (and y); known: what they depend on, the centre first
    size       of the shape, m; value: how high its lowest point is above the curve or surface, over the height of the centre
    residual   k; others: other points of the shape, each along x (and y), and its value
    nearest    k of a shape that may be deeper than the surface, the same where it is not; empty of others
    """

    unknowns: tuple[sp.Symbol, ...]
    known: tuple[sp.Symbol, ...]
    size: sp.Expr
    value: sp.Expr
    residual: tuple[sp.Expr, ...]
    others: tuple[tuple[sp.Expr, ...], ...]
    nearest: tuple[sp.Expr, ...] = ()

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "recorded"}  # made again where it is needed

    @cached_property
    def recorded(self) -> Recorded:
        """The same on a tape of its own."""
        recorder, memory = Recorder(), dict[sp.Basic, Any]()
        symbols = (*self.unknowns, *self.known)
        leaves = [recorder.leaf(s.name, STATE) for s in symbols]
        changes = [recorder.leaf(f"d{s.name}", STATE) for s in self.known]
        stands_for = dict(zip(symbols, leaves, strict=True))

        def taken(*expressions: sp.Expr) -> list[Any]:
            return [record_expression(recorder, e, stands_for, memory) for e in expressions]

        n = len(self.unknowns)

        def with_slopes(k: Sequence[sp.Expr]) -> tuple[list[Any], list[Any]]:
            of_k = taken(*k)
            return of_k, jacobian(recorder, of_k, leaves[:n], "forward").ravel().tolist()

        result = [with_slopes(k) for k in (self.residual, self.nearest) if k]
        (residual, slopes), (last, last_slopes) = result[0], result[-1]
        right = forward(recorder, last, dict(zip(leaves[n:], changes, strict=True)))
        return Recorded(leaves, changes, [*residual, *slopes, *taken(self.value)], taken(*[e for p in self.others for e in p]),
                        taken(self.size), _cramer(last_slopes, [-e for e in right]),
                        [*last, *last_slopes, *taken(self.value)] if self.nearest else [])

    @property
    def last(self) -> tuple[sp.Expr, ...]:
        """k at the point that is found."""
        return self.nearest or self.residual


@dataclass(frozen=True)
class Recorded:
    """Leaves of the unknowns and of what is known, and of its changes; then entries, each part by itself: k, dk/ds and the value;
    the other points one after the other; the size; the changes of the unknowns; k, dk/ds and the value of the nearest point."""

    leaves: list[Node]
    changes: list[Node]
    equations: list[Any]
    others: list[Any]
    size: list[Any]
    tangents: list[Any]
    nearest: list[Any]


@dataclass(frozen=True, kw_only=True)
class Touching(UserFunction):
    """s of the centre and of what else the equations depend on; see the module. It fails where there is no such point."""

    implicit: Implicit = field(compare=False)

    given = False

    def rows(self, values: Sequence[Any]) -> np.ndarray:
        result, _ = symdyn_each(lambda at: self._solved(_Doubles(), at, CLOSE), self.results, values)
        return np.moveaxis(np.array(result), 0, -1)

    def precise(self, context: Any, values: Sequence[Any]) -> list[Any]:
        result = self._solved(Lenient.of(context), values, context.sqrt(context.eps))
        return [context.nan] * self.results if result is None else list(result)

    def tangents(self, recorder: Any, values: Sequence[Any], results: Sequence[Any], changes: Sequence[Any]) -> list[Any]:
        r = self.implicit.recorded
        known = dict(zip((*r.leaves, *r.changes), (*results, *values, *changes), strict=True))
        return _walked(Again(recorder), r.tangents, known)

    def slope(self, index: int, k: int, arguments: Sequence[sp.Expr]) -> sp.Expr:
        i = self.implicit
        at = dict(zip((*i.unknowns, *i.known), (*self.applied(arguments), *arguments), strict=True))
        result = _cramer([e.diff(s) for e in i.last for s in i.unknowns], [-e.diff(i.known[k]) for e in i.last])[index]
        return result.xreplace(at)

    def _solved(self, numbers: Arithmetic, values: Sequence[Any], close: Any) -> Any:
        r, n = self.implicit.recorded, self.results

        def part(entries: list[Any]) -> Callable[[Sequence[Any]], list[Any]]:
            return lambda s: _walked(numbers, entries, dict(zip(r.leaves, (*s, *values), strict=True)))

        with np.errstate(all="ignore"):
            return touching_point(part(r.equations), part(r.others), part(r.nearest) if r.nearest else None, list(values[:n]),
                                  part(r.size)(values[:n])[0], close)


def _walked(arithmetic: Arithmetic, entries: Sequence[Any], known: Mapping[Node, Any]) -> list[Any]:
    done = walk([node for node in reachable(entries) if node.op != "leaf"], arithmetic, known)
    return [done.of(e) for e in entries]


class _Doubles(Arithmetic):
    functions = FUNCTIONS

    def number(self, value: Any) -> Any:
        return value if isinstance(value, bool) else float(value)

    def call(self, node: Node, args: list[Any]) -> Any:
        return node.args[0].rows(args)


def _cramer(A: Sequence[Any], b: Sequence[Any]) -> list[Any]:
    """x with A x = b, of one or two unknowns; A row by row."""
    if len(b) == 1:
        return [b[0] / A[0]]
    determinant = A[0] * A[3] - A[1] * A[2]
    return [(A[3] * b[0] - A[1] * b[1]) / determinant, (A[0] * b[1] - A[2] * b[0]) / determinant]


def touching_of(label: str, what: str, implicit: Callable[[Spline | None], Implicit],
                spline: Spline | None) -> tuple[Touching, Spline | None]:
    """The function of a touching point, and the spline that stands with it in one text.

    implicit   gives the equations with the spline
    Raises UnsupportedExpression for a height that has no text.
    """
    first = implicit(spline)
    ours = {"c": _text_in_c(label, first), "numpy": _text_in_python(label, first)}
    if spline is not None:
        ours = {backend: f"{text}\n\n{ours[backend]}" for backend, text in spline.texts}
    texts = tuple(sorted(ours.items()))
    together = None if spline is None else replace(spline, texts=texts, parts=(*spline.parts, PART))
    made = Touching(
        name=f"symdyn_call_{label}", label=label, arguments=tuple(s.name for s in first.known), results=len(first.unknowns),
        texts=texts, derivative=None, cost=300 * len(first.unknowns), numbers=None, digits=touching_point,
        parts=(PART,) if together is None else together.parts,
        reason=f"{what} touches nowhere, or in several places at once: it is wider than a hollow, or lies flat",
        implicit=implicit(together))
    return made, together


# These two functions stand in generated modules as they are.


def touching_from(equations: Any, s: Any, size: Any, close: Any) -> Any:
    """Newton's method from s: (s, value), or None where it does not converge to a point that is lowest."""
    n = len(s)
    *k, value = equations(s)
    for _ in range(50):
        if n == 1:
            step, positive = [-k[0] / k[1]], k[1] > 0
        else:
            determinant = k[2] * k[5] - k[3] * k[4]
            step = [(k[3] * k[1] - k[5] * k[0]) / determinant, (k[4] * k[0] - k[2] * k[1]) / determinant]
            positive = determinant > 0 and k[2] + k[5] > 0
        full = [a + d for a, d in zip(s, step)]
        if max(abs(d) for d in step) <= close * (size + max(abs(a) for a in s)):
            return (full, value) if positive else None
        square, part = sum(a * a for a in k[:n]), 1.0
        while True:
            new = [a + d * part for a, d in zip(s, step)]
            *k, value = equations(new)
            if sum(a * a for a in k[:n]) <= square * (1 - part / 4):
                break
            part = part / 2
            if part < 1e-9:
                return None
        s = new
    return None


def touching_point(equations: Any, others: Any, nearest: Any, s: Any, size: Any, close: Any) -> Any:
    """s where a shape is lowest, from a start, then the nearest point if that is wanted; None where there is no such point."""
    n = len(s)
    best = touching_from(equations, s, size, close)
    for _ in range(4):
        at = s if best is None else best[0]
        listed = others(at)
        points = [listed[i:i + n + 1] for i in range(0, len(listed), n + 1)]
        lowest = min(points, key=lambda point: point[n])
        if best is not None and not lowest[n] < best[1] - 1e-9 * size:
            last = best if nearest is None else touching_from(nearest, best[0], size, close)
            return None if last is None else last[0]
        result = touching_from(equations, lowest[:n], size, close)
        if result is None or (best is not None and not result[1] < best[1]):
            return None
        best = result
    return None


class _Lines(Arithmetic):
    """A tape as lines of text, an assignment for every step; the values are names and numbers."""

    declared, infix, ends = "", {"add": "+", "sub": "-", "mul": "*", "div": "/", "lt": "<", "le": "<=", "gt": ">", "ge": ">=",
                                 "eq": "==", "ne": "!="}, ""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def number(self, value: Any) -> str:
        return repr(float(value)) if value >= 0 else f"({float(value)!r})"

    def step(self, node: Node, args: list[str]) -> str:
        sign = self.infix.get(node.op)
        return self.assigned(f"{args[0]} {sign} {args[1]}" if sign else self.function(node.op, args))

    def item(self, node: Node, results: list[str]) -> str:
        return results[node.args[1]]

    def call(self, node: Node, args: list[str]) -> list[str]:
        intrinsic = node.args[0]
        if not isinstance(intrinsic, Spline):
            called = getattr(intrinsic, "signature", intrinsic.name)
            raise UnsupportedExpression(f"the height calls {called}, which a round shape does not "
                                        "go with; pass a Point, or the height as an expression or a spline")
        n = len(intrinsic.degrees)
        return [self.assigned(self.spline(intrinsic, args[:n], [str(int(float(order))) for order in args[n:]]))]

    def assigned(self, text: str) -> str:
        name = f"w{len(self.lines)}"
        self.lines.append(f"{self.declared}{name} = {text}{self.ends}")
        return name

    def function(self, op: str, args: list[str]) -> str:
        raise NotImplementedError

    def spline(self, spline: Spline, variables: list[str], orders: list[str]) -> str:
        raise NotImplementedError


class _C(_Lines):
    declared, ends = "const double ", ";"
    named = {"abs": "fabs", "min": "fmin", "max": "fmax"}
    written = {"neg": "-{0}", "sign": "({0} > 0) - ({0} < 0)", "and": "{0} > 0 && {1} > 0", "or": "{0} > 0 || {1} > 0",
               "not": "!({0} > 0)", "select": "{0} > 0 ? {1} : {2}", "pi": "3.141592653589793"}

    def number(self, value: Any) -> str:
        return str(int(value)) if isinstance(value, bool) else super().number(value)

    def function(self, op: str, args: list[str]) -> str:
        return self.written[op].format(*args) if op in self.written else f"{self.named.get(op, op)}({', '.join(args)})"

    def spline(self, spline: Spline, variables: list[str], orders: list[str]) -> str:
        return f"{spline.label}_at({', '.join([*variables, *orders])})"


class _Python(_Lines):
    written = {"neg": "-{0}", "pi": "np.pi", "erf": "math.erf({0})"}

    def number(self, value: Any) -> str:
        return repr(value) if isinstance(value, bool) else super().number(value)

    def function(self, op: str, args: list[str]) -> str:
        return self.written[op].format(*args) if op in self.written else f"np.{OPERATIONS[op].numpy}({', '.join(args)})"

    def spline(self, spline: Spline, variables: list[str], orders: list[str]) -> str:
        return spline.in_python(variables, orders)


def _names(i: Implicit) -> list[str]:
    """Names of the unknowns and of the known quantities."""
    return [*[f"s{k}" for k in range(len(i.unknowns))], *[f"p{k}" for k in range(len(i.known))]]


def _text_in_c(label: str, i: Implicit) -> str:
    n, r = len(i.unknowns), i.recorded
    known = dict(zip(r.leaves, _names(i), strict=True))

    def function(name: str, entries: Sequence[Any]) -> list[str]:
        writer, used = _C(), set(reachable(entries))
        left = _walked(writer, entries, known)
        reads = [f"const double {known[leaf]} = {'s' if k < n else 'in'}[{k if k < n else k - n}];"
                 for k, leaf in enumerate(r.leaves) if leaf in used]
        unread = [f"(void){name};" for name, leaves in (("in", r.leaves[n:]), ("s", r.leaves[:n])) if not used & set(leaves)]
        body = [*unread, *reads, *writer.lines, *[f"out[{k}] = {text};" for k, text in enumerate(left)]]
        head = f"static void {name}(const double *in, const double *s, double *out) {{"
        return [head, *[f"    {line}" for line in body], "}", ""]

    nearest = f"{label}_nearest" if r.nearest else "0"
    functions = ", ".join([*(f"{label}_{name}" for name in ("equations", "others", "size")), nearest])
    return "\n".join([
        *function(f"{label}_equations", r.equations), *function(f"{label}_others", r.others), *function(f"{label}_size", r.size),
        *(function(f"{label}_nearest", r.nearest) if r.nearest else []),
        f"static int {label}(const double *in, double *out) {{", f"    double room[{len(r.others)}];",
        f"    const symdyn_shape shape = {{{n}, {len(i.others)}, {functions}, room, {CLOSE!r}}};",
        "    return symdyn_touching(&shape, in, out);", "}"])


def _text_in_python(label: str, i: Implicit) -> str:
    n, r, names = len(i.unknowns), i.recorded, _names(i)
    known = dict(zip(r.leaves, names, strict=True))

    def function(name: str, entries: Sequence[Any]) -> list[str]:
        writer = _Python()
        left = _walked(writer, entries, known)
        body = [f"{', '.join(names[:n])}, = s", *writer.lines, f"return [{', '.join(left)}]"]
        return [f"        def {name}(s):", *[f"            {line}" for line in body], ""]

    functions = [*function("equations", r.equations), *function("others", r.others), *function("size", r.size)]
    functions += function("nearest", r.nearest) if r.nearest else []
    return "\n".join([
        *[line.rstrip().replace(": Any", "").replace(" -> Any", "")
          for f in (touching_from, touching_point) for line in [*inspect.getsource(f).splitlines(), ""]],
        f"def {label}(*values):", *["    import math", ""] * any("math." in line for line in functions),
        f"    results = np.full((len(values[0]), {n}), np.nan)", "    for state, at in enumerate(zip(*values)):",
        f"        {', '.join(names[n:])}, = at", "", *functions,
        f"        start = list(at[:{n}])",
        f"        nearest_ones = {'nearest' if r.nearest else None}",
        f"        found = touching_point(equations, others, nearest_ones, start, size(start)[0], {CLOSE!r})",
        "        if found is not None:", "            results[state] = found",
        f"    return {'results[:, 0]' if n == 1 else 'tuple(results.T)'}"])


def circle_of_points(n: int) -> list[tuple[float, float]]:
    """Cosine and sine of n angles all around."""
    return [(math.cos(2 * math.pi * k / n), math.sin(2 * math.pi * k / n)) for k in range(n)]
