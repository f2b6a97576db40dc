"""Equilibria from many starts, distinguished and named."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.counting import counted
from symdyn.errors import ArgumentError, EvaluationError, NoEquilibrium
from symdyn.real_numbers import NotReal, length_of, real
from symdyn.runtime.memory import in_bytes
from symdyn.shown import shown
from symdyn.statics.equilibrium import Equilibrium, begin, find, settled, steps
from symdyn.statics.manifold import natural_length
from symdyn.statics.selection import Selection, listed, select
from symdyn.statics.terms import OperatingPoint, coordinate_names
from symdyn.turning import in_radians, turns

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# Equilibria this close, in m, rad and Euler parameters, are one.
APART = 1e-6
# Names distinguish them by coordinates that differ by more, in rad or lengths of the mechanism; where none does, by the second.
CLEARLY = (0.1, 1e-3)
# Random starts differ by so much unless ranges are given: in rad, and in what is no angle.
TURNS, LENGTHS = np.pi, 1.0
# Starts of one search, each of which takes milliseconds.
MOST = 10_000_000


@dataclass(frozen=True, eq=False)
class Equilibria:
    """Different equilibria, stable ones first, then by how many starts lead there; prints as a table. An index is a number.

    found        each with a name
    counts       from how many starts each was found; iterations: of each start, in order, -1 where none was found
    failures     (start, message) of starts that led nowhere

    >>> found = sd.systems.pendulum().compile(backend="numpy").equilibria(10)
    >>> sorted(rest.verdict for rest in found)
    ['neutral', 'unstable']
    """

    title: str
    found: tuple[Equilibrium, ...]
    counts: tuple[int, ...]
    iterations: np.ndarray
    failures: tuple[tuple[np.ndarray, str], ...]

    def __len__(self) -> int:
        return len(self.found)

    def __iter__(self) -> Any:
        return iter(self.found)

    def __getitem__(self, key: int) -> Equilibrium:
        return self.found[key]

    @property
    def stable(self) -> tuple[Equilibrium, ...]:
        """The stable ones.

        >>> found = sd.systems.pendulum().compile(backend="numpy").equilibria(10)
        >>> [abs(round(float(rest["q1"]), 6)) for rest in found.stable]
        [0.0]
        """
        return tuple(e for e in self.found if e.stable)

    def __repr__(self) -> str:
        starts = len(self.iterations)
        lines = [f"{self.title}: {counted(len(self.found), 'equilibrium', 'equilibria')} from {counted(starts, 'start')}, "
                 f"at most {counted(int(self.iterations.max(initial=0)), 'iteration')}, "
                 f"{counted(len(self.failures), 'start')} without"]
        for equilibrium, count in zip(self.found, self.counts, strict=True):
            lines.append(f"  {equilibrium.name}  ({counted(int(count), 'start')})")
        return "\n".join(lines)


def equilibria(module: Module, starts: Any = 100, ranges: Any = None, seed: int = 0, start: Any = None, free: Any = None,
               fixed: Any = None, params: Any = None, t: float = 0.0, inputs: Any = None, unknown_params: Any = None,
               max_iterations: int = 100) -> Equilibria:
    """See Module.equilibria."""
    selection = select(module, free, fixed, unknown_params)
    limit = steps(max_iterations, module.name)
    first = begin(module, selection, start, params, t, inputs)
    selection = settled(first, selection)
    if isinstance(starts, (int, np.integer)) and not isinstance(starts, bool):
        if not 0 < starts <= MOST:
            size = f", {MOST} at most: their states alone take {in_bytes(int(starts) * first.x.nbytes)}" if starts > MOST else ""
            raise ArgumentError(f"{module.name}: {shown(starts)} starts requested; at least 1 is needed{size}")
        points = _random(first, selection, int(starts), ranges, seed)
    else:
        if ranges is not None:
            raise ArgumentError(f"{module.name}: ranges are given, but so are the starts themselves; leave one of them out")
        if isinstance(starts, (str, bytes, Mapping)) or not isinstance(starts, Iterable) or \
                (length_of(starts) is None and hasattr(starts, "ndim")):
            raise ArgumentError(f"{module.name}: starts must be a number of them, or a list of starts, found {shown(starts)}")
        if length_of(starts) == 0:
            raise ArgumentError(f"{module.name}: no starts are given; pass a number of them, or a list of one at least")
        points = [begin(module, selection, each, params, t, inputs) for each in starts]
    distinct: list[Equilibrium] = []
    counts: list[int] = []
    iterations: list[int] = []
    failures: list[tuple[np.ndarray, str]] = []
    for point in points:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore" if distinct else "default")  # validity checks warn once
                new = find(point, selection, limit)
        except (NoEquilibrium, EvaluationError, ArgumentError) as error:  # also from a start where nothing can be evaluated
            failures.append((point.x, str(error)))
            iterations.append(-1)
            continue
        iterations.append(new.iterations)
        known = [k for k, e in enumerate(distinct) if same(e, new)]
        if known:
            counts[known[0]] += 1
        else:
            distinct.append(new)
            counts.append(1)
    if not distinct:
        raise NoEquilibrium(f"{module.name}: none of {len(failures)} starts leads to an equilibrium; the first: {failures[0][1]}")
    order = sorted(range(len(distinct)), key=lambda k: (not distinct[k].stable, -counts[k]))
    named = _named([distinct[k] for k in order])
    return Equilibria(module.name, tuple(named), tuple(counts[k] for k in order), np.array(iterations), tuple(failures))


def same(a: Equilibrium, b: Equilibrium) -> bool:
    """Whether two are one but for whole turns and the sign of Euler parameters."""
    metadata = a.module.metadata
    names = metadata.q
    gap, there = a.q - b.q, np.ones(len(names), dtype=bool)
    for group in metadata.unit_groups:
        indices = [names.index(n) for n in group]
        there[indices] = False
        if min(np.abs(a.q[indices] - b.q[indices]).max(), np.abs(a.q[indices] + b.q[indices]).max()) > APART:
            return False
    gap = np.array([_turned(g) if in_radians(metadata.units.get(n)) else g for g, n in zip(gap, names, strict=True)])
    more = [a.z - b.z, [a[n] - b[n] for n in a.selection.unknown]]
    sizes = [*a.z, *[a[n] for n in a.selection.unknown]]
    return bool((np.abs(gap[there]) <= APART).all()
                and all(abs(g) <= APART * max(1.0, abs(s)) for g, s in zip(np.concatenate(more), sizes, strict=True)))


def _turned(angle: float) -> float:
    """Between -pi and pi."""
    return float(np.remainder(angle + np.pi, 2 * np.pi) - np.pi)


def _random(first: OperatingPoint, selection: Selection, count: int, ranges: Any, seed: Any) -> list[OperatingPoint]:
    """Starts around the first one."""
    module, metadata = first.module, first.module.metadata
    if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or seed < 0:
        raise ArgumentError(f"{module.name}: the seed must be a whole number of at least 0, found {shown(seed)}")
    labels = coordinate_names(metadata)
    spans = _spans(first, ranges)
    direct = [n for n in spans if n not in labels and n not in selection.kept]
    stream = np.random.default_rng(seed)
    B = selection.directions(first)
    points = []
    for _ in range(count):
        v = np.array([stream.uniform(*spans[label]) for label in labels])
        x = first.x.copy()
        x[:len(first.q)] = first.moved(B @ (np.linalg.pinv(B) @ v))
        for name in direct:
            x[metadata.q.index(name)] += stream.uniform(*spans[name])
        points.append(first.at(x=selection.apply(x)))
    return points


def _spans(first: OperatingPoint, ranges: Any) -> dict[str, tuple[float, float]]:
    """Ranges along each speed; and of coordinates whose rates are no speeds, where they are named."""
    module = first.module
    metadata = module.metadata
    labels = coordinate_names(metadata)
    spans = {label: _span(TURNS if turns(metadata.units.get(u)) else LENGTHS, label, module.name)
             for label, u in zip(labels, metadata.u, strict=True)}
    if ranges is None:
        return spans
    if not isinstance(ranges, Mapping):
        raise ArgumentError(f"{module.name}: ranges must be a mapping from coordinates to (least, most), found {shown(ranges)}")
    turned = {n for group in metadata.unit_groups for n in group}
    known = dict.fromkeys([*labels, *[n for n in metadata.q if n not in turned], *metadata.u])
    names = listed(list(ranges), known, "ranges", module.name)
    requested = {labels[metadata.u.index(n)] if n in metadata.u else n: _span(value, n, module.name)
             for n, value in zip(names, ranges.values(), strict=True)}
    return {**dict.fromkeys(labels, (0.0, 0.0)), **requested}


def _span(value: Any, name: str, owner: str) -> tuple[float, float]:
    wrong = f"the range of {name} is {shown(value)}; pass (least, most), or one number r for (-r, r)"
    try:
        span = real(value)
    except NotReal as error:
        raise ArgumentError(f"{owner}: {wrong}: {error}") from None
    pair = np.abs(span) * np.array([-1.0, 1.0]) if span.ndim == 0 else span
    # Uniform numbers are drawn from the difference, which must be a double, too.
    if pair.shape != (2,) or not (np.isfinite(pair).all() and pair[0] <= pair[1]
                                  and np.abs(pair).max() <= np.finfo(float).max / 4):
        raise ArgumentError(f"{owner}: {wrong}")
    return float(pair[0]), float(pair[1])


def _named(distinct: list[Equilibrium]) -> list[Equilibrium]:
    """Each with its number, its stability, and what distinguishes it from the others: coordinates, attitudes."""
    if not distinct:
        return []
    metadata = distinct[0].module.metadata
    turned = [[metadata.q.index(n) for n in group] for group in metadata.unit_groups]
    single = [k for k in range(len(metadata.q)) if not any(k in group for group in turned)]
    sizes = np.where([metadata.units.get(metadata.q[k]) == "m" for k in single], natural_length(distinct[0].point), 1.0)
    columns = [np.array([e.q[single] / sizes for e in distinct])]
    columns += [np.array([_attitude(e.q[group]) for e in distinct]) for group in turned]
    # Each entry a column, an attitude three in one.
    parts = [np.hstack(columns)[:, k:k + 1] for k in range(len(single))] + columns[1:]
    distinguishing = sorted(_distinguishing(parts))
    result = []
    for k, e in enumerate(distinct):
        kind = e.verdict or "rigid"
        words = []
        for i in distinguishing:
            if i < len(single):
                value = e.q[single[i]]
                words.append(f"{metadata.q[single[i]]} = {value if abs(value) > APART else 0:.4g}")
            else:
                of = f" ({metadata.q[turned[i - len(single)][0]]} ...)" if len(turned) > 1 else ""
                words.append(_turn(parts[i][k]) + of)
        result.append(replace(e, name=f"{k + 1}: {kind}" + (f" at {', '.join(words)}" if words else "")))
    return result


def _attitude(parameters: np.ndarray) -> np.ndarray:
    """The rotation vector of Euler parameters (scalar first), of at most half a turn, rad, (3,)."""
    e = parameters * np.sign(parameters[0] or 1.0)
    size = float(np.linalg.norm(e[1:]))
    vector: np.ndarray = np.zeros(3) if size < APART else 2 * np.arctan2(size, e[0]) / size * e[1:]
    if abs(e[0]) < APART:  # half a turn: the axis with its first entry positive
        vector = vector * np.sign(vector[np.flatnonzero(np.abs(vector) > 1e-3)[0]])
    return vector


def _turn(vector: np.ndarray) -> str:
    """A rotation vector in words."""
    angle = float(np.linalg.norm(vector))
    if angle <= 10 * APART:
        return "not turned"
    axis = vector / angle
    k = int(np.argmax(np.abs(axis)))
    if abs(axis[k]) > 1 - 1e-6:
        return f"turned by {np.degrees(angle * np.sign(axis[k])):.4g} deg about {'xyz'[k]}"
    about = ", ".join(f"{v if abs(v) > 1e-4 else 0:.3g}" for v in axis)
    return f"turned by {np.degrees(angle):.4g} deg about ({about})"


def _distinguishing(parts: list[np.ndarray]) -> list[int]:
    """Parts (n, m) in which all rows differ, as few as can be found one by one: those that part most pairs, then those that part
    them furthest."""
    count = len(parts[0]) if parts else 0
    if count < 2:
        return []
    gaps = np.array([[np.linalg.norm(part[k] - part[j]) for part in parts] for k in range(count) for j in range(k)])
    chosen: list[int] = []
    open_ = np.ones(len(gaps), dtype=bool)
    for clear in CLEARLY:
        while open_.any():
            parted = np.sum(gaps[open_] > clear, axis=0)
            best = int(np.lexsort((gaps[open_].max(axis=0), parted))[-1])
            if not parted[best]:
                break
            chosen.append(best)
            open_ &= gaps[:, best] <= clear
    return chosen
