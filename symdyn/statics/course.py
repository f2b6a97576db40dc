"""A motion over one period, held where it is held: states, accelerations and linear equations at equal steps of time.

The linear equations along a periodic motion are periodic, and their values at equal steps give them everywhere by a trigonometric
polynomial, to rounding where the motion is smooth.
Source: Trefethen, Spectral Methods in MATLAB, chapter 3.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.integrate
import scipy.interpolate
import scipy.linalg

from symdyn.errors import ArgumentError, EvaluationError, NoEquilibrium
from symdyn.runtime.consistent import closest
from symdyn.statics.manifold import (
    Manifold,
    common_partition,
    held_indices,
    in_motion,
    natural_length,
    natural_scales,
)
from symdyn.statics.steady import depends_on_time
from symdyn.statics.terms import OperatingPoint, coordinate_names, rest
from symdyn.turning import in_radians

# Numbers of steps that are tried; the highest harmonics must be this part of all.
STEPS, SMOOTH = (16, 32, 64, 128), 1e-11
# Highest harmonics beyond this leave the monodromy matrix open; up to it they count as what is not known of it.
RESOLVED = 1e-5
# Steps of a motion that is not periodic yet.
OPEN_STEPS = 48
# State matrices after a period differ at most by this part of their largest entry, scaled.
REPEATS = 1e-7
# Parts of the period at which forces are compared with those a period later.
LOOKS = (0.13, 0.31, 0.47, 0.71, 0.89)
# Columns of state matrices below this part of the largest: nothing depends on the displacement.
NOTHING = 1e-10
# Error of the motion, per unit; while a closed one is looked for.
PRECISE, ROUGH = 1e-12, 1e-8
# Difference of a periodic motion after its period, relative to the size of its coordinates and speeds, before the last of
# Newton's steps and before the motion is followed precisely; the number of steps, and the largest.
CLOSED, NEARLY, ITERATIONS, LARGEST_STEP = 1e-9, 1e-4, 25, 0.5
# Where the period is searched for: the largest part by which a step changes it, and the factor by which it may leave the guess.
LARGEST_CHANGE, FURTHEST = 0.2, 5.0
# Flow in natural units, by the period, that is rest.
NO_MOTION = 1e-6
# Logarithm of the change of volumes in the space of states over a period that is none.
KEPT = 1e-6


@dataclass(frozen=True, eq=False)
class Course:
    """A motion over one period, from its first state on.

    nodes     manifolds at equal steps of time, the last before the end; last: the state there
    closed    whether it comes back; bundled: whether its variables are all changes [v; u'; z'], since no choice of independent
              ones serves everywhere, or those that the nodes have in common
    """

    period: float
    nodes: tuple[Manifold, ...]
    last: OperatingPoint
    closed: bool = True
    bundled: bool = False

    @property
    def first(self) -> Manifold:
        return self.nodes[0]

    @property
    def times(self) -> np.ndarray:
        """From the start, s, (n,)."""
        return self.period * np.arange(len(self.nodes)) / len(self.nodes)

    @cached_property
    def A(self) -> np.ndarray:
        """State matrices, (n, m, m)."""
        return np.array([self.matrix(node) for node in self.nodes])

    def matrix(self, node: Manifold) -> np.ndarray:
        """The state matrix of a node in the variables of the course, (m, m)."""
        return node.bundle[2] if self.bundled else node.matrices[0]

    @cached_property
    def after(self) -> np.ndarray:
        """The state matrix at the end of the period, (m, m)."""
        partition = None if self.bundled else self.first.partition
        return self.matrix(Manifold(self.last, self.first.selection, partition=partition))

    def reduced(self, X: np.ndarray) -> np.ndarray:
        """A matrix of the variables of the course that leads from the manifold at the start back there, in its own variables."""
        if not self.bundled:
            return X
        T, L, _ = self.first.bundle
        return np.asarray(L @ X @ T)

    def widened(self, x: np.ndarray) -> np.ndarray:
        """A change of the state at the start in the variables of the course."""
        return np.asarray(self.first.bundle[0] @ x) if self.bundled else x

    def displaced(self, node: Manifold) -> np.ndarray:
        """v of the displacements among the variables, (n_u, n)."""
        return np.eye(len(node.Z_v)) if self.bundled else node.Z_v

    @property
    def sizes(self) -> tuple[int, int, int]:
        """Numbers of displacements, speeds and extra states among the variables."""
        first = self.first
        n_u = first.point.sizes[1]
        return (n_u, n_u, len(first.states)) if self.bundled else (first.n_d, first.n_s, len(first.states))

    @cached_property
    def harmonics(self) -> np.ndarray:
        """Coefficients of A by multiples of the frequency, (n, m, m) complex, in the order of numpy.fft."""
        return np.asarray(np.fft.fft(self.A, axis=0) / len(self.nodes))

    @cached_property
    def tail(self) -> float:
        """Size of the highest harmonics of A relative to its largest entry, scaled: what the steps leave open."""
        n = len(self.nodes)
        scale = scales(self)
        sizes = (np.abs(self.harmonics) * (scale / scale[:, None])).reshape(n, -1).max(axis=1)
        high = np.abs(np.fft.fftfreq(n, 1 / n)) > 3 * n / 8
        return float(sizes[high].max(initial=0.0) / sizes.max(initial=1e-300))

    def rate(self) -> np.ndarray:
        """dA/dt at the nodes, (n, m, m)."""
        n = len(self.nodes)
        k = np.fft.fftfreq(n, 1 / n)
        k[np.abs(k) == n / 2] = 0.0
        factors = (2j * np.pi / self.period * k)[:, None, None]
        return np.asarray(np.real(np.fft.ifft(factors * self.harmonics * n, axis=0)))

    def sampled(self, times: np.ndarray) -> np.ndarray:
        """A at times from the start, (n_t, m, m): by a trigonometric polynomial, or splines where the motion is not closed."""
        n, shape = len(self.nodes), self.A.shape[1:]
        if not self.closed:
            knots = np.append(self.times, self.period)
            return np.asarray(scipy.interpolate.CubicSpline(knots, np.concatenate([self.A, self.after[None]]))(times))
        k = np.fft.fftfreq(n, 1 / n)
        half = k >= 0
        weights = np.where((k[half] == 0) | (k[half] == n / 2), 1.0, 2.0)
        angles = 2 * np.pi / self.period * np.outer(times, k[half])
        coefficients = self.harmonics[half].reshape(int(half.sum()), -1)
        result = (weights * np.cos(angles)) @ coefficients.real - (weights * np.sin(angles)) @ coefficients.imag
        return np.asarray(result.reshape(len(times), *shape))


def scales(course: Course) -> np.ndarray:
    """Powers of two that make the entries of all A alike, (m,)."""
    mean = np.abs(course.A).mean(axis=0)
    sizes = course.widened(_sizes(course))
    sizes = np.where(np.abs(sizes) > 0, np.abs(sizes), 1.0)
    natural = mean / sizes[:, None] * sizes
    mean[natural <= NOTHING * 1e-3 * natural.max(initial=0.0)] = 0.0  # rounding in place of zeros would be scaled up
    _, (scale, _) = scipy.linalg.matrix_balance(mean, permute=False, separate=True)
    return np.asarray(scale)


def follow(start: Manifold, period: float, closed: bool = True, precise: float = PRECISE) -> Course:
    """The course through the state of a manifold; with as many steps as its linear equations need.

    closed   whether these must be the same after a period: raises ArgumentError if they are not
    precise  relative error of the motion
    """
    point = start.point
    result: Course | None = None
    motion = _motion(point, start, period, precise)
    partition: tuple[list[int], list[int]] | None = None
    points: list[OperatingPoint] = []
    nodes: tuple[Manifold, ...] = ()
    for n in STEPS if closed else (OPEN_STEPS,):
        # Every second position is one of those before.
        points = [points[k // 2] if points and k % 2 == 0 else motion(period * k / n) for k in range(n)]
        if not nodes:
            partition = common_partition(start, points[1::max(1, n // 16)])
        try:
            nodes = _nodes(start, points, partition, nodes)
        except ArgumentError:  # the choice fails between the positions that it was compared at
            if partition is None:
                raise
            partition = None
            nodes = _nodes(start, points, None, ())
        result = Course(period, nodes, motion(period), closed, partition is None)
        if result.tail <= SMOOTH:
            break
    assert result is not None
    if closed:
        scale = scales(result)
        into = scale / scale[:, None]
        gap = np.abs(result.after - result.A[0]) * into
        if gap.max(initial=0.0) > REPEATS * (np.abs(result.A) * into).max(initial=0.0):
            i, j = np.unravel_index(int(np.argmax(gap)), gap.shape)
            raise ArgumentError(f"{point.module.name}: the linear equations do not repeat after {period:.6g} s: the entry "
                                f"[{i}, {j}] of A is {result.A[0][i, j]:.6g} at the start and {result.after[i, j]:.6g} then; "
                                "pass the period of the motion as period=...")
    if closed:
        _demand_repetition(result)
    if closed and result.tail > RESOLVED:
        raise ArgumentError(f"{point.module.name}: the linear equations along the motion are not smooth: {STEPS[-1]} steps a "
                            f"period "
                            "do not resolve them; loads with kinks (tables, Piecewise) have no monodromy matrix of this kind")
    return result


def _nodes(start: Manifold, points: Sequence[OperatingPoint], partition: tuple[list[int], list[int]] | None,
           before: Sequence[Manifold]) -> tuple[Manifold, ...]:
    """Manifolds at positions along a motion; `before`: those at every second one, () if none."""
    return tuple(before[k // 2] if before and k % 2 == 0 else
                 Manifold(each, start.selection, partition=partition or (None if k else start.partition))
                 for k, each in enumerate(points))


def _motion(point: OperatingPoint, manifold: Manifold, period: float, precise: float) -> Callable[[float], OperatingPoint]:
    """The motion from a point on as a function of the time since."""
    selection, module = manifold.selection, point.module
    n_q, n_u, *_ = point.sizes
    states = [n_q + n_u + k for k in manifold.states]

    held = _held_rates(point, selection.held)
    free = [k for k in range(n_u) if k not in set(held or ())]

    def rates(t: float, x: np.ndarray) -> np.ndarray:
        if not selection.held:
            return np.asarray(module.rhs(point.t + t, x, point.p, point.inputs))
        here = rest(module, point.t + t, x, point.p, point.inputs)
        result = np.zeros(len(x))
        if held is None:
            result[n_q:n_q + n_u] = in_motion(here, selection).ud
        else:  # forces along what is held are taken up, and it goes on as it moves
            result[n_q:][free] = np.linalg.solve(here.M[np.ix_(free, free)], -here.forces[free])
        result[:n_q] = here.balance[here.parts["q_dot"]]
        result[states] = here.rates_z[manifold.states]
        return result

    size = np.maximum(np.abs(point.x), 1.0)
    result = scipy.integrate.solve_ivp(rates, (0.0, period), point.x, "DOP853", dense_output=True, rtol=precise,
                                       atol=precise * size)
    if not result.success:
        raise NoEquilibrium(f"{module.name}: the motion cannot be followed over its period: {result.message}")

    def at(t: float) -> OperatingPoint:
        return in_motion(point.at(t=point.t + t, x=result.sol(t) if t else point.x), selection)

    return at


def _held_rates(point: OperatingPoint, held: Sequence[str]) -> list[int] | None:
    """Indices of the speeds that are held, if each of them is the rate of a coordinate and nothing else is constrained."""
    metadata = point.module.metadata
    labels = coordinate_names(metadata)
    result = []
    for name in held:
        indices = [k for k, (label, u) in enumerate(zip(labels, metadata.u, strict=True)) if name in (label, u)
                   and label in metadata.q]
        if point.sizes[3] or not (indices or name in metadata.z):
            return None
        result += indices
    return result


def closed_course(start: Manifold, period: float, monodromy: Callable[[Course], np.ndarray],
                  open_course: Course | None = None) -> Course:
    """The periodic motion near a state, by shooting with the monodromy matrix. Raises NoEquilibrium where there is none near.

    period        that of the motion, s; where nothing but the motion itself sets the time, a guess: a limit cycle has the period
                  that it has. Where volumes in the space of states stay the same (no damping), a motion of each period may be
                  near, and that of this period is searched for first
    open_course   the precise motion from the state on, where it is there already
    Displacements on which nothing depends (the way along a straight track) need not come back.
    Source: Seydel, Practical Bifurcation and Stability Analysis, section 7.1 (phase condition: 7.1.2).
    """
    precise = ROUGH if open_course is None else PRECISE
    course = follow(start, period, closed=False, precise=precise) if open_course is None else open_course
    if not autonomous(start):
        return _shot(course, monodromy, precise, free=False)
    change = 0.0 if course.bundled else period * float(np.mean(np.trace(course.A, axis1=1, axis2=2)))
    first = abs(change) > KEPT
    try:
        return _shot(course, monodromy, precise, free=first)
    except NoEquilibrium:
        if first:
            raise
        return _shot(course, monodromy, precise, free=True)


def autonomous(manifold: Manifold) -> bool:
    """Whether nothing but the motion itself sets the time: t does not appear in the equations, and what is held stands still."""
    point = manifold.point
    if depends_on_time(point):
        return False
    coordinates, speeds = held_indices(point, manifold.selection)
    return not (point.balance[point.parts["q_dot"]][coordinates].any() or point.u[speeds].any())


def _shot(course: Course, monodromy: Callable[[Course], np.ndarray], precise: float, free: bool) -> Course:
    """Newton's method for the state that comes back, from a motion that is known to `precise`.

    free   the period is an unknown, too, and the change of the state orthogonal to the flow at the start, in natural units: of
           the states along a closed motion, which all come back, the nearest one is found
    """
    manifold, period, guess = course.first, course.period, course.period
    owner = manifold.point.module.name
    try:
        for step in range(ITERATIONS):
            course = course if not step else follow(manifold, period, closed=False, precise=precise)
            residual = _left_open(course)
            scale = _sizes(course)
            counted = np.flatnonzero(~_cyclic(course))
            left = float((np.abs(residual) / scale)[counted].max(initial=0.0))
            if not step and precise == ROUGH and left <= NEARLY:  # perhaps closed already: not to be moved then
                precise = PRECISE
                residual = _left_open(follow(manifold, period, closed=False, precise=precise))
                left = float((np.abs(residual) / scale)[counted].max(initial=0.0))
            J = (monodromy(course) - np.eye(len(residual)))[np.ix_(counted, counted)]
            change = np.zeros(len(residual))
            inner = scale[counted]
            J, right = J * inner / inner[:, None], residual[counted] / inner
            if free:  # columns: states and period; the last row is the phase condition
                before, after = (period * _flow(course.first, point)[counted] / inner
                                 for point in (course.first.point, course.last))
                J, right = np.block([[J, after[:, None]], [before, 0.0]]), np.append(right, 0.0)
            newton = -np.linalg.lstsq(J, right, rcond=1e-9)[0]
            change[counted] = inner * newton[:len(counted)]
            longer = float(newton[-1]) if free else 0.0
            largest = max(float(np.abs(change[:course.first.n_d] / scale[:course.first.n_d]).max(initial=0.0)),
                          abs(longer) * LARGEST_STEP / LARGEST_CHANGE)
            if left <= CLOSED and precise == PRECISE:
                if free and np.abs(before).max(initial=0.0) <= NO_MOTION:
                    raise NoEquilibrium(f"{owner}: no periodic motion found near the start: the search ended at a state of rest; "
                                        "begin nearer to the motion, with at=..., or with another period=...")
                return follow(_shifted(course.first, change), period * (1 + longer)) if step else follow(manifold, period)
            precise = PRECISE if left <= NEARLY else ROUGH
            part = min(1.0, LARGEST_STEP / largest) if largest else 1.0
            manifold, period = _shifted(course.first, change * part), period * (1 + longer * part)
            if not guess / FURTHEST < period < guess * FURTHEST:
                raise NoEquilibrium(f"{owner}: no periodic motion found near the start: the search for the period left the guess "
                                    f"of {guess:.6g} s for {period:.6g} s; begin elsewhere, with at=..., or another period=...")
    except EvaluationError as error:
        raise NoEquilibrium(f"{owner}: no periodic motion found near the start: "
                            f"{str(error).removeprefix(f'{owner}: ')}") from error
    k = int(np.argmax(np.abs(residual)))
    names = (*course.first.labels, *course.first.speed_labels, *course.first.state_labels)
    raise NoEquilibrium(f"{owner}: no periodic motion of {period:.6g} s found near the start: after {ITERATIONS} steps "
                        f"{names[k]} "
                        f"differs by {residual[k]:.3g} after a period; begin elsewhere, with at=..., or check the period")


def _demand_repetition(course: Course) -> None:
    """Raises ArgumentError where forces that depend on time are others a period later, at the same positions."""
    if not depends_on_time(course.first.point):
        return
    owner, n = course.first.point.module.name, len(course.nodes)
    for k in sorted({int(part * n) for part in LOOKS}):
        node = course.nodes[k]
        later = in_motion(node.point.at(t=node.point.t + course.period), node.selection)
        sizes = natural_scales(later) * (2 * np.pi / course.period) ** 2
        gap = np.abs(later.ud - node.point.ud) / np.maximum(np.abs(node.point.ud), sizes)
        other = Manifold(later, node.selection, partition=node.partition).matrices[0]
        mine = node.matrices[0]
        if (gap > REPEATS).any() or np.abs(other - mine).max(initial=0.0) > REPEATS * np.abs(mine).max(initial=0.0):
            raise ArgumentError(f"{owner}: the linear equations do not repeat after {course.period:.6g} s: forces at t = "
                                f"{node.point.t:.4g} s and at t = {later.t:.4g} s differ at the same position; pass the period "
                                "of the motion as period=...")


def comes_back(course: Course) -> bool:
    """Whether the motion is where it was after the period, but for displacements on which nothing depends."""
    left, scale = _left_open(course), _sizes(course)
    counted = ~_cyclic(course)
    return bool((np.abs(left[counted]) <= 100 * CLOSED * scale[counted]).all())


def _flow(manifold: Manifold, point: OperatingPoint) -> np.ndarray:
    """Rates of the coordinates of a manifold along the motion at a state, (m,)."""
    return np.concatenate([point.u[manifold.displacements], point.ud[manifold.speeds], point.rates_z[manifold.states]])


def _cyclic(course: Course) -> np.ndarray:
    """Mask of the coordinates of the manifold that are displacements on which nothing depends, (m,)."""
    scale = _sizes(course)
    T = course.widened(np.eye(len(scale)))
    wide = np.abs(T) @ scale if course.bundled else scale
    columns = np.abs((course.A @ T) / wide[:, None] * scale).max(axis=0).max(axis=0)
    result = columns <= NOTHING * columns.max(initial=0.0)
    result[course.first.n_d:] = False
    return np.asarray(result)


def _left_open(course: Course) -> np.ndarray:
    """The change of the state over a period in the coordinates of the manifold, whole turns left out, (m,)."""
    manifold, before, after = course.first, course.first.point, course.last
    metadata = before.module.metadata
    gap = after.q - before.q
    for k, name in enumerate(metadata.q):
        if in_radians(metadata.units.get(name)):
            gap[k] = np.remainder(gap[k] + np.pi, 2 * np.pi) - np.pi
    for group in metadata.unit_groups:
        indices = [metadata.q.index(n) for n in group]
        if after.q[indices] @ before.q[indices] < 0:
            gap[indices] = -after.q[indices] - before.q[indices]
    v = np.linalg.lstsq(before.N, gap, rcond=None)[0]
    return np.concatenate([v[manifold.displacements], (after.u - before.u)[manifold.speeds],
                           (after.z - before.z)[manifold.states]])


def _sizes(course: Course) -> np.ndarray:
    """References for changes of the coordinates of the manifold: 1 rad or the natural length, by the period, (m,)."""
    manifold = course.first
    sizes = natural_scales(manifold.point) * natural_length(manifold.point)
    return np.concatenate([sizes[manifold.displacements], sizes[manifold.speeds] * 2 * np.pi / course.period,
                           np.maximum(np.abs(manifold.point.z[manifold.states]), 1.0)])


def _shifted(manifold: Manifold, change: np.ndarray) -> Manifold:
    """The manifold at a state moved along its coordinates, back on the constraints."""
    point = manifold.point
    n_q = point.sizes[0]
    along = manifold.tangent() @ change
    v = manifold.Z_v @ change[:manifold.n_d]
    x = point.x + along
    x[:n_q] = point.moved(v)
    if point.sizes[3]:
        x = closest(point.bound, point.t, x, point.p)
    moved = in_motion(point.at(x=x), manifold.selection)
    return Manifold(moved, manifold.selection, partition=manifold.partition)
