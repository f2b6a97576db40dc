"""Whether the linear equations about a state stay the same along its motion: rest, steady motion, or neither.

Eigenvalues decide about stability where the linear equations are constant: at rest, where nothing depends on time, and along a
motion with constant speeds that leaves them as they are (a top, a wheel that rolls straight). Constancy is checked at positions
further on: accelerations must stay zero there, and the matrices equal. Source: Meirovitch, Methods of Analytical Dynamics,
chapter 6 (perturbation about steady motion); Hagedorn and Hochlenert, Technische Schwingungslehre, chapter 5 (constant and
periodic coefficients).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.integrate

from symdyn.errors import ArgumentError, EvaluationError
from symdyn.runtime.constraints import turning
from symdyn.statics.manifold import (
    Manifold,
    acceleration_size,
    common_partition,
    in_motion,
    natural_length,
    natural_scales,
)
from symdyn.statics.terms import OperatingPoint, rest

# Positions further on: so many radians, or lengths of the mechanism, of the fastest speed; and seconds, where time counts.
FURTHER = (0.41, 1.3, 2.9, 5.3)
LATER = (0.37, 1.7, 7.3)
# Accelerations up to this part of what single loads make, and entries of matrices that differ by this part, are the same.
STILL, SAME = 1e-7, 1e-8
# Rounding, as a part of what a radian or the natural length changes.
ROUNDING = 1e-12
# Error of positions along a motion, per unit of their change.
PRECISE = 1e-12


@dataclass(frozen=True, eq=False)
class Steadiness:
    """Kind of a state: "rest", "steady motion", or "" with the reason why it is neither."""

    kind: str
    reason: str = ""


def steadiness(manifold: Manifold) -> Steadiness:
    """Whether the linear equations of a manifold are constant along the motion through its state."""
    point = manifold.point
    if point.motion_rates:
        name, value = next(iter(point.motion_rates.items()))
        return Steadiness("", f"the input {name} is {value:.4g}: how the motion goes on is not known from one instant; "
                              "write it as an expression in t, or take a coordinate with a prescribed speed in its place")
    moving = accelerating(point, manifold)
    if moving:
        return Steadiness("", moving)
    kind = "steady motion" if point.u.any() else "rest"
    clock = fastest(point)
    try:
        points = further_on(point, manifold)
        for later in points:
            changed = accelerating(later, manifold)
            if changed:
                return Steadiness("", f"further on, at t = {later.t:.4g} s, {changed}: the forces change along the motion")
        partition = common_partition(manifold, points)
        if partition is None:
            return Steadiness("", "no choice of independent coordinates serves along the motion, along which the linear "
                                  "equations change")
        here = Manifold(point, manifold.selection, partition=partition)
        for later in points:
            other = Manifold(later, manifold.selection, partition=partition)
            difference = _difference(here, other, clock)
            if difference:
                return Steadiness("", f"the linear equations change along the motion: {difference} at t = {later.t:.4g} s")
    except (EvaluationError, ArgumentError) as error:
        owner = f"{point.module.name}: "
        return Steadiness("", f"the motion cannot be followed: {str(error).removeprefix(owner)}")
    return Steadiness(kind)


def accelerating(point: OperatingPoint, manifold: Manifold) -> str:
    """The largest acceleration, or rate of an extra state, that is more than rounding of what single loads make; "" if
    none."""
    metadata = point.module.metadata
    names = [*metadata.parameters, *metadata.inputs]
    values = np.concatenate([point.p, point.inputs])
    by = np.abs(point.by(names)) @ np.abs(values)
    acting = by[point.parts["forces"]]
    if point.sizes[3]:
        acting = acting + np.abs(point.evaluate("C_r").T) @ np.abs(point.lam)
    # Where single loads vanish, too, rounding of what a radian, or the natural length, would bring about.
    lengths = natural_scales(point) * natural_length(point)
    acting = acting + ROUNDING / STILL * (np.abs(point.by_v[point.parts["forces"]]) @ lengths)
    level = acceleration_size(point, acting)
    sizes = np.abs(point.ud / natural_scales(point))
    if sizes.max(initial=0.0) > STILL * level:
        k = int(np.argmax(sizes))
        return f"{metadata.u[k]} changes by {point.ud[k]:.4g} a second"
    rates = np.abs(point.rates_z)
    of_z = np.abs(point.by_z[point.parts["z_dot"]])
    allowed = STILL * (by[point.parts["z_dot"]] + of_z @ np.abs(point.z)) + ROUNDING * of_z.sum(axis=1)
    for k in manifold.states:
        if rates[k] > allowed[k]:
            return f"{metadata.z[k]} changes by {point.rates_z[k]:.4g} a second"
    return ""


def further_on(point: OperatingPoint, manifold: Manifold) -> list[OperatingPoint]:
    """The motion with constant speeds and extra states at a few later times, with the accelerations that belong there."""
    timed = depends_on_time(point)
    if not point.u.any() and not timed:
        return []
    rate = fastest(point)
    times = np.array(FURTHER) / rate if rate else np.array(LATER)
    if rate and timed:
        times = np.unique(np.concatenate([times, LATER]))
    n_q = point.sizes[0]

    def rates(t: float, q: np.ndarray) -> np.ndarray:
        x = np.concatenate([q, point.x[n_q:]])
        here = rest(point.module, point.t + t, x, point.p, point.inputs)
        return np.asarray(here.balance[here.parts["q_dot"]])

    result = scipy.integrate.solve_ivp(rates, (0.0, float(times[-1])), point.q, "DOP853", times, rtol=PRECISE, atol=PRECISE)
    points = []
    for t, q in zip(result.t, result.y.T, strict=True):
        x = np.concatenate([q, point.x[n_q:]])
        points.append(in_motion(rest(point.module, point.t + float(t), x, point.p, point.inputs), manifold.selection))
    return points


def fastest(point: OperatingPoint) -> float:
    """The largest speed, lengths by the natural length, 1/s."""
    speeds = np.abs(point.u) / np.where(turning(point.module), 1.0, natural_length(point))
    return float(speeds.max(initial=0.0))


def depends_on_time(point: OperatingPoint) -> bool:
    """Whether t is an argument of the equations."""
    return "t" in point.module.library("balance").metadata.arguments.get("balance", ())


def _difference(a: Manifold, b: Manifold, slowest: float) -> str:
    """The entry of A that differs most between two states, in words; "" if they are the same; slowest: a rate that counts,
    1/s."""
    A, B = a.matrices[0], b.matrices[0]
    # Compared on one footing: metres and radians, and times by the size of the matrix.
    weights = np.sqrt(np.abs(np.diag(a.M)))
    scale = np.ones(len(A))
    if a.n_d == a.n_s:
        scale[:2 * a.n_d] = np.concatenate([weights, weights])
    scale = np.where(scale > 0, scale, 1.0)
    n_d, n_s = a.n_d, a.n_s
    lower = np.abs(A[n_d:n_d + n_s, :n_d] * (scale[n_d:n_d + n_s, None] / scale[:n_d])).max(initial=0.0)
    clock = max(float(np.sqrt(lower)), float(np.abs(A[n_d:, n_d:]).max(initial=0.0)), slowest, 1e-300)
    rates = np.concatenate([np.full(n_d, clock), np.ones(len(A) - n_d)])
    gap = np.abs(B - A) * (scale[:, None] / scale) * (rates[:, None] / rates) / clock
    k = int(np.argmax(gap)) if gap.size else 0
    if not gap.size or gap.ravel()[k] <= SAME:
        return ""
    i, j = np.unravel_index(k, gap.shape)
    names = (*a.labels, *a.speed_labels, *a.state_labels)
    return f"the entry of {names[int(i)]} by {names[int(j)]} is {A[i, j]:.6g} here and {B[i, j]:.6g}"
