"""Campbell diagram: natural frequencies over the speed of a rotor.

Modes are followed from speed to speed by the likeness of their shapes (modal assurance criterion, weighed by the mass matrix)
and by how near their eigenvalues are to those extrapolated.
Source: Allemang, The modal assurance criterion, Sound and Vibration (August 2003).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.optimize

from symdyn.errors import ArgumentError
from symdyn.runtime.statics.equilibrium import begin, find, settled, steps
from symdyn.runtime.statics.linear import Reduced
from symdyn.runtime.statics.modes import Linear, Mode, Modes, dominant, modes_of
from symdyn.runtime.statics.multiblade import Steady, rotor_of, steady
from symdyn.runtime.statics.selection import Selection, listed, select
from symdyn.runtime.statics.terms import Place

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# A pattern of blades goes round if its cosine and sine are out of phase by so much: 1 is a round whirl, 0 a standing wave.
LEAST_WHIRL = 0.2
OPTIONS = ("free", "fixed", "start", "params", "t", "inputs", "blades", "azimuth", "azimuths", "max_iterations")


@dataclass(frozen=True, eq=False)
class Campbell:
    """Modes over rotor speed; prints as a table.

    speed         name; values (n,): its values, rad/s
    eigenvalues   (n, n_modes) complex, 1/s; NaN where a mode could not be followed
    names         by the coordinates with most kinetic energy over all speeds; of blades also "collective", and "forward" or
                  "backward" where their pattern goes round with the rotor or against it, seen from the fixed frame
    modes         at every speed, as found; equilibria: the states they are about (Equilibrium, or multiblade.Steady)
    """

    title: str
    speed: str
    values: np.ndarray
    eigenvalues: np.ndarray
    names: tuple[str, ...]
    modes: tuple[Modes, ...]
    equilibria: tuple[Any, ...]

    @property
    def frequencies(self) -> np.ndarray:
        """|Im eigenvalue| / 2 pi, Hz, (n, n_modes)."""
        return np.asarray(np.abs(self.eigenvalues.imag) / (2 * np.pi))

    @property
    def damping(self) -> np.ndarray:
        """Damping ratios, (n, n_modes); negative where a mode grows."""
        size = np.abs(self.eigenvalues)
        return np.asarray(np.where(size > 0, -self.eigenvalues.real / np.where(size > 0, size, 1.0), 0.0))

    def __getitem__(self, name: str) -> np.ndarray:
        """Frequencies of a mode by its name, Hz, (n,). Raises ArgumentError for an unknown one."""
        if name not in self.names:
            raise ArgumentError(f"{self.title}: there is no mode {name!r}; there are {', '.join(self.names)}")
        return np.asarray(self.frequencies[:, self.names.index(name)])

    def plot(self, path: Any = None, harmonics: Sequence[float] = (1, 3, 6), highest: float | None = None) -> Any:
        """The diagram up to a frequency (Hz), with lines of multiples of the rotor's speed, as a figure; saved to a path.

        By default modes that are far above the others and the lines are left out, which the legend tells. Needs matplotlib.
        """
        from symdyn.runtime.pictures.campbell import plot

        return plot(self, path, harmonics, highest)

    def __repr__(self) -> str:
        width = [max(9, len(n)) for n in self.names]
        lines = [f"{self.title}: damped natural frequencies, Hz",
                 f"{self.speed:>16}  " + "  ".join(f"{n:>{w}}" for n, w in zip(self.names, width, strict=True))]
        for value, row in zip(self.values, self.frequencies, strict=True):
            lines.append(f"{value:>16.6g}  " + "  ".join(f"{f:>{w}.5g}" for f, w in zip(row, width, strict=True)))
        return "\n".join(lines)


def campbell(module: Module, speed: Any, values: Any, free: Any = None, fixed: Any = None, start: Any = None, params: Any = None,
             t: float = 0.0, inputs: Any = None, blades: Sequence[Sequence[Any]] = (), azimuth: Any = None,
             azimuths: int = 12, max_iterations: int = 100, **others: Any) -> Campbell:
    """Natural frequencies over a rotor's speed.

    speed      name or symbol; values: rad/s. At each the equilibrium with this speed is found, then its modes
    free, fixed, start, params, t, inputs   as for Module.equilibrium
    blades     sets of coordinates of the blades of a rotor, one set per shape: the same coordinate of every blade, in the order
               in which blades lie ahead of each other in the sense of the azimuth, such as [("flap1", "flap2", "flap3")]: modes
               in the fixed frame by multi-blade coordinates, averaged over `azimuths` positions; accelerations of blades that
               the rotation brings about are in the steady state
    azimuth    the coordinate whose rate the speed is, where the names do not tell
    Without blades the azimuth stays where it is at the start: enough for rotors that look the same at every azimuth.
    Raises NoEquilibrium, ArgumentError.
    """
    metadata, owner = module.metadata, module.name
    listed(list(others), OPTIONS, "options", owner)
    named = listed(speed, metadata["u"], "speed", owner)
    if len(named) != 1:
        raise ArgumentError(f"{owner}: speed must be one name or symbol, found {speed!r}")
    (name,) = named
    numbers, limit = _values(values, owner), steps(max_iterations, owner)
    given = dict(fixed or {})
    if name in {str(getattr(k, "name", k)) for k in given}:
        raise ArgumentError(f"{owner}: {name} is in fixed, too; leave it out there")
    if isinstance(blades, str) or not isinstance(blades, Iterable):
        raise ArgumentError(f"{owner}: blades must be a list of sets of coordinates, found {blades!r}")
    groups = [listed(group, metadata["q"], "blades", owner) for group in blades]
    if isinstance(azimuths, bool) or not isinstance(azimuths, (int, np.integer)):
        raise ArgumentError(f"{owner}: azimuths must be a whole number, found {azimuths!r}")
    turned = listed(azimuth if azimuth is not None else name.removesuffix("_dot"), metadata["q"], "azimuth", owner)[0] \
        if groups or azimuth is not None else None
    found: list[tuple[Linear, Any]] = []
    last: Any = start
    for value in numbers:
        selection = select(module, free, {**given, name: value}, None)
        place = begin(module, selection, None if isinstance(last, Steady) else last, params, t, inputs)
        selection = settled(place, selection)
        if groups:
            assert turned is not None
            linear, last = _in_fixed_frame(module, place, selection, (name, turned, groups), int(azimuths), last)
        else:
            last = find(place, selection, limit)
            linear = Reduced(last.place, selection)
        found.append((linear, last))
    sets = [modes_of(linear, f"{owner} at {name} = {value:g}") for (linear, _), value in zip(found, numbers, strict=True)]
    tracks = follow(sets, [linear.inertia for linear, _ in found], numbers)
    eigenvalues = np.full((len(numbers), len(tracks)), complex(np.nan, np.nan))
    for j, track in enumerate(tracks):
        for k, mode in track.items():
            eigenvalues[k, j] = mode.eigenvalue
    return Campbell(owner, name, numbers, eigenvalues, _names(tracks), tuple(sets), tuple(e for _, e in found))


def _in_fixed_frame(module: Module, place: Place, selection: Selection, names: tuple[str, str, list[list[str]]], azimuths: int,
                    last: Any) -> tuple[Linear, Steady]:
    speed, azimuth, groups = names
    rotor = rotor_of(module, selection, speed, azimuth, groups)
    if azimuths < 1:
        raise ArgumentError(f"{module.name}: {azimuths} azimuths asked for; at least 1 is needed")
    # Not in step with any number of blades: harmonics of the rotation average out.
    at = 2 * np.pi * np.arange(azimuths) / azimuths
    omega = float(selection.values[speed])
    if isinstance(last, Steady):
        begun = Steady(rotor, place.at(x=last.place.x), last.a, omega, at)
    else:
        T = rotor.transform(float(place.x[rotor.azimuth]))[0]
        q = np.zeros(len(rotor.free))
        q[rotor.rows] = place.x[list(rotor.coordinates)]
        begun = Steady(rotor, place, np.linalg.solve(T, q), omega, at)
    found, linear = steady(begun)
    return linear, found


def _values(values: Any, owner: str) -> np.ndarray:
    try:
        numbers = np.atleast_1d(np.asarray(values, dtype=float))
    except (TypeError, ValueError):
        numbers = np.full(1, np.nan)
    if numbers.ndim != 1 or not len(numbers) or not np.isfinite(numbers).all():
        raise ArgumentError(f"{owner}: values must be speeds in rad/s, found {values!r}")
    return numbers


def follow(sets: Sequence[Modes], inertias: Sequence[np.ndarray], values: np.ndarray) -> list[dict[int, Mode]]:
    """Tracks, each place among the values -> mode: every mode goes on in the one most like it, all of them taken together.

    A track ends, or begins, where the number of modes changes: a pair of eigenvalues becomes real.
    """
    tracks: list[dict[int, Mode]] = [{0: mode} for mode in sets[0]]
    for k in range(1, len(sets)):
        open_ = [track for track in tracks if k - 1 in track]
        likeness = np.array([[_likeness(track, mode, inertias[k], values, k) for mode in sets[k]] for track in open_])
        likeness = likeness.reshape(len(open_), len(sets[k]))
        rows, columns = scipy.optimize.linear_sum_assignment(-likeness)
        taken = set()
        for i, j in zip(rows, columns, strict=True):
            open_[i][k] = sets[k][int(j)]
            taken.add(j)
        tracks += [{k: mode} for j, mode in enumerate(sets[k]) if j not in taken]
    return tracks


def _likeness(track: dict[int, Mode], mode: Mode, M: np.ndarray, values: np.ndarray, k: int) -> float:
    before = track[k - 1]
    expected = before.eigenvalue
    if k - 2 in track and values[k - 1] != values[k - 2]:
        slope = (before.eigenvalue - track[k - 2].eigenvalue) / (values[k - 1] - values[k - 2])
        expected = expected + slope * (values[k] - values[k - 1])
    product = abs(np.vdot(before.shape, M @ mode.shape))**2
    norms = np.real(np.vdot(before.shape, M @ before.shape) * np.vdot(mode.shape, M @ mode.shape))
    gap = abs(mode.eigenvalue - expected) / max(abs(mode.eigenvalue), abs(expected), 1e-300)
    return float((product / norms if norms > 0 else 0.0) - min(gap, 1.0))


def _names(tracks: Sequence[dict[int, Mode]]) -> tuple[str, ...]:
    names: list[str] = []
    for track in tracks:
        modes = list(track.values())
        shares = np.sum([m.shares for m in modes], axis=0)
        told = dominant(shares, modes[0].coordinates).split(", ") if shares.any() else [modes[0].name]
        stems = {label.rpartition(" ")[0] for label in told if label.endswith((" cosine", " sine"))}
        for stem in sorted(stems):
            sense = _whirl(modes, stem)
            if sense:
                cyclic = [k for k, label in enumerate(told) if label in (f"{stem} cosine", f"{stem} sine")]
                told = [f"{stem} {sense}" if k == cyclic[0] else label for k, label in enumerate(told) if k not in cyclic[1:]]
        names.append(", ".join(told))
    return tuple(n if names.count(n) == 1 else f"{n} ({names[:k + 1].count(n)})" for k, n in enumerate(names))


def _whirl(modes: Iterable[Mode], stem: str) -> str:
    """Which way the pattern of a set of blades goes round, seen from the fixed frame, if it does."""
    turning = total = 0.0
    for mode in modes:
        c, s = (mode.coordinates.index(f"{stem} {part}") for part in ("cosine", "sine"))
        turning -= float(np.imag(mode.shape[c].conj() * mode.shape[s]))
        total += float(np.sum(np.abs(mode.shape[[c, s]])**2)) / 2
    if not total or abs(turning) < LEAST_WHIRL * total:
        return ""
    return "forward" if turning > 0 else "backward"
