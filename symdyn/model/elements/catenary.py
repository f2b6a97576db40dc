"""A hanging elastic line at rest: the force at its upper end, found by Newton's method, with derivatives of any order.

All lengths are over the unstretched length L of the line, all forces over its weight w L. With h, v the horizontal and the
vertical force at the fairlead, b the vertical force at the anchor, s the length that lies on the seabed, t and a the
tensions of both ends of what hangs and e = w L / EA, the fairlead is at

    x = s + h (asinh(v / h) - asinh(b / h)) + e (h (1 - s) + h r - C_B r^2 / 2)
    z = t - a + e (v^2 - b^2) / 2

from the anchor. A line over a seabed has b = max(v - 1, 0), s = max(1 - v, 0), of which friction C_B leaves the length
r = min(s, h / C_B) under tension; any other has b = v - 1, s = 0. A line over a seabed that is longer than what hangs and
what lies is slack: h = 0, and v is the weight of what hangs.
Source: Jonkman, Dynamics Modeling and Loads Analysis of an Offshore Floating Wind Turbine, NREL/TP-500-41958 (2007), quasi-static
mooring lines, its two cases put into one; Irvine, Cable Structures (1981).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from symdyn.model.algorithms.catenary import SYMDYN_CLOSE, SYMDYN_TINY, symdyn_line_force
from symdyn.tape.algorithms.states import symdyn_each
from symdyn.tape.differentiate import forward
from symdyn.tape.intrinsics import Intrinsic
from symdyn.tape.node import STATE, Node, is_zero
from symdyn.tape.passes import Again
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import reachable
from symdyn.tape.walk import walk

# Friction below this is none, so that nothing is divided by zero.
SMOOTH = Fraction(1, 10**12)


@dataclass(frozen=True)
class Catenary(Intrinsic):
    """(h, v) of (x, z, e, C_B), for sizes (seabed,), 1 where there is one; see the module.

    It fails where x <= 1e-9 unless the line is slack, where z <= 0 over a seabed, and where e or C_B is negative.
    """

    name = "symdyn_catenary"
    module = "symdyn.model.algorithms.catenary"
    called_by = "sd.MooringLine"

    @property
    def letters(self) -> tuple[str, ...]:
        return ("h", "v")

    @property
    def n_out(self) -> int:
        return 2

    @property
    def operations(self) -> int:
        return 5 * 70

    def rows(self, values: Sequence[Any]) -> np.ndarray:
        result, _ = symdyn_each(lambda line: symdyn_line_force(math, self.sizes[0], line, SYMDYN_TINY, SYMDYN_CLOSE), 2, values)
        return np.moveaxis(np.array(result), 0, -1)

    def precise(self, context: Any, values: Sequence[Any]) -> list[Any]:
        result = symdyn_line_force(context, self.sizes[0], values, 4 * context.eps, context.sqrt(context.eps))
        return [context.nan] * 2 if result is None else list(result)

    def tangents(self, recorder: Any, values: Sequence[Any], results: Sequence[Any], changes: Sequence[Any]) -> list[Any]:
        leaves, steps, entries = _linearized(bool(self.sizes[0]), not is_zero(values[3]) or not is_zero(changes[3]))
        new = walk(steps, Again(recorder), dict(zip(leaves, [*results, *values, *changes], strict=True)))
        return [new[e] for e in entries]


def potential(recorder: Recorder, seabed: bool, results: Sequence[Any], values: Sequence[Any]) -> Any:
    """Elastic and gravity potential energy over w L^2 of a line without friction, from its ends: h = dU/dx, v = dU/dz.

    It is x h + z v less the complementary energy, the integral of T + e T^2 / 2 over the line, which h and v make stationary.
    Recorded, with its derivatives by x, z and e.
    """
    h, v = results
    x, z, e, _ = values
    sure = _above_zero(recorder, h) if seabed else h
    s, b, t, a = _tensions(recorder, seabed, sure, v)
    arc = recorder.apply("asinh", v / sure) - recorder.apply("asinh", b / sure)
    stretched = h * h + (v * v * v - b * b * b) / 3
    taut = x * h + z * v - (v * t - b * a + h * h * arc) / 2 - h * s - e * stretched / 2
    by_e = -stretched / 2
    if seabed:
        above = recorder.apply("gt", h, 0)
        taut = recorder.apply("select", above, taut, z * v - v * v / 2 - e * v * v * v / 6)
        by_e = recorder.apply("select", above, by_e, -v * v * v / 6)
    if isinstance(taut, Node):
        recorder.slopes[taut] = ((h, x), (v, z), (by_e, e))
    return taut


def _above_zero(recorder: Recorder, h: Any) -> Any:
    """h, or 1 for a slack line, whose other branch then has finite derivatives: they are multiplied by zero."""
    return recorder.apply("select", recorder.apply("gt", h, 0), h, 1)


def _tensions(recorder: Recorder, seabed: bool, h: Any, v: Any) -> tuple[Any, Any, Any, Any]:
    """s, b, t, a"""
    s = recorder.apply("max", 1 - v, 0) if seabed else 0
    b = recorder.apply("max", v - 1, 0) if seabed else v - 1
    return s, b, recorder.sqrt(h * h + v * v), recorder.sqrt(h * h + b * b)


@functools.cache
def _linearized(seabed: bool, rough: bool) -> tuple[list[Node], list[Node], list[Any]]:
    """Terms of the changes of h and v (h, v, the four values and their changes), the steps, and the changes.

    By the implicit function theorem; rough: there is friction.
    """
    r = Recorder()
    leaves = [r.leaf(name, STATE) for name in ("h", "v", "x", "z", "e", "C_B", "dx", "dz", "de", "dC_B")]
    h, v, _, _, e, friction, dx, dz, de, dfriction = leaves
    sure = _above_zero(r, h) if seabed else h
    s, b, t, a = _tensions(r, seabed, sure, v)
    tense = s
    if rough:
        tense = r.apply("min", s, sure / r.apply("max", friction, SMOOTH))
    stretched = sure * (1 - s) + sure * tense - (friction * tense * tense / 2 if rough else 0)
    place = [s + sure * (r.apply("asinh", v / sure) - r.apply("asinh", b / sure)) + e * stretched,
             t - a + e * (v * v - b * b) / 2]
    (x_h, z_h), (x_v, z_v) = (forward(r, place, {force: 1}) for force in (sure, v))
    known = forward(r, place, {e: de, friction: dfriction})
    x_left, z_left = dx - known[0], dz - known[1]
    determinant = x_h * z_v - x_v * z_h
    dh, dv = (z_v * x_left - x_v * z_left) / determinant, (x_h * z_left - z_h * x_left) / determinant
    if seabed:
        taut = r.apply("gt", h, 0)
        dh = r.apply("select", taut, dh, 0)
        dv = r.apply("select", taut, dv, (dz - v * v / 2 * de) / (1 + e * v))
    return leaves, [node for node in reachable([dh, dv]) if node.op != "leaf"], [dh, dv]
