"""Laws of rigid contact at one instant: which contacts open, stick or slide, with which accelerations; and what an impact does.

Both are the same problem: relative velocities (of an impact) or accelerations w = b + D lam, with lam_N >= 0, w_N >= 0 and
lam_N w_N = 0 in every contact, and friction within Coulomb's cone. Each combination of modes is a system of linear equations,
whose solution counts where it fulfils the inequalities. All combinations of few contacts in a plane are solved at once, which
finds all solutions, also none or several (Painleve). With more contacts, and in space, where directions of slip are unknowns,
Lemke's method gives the modes, in space with a cone of FACETS, which are then put right for the round one; combinations are tried
one after the other only where that fails.

Source: Pfeiffer and Glocker, Multibody Dynamics with Unilateral Contacts, 1996, chapters 5, 8 (impacts: Newton's and Poisson's
law); Glocker, Set-Valued Force Laws, 2001; Stewart and Trinkle, An implicit time-stepping scheme for rigid body dynamics with
inelastic collisions and Coulomb friction, 1996 (the complementarity problem with a cone of facets).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice, product
from typing import Any

import numpy as np

from symdyn.runtime.complementarity import lemke
from symdyn.runtime.shared_forces import MARGIN, Cone, least_solution, shared_forces
from symdyn.thresholds import DEPENDENT

OPEN, STICKING, SLIDING = "open", "sticking", "sliding"
# Inequalities hold to this part of the sizes of what stands in them.
NOISE = 1e-9
# Normal forces below this part of the largest do not press.
LIGHT = 1e-6
# Combinations of modes that are all solved, that are tried at most in a plane and in space, and that are solved at once.
MOST_COMBINATIONS, MOST_TRIED, MOST_TRIED_IN_SPACE, AT_ONCE = 1024, 20_000, 100, 256
# Steps of Newton's method for directions of slip, the angle that derivatives are taken over, rad.
STEPS, SMALL_ANGLE = 20, 1e-7
# Accelerations that differ by more than this part of their size are different solutions.
DIFFERENT = 1e-6
# A tangent that is left this part of its mobility where other rows hold does not move.
KEPT = 1e-9
# Directions that are tried first where a contact in space begins to slide.
DIRECTIONS = 48
# Times that each direction is put right for the others, where all at once do not converge.
ROUNDS = 20
# Sides of the cone of friction in space that Lemke's method takes; covering vectors that it starts with in search of solutions.
FACETS, COVERS = 8, 5


@dataclass(frozen=True)
class Site:
    """One contact of a problem.

    rows       indices of its normal row and its tangential ones; of dry friction with given bounds that of its one row
    static, kinetic   coefficients of friction
    slip       unit vector of the slip that it has; None: it does not slip, and may stick or begin to slide
    least      a normal force that acts in every case: the impulse of expansion
    excluded   modes that are ruled out
    bounded    whether static and kinetic are forces, as of dry friction of a joint, which has no normal row
    """

    rows: tuple[int, ...]
    static: float
    kinetic: float
    slip: np.ndarray | None = None
    least: float = 0.0
    excluded: tuple[str, ...] = ()
    bounded: bool = False

    @property
    def normal(self) -> int | None:
        """The index of its normal row."""
        return None if self.bounded else self.rows[0]

    @property
    def tangents(self) -> list[int]:
        """The indices of its tangential rows."""
        return list(self.rows if self.bounded else self.rows[1:])

    def limit(self, lam: np.ndarray) -> Any:
        """The largest friction under forces (..., n)."""
        return self.static if self.normal is None else self.static * lam[..., self.normal]


@dataclass(frozen=True)
class Mode:
    """State of one contact: OPEN, STICKING or SLIDING, the direction of its slip, whether its normal row holds.

    kept   whether it has the friction of SLIDING, but other contacts keep it from slipping; the direction is then longer than a
           unit vector, so that kinetic friction times that is static friction, or zero where nothing presses it
    """

    kind: str
    direction: np.ndarray
    held: bool
    kept: bool = False


@dataclass(frozen=True)
class Solved:
    """A solution: the mode of each contact, forces lam (n,) and what comes of them, w (n,); shared: whether the rows that hold
    depend on each other, so that lam is the one of least norm, or that of a softness of the rows, (n,), see shared_forces; loose:
    whether no softness gives lam."""

    modes: tuple[Mode, ...]
    lam: np.ndarray
    w: np.ndarray
    shared: bool
    softness: np.ndarray | None = None
    loose: bool = False


def solutions(D: np.ndarray, b: np.ndarray, sites: Sequence[Site]) -> list[Solved]:
    """Solutions that differ in w, the one with the smallest forces first; all of them up to MOST_COMBINATIONS in a plane.

    A contact that static friction can hold does not begin to slide: kinetic friction, where it is less, counts for what slides
    then. A contact that others keep from slipping while its own friction is at its bound has static friction, see Mode.kept.
    """
    return _with_static_friction(D, b, sites, ())


def _with_static_friction(D: np.ndarray, b: np.ndarray, sites: Sequence[Site], slipping: Sequence[int]) -> list[Solved]:
    """The same, where it is known which of the sites begin to slip."""
    steep = []
    for k, site in enumerate(sites):
        if site.slip is not None or not site.tangents or k in slipping:
            continue
        if (site.kinetic != site.static and STICKING not in site.excluded) or _may_be_kept(D, sites, k):
            steep.append(k)
    if not steep:
        return _of_one_friction(D, b, sites)
    result = []
    for one in _of_one_friction(D, b, [replace(site, kinetic=site.static) if k in steep else site
                                       for k, site in enumerate(sites)]):
        slides = [k for k in steep if one.modes[k].kind == SLIDING and not one.modes[k].kept]
        kept = [k for k in slides if _may_be_kept(D, sites, k) and _is_kept(D, sites, one.modes, k)]
        slides = [k for k in slides if k not in kept]
        if slides:
            result += _with_static_friction(D, b, [replace(site, excluded=tuple({*site.excluded, STICKING})) if k in slides
                                                   else site for k, site in enumerate(sites)], (*slipping, *slides))
        else:
            modes = [replace(mode, direction=mode.direction * (sites[k].static / sites[k].kinetic), kept=True) if k in kept
                     else mode for k, mode in enumerate(one.modes)]
            result.append(replace(one, modes=tuple(modes)))
    return _different(b, result)


def _may_be_kept(D: np.ndarray, sites: Sequence[Site], k: int) -> bool:
    """Whether other rows that may hold would keep a site from slipping, and whether its static friction can be written as a
    multiple of the kinetic one, in a given direction. A contact that slips, or must, keeps no other from it."""
    site = sites[k]
    if len(sites) == 1 or len(site.tangents) != 1 or site.kinetic == 0:
        return False
    closed = [one for one in sites if not {STICKING, SLIDING} <= set(one.excluded)]
    held = [one.normal for one in closed if one.normal is not None]
    held += [row for one in closed if one is not site and one.slip is None and STICKING not in one.excluded
             for row in one.tangents]
    return moves_with(D, site.tangents[0], held)


def _is_kept(D: np.ndarray, sites: Sequence[Site], modes: Sequence[Mode], k: int) -> bool:
    """Whether the rows that hold keep a site from slipping."""
    held = [site.rows[0] for site, mode in zip(sites, modes, strict=True) if site.normal is not None and mode.held]
    held += [row for site, mode in zip(sites, modes, strict=True) if mode.kind == STICKING for row in site.tangents]
    return moves_with(D, sites[k].tangents[0], held)


def moves_with(D: np.ndarray, row: int, held: Sequence[int]) -> bool:
    """Whether a row does not move where others do not."""
    if not held:
        return False
    along = D[held, row]
    left = D[row, row] - along @ least_solution(D[np.ix_(held, held)], along)
    return bool(left <= KEPT * D[row, row])


def _of_one_friction(D: np.ndarray, b: np.ndarray, sites: Sequence[Site]) -> list[Solved]:
    """Solutions where what begins to slide has kinetic friction at once."""
    if _is_simple(sites):
        return (_one_bounded if sites[0].bounded else _one)(D, b, sites[0])
    options = [list(_options(site)) for site in sites]
    if all(len(site.tangents) < 2 for site in sites) and np.prod([float(len(o)) for o in options]) <= MOST_COMBINATIONS:
        result = [one for one in _Table(D, b, sites, options).solved(list(product(*[range(len(o)) for o in options]))) if one]
    else:
        result = _by_lemke(D, b, sites) or _first(D, b, sites, options)
    return _different(b, result)


def _is_simple(sites: Sequence[Site]) -> bool:
    """Whether there is one contact only, whose solutions are closed forms of one unknown."""
    return len(sites) == 1 and (sites[0].bounded or sites[0].slip is not None or not sites[0].tangents or (
        len(sites[0].tangents) == 1 and sites[0].least == 0))


def _one(D: np.ndarray, b: np.ndarray, site: Site) -> list[Solved]:
    """Solutions of one contact whose friction is known, as the tables of combinations find them: the case of nearly all
    impacts."""
    k, tangents = site.rows[0], site.tangents
    size = max(float(np.abs(b).max()), float(np.abs(D[:, k]).max()) * site.least, 1e-300)
    result = []
    for mode in _options(site):
        if mode.kind == STICKING:
            result += _sticks(D, b, site, mode, size)
            continue
        column = np.zeros(len(b))
        column[k] = 1.0
        column[tangents] = -site.kinetic * mode.direction
        gain = D @ column
        if mode.kind == OPEN or not mode.held:
            lam = site.least if mode.kind != OPEN else 0.0
            w = b + gain * lam
            if w[k] >= -NOISE * size:
                result.append(Solved((mode,), column * lam, w, False))
        elif gain[k] != 0:
            lam = -float(b[k]) / float(gain[k])
            w = b + gain * lam
            w[k] = 0.0
            force = max(abs(lam) * float(np.abs(column).max()), size / max(float(np.diag(D).max()), 1e-300))
            along = site.slip is not None or float(w[tangents] @ mode.direction) >= -NOISE * size
            if lam >= site.least - NOISE * force and along:
                result.append(Solved((mode,), column * lam, w, False))
    return _different(b, result)


def _sticks(D: np.ndarray, b: np.ndarray, site: Site, mode: Mode, size: float) -> list[Solved]:
    """The solution in which one contact in a plane sticks, if there is one."""
    (a, c), (_, d) = D.tolist()
    determinant, gain = a * d - c * c, max(a, d)
    if determinant <= DEPENDENT * gain**2:  # a tangent along which nothing moves
        table = _Table(D, b, [site], [[mode]])
        return [one for one in table.solved([[0]]) if one is not None]
    lam = np.array([c * b[1] - d * b[0], c * b[0] - a * b[1]]) / determinant
    force = max(float(np.abs(lam).max()), size / max(gain, 1e-300))
    good = lam[0] >= -NOISE * force and abs(lam[1]) <= site.static * lam[0] + NOISE * force
    return [Solved((mode,), lam, np.zeros(2), False)] if good else []


def _one_bounded(D: np.ndarray, b: np.ndarray, site: Site) -> list[Solved]:
    """The same of dry friction of one joint."""
    result = []
    for mode in _options(site):
        if mode.kind == STICKING:
            lam = -float(b[0]) / float(D[0, 0]) if D[0, 0] else 0.0
            w, good = 0.0 if D[0, 0] else float(b[0]), abs(lam) <= site.static * (1 + NOISE) and (D[0, 0] or b[0] == 0)
        else:
            lam = -site.kinetic * float(mode.direction[0])
            w = float(b[0]) + float(D[0, 0]) * lam
            size = max(abs(float(b[0])), float(D[0, 0]) * site.static)
            good = site.slip is not None or w * float(mode.direction[0]) >= -NOISE * size
        if good:
            result.append(Solved((mode,), np.array([lam]), np.array([w]), False))
    return _different(b, result)


def _different(b: np.ndarray, result: Sequence[Solved]) -> list[Solved]:
    different: list[Solved] = []
    for one in result:
        size = max(np.abs(one.w).max(initial=0.0), np.abs(b).max(initial=0.0))
        if all(np.abs(one.w - other.w).max(initial=0.0) > DIFFERENT * size for other in different):
            different.append(one)
    return sorted(different, key=lambda one: float(np.abs(one.lam).sum()))


def degenerate(D: np.ndarray, b: np.ndarray, sites: Sequence[Site], one: Solved) -> list[int]:
    """Sites on the border of two modes, which both give these accelerations: those that neither press nor leave, and those whose
    friction is at its bound without slip. Those of which a mode is ruled out are there because they change it."""
    if one.shared or any(mode.kept for mode in one.modes):
        return []
    size = float(np.abs(b).max(initial=0.0))
    force = max(float(np.abs(one.lam).max(initial=0.0)), size / max(float(np.diag(D).max(initial=0.0)), 1e-300))
    result = []
    for index, site in enumerate(sites):
        if site.excluded:
            continue
        k, tangents = site.normal, site.tangents
        pressing, slip = k is None or one.lam[k] > NOISE * force, np.linalg.norm(one.w[tangents])
        bound = site.limit(one.lam) - np.linalg.norm(one.lam[tangents])
        at_bound = bool(tangents) and site.slip is None and site.static > 0 and slip <= NOISE * size and bound <= NOISE * force
        if at_bound if pressing else abs(one.w[k]) <= NOISE * size:
            result.append(index)
    return result


def impact(D: np.ndarray, v: np.ndarray, restitution: Sequence[float], sites: Sequence[Site], law: str) -> list[Solved]:
    """Result of an impact: lam are the impulses, w the velocities after it; v: before it.

    restitution   of each site; law: "newton" or "poisson"
    """
    normal = [site.rows[0] for site in sites]
    e = np.array(restitution)
    if law == "newton":
        back = np.zeros(len(v))
        back[normal] = e * np.minimum(v[normal], 0.0)
        return [Solved(one.modes, one.lam, one.w - back, one.shared) for one in solutions(D, v + back, sites)]
    pressed = solutions(D, v, sites)
    result = []
    for one in pressed:
        least = e * one.lam[normal]
        after = [Site(s.rows, s.static, s.kinetic, None, float(p)) for s, p in zip(sites, least, strict=True)]
        result += [Solved(two.modes, one.lam + two.lam, two.w, two.shared) for two in solutions(D, one.w, after)]
    return result


def _options(site: Site) -> Iterator[Mode]:
    """Modes of a contact, the preferred ones first."""
    n = len(site.tangents)
    still = np.zeros(n)
    for held in (True, False):
        if not held and (site.least == 0 or site.bounded):
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
    if site.least == 0 and OPEN not in site.excluded and not site.bounded:
        yield Mode(OPEN, still, False)


class _Table:
    """Combinations of modes of contacts as systems of linear equations: the forces are lam = H x + fixed, of which the active x
    are unknown, for each mode of each site."""

    def __init__(self, D: np.ndarray, b: np.ndarray, sites: Sequence[Site], options: Sequence[Sequence[Mode]]) -> None:
        self.D, self.b, self.sites, self.options = D, b, sites, options
        n = len(b)
        least = np.zeros(n)
        for site in sites:
            least[site.rows[0]] = site.static if site.bounded else site.least
        self.size = float(max(np.abs(b).max(initial=0.0), (np.abs(D) @ least).max(initial=0.0), 1e-300))  # of w
        self.H, self.fixed, self.active = [], [], []
        for site, modes in zip(sites, options, strict=True):
            k, tangents = site.normal, site.tangents
            H, fixed, active = np.zeros((len(modes), n, n)), np.zeros((len(modes), n)), np.zeros((len(modes), n), dtype=bool)
            for i, mode in enumerate(modes):
                column = np.zeros(n)
                if k is not None:
                    column[k] = 1.0
                if mode.kind == SLIDING and tangents:
                    column[tangents] = -site.kinetic * mode.direction
                if k is None:
                    fixed[i] = column
                elif mode.held:
                    active[i, k] = True
                    H[i, :, k] = column
                elif site.least:
                    fixed[i] = site.least * column
                if mode.kind == STICKING:
                    active[i, tangents] = True
                    H[i, tangents, tangents] = 1.0
            self.H.append(H)
            self.fixed.append(fixed)
            self.active.append(active)

    def linear(self, chosen: np.ndarray) -> tuple[np.ndarray, ...]:
        """lam and w (n_chosen, n) of combinations, rows of indices of the modes of each site; whether the rows that hold do hold,
        and whether they depend on each other."""
        each = range(len(self.sites))
        H, fixed = (np.sum([of[k][chosen[:, k]] for k in each], axis=0) for of in (self.H, self.fixed))
        active = np.any([self.active[k][chosen[:, k]] for k in each], axis=0)
        free = self.b + fixed @ self.D.T
        A, right = np.where(active[:, :, None], self.D @ H, np.eye(len(self.b))), np.where(active, -free, 0.0)
        x, shared = _least_norm(A, right)
        left = np.abs((A @ x[:, :, None])[:, :, 0] - right).max(axis=1)
        exact = left <= NOISE * np.maximum(np.abs(right).max(axis=1), self.size)
        lam = (H @ x[:, :, None])[:, :, 0] + fixed
        w = self.b + lam @ self.D.T
        w[active & exact[:, None]] = 0.0
        return lam, w, exact, shared

    def broken(self, chosen: np.ndarray, lam: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Mask of the sites that break an inequality, (n_chosen, n_sites)."""
        size = self.size
        force = np.maximum(np.abs(lam).max(axis=1, initial=0.0), size / max(np.diag(self.D).max(initial=0.0), 1e-300))
        result = np.zeros(chosen.shape, dtype=bool)
        for index, (site, modes) in enumerate(zip(self.sites, self.options, strict=True)):
            k, tangents, mode = site.normal, site.tangents, chosen[:, index]
            if k is not None:
                held = np.array([m.held for m in modes])[mode]
                result[:, index] = np.where(held, lam[:, k] < site.least - NOISE * force, w[:, k] < -NOISE * size)
            if not tangents:
                continue
            sticking = np.array([m.kind == STICKING for m in modes])[mode]
            cone = np.linalg.norm(lam[:, tangents], axis=1) > site.limit(lam) + NOISE * force
            result[:, index] |= sticking & cone
            if site.slip is None:
                along = (w[:, tangents] * np.array([m.direction for m in modes])[mode]).sum(axis=1)
                sliding = np.array([m.kind == SLIDING for m in modes])[mode]
                result[:, index] |= sliding & (along < -NOISE * size)
        return result

    def shared_out(self, lam: np.ndarray, w: np.ndarray, least: bool = True) -> Solved | None:
        """The solution of the only combination, whose rows depend on each other, where contacts stick in space; None where there
        is none. lam: its forces of least norm, taken where they are within all cones if `least`; w: its accelerations."""
        only = np.zeros((1, len(self.sites)), dtype=int)
        modes = tuple(o[0] for o in self.options)
        if not any(mode.kind == STICKING and len(site.tangents) == 2 for site, mode in zip(self.sites, modes, strict=True)):
            return None
        if least and not self.broken(only, lam[None], w[None]).any():
            return Solved(modes, lam, w, True)
        H, fixed, active = self._only()
        cones, rows_of = [], np.zeros(len(lam))
        for site, mode in zip(self.sites, modes, strict=True):
            rows_of[list(site.rows)] = float(np.diag(self.D)[list(site.rows)].sum())
            if mode.held and mode.kind == STICKING and site.tangents:
                cones.append(Cone(site.normal, tuple(site.tangents), site.static))
            elif mode.held and site.normal is not None and (not mode.kept or mode.direction.any()):
                cones.append(Cone(site.normal, (), 1.0))
        right = -(self.b + self.D @ fixed)[active]
        result = shared_forces((self.D @ H)[np.ix_(active, active)], right, H[:, active], fixed, rows_of[active], cones)
        if result.margin <= MARGIN or self.broken(only, result.lam[None], w[None]).any():
            return None
        return Solved(modes, result.lam, w, True, result.softness, result.softness is None)

    def _only(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """H, fixed and the indices of the active unknowns of the only combination."""
        H, fixed = (np.sum([of[0] for of in parts], axis=0) for parts in (self.H, self.fixed))
        return H, fixed, np.flatnonzero(np.any([of[0] for of in self.active], axis=0))

    def unloaded(self, lam: np.ndarray) -> list[int]:
        """Sites that nothing presses in the only combination, whose rows depend on each other, however forces are shared; lam:
        forces of least norm."""
        from scipy.optimize import linprog

        H, _, active = self._only()
        _, s, V = np.linalg.svd((self.D @ H)[np.ix_(active, active)])
        indices = [k for k, (site, (mode,)) in enumerate(zip(self.sites, self.options, strict=True))
                  if site.normal is not None and mode.held]
        normals, force = [self.sites[k].rows[0] for k in indices], float(np.abs(lam).max(initial=0.0))
        free = H[normals][:, active] @ V[s <= DEPENDENT * s[:1]].T
        if not indices or not force or float(lam[normals].min()) > NOISE * force:
            return []
        # As many forces as can be: the largest sum of parts from 0 to 1, in LIGHT of the largest force, that are below them.
        (n, m), most = free.shape, LIGHT * np.eye(len(indices))
        result = linprog(np.append(np.zeros(m), -np.ones(n)), np.hstack([-free, most]), np.maximum(lam[normals] / force, 0.0),
                         bounds=[(None, None)] * m + [(0, 1)] * n)
        return [k for k, part in zip(indices, result.x[m:].tolist(), strict=True) if part < 0.5] if result.success else []

    def solved(self, combinations: Sequence[Sequence[int]]) -> list[Solved | None]:
        """The solution of each combination; None where it breaks an inequality."""
        result: list[Solved | None] = []
        for first in range(0, len(combinations), AT_ONCE):
            chosen = np.array(combinations[first:first + AT_ONCE], dtype=int)
            lam, w, exact, shared = self.linear(chosen)
            good = exact & ~self.broken(chosen, lam, w).any(axis=1)
            result += [Solved(tuple(o[k] for o, k in zip(self.options, row, strict=True)), lam[i], w[i], bool(shared[i]))
                       if good[i] else None for i, row in enumerate(chosen)]
        return result


def _least_norm(A: np.ndarray, right: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """x of least norm with A x nearest to right (m, n), and whether rows depend on each other (m,)."""
    if not A.shape[1]:
        return right, np.zeros(len(A), dtype=bool)
    U, s, V = np.linalg.svd(A)
    kept: np.ndarray = s > DEPENDENT * s[:, :1]
    scaled = np.where(kept, (right[:, None, :] @ U)[:, 0] / np.where(kept, s, 1.0), 0.0)
    return (scaled[:, None, :] @ V)[:, 0], np.asarray(~kept.all(axis=1))


def _solved(D: np.ndarray, b: np.ndarray, sites: Sequence[Site], modes: Sequence[Mode]) -> Solved | None:
    """The solution of one combination of modes, with the directions in which contacts in space begin to slide; None where it
    breaks an inequality."""
    unknown = [k for k, (s, m) in enumerate(zip(sites, modes, strict=True))
               if len(s.tangents) == 2 and m.kind == SLIDING and not m.direction.any()]
    directed = _directed(D, b, sites, modes, unknown) if unknown else modes
    return None if directed is None else _Table(D, b, sites, [[m] for m in directed]).solved([[0] * len(sites)])[0]


def _first(D: np.ndarray, b: np.ndarray, sites: Sequence[Site], options: Sequence[Sequence[Mode]]) -> list[Solved]:
    """The first combination that is a solution, of as many as are tried."""
    planar = all(len(site.tangents) < 2 for site in sites)
    for modes in islice(product(*options), MOST_TRIED if planar else MOST_TRIED_IN_SPACE):
        one = _solved(D, b, sites, modes)
        if one is not None:
            return [one]
    return []


def _by_lemke(D: np.ndarray, b: np.ndarray, sites: Sequence[Site]) -> list[Solved]:
    """Solutions that Lemke's method comes to from different covering vectors; in space the first, for the round cone."""
    stream = np.random.default_rng(0)
    planar, result = all(len(site.tangents) < 2 for site in sites), list[Solved]()
    still = [next((mode for mode in _options(site) if mode.held), None) for site in sites]
    if not planar and all(mode is not None and (mode.kind == STICKING or site.slip is not None or not site.tangents)
                          for mode, site in zip(still, sites, strict=True)):
        one = held(D, b, sites, [mode for mode in still if mode is not None])
        if one is not None:
            return [one]
    for k in range(COVERS):
        if result and not planar:
            break
        weights = None if k == 0 else stream.uniform(0.1, 1.0, 64)
        answer = _modes_by_lemke(D, b, sites, weights)
        one = _repaired(D, b, sites, *answer) if answer is not None else None
        if one is not None:
            result.append(one)
    return result


def _modes_by_lemke(D: np.ndarray, b: np.ndarray, sites: Sequence[Site],
                    weights: np.ndarray | None) -> tuple[tuple[Mode, ...], np.ndarray] | None:
    """Modes and forces by the complementarity problem with a cone of facets; None where there is no solution."""
    problem = _Faceted(D, b, sites)
    result = lemke(problem.M, problem.q, None if weights is None else np.resize(weights, len(problem.q)))
    return None if result is None else (problem.modes(result.z, result.w), problem.W.T @ result.z + problem.lam_0)


class _Faceted:
    """The complementarity problem w = M z + q of contacts: for each normal force beyond the least, and where it may stick the
    forces beta along the facets' directions, and the speed gamma of its slip."""

    def __init__(self, D: np.ndarray, b: np.ndarray, sites: Sequence[Site]) -> None:
        self.sites = sites
        self.first: dict[int, int] = {}
        columns: list[np.ndarray] = []
        speeds: list[tuple[int, int, int]] = []  # indices of gamma and of the normal force, site
        lam_0 = np.zeros(len(b))
        n = 0
        for index, site in enumerate(sites):
            if {STICKING, SLIDING} <= set(site.excluded):
                continue
            self.first[index] = n
            k, tangents = site.normal, site.tangents
            column = np.zeros(len(b))
            if tangents and site.slip is not None:
                column[tangents] = -site.kinetic * site.slip
            if k is None:
                lam_0 += column
            else:
                column[k] = 1.0
                lam_0 += site.least * column
                columns.append(column)
                n += 1
            if tangents and site.slip is None:
                for direction in _facets(len(tangents)):
                    column = np.zeros(len(b))
                    column[tangents] = direction
                    columns.append(column)
                    n += 1
                speeds.append((n, self.first[index], index))
                columns.append(np.zeros(len(b)))
                n += 1
        W = np.array(columns).reshape(n, len(b))
        self.W, self.lam_0 = W, lam_0
        at = b + D @ lam_0
        self.M, self.q = W @ D @ W.T, W @ at
        scale = max(float(np.abs(np.diag(D)).max(initial=0.0)), 1e-300)  # gamma in units of a force
        for row, first, index in speeds:
            site = sites[index]
            friction = site.kinetic if STICKING in site.excluded else site.static
            facets = list(range(first if site.bounded else first + 1, row))
            self.M[facets, row] = scale
            self.M[row, facets] = -scale
            self.q[row] = scale * friction * (1.0 if site.bounded else site.least)
            if not site.bounded:
                self.M[row, first] = scale * friction

    def modes(self, z: np.ndarray, w: np.ndarray) -> tuple[Mode, ...]:
        """Mode of each contact."""
        small_z, small_w = (NOISE * max(float(np.abs(v).max(initial=0.0)), 1e-300) for v in (z, self.q))
        result: list[Mode] = []
        for index, site in enumerate(self.sites):
            n_tangents = len(site.tangents)
            if index not in self.first:
                result.append(Mode(OPEN, np.zeros(n_tangents), False))
                continue
            k = self.first[index]
            held = site.bounded or bool(w[k] <= small_w) or bool(z[k] > small_z)
            if not held and site.least == 0:
                result.append(Mode(OPEN, np.zeros(n_tangents), False))
            elif not n_tangents or site.slip is not None:
                result.append(Mode(SLIDING, np.zeros(n_tangents) if site.slip is None else site.slip, held))
            else:
                facets, first = _facets(n_tangents), k if site.bounded else k + 1
                force = z[first:first + len(facets)] @ facets
                size = np.linalg.norm(force)
                slides = size > small_z and (STICKING in site.excluded or z[first + len(facets)] > small_z)
                result.append(Mode(SLIDING, -force / size, held) if slides else Mode(STICKING, np.zeros(n_tangents), held))
        return tuple(result)


def _facets(n: int) -> np.ndarray:
    """Directions of friction, (n_facets, n)."""
    if n == 1:
        return np.array([[1.0], [-1.0]])
    angles = 2 * np.pi * np.arange(FACETS) / FACETS
    return np.column_stack([np.cos(angles), np.sin(angles)])


def _repaired(D: np.ndarray, b: np.ndarray, sites: Sequence[Site], modes: Sequence[Mode], forces: np.ndarray) -> Solved | None:
    """The solution that begins with these modes: while contacts break an inequality, those take the mode that their numbers ask
    for. Where rows depend on each other, given forces may fulfil what those of least norm do not. None where that comes to no
    end."""
    seen = set()
    for _ in range(10 + 4 * len(sites)):
        unknown = [k for k, (site, mode) in enumerate(zip(sites, modes, strict=True))
                   if len(site.tangents) == 2 and site.slip is None and mode.kind == SLIDING]
        directed = _directed(D, b, sites, modes, unknown) if unknown else tuple(modes)
        if directed is None:
            return None
        table, only = _Table(D, b, sites, [[m] for m in directed]), np.zeros((1, len(sites)), dtype=int)
        lam, w, exact, shared = table.linear(only)
        broken = table.broken(only, lam, w)[0]
        fitting = held(D, b, sites, directed) if exact[0] and shared[0] else None
        if fitting is not None:
            return fitting
        if exact[0] and not broken.any():
            return Solved(directed, lam[0], w[0], bool(shared[0]))
        if exact[0] and shared[0] and not unknown and not table.broken(only, forces[None, :], w).any() and np.abs(
                b + D @ forces - w[0]).max() <= NOISE * table.size:
            return Solved(directed, forces, w[0], True)
        named = tuple((m.kind, m.held) for m in directed)
        if named in seen or not exact[0]:
            return None
        seen.add(named)
        modes = [_other(site, mode, lam[0], w[0]) if bad else mode
                 for site, mode, bad in zip(sites, directed, broken, strict=True)]
    return None


def held(D: np.ndarray, b: np.ndarray, sites: Sequence[Site], modes: Sequence[Mode], least: bool = True) -> Solved | None:
    """The solution with these modes, whose rows depend on each other, with forces that are within all cones of friction, of least
    norm if these are and `least`; None where there is none. Contacts in space that nothing presses have no friction."""
    table, only = _Table(D, b, sites, [[m] for m in modes]), np.zeros((1, len(sites)), dtype=int)
    lam, w, exact, shared = table.linear(only)
    if not exact[0] or not shared[0]:
        return None
    light = [k for k in table.unloaded(lam[0]) if modes[k].kind == STICKING and len(sites[k].tangents) == 2]
    if not light:
        return table.shared_out(lam[0], w[0], least)
    without = [Mode(SLIDING, np.zeros(2), True, kept=True) if k in light else mode for k, mode in enumerate(modes)]
    others = _Table(D, b, sites, [[m] for m in without])
    lam, w, exact, shared = others.linear(only)
    slips = np.abs(w[0][[row for k in light for row in sites[k].tangents]]).max() > NOISE * table.size
    if not exact[0] or slips:
        return None
    if not least or others.broken(only, lam, w).any():
        return others.shared_out(lam[0], w[0], least) if shared[0] else None
    return Solved(tuple(without), lam[0], w[0], bool(shared[0]))


def _other(site: Site, mode: Mode, lam: np.ndarray, w: np.ndarray) -> Mode:
    """The mode that a contact goes to where its own breaks an inequality."""
    n = len(site.tangents)
    still = np.zeros(n)
    if site.normal is not None and mode.held and lam[site.normal] < site.least:
        return Mode(mode.kind, mode.direction, False) if site.least else Mode(OPEN, still, False)
    if mode.kind == STICKING and SLIDING not in site.excluded:
        force = lam[site.tangents]
        size = np.linalg.norm(force)
        return Mode(SLIDING, -force / size if size else still, mode.held)
    if n and site.slip is None and STICKING not in site.excluded:
        return Mode(STICKING, still, True)
    return Mode(SLIDING, still if site.slip is None else site.slip, True)


def _linear(D: np.ndarray, b: np.ndarray, sites: Sequence[Site], modes: Sequence[Mode]) -> np.ndarray:
    """w of given modes."""
    result: np.ndarray = _Table(D, b, sites, [[m] for m in modes]).linear(np.zeros((1, len(sites)), dtype=int))[1][0]
    return result


def _directed(D: np.ndarray, b: np.ndarray, sites: Sequence[Site], modes: Sequence[Mode],
              unknown: Sequence[int]) -> tuple[Mode, ...] | None:
    """The modes with the directions in which contacts in space begin to slide: along w_T, one after the other until all fit."""
    chosen = list(modes)
    for k in unknown:
        if modes[k].direction.any():
            continue
        w = _linear(D, b, sites, [Mode(OPEN, m.direction, m.held) if j in unknown else m for j, m in enumerate(chosen)])
        start = w[sites[k].tangents]
        size = np.linalg.norm(start)
        chosen[k] = Mode(SLIDING, start / size if size else np.array([1.0, 0.0]), modes[k].held)
    together = _directions(D, b, sites, chosen, unknown)
    if together is not None:
        return together
    for _ in range(ROUNDS):
        before = [chosen[k].direction for k in unknown]
        for k in unknown:
            result = _direction(D, b, sites, chosen, k)
            if result is None:
                return None
            chosen[k] = Mode(SLIDING, result, chosen[k].held)
        if all(np.abs(chosen[k].direction - old).max() < 1e-14 for k, old in zip(unknown, before, strict=True)):
            break
    return tuple(chosen)


def _directions(D: np.ndarray, b: np.ndarray, sites: Sequence[Site], modes: Sequence[Mode],
                unknown: Sequence[int]) -> tuple[Mode, ...] | None:
    """All unknown directions at once by Newton's method from those given; None where it does not converge."""
    indices = list(unknown)
    tangents = np.array([sites[k].tangents for k in indices])
    angles = np.array([np.arctan2(modes[k].direction[1], modes[k].direction[0]) for k in indices])

    def across(trials: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        d = np.stack([np.cos(trials), np.sin(trials)], axis=2)
        options: list[list[Mode]] = [[m] for m in modes]
        chosen = np.zeros((len(trials), len(sites)), dtype=int)
        for i, k in enumerate(indices):
            options[k] = [Mode(SLIDING, one, modes[k].held) for one in d[:, i]]
            chosen[:, k] = range(len(trials))
        w = _Table(D, b, sites, options).linear(chosen)[1][:, tangents]
        return w[:, :, 1] * d[:, :, 0] - w[:, :, 0] * d[:, :, 1], (w * d).sum(axis=2)

    scale = float(np.abs(b).max(initial=0.0))
    size = np.inf
    for _ in range(STEPS):
        values, along = across(np.vstack([angles, angles + SMALL_ANGLE * np.eye(len(indices))]))
        slope = (values[1:] - values[0]).T / SMALL_ANGLE
        step = least_solution(slope, -values[0])
        last, size = size, float(np.abs(step).max())
        if size > 1.0:
            return None
        angles = angles + step
        if size < 1e-15 or (size < 1e-10 and size >= last / 2):
            break
    values, along = across(angles[None, :])
    if np.abs(values).max() > NOISE * scale or (along < -NOISE * scale).any():
        return None
    result = list(modes)
    for k, angle in zip(indices, angles, strict=True):
        result[k] = Mode(SLIDING, np.array([np.cos(angle), np.sin(angle)]), modes[k].held)
    return tuple(result)


def _direction(D: np.ndarray, b: np.ndarray, sites: Sequence[Site], modes: Sequence[Mode], k: int) -> np.ndarray | None:
    """The direction d of one contact with w_T along d; None where there is none."""
    from scipy.optimize import brentq

    tangents = sites[k].tangents

    def across(angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        d = np.column_stack([np.cos(angles), np.sin(angles)])
        trials = [[Mode(SLIDING, one, m.held) for one in d] if j == k else [m] for j, m in enumerate(modes)]
        chosen = np.zeros((len(angles), len(sites)), dtype=int)
        chosen[:, k] = range(len(angles))
        w = _Table(D, b, sites, trials).linear(chosen)[1][:, tangents]
        return w[:, 1] * d[:, 0] - w[:, 0] * d[:, 1], (w * d).sum(axis=1)

    first = float(np.arctan2(modes[k].direction[1], modes[k].direction[0]))
    angles = first + np.pi * (np.arange(DIRECTIONS + 1) / DIRECTIONS * 2 - 1) * (1 + 1e-9)
    values, along = across(np.append(angles, first))
    if abs(values[-1]) <= 1e-15 * np.abs(b).max(initial=0.0) and along[-1] > 0:
        return np.array([np.cos(first), np.sin(first)])
    def root(low: float, high: float) -> float:
        f, g = (across(np.array([a]))[0][0] for a in (low, high))
        if f * g >= 0:  # rounding has turned a sign: one of the ends is the root
            return low if abs(f) < abs(g) else high
        return float(brentq(lambda a: across(np.array([a]))[0][0], low, high, xtol=1e-15, rtol=1e-15))

    roots = [root(low, high) for low, high, f, g in zip(angles[:-1], angles[1:], values[:-2], values[1:-1], strict=True)
             if f * g <= 0 and f != g]
    good = [a for a in roots if across(np.array([a]))[1][0] >= 0]
    if not good:
        return None
    best = min(good, key=lambda a: abs(a - first))
    return np.array([np.cos(best), np.sin(best)])
