"""Laws of rigid contact at one instant: which contacts open, stick or slide, with which accelerations; and what an impact does.

Both are the same problem: relative velocities (of an impact) or accelerations w = b + D lam, with lam_N >= 0, w_N >= 0 and
lam_N w_N = 0 in every contact, and friction within Coulomb's cone. It is solved exactly: each combination of modes is a system of
linear equations, whose solution counts where it fulfils the inequalities. So all solutions are found, none or several as well
(Painleve). Beyond MOST_COMBINATIONS, and in space, where directions of slip are unknowns as well, the first one found counts.

Source: Pfeiffer and Glocker, Multibody Dynamics with Unilateral Contacts, 1996, chapters 5, 8 (impacts: Newton's and Poisson's
law); Glocker, Set-Valued Force Laws, 2001.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, product

import numpy as np

OPEN, STICKING, SLIDING = "open", "sticking", "sliding"
# Inequalities hold to this part of the sizes of what stands in them.
NOISE = 1e-9
# Combinations of modes that are all tried, and that are tried at most.
MOST_COMBINATIONS, MOST_TRIED = 1024, 200_000
# Accelerations that differ by more than this part of their size are different solutions.
DIFFERENT = 1e-6
# Singular values below this part of the largest: rows that depend on each other.
DEPENDENT = 1e-10
# Directions that are tried first where a contact in space begins to slide.
DIRECTIONS = 48


@dataclass(frozen=True)
class Site:
    """One contact of a problem.

    rows       places of its normal row and its tangential ones
    static, kinetic   coefficients of friction
    slip       unit vector of the slip that it has; None: it does not slip, and may stick or begin to slide
    least      a normal force that acts in every case: the impulse of expansion
    excluded   modes that are ruled out
    """

    rows: tuple[int, ...]
    static: float
    kinetic: float
    slip: np.ndarray | None = None
    least: float = 0.0
    excluded: tuple[str, ...] = ()


@dataclass(frozen=True)
class Mode:
    """What one contact does: OPEN, STICKING or SLIDING, the direction of its slip, whether its normal row holds."""

    kind: str
    direction: np.ndarray
    held: bool


@dataclass(frozen=True)
class Solved:
    """A solution: the mode of each contact, forces lam (n,) and what comes of them, w (n,); shared: whether the rows that hold
    depend on each other, so that lam is the one of least norm."""

    modes: tuple[Mode, ...]
    lam: np.ndarray
    w: np.ndarray
    shared: bool


def solutions(D: np.ndarray, b: np.ndarray, sites: Sequence[Site]) -> list[Solved]:
    """Solutions that differ in w, the one with the smallest forces first; all of them up to MOST_COMBINATIONS."""
    options = [list(_options(site)) for site in sites]
    planar = all(len(site.rows) < 3 for site in sites)
    few = planar and np.prod([float(len(o)) for o in options]) <= MOST_COMBINATIONS
    found: list[Solved] = []
    for modes in islice(product(*options), MOST_TRIED):
        one = _solved(D, b, sites, modes)
        if one is None:
            continue
        size = max(np.abs(one.w).max(initial=0.0), np.abs(b).max(initial=0.0))
        if all(np.abs(one.w - other.w).max(initial=0.0) > DIFFERENT * size for other in found):
            found.append(one)
        if not few:
            break
    return sorted(found, key=lambda one: float(np.abs(one.lam).sum()))


def impact(D: np.ndarray, v: np.ndarray, restitution: Sequence[float], sites: Sequence[Site], law: str) -> list[Solved]:
    """What an impact does: lam are the impulses, w the velocities after it; v: before it.

    restitution   of each site; law: "newton" or "poisson"
    """
    normal = [site.rows[0] for site in sites]
    e = np.array(restitution)
    if law == "newton":
        back = np.zeros(len(v))
        back[normal] = e * np.minimum(v[normal], 0.0)
        return [Solved(one.modes, one.lam, one.w - back, one.shared) for one in solutions(D, v + back, sites)]
    pressed = solutions(D, v, sites)
    found = []
    for one in pressed:
        least = e * one.lam[normal]
        after = [Site(s.rows, s.static, s.kinetic, None, float(p)) for s, p in zip(sites, least, strict=True)]
        found += [Solved(two.modes, one.lam + two.lam, two.w, two.shared) for two in solutions(D, one.w, after)]
    return found


def _options(site: Site) -> Iterator[Mode]:
    """Modes of a contact, the preferred ones first."""
    n = len(site.rows) - 1
    still = np.zeros(n)
    for held in (True, False):
        if not held and site.least == 0:
            continue
        if n == 0 or site.slip is not None:
            if SLIDING not in site.excluded:
                yield Mode(SLIDING, still if site.slip is None else site.slip, held)
            continue
        if STICKING not in site.excluded:
            yield Mode(STICKING, still, held)
        if SLIDING not in site.excluded:
            for sign in (1.0, -1.0) if n == 1 else (0.0,):  # in space the direction is an unknown
                yield Mode(SLIDING, np.full(n, sign), held)
    if site.least == 0 and OPEN not in site.excluded:
        yield Mode(OPEN, still, False)


def _solved(D: np.ndarray, b: np.ndarray, sites: Sequence[Site], modes: tuple[Mode, ...]) -> Solved | None:
    """The solution of one combination of modes; None where it breaks an inequality."""
    unknown = [k for k, (s, m) in enumerate(zip(sites, modes, strict=True))
               if len(s.rows) == 3 and m.kind == SLIDING and not m.direction.any()]
    if unknown:
        directed = _directed(D, b, sites, modes, unknown)
        if directed is None:
            return None
        modes = directed
    lam, w, exact, shared = _linear(D, b, sites, modes)
    size = max(np.abs(b).max(initial=0.0), 1e-300)
    force = max(np.abs(lam).max(initial=0.0), size / max(np.diag(D).max(initial=0.0), 1e-300))
    if not exact:
        return None
    for site, mode in zip(sites, modes, strict=True):
        k, tangents = site.rows[0], list(site.rows[1:])
        if mode.held and lam[k] < site.least - NOISE * force:
            return None
        if not mode.held and w[k] < -NOISE * size:
            return None
        if mode.kind == STICKING and np.linalg.norm(lam[tangents]) > site.static * lam[k] + NOISE * force:
            return None
        if mode.kind == SLIDING and site.slip is None and tangents and w[tangents] @ mode.direction < -NOISE * size:
            return None
    return Solved(modes, lam, w, shared)


def _linear(D: np.ndarray, b: np.ndarray, sites: Sequence[Site],
            modes: Sequence[Mode]) -> tuple[np.ndarray, np.ndarray, bool, bool]:
    """lam and w of given modes, whether the rows that hold do hold, and whether they depend on each other."""
    n = len(b)
    H, fixed, active = np.zeros((n, n)), np.zeros(n), []
    for site, mode in zip(sites, modes, strict=True):
        k, tangents = site.rows[0], list(site.rows[1:])
        column = np.zeros(n)
        column[k] = 1.0
        if mode.kind == SLIDING and tangents:
            column[tangents] = -site.kinetic * mode.direction
        if mode.held:
            active.append(k)
            H[:, k] = column
        elif site.least:
            fixed += site.least * column
        if mode.kind == STICKING:
            active += tangents
            H[tangents, tangents] = 1.0
    x, exact, shared = np.zeros(n), True, False
    if active:
        A, right = (D @ H)[np.ix_(active, active)], -(b + D @ fixed)[active]
        x[active], _, rank, _ = np.linalg.lstsq(A, right, rcond=DEPENDENT)
        shared = bool(rank < len(active))
        left = np.abs(A @ x[active] - right).max()
        exact = bool(left <= NOISE * max(np.abs(right).max(), np.abs(b).max()))
    lam = H @ x + fixed
    w = b + D @ lam
    if exact:
        w[active] = 0.0
    return lam, w, exact, shared


def _directed(D: np.ndarray, b: np.ndarray, sites: Sequence[Site], modes: tuple[Mode, ...],
              unknown: Sequence[int]) -> tuple[Mode, ...] | None:
    """The modes with the directions in which contacts in space begin to slide: along w_T, one after the other until all fit."""
    chosen = list(modes)
    for k in unknown:
        w = _linear(D, b, sites, [Mode(OPEN, m.direction, m.held) if j in unknown else m for j, m in enumerate(chosen)])[1]
        start = w[list(sites[k].rows[1:])]
        size = np.linalg.norm(start)
        chosen[k] = Mode(SLIDING, start / size if size else np.array([1.0, 0.0]), modes[k].held)
    for _ in range(100):
        before = [chosen[k].direction for k in unknown]
        for k in unknown:
            found = _direction(D, b, sites, chosen, k)
            if found is None:
                return None
            chosen[k] = Mode(SLIDING, found, chosen[k].held)
        if all(np.abs(chosen[k].direction - old).max() < 1e-14 for k, old in zip(unknown, before, strict=True)):
            break
    return tuple(chosen)


def _direction(D: np.ndarray, b: np.ndarray, sites: Sequence[Site], modes: Sequence[Mode], k: int) -> np.ndarray | None:
    """The direction d of one contact with w_T along d; None where there is none."""
    from scipy.optimize import brentq

    tangents = list(sites[k].rows[1:])

    def across(angle: float) -> tuple[float, float]:
        d = np.array([np.cos(angle), np.sin(angle)])
        trial = [Mode(SLIDING, d, m.held) if j == k else m for j, m in enumerate(modes)]
        w = _linear(D, b, sites, trial)[1][tangents]
        return float(w[1] * d[0] - w[0] * d[1]), float(w @ d)

    first = float(np.arctan2(modes[k].direction[1], modes[k].direction[0]))
    if abs(across(first)[0]) <= 1e-15 * np.abs(b).max(initial=0.0) and across(first)[1] > 0:
        return np.array([np.cos(first), np.sin(first)])
    angles = first + np.pi * (np.arange(DIRECTIONS + 1) / DIRECTIONS * 2 - 1) * (1 + 1e-9)
    values = [across(a)[0] for a in angles]
    roots = [brentq(lambda a: across(a)[0], lo, hi, xtol=1e-15, rtol=1e-15) for lo, hi, f, g in
             zip(angles[:-1], angles[1:], values[:-1], values[1:], strict=True) if f * g <= 0 and f != g]
    good = [a for a in roots if across(a)[1] >= 0]
    if not good:
        return None
    best = min(good, key=lambda a: abs(a - first))
    return np.array([np.cos(best), np.sin(best)])
