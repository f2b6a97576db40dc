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

from symdyn.tape.differentiate import forward
from symdyn.tape.kernels import Kernel
from symdyn.tape.node import STATE, Node, is_zero
from symdyn.tape.passes import Again
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import reachable
from symdyn.tape.walk import walk

# A line that hangs freely has no horizontal force if its ends are as near to one vertical as this part of its length.
NEAREST = 1e-9
STEPS = 100
# Friction below this is none, so that nothing is divided by zero.
SMOOTH = Fraction(1, 10**12)


@dataclass(frozen=True)
class Catenary(Kernel):
    """(h, v) of (x, z, e, C_B), for sizes (seabed,), 1 where there is one; see the module.

    It fails where x <= 1e-9 unless the line is slack, where z <= 0 over a seabed, and where e or C_B is negative.
    """

    name = "symdyn_catenary"

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
        stacked = np.stack(np.broadcast_arrays(*[np.asarray(v, dtype=float) for v in values]), axis=-1)
        return np.apply_along_axis(lambda row: _solved(math, np.finfo(float).eps, self.sizes[0], *map(float, row)), -1, stacked)

    def precise(self, context: Any, values: Sequence[Any]) -> list[Any]:
        return list(_solved(context, context.eps, self.sizes[0], *values))

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
    """What the changes of h and v are made of (h, v, the four values and their changes), the steps, and the changes.

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


def _solved(context: Any, eps: Any, seabed: int, x: Any, z: Any, e: Any, friction: Any) -> tuple[Any, Any]:
    """h, v with the arithmetic of a context, or NaN twice; eps is its rounding."""
    failed = (math.nan, math.nan)
    if not (e >= 0 and friction >= 0 and abs(x) + abs(z) < 1e100) or (seabed and not z > 0):
        return failed
    if seabed:
        v = 2 * z / (1 + context.sqrt(1 + 2 * e * z))
        if v <= 1 and x <= 1 - v + 4 * eps:
            return x * 0, v
    if not x > NEAREST:
        return failed
    h, v = _start(context, seabed, x, z, e)
    for _ in range(STEPS):
        rests = seabed and v < 1
        s, b = (1 - v, v * 0) if rests else (v * 0, v - 1)
        l, t, a = 1 - s, context.sqrt(h * h + v * v), context.sqrt(h * h + b * b)
        top, foot = t + v if v > 0 else h * h / (t - v), h * h / (a - b) if b < 0 else a + b  # t + v and a + b
        arc = context.log1p(2 * l * top / (h * h + foot * top))  # asinh(v / h) - asinh(b / h) without cancellation
        tense = h / friction if friction * s > h else s
        x_off = s + h * arc + e * (h * (l + tense) - friction * tense * tense / 2) - x
        z_off = l * (v + b) * (1 / (t + a) + e / 2) - z
        x_h, z_h = arc - (v / t - b / a) + e * (l + tense), h / t - h / a
        x_v, z_v = z_h + (e * friction * tense if rests else 0), v / t - b / a + e * l
        determinant = x_h * z_v - x_v * z_h
        if not 0 < determinant < math.inf:
            return failed
        dh, dv = (x_v * z_off - z_v * x_off) / determinant, (z_h * x_off - x_h * z_off) / determinant
        step = 1 if h + dh >= h / 10 else -h * 9 / 10 / dh
        if seabed and v + step * dv < v / 10:
            step = -v * 9 / 10 / dv
        h, v = h + step * dh, v + step * dv
        if abs(dh) <= context.sqrt(eps) * h + 4 * eps and abs(dv) <= context.sqrt(eps) * (h + abs(v)):
            return h, v
    return failed


def _start(context: Any, seabed: int, x: Any, z: Any, e: Any) -> tuple[Any, Any]:
    """Where Newton's method starts: a parabola (Jonkman's rule), a straight line where the ends are far apart, or a stiff line
    that touches the seabed, for which (1 - x) / z = (sqrt(u (u + 2)) - acosh(1 + u)) / u with u = z / h, solved roughly."""
    d = context.sqrt(x * x + z * z)
    flat = context.sqrt(3 * (1 - d * d)) / x if d < 1 else 1 / (x * 0 + 5)
    h, v = x / (2 * flat), (z / context.tanh(flat) + 1) / 2
    if d > 1 and (d - 1) * x > e * h * d and e > 0:
        h, v = (d - 1) * x / (e * d), (d - 1) * z / (e * d) + (x * 0 + 1) / 2
    if seabed and 1 - z < x < 1:
        f = (1 - x) / z
        touching = z * (1 - f) / (f * f * (4.5 - f * (4.2 - 3.6 * f)))
        lifted = context.sqrt(z * (z + 2 * touching))
        if lifted < 1:
            h, v = touching, lifted
    return h, v
