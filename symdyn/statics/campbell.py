"""Campbell diagram: natural frequencies over the speed of a rotor, as the fixed frame sees them.

Modes are followed from speed to speed by the likeness of their shapes (modal assurance criterion, weighed by the mass matrix)
and by how near their eigenvalues are to those extrapolated.
Source: Allemang, The modal assurance criterion, Sound and Vibration (August 2003).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.optimize

from symdyn.errors import ArgumentError, NoEquilibrium
from symdyn.real_numbers import real_of
from symdyn.shown import name_of, shown
from symdyn.statics.analysis import decade
from symdyn.statics.equilibrium import begin, find, settled, steps
from symdyn.statics.manifold import Manifold, in_motion
from symdyn.statics.modes import Mode, Modes, dominant, modes_of, sense_of
from symdyn.statics.multiblade import Averaged, Steady, rotor_of, steady
from symdyn.statics.selection import Selection, listed, select
from symdyn.statics.spectrum import Unknown, spectrum
from symdyn.statics.stability import of_manifold
from symdyn.statics.terms import OperatingPoint

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from symdyn.given import PathName
    from symdyn.runtime.module import Module
    from symdyn.statics.equilibrium import Equilibrium

# State matrices in multi-blade coordinates are the same at all azimuths if entries differ by this part of the largest, scaled.
CONSTANT = 1e-9
# Orders of blades that are tried where theirs makes nothing constant, at most of so many blades.
MOST_BLADES = 6
FRAMES = ("fixed", "rotating")


@dataclass(frozen=True, eq=False)
class Campbell:
    """Modes over rotor speed; prints as a table.

    speed         name; values (n,): its values, rad/s
    eigenvalues   (n, n_modes) complex, 1/s; NaN where a mode could not be followed
    names         by the coordinates with most kinetic energy over all speeds; of blades also "collective", and "forward" or
                  "backward" where their pattern goes round with the rotor or against it, seen from the fixed frame; without
                  named blades by the mean of the modes' whirl, see Mode.whirl
    modes         at every speed, as found; equilibria: the states they are about (Equilibrium; multiblade.Steady, the mean over
                  a turn;
                  Stability of a periodic motion)
    frame         "fixed" or "rotating": who sees these frequencies; held: names of what is held
    varies        of averaged equations, by what part of their largest entry they differ over a turn

    >>> a, b, phi = sd.coordinates("a b phi")
    >>> system = sd.System("disc")
    >>> yoke, gimbal = system.add_body("yoke", mass=0), system.add_body("gimbal", mass=0)
    >>> disc = system.add_body("disc", mass=1, inertia=[0.5, 0.5, 0.8])
    >>> x = system.add_joint(sd.Revolute("x", system.ground, yoke, a, axis=[1, 0, 0]))
    >>> y = system.add_joint(sd.Revolute("y", yoke, gimbal, b, axis=[0, 1, 0]))
    >>> spin = system.add_joint(sd.Revolute("spin", gimbal, disc, phi, axis=[0, 0, 1]))
    >>> system.add_joint_force(x, -50 * a)
    >>> system.add_joint_force(y, -72 * b)
    >>> diagram = system.compile(backend="numpy").campbell("phi_dot", [0.0, 2.0])
    >>> diagram.speed, diagram.names
    ('phi_dot', ('a backward', 'b forward'))
    """

    title: str
    speed: str
    values: np.ndarray
    eigenvalues: np.ndarray
    names: tuple[str, ...]
    modes: tuple[Modes, ...]
    equilibria: tuple[Equilibrium, ...]
    frame: str = "fixed"
    held: tuple[str, ...] = ()
    varies: float = 0.0

    @property
    def frequencies(self) -> np.ndarray:
        """|Im eigenvalue| / 2 pi, Hz, (n, n_modes).

        >>> a, b, phi = sd.coordinates("a b phi")
        >>> system = sd.System("disc")
        >>> yoke, gimbal = system.add_body("yoke", mass=0), system.add_body("gimbal", mass=0)
        >>> disc = system.add_body("disc", mass=1, inertia=[0.5, 0.5, 0.8])
        >>> x = system.add_joint(sd.Revolute("x", system.ground, yoke, a, axis=[1, 0, 0]))
        >>> y = system.add_joint(sd.Revolute("y", yoke, gimbal, b, axis=[0, 1, 0]))
        >>> spin = system.add_joint(sd.Revolute("spin", gimbal, disc, phi, axis=[0, 0, 1]))
        >>> system.add_joint_force(x, -50 * a)
        >>> system.add_joint_force(y, -72 * b)
        >>> diagram = system.compile(backend="numpy").campbell("phi_dot", [0.0, 2.0])
        >>> np.round(diagram.frequencies * 2 * np.pi, 6)
        array([[10.      , 12.      ],
               [ 9.228958, 13.002551]])
        """
        return np.asarray(np.abs(self.eigenvalues.imag) / (2 * np.pi))

    @property
    def damping(self) -> np.ndarray:
        """Damping ratios, (n, n_modes); negative where a mode grows.

        >>> a, b, phi = sd.coordinates("a b phi")
        >>> system = sd.System("disc")
        >>> yoke, gimbal = system.add_body("yoke", mass=0), system.add_body("gimbal", mass=0)
        >>> disc = system.add_body("disc", mass=1, inertia=[0.5, 0.5, 0.8])
        >>> x = system.add_joint(sd.Revolute("x", system.ground, yoke, a, axis=[1, 0, 0]))
        >>> y = system.add_joint(sd.Revolute("y", yoke, gimbal, b, axis=[0, 1, 0]))
        >>> spin = system.add_joint(sd.Revolute("spin", gimbal, disc, phi, axis=[0, 0, 1]))
        >>> system.add_joint_force(x, -50 * a)
        >>> system.add_joint_force(y, -72 * b)
        >>> diagram = system.compile(backend="numpy").campbell("phi_dot", [2.0])
        >>> np.round(diagram.damping, 9) + 0.0
        array([[0., 0.]])
        """
        size = np.abs(self.eigenvalues)
        return np.asarray(np.where(size > 0, -self.eigenvalues.real / np.where(size > 0, size, 1.0), 0.0))

    def __getitem__(self, name: str) -> np.ndarray:
        """Frequencies of a mode by its name, Hz, (n,). Raises ArgumentError for an unknown one."""
        if name not in self.names:
            raise ArgumentError(f"{self.title}: there is no mode {shown(name)}; there are {', '.join(self.names)}")
        return np.asarray(self.frequencies[:, self.names.index(name)])

    def plot(self, path: PathName | None = None, harmonics: Sequence[float] = (1, 3, 6), highest: float | None = None) -> Figure:
        """The diagram up to a frequency (Hz), with lines of multiples of the rotor's speed, as a figure; saved to a path.

        By default modes that are far above the others and the lines are left out, which the legend reports. Needs matplotlib.

        >>> a, b, phi = sd.coordinates("a b phi")
        >>> system = sd.System("disc")
        >>> yoke, gimbal = system.add_body("yoke", mass=0), system.add_body("gimbal", mass=0)
        >>> disc = system.add_body("disc", mass=1, inertia=[0.5, 0.5, 0.8])
        >>> x = system.add_joint(sd.Revolute("x", system.ground, yoke, a, axis=[1, 0, 0]))
        >>> y = system.add_joint(sd.Revolute("y", yoke, gimbal, b, axis=[0, 1, 0]))
        >>> spin = system.add_joint(sd.Revolute("spin", gimbal, disc, phi, axis=[0, 0, 1]))
        >>> system.add_joint_force(x, -50 * a)
        >>> system.add_joint_force(y, -72 * b)
        >>> diagram = system.compile(backend="numpy").campbell("phi_dot", [0.0, 2.0])
        >>> figure = diagram.plot()
        >>> figure.axes[0].get_ylabel()
        'damped frequency, fixed frame [Hz]'
        """
        from symdyn.pictures.campbell import plot

        return plot(self, path, harmonics, highest)

    def __repr__(self) -> str:
        width = [max(9, len(n)) for n in self.names]
        held = f", held: {', '.join(self.held)}" if self.held else ""
        mean = f", mean over the azimuth of equations that vary by {decade(self.varies)}" if self.varies > CONSTANT else ""
        lines = [f"{self.title}: damped natural frequencies in the {self.frame} frame, Hz{held}{mean}",
                 f"{self.speed + ' [rad/s]':>16}  " + "  ".join(f"{n:>{w}}" for n, w in zip(self.names, width, strict=True))]
        for value, row in zip(self.values, self.frequencies, strict=True):
            lines.append(f"{value:>16.6g}  " + "  ".join(f"{f:>{w}.5g}" for f, w in zip(row, width, strict=True)))
        for k, name in enumerate(self.names):
            grows = [f"{v:g}" for v, modes, value in zip(self.values, self.modes, self.eigenvalues[:, k], strict=True)
                     if any(m.kind == "unstable" and m.eigenvalue == value for m in modes)]
            lines += [f"unstable: {name} at {', '.join(grows)} rad/s"] if grows else []
        return "\n".join(lines)


def campbell(module: Module, speed: Any, values: Any, free: Any = None, fixed: Any = None, start: Any = None, params: Any = None,
             t: float = 0.0, inputs: Any = None, blades: Sequence[Sequence[Any]] = (), azimuth: Any = None,
             azimuths: int = 12, max_iterations: int = 100, frame: str = "fixed", averaged: bool = False) -> Campbell:
    """See Module.campbell."""
    metadata, owner = module.metadata, module.name
    if frame not in FRAMES:
        raise ArgumentError(f"{owner}: frame must be 'fixed' or 'rotating', found {shown(frame)}")
    if frame == "rotating" and list(blades):
        raise ArgumentError(f"{owner}: blades are named, whose modes are seen from the fixed frame; leave them out, or "
                            f"frame='rotating'")
    named = listed(speed, metadata.u, "speed", owner)
    if len(named) != 1:
        raise ArgumentError(f"{owner}: speed must be one name or symbol, found {shown(speed)}")
    (name,) = named
    numbers, limit = _values(values, owner), steps(max_iterations, owner)
    prescribed = dict(fixed or {})
    if name in {name_of(k) for k in prescribed}:
        raise ArgumentError(f"{owner}: {name} is in fixed, too; leave it out there")
    if isinstance(blades, str) or not isinstance(blades, Iterable):
        raise ArgumentError(f"{owner}: blades must be a list of sets of coordinates, found {shown(blades)}")
    groups = [listed(group, metadata.q, "blades", owner) for group in blades]
    if isinstance(azimuths, bool) or not isinstance(azimuths, (int, np.integer)):
        raise ArgumentError(f"{owner}: azimuths must be a whole number, found {shown(azimuths)}")
    turned = listed(azimuth if azimuth is not None else name.removesuffix("_dot"), metadata.q, "azimuth", owner)[0] \
        if groups or azimuth is not None else None
    result: list[_Found] = []
    last: Any = start
    for value in numbers:
        selection = select(module, free, {**prescribed, name: value}, None)
        point = begin(module, selection, None if isinstance(last, (Steady, dict)) else last, params, t, inputs)
        selection = settled(point, selection)
        title = f"{owner} at {name} = {value:g}"
        if groups:
            assert turned is not None
            each = _of_blades(module, point, selection, (name, turned, groups), int(azimuths), last, title, averaged)
        else:
            each = _of_rotor(point, selection, limit, frame, title)
        result.append(each)
        last = each.start
    sets = [each.modes for each in result]
    tracks = follow(sets, [each.inertia for each in result], numbers)
    eigenvalues = np.full((len(numbers), len(tracks)), complex(np.nan, np.nan))
    for j, track in enumerate(tracks):
        for k, mode in track.items():
            eigenvalues[k, j] = mode.eigenvalue
    held = selection.held
    return Campbell(owner, name, numbers, eigenvalues, _names(tracks, numbers), tuple(sets), tuple(each.about for each in result),
                    frame, held, max(each.varies for each in result) if averaged else 0.0)


@dataclass(frozen=True, eq=False)
class _Found:
    """Modes at one speed, the mass matrix that compares their shapes, what they are about, and where to begin next; varies: the
    part of the largest entry by which averaged equations differ over a turn."""

    modes: Modes
    inertia: np.ndarray
    about: Any
    start: Any
    varies: float = 0.0


def _of_rotor(point: OperatingPoint, selection: Selection, limit: int, frame: str, title: str) -> _Found:
    """Without named blades."""
    start: Any
    try:
        about: Any = find(point, selection, limit)
        manifold, start = Manifold(in_motion(about.point, selection), selection), about
    except NoEquilibrium as error:
        if "module.stability" not in str(error):
            raise
        about, start, manifold = None, None, Manifold(in_motion(point, selection), selection)
    result = of_manifold(manifold, rotating=frame == "rotating")
    return _Found(Modes(title, result.modes, result.modes.notes), manifold.inertia, about or result, start)


def _of_blades(module: Module, point: OperatingPoint, selection: Selection, names: tuple[str, str, list[list[str]]],
               azimuths: int, last: Any,
               title: str, averaged: bool) -> _Found:
    speed, azimuth, groups = names
    rotor = rotor_of(module, selection, speed, azimuth, groups)
    if azimuths < 1:
        raise ArgumentError(f"{module.name}: {azimuths} azimuths requested; at least 1 is needed")
    # Not in step with any number of blades: harmonics of the rotation average out.
    at = 2 * np.pi * np.arange(azimuths) / azimuths
    omega = float(selection.values[speed])
    if isinstance(last, Steady):
        begun = Steady(rotor, point.at(x=last.point.x), last.a, omega, at)
    else:
        T = rotor.transform(float(point.x[rotor.azimuth]))[0]
        q = np.zeros(len(rotor.free))
        q[rotor.rows] = point.x[list(rotor.coordinates)]
        begun = Steady(rotor, point, np.linalg.solve(T, q), omega, at)
    about, linear = steady(begun)
    size = _scaled_size(linear)
    varies = float(size.max(initial=0.0))
    if varies > CONSTANT:
        _demand_order(about, varies, groups)
    if varies <= CONSTANT or averaged:
        unknown = 1e-14 * np.abs(linear.A()) + (4 * linear.spread if varies <= CONSTANT else 0.0)
        result = spectrum(linear.A(), Unknown.of(unknown))
        modes = [_patterned(mode, omega) for mode in modes_of(result, linear.shapes, title)]
        return _Found(Modes(title, modes), linear.M, about, about, varies)
    state = about.at(0.0)[0]
    manifold = Manifold(in_motion(state, selection), selection)
    judged = of_manifold(manifold)
    into = _into_blades(about, manifold)
    modes = [_patterned(_in_blades(mode, into, linear), omega) for mode in judged.modes]
    names_of = [m.name for m in modes]
    numbered = [m if names_of.count(m.name) == 1 else replace(m, name=f"{m.name} ({names_of[:k + 1].count(m.name)})")
                for k, m in enumerate(modes)]
    return _Found(Modes(title, numbered, judged.modes.notes), linear.M, about, about)


def _scaled_size(linear: Averaged) -> np.ndarray:
    """The spread of the state matrix relative to its largest entry, metres and radians on one footing."""
    weights = np.sqrt(np.abs(np.diag(linear.M)))
    scale = np.concatenate([weights, weights])
    A = np.abs(linear.A()) * (scale[:, None] / scale)
    return np.asarray(linear.spread * (scale[:, None] / scale) / max(float(A.max(initial=0.0)), 1e-300))


def _demand_order(about: Steady, size: float, groups: list[list[str]]) -> None:
    """Raises ArgumentError if the blades in another order make the equations constant, or much more nearly so."""
    count = len(groups[0])
    if count > MOST_BLADES or any(len(g) != count for g in groups):
        return
    best, order = size, tuple(range(count))
    for tail in itertools.permutations(range(1, count)):
        other = (0, *tail)
        rotor = rotor_of(about.rotor.module, _selection_of(about), about.point.module.metadata.u[about.rotor.speed],
                         about.point.module.metadata.q[about.rotor.azimuth], [[g[k] for k in other] for g in groups])
        T = about.rotor.transform(0.0)[0]
        q = T @ about.a
        turned = Steady(rotor, about.point, np.linalg.solve(rotor.transform(0.0)[0], q), about.omega, about.azimuths)
        result = float(_scaled_size(turned.averages()[1]).max(initial=0.0))
        if result < 0.1 * best:
            best, order = result, other
    if order != tuple(range(count)):
        right = [tuple(g[k] for k in order) for g in groups]
        raise ArgumentError(f"{about.point.module.name}: blades: in this order multi-blade coordinates do not make the "
                            f"equations constant "
                            f"(entries differ by {size:.2g} of the largest over a turn); in the order {right} they differ by "
                            f"{best:.2g}: name the blades as they lie ahead of each other in the sense of the azimuth")


def _selection_of(about: Steady) -> Selection:
    """A selection with the coordinates of a rotor free."""
    module = about.point.module
    free = {about.point.module.metadata.u[k] for k in about.rotor.free}
    kept = tuple(u for u in module.metadata.u if u not in free)
    return Selection(module, kept, {})


def _into_blades(about: Steady, manifold: Manifold) -> np.ndarray:
    """Multi-blade coordinates of displacements eta at azimuth zero, (n, n_d)."""
    rows = [manifold.displacements.index(k) for k in about.rotor.free]
    T = about.rotor.transform(0.0)[0]
    return np.asarray(np.linalg.inv(T)[:, np.argsort(rows)])


def _in_blades(mode: Mode, into: np.ndarray, linear: Averaged) -> Mode:
    """A mode named by multi-blade coordinates at azimuth zero."""
    amplitudes = into @ mode.right[:into.shape[1]]
    energies = np.abs(np.real(amplitudes.conj() * (linear.M @ amplitudes)))
    if not energies.sum() > 0:
        return mode
    shares = energies / energies.sum()
    leader = int(np.argmax(np.round(shares, 6)))
    return replace(mode, shape=amplitudes / amplitudes[leader], shares=shares, name=dominant(shares, linear.labels),
                   coordinates=linear.labels)


def _values(values: Any, owner: str) -> np.ndarray:
    numbers = np.array(real_of(values, owner, "values must be speeds in rad/s"), ndmin=1)
    if numbers.ndim != 1 or not len(numbers) or not np.isfinite(numbers).all():
        raise ArgumentError(f"{owner}: values must be speeds in rad/s, found {shown(values)}")
    return numbers


def follow(sets: Sequence[Modes], inertias: Sequence[np.ndarray], values: np.ndarray) -> list[dict[int, Mode]]:
    """Tracks, each index among the values -> mode: every mode goes on in the one most like it, all of them taken together.

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


def _names(tracks: Sequence[dict[int, Mode]], values: np.ndarray) -> tuple[str, ...]:
    names: list[str] = []
    for track in tracks:
        modes = list(track.values())
        shares = np.sum([m.shares for m in modes], axis=0)
        leading = dominant(shares, modes[0].coordinates).split(", ") if shares.any() else [modes[0].name]
        stems = {label.rpartition(" ")[0] for label in leading if label.endswith((" cosine", " sine"))}
        for stem in sorted(stems):
            sense = _whirl(track, stem, values)
            if sense:
                cyclic = [k for k, label in enumerate(leading) if label in (f"{stem} cosine", f"{stem} sine")]
                leading = [f"{stem} {sense}" if k == cyclic[0] else label
                           for k, label in enumerate(leading) if k not in cyclic[1:]]
        names.append(", ".join(leading) + ("" if stems else _sense(modes)))
    return tuple(n if names.count(n) == 1 else f"{n} ({names[:k + 1].count(n)})" for k, n in enumerate(names))


def _sense(modes: Sequence[Mode]) -> str:
    """Sense in which the displacements of a mode go round the axis of the rotor, if they do, in the mean over the speeds."""
    translation, tilt = np.mean([mode.whirls for mode in modes], axis=0)
    sense = sense_of(float(np.mean([mode.whirl for mode in modes])), (float(translation), float(tilt)))
    return f" {sense}" if sense else ""


def _whirl(track: dict[int, Mode], stem: str, values: np.ndarray) -> str:
    """Sense in which the pattern of a set of blades goes round, with the rotor or against it, seen from the fixed frame, if it
    does."""
    turning, total = np.sum([_pattern(mode, stem, float(values[k])) for k, mode in track.items()], axis=0)
    return sense_of(float(turning / total), (0.0, 0.0)) if total else ""


def _pattern(mode: Mode, stem: str, speed: float) -> tuple[float, float]:
    """Amount by which the pattern of a set of blades goes round, with the rotor positive, and its part of a round whirl."""
    c, s = (mode.coordinates.index(f"{stem} {part}") for part in ("cosine", "sine"))
    turning = -float(np.imag(mode.shape[c].conj() * mode.shape[s])) * (1.0 if speed >= 0 else -1.0)
    return turning, float(np.sum(np.abs(mode.shape[[c, s]])**2)) / 2


def _patterned(mode: Mode, speed: float) -> Mode:
    """A mode in multi-blade coordinates with the whirl of the pattern of its blades, where these name it."""
    stems = dict.fromkeys(n.rpartition(" ")[0] for n in mode.name.split(", ") if n.endswith((" cosine", " sine")))
    if not stems or not mode.shares.any():
        return mode
    turning, total = np.sum([_pattern(mode, stem, speed) for stem in stems], axis=0)
    return replace(mode, whirl=float(turning / total), whirls=(0.0, 0.0)) if total else mode
