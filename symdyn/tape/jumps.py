"""Surfaces at which expressions may jump, where their signs, conditions and floors change, for the search of chattering."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple

from symdyn.errors import UnsupportedExpression
from symdyn.tape.node import COORDINATE, INPUT, SPEED, STATE, TIME, Node
from symdyn.tape.recorder import Recorder
from symdyn.tape.sympy_bridge import expand
from symdyn.tape.tape import Output, reachable

_MOVING = TIME | COORDINATE | SPEED | STATE | INPUT
_COMPARED = {"lt": "<", "le": "<=", "gt": ">", "ge": ">="}
_BENT = ("abs", "min", "max")
_ROUNDED = {"floor": Fraction(1, 2), "ceil": Fraction(1, 2)}
# Expressions with more operations than this are named by where they stand alone.
_SHORT, _LETTERS = 60, 100


class Jump(NamedTuple):
    """One place where expressions may jump.

    surface   what passes zero there; node: the operation that jumps
    smooth    how the jump can be made smooth, with {s} for the surface
    """

    surface: Any
    node: Node
    smooth: str


def jumps(recorder: Recorder, entries: Sequence[Any]) -> list[Jump]:
    """Jumps of these entries along a motion, each surface once; kinks, of abs, min and max, do not count."""
    result: dict[Any, Jump] = {}
    for node in reachable(entries):
        if not node.mask & _MOVING:
            continue
        if node.op == "sign":
            surface, smooth = node.args[0], "tanh(({s})/eps) in place of sign({s})"
        elif node.op in _COMPARED:
            surface, smooth = recorder.sub(*node.args), "(1 + tanh(({s})/eps))/2 as the weight of the two sides"
        elif node.op == "atan2":  # by a full turn, where the second argument is negative or zero
            surface, smooth = node.args[0], "an angle that does not pass pi"
        elif node.op == "div" and (factor := _direction(node.args[1])) is not None:
            surface, smooth = factor, "sqrt(({s})**2 + eps**2) in the denominator"
        elif node.op in _ROUNDED:
            nearest = recorder.apply("floor", recorder.add(node.args[0], _ROUNDED[node.op]))
            surface, smooth = recorder.sub(node.args[0], nearest), "a smooth step within eps of each whole number"
        else:
            continue
        if isinstance(surface, Node):
            opposite = surface.args[0] if surface.op == "neg" else recorder.neg(surface)
            if surface not in result and opposite not in result:
                result[surface] = Jump(surface, node, smooth)
    return list(result.values())


def breaks(recorder: Recorder, entries: Sequence[Any]) -> list[Any]:
    """Expressions that pass zero along a motion where these entries have a kink or a jump, each surface once."""
    result: dict[Any, None] = {}
    for node in reachable(entries):
        if node.mask & _MOVING and node.op in _BENT:
            result[node.args[0] if node.op == "abs" else recorder.sub(*node.args)] = None
    result |= dict.fromkeys(jump.surface for jump in jumps(recorder, entries))
    return [surface for surface in result if isinstance(surface, Node)]


def _direction(denominator: Any) -> Any:
    """The v of a denominator with |v| or sqrt(v^2) as a factor, by which v/|v| jumps like a sign; None without one."""
    for factor in _factors(denominator):
        if factor.op == "abs":
            return factor.args[0]
        if factor.op == "sqrt" and isinstance(factor.args[0], Node) and factor.args[0].op == "mul":
            first, second = factor.args[0].args
            if first is second:
                return first
    return None


def _factors(value: Any) -> list[Node]:
    if not isinstance(value, Node):
        return []
    return [f for part in value.args for f in _factors(part)] if value.op in ("mul", "neg") else [value]


def description(jump: Jump, symbols: Any) -> dict[str, str]:
    """The jump, its surface, the remedy, and where it stands, as text; symbols: leaf -> the user's symbol."""
    surface = _text(jump.surface, symbols)
    what = "a condition" if jump.node.op in _COMPARED else jump.node.op
    if surface:
        what = f"the condition {surface} {_COMPARED[jump.node.op]} 0" if jump.node.op in _COMPARED else _text(jump.node, symbols)
    return {"what": what, "surface": surface or "its argument", "where": jump.node.section,
            "remedy": jump.smooth.format(s=surface or "x")}


def _text(node: Node, symbols: Any) -> str:
    """The expression, "" if it is long or has no explicit form."""
    if len(reachable([node])) > _SHORT:
        return ""
    try:
        text = str(expand(Output.of("value", node), symbols))
    except (UnsupportedExpression, KeyError):
        return ""
    return text if len(text) <= _LETTERS else ""
