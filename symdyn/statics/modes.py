"""Natural modes of a linear model: frequencies, damping ratios, shapes named by the coordinates that carry their energy."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.linalg

from symdyn.errors import ArgumentError
from symdyn.shown import name_of, shown
from symdyn.statics.spectrum import Spectrum

# Coordinates with at least this share of the kinetic energy of the largest are named.
NAMED = 0.35
# A motion across the axis of a rotor goes round if it whirls by so much: 1 is a circle, 0 a straight line.
LEAST_WHIRL = 0.2
# Eigenvalues that differ by this part are one, several times, and share a space of shapes.
SAME = 1e-10


@dataclass(frozen=True, eq=False)
class Shapes:
    """Shapes that name eigenvectors of states [eta; zeta; z']: their kinetic energy and the speeds that they move.

    M            (n, n) of what carries the energy, and Z (n_u, n) that gives all speeds from it: of eta where there are as many
                 displacements as speeds, else of zeta (`by_speeds`)
    sizes        numbers of eta, zeta and z'; labels: of what carries the energy; state_labels: of z'
    displaced    (n_u, n_d) that gives what moves from eta, and names of eta: of displacements that carry no energy
    """

    M: np.ndarray
    Z: np.ndarray
    sizes: tuple[int, int, int]
    labels: tuple[str, ...]
    state_labels: tuple[str, ...]
    displaced: tuple[np.ndarray, tuple[str, ...]]
    by_speeds: bool = False

    def amplitudes(self, right: np.ndarray) -> np.ndarray:
        """Amplitudes of an eigenvector (m,) that carry the energy, (n,): displacements, or speeds where these alone move."""
        n_d, n_s, _ = self.sizes
        eta, zeta = right[:n_d], right[n_d:n_d + n_s]
        if self.by_speeds:
            return zeta if np.abs(zeta).max(initial=0.0) > 1e-8 * np.abs(right).max(initial=0.0) else np.zeros_like(zeta)
        return eta if np.abs(eta).max(initial=0.0) > 1e-9 * np.abs(right).max(initial=0.0) else zeta


@dataclass(frozen=True, eq=False)
class Mode:
    """One mode.

    eigenvalue   1/s, of a pair the one with positive imaginary part
    shape        (n_u,) complex amplitudes of all velocities v (see linear); that of the leading coordinate is 1
    coordinates  names of the independent ones; shares: of each in the kinetic energy, sum 1, (n,)
    kind         "oscillation", "real" (creeps back), "zero" (neither returns nor leaves), "unstable", or "not decided" where
                 rounding hides whether it grows or decays
    name         coordinates with the largest shares
    right, left  eigenvectors of the state matrix
    harmonics    of a periodic motion: (multiple k of its frequency, share of the energy) of the parts of the shape that move with
                 exp((eigenvalue + i k 2 pi / period) t), seen from the fixed frame, the largest first
    whirl        from -1 to 1: how round displacements go about the axis of a rotor, positive in the sense of its rotation; 0
                 where translation and tilt go in opposite senses
    whirls       the same of translation and of tilt apart; 0 of what takes no part

    >>> linear = sd.systems.pendulum().compile(backend="numpy").linearize({"q1": 0.0}, params={"l": 9.81})
    >>> mode = linear.modes()[0]
    >>> mode.name, round(mode.omega, 9), round(mode.period / np.pi, 9)
    ('q1', 1.0, 2.0)
    """

    eigenvalue: complex
    shape: np.ndarray
    shares: np.ndarray
    kind: str
    name: str
    coordinates: tuple[str, ...]
    right: np.ndarray
    left: np.ndarray
    harmonics: tuple[tuple[int, float], ...] = ()
    whirl: float = 0.0
    whirls: tuple[float, float] = (0.0, 0.0)

    @property
    def sense(self) -> str:
        """Sense in which the mode goes round with respect to the rotation, seen from the fixed frame; see `sense_of`.

        >>> linear = sd.systems.pendulum().compile(backend="numpy").linearize({"q1": 0.0}, params={"l": 9.81})
        >>> linear.modes()[0].sense
        ''
        """
        return sense_of(self.whirl, self.whirls)

    @property
    def omega(self) -> float:
        """|eigenvalue|, natural frequency without its damping, rad/s.

        >>> linear = sd.systems.pendulum().compile(backend="numpy").linearize({"q1": 0.0}, params={"l": 9.81})
        >>> round(linear.modes()[0].omega, 9)
        1.0
        """
        return abs(self.eigenvalue)

    @property
    def frequency(self) -> float:
        """|eigenvalue| / 2 pi, Hz.

        >>> linear = sd.systems.pendulum().compile(backend="numpy").linearize({"q1": 0.0}, params={"l": 9.81})
        >>> round(2 * np.pi * linear.modes()[0].frequency, 9)
        1.0
        """
        return self.omega / (2 * np.pi)

    @property
    def damped_frequency(self) -> float:
        """|Im eigenvalue| / 2 pi: what a free decay shows, Hz.

        >>> linear = sd.systems.pendulum().compile(backend="numpy").linearize({"q1": 0.0}, params={"l": 9.81})
        >>> round(2 * np.pi * linear.modes()[0].damped_frequency, 9)
        1.0
        """
        return abs(self.eigenvalue.imag) / (2 * np.pi)

    @property
    def period(self) -> float:
        """Period of the damped oscillation, s; infinite for real eigenvalues.

        >>> linear = sd.systems.pendulum().compile(backend="numpy").linearize({"q1": 0.0}, params={"l": 9.81})
        >>> round(linear.modes()[0].period / np.pi, 9)
        2.0
        """
        return 1 / self.damped_frequency if self.eigenvalue.imag else np.inf

    @property
    def time_constant(self) -> float:
        """1 / |Re eigenvalue|: the time in which it changes by a factor e, s; infinite if it neither grows nor decays.

        >>> linear = sd.systems.pendulum().compile(backend="numpy").linearize({"q1": 0.0}, params={"l": 9.81})
        >>> linear.modes()[0].time_constant
        inf
        """
        return 1 / abs(self.eigenvalue.real) if self.eigenvalue.real else np.inf

    @property
    def damping(self) -> float:
        """Damping ratio, -Re / |eigenvalue|; 0 of a zero eigenvalue.

        >>> linear = sd.systems.pendulum().compile(backend="numpy").linearize({"q1": 0.0}, params={"l": 9.81})
        >>> round(linear.modes()[0].damping, 9) + 0.0
        0.0
        """
        return 0.0 - self.eigenvalue.real / self.omega if self.kind != "zero" else 0.0

    def __repr__(self) -> str:
        if self.kind == "zero":
            return f"<Mode {self.name}: zero>"
        if not self.eigenvalue.imag:
            return f"<Mode {self.name}: time constant {self.time_constant:.6g} s, {self.kind}>"
        sense = f", {self.sense}" if self.sense else ""
        return f"<Mode {self.name}: {self.frequency:.6g} Hz, damping {self.damping:.3g}, {self.kind}{sense}>"


class Modes:
    """Modes in the order of their natural frequencies; prints as a table. An index is a number, a name, or its first part.

    >>> modes = sd.systems.double_pendulum().compile(backend="numpy").linearize({"q1": -np.pi / 2, "q2": 0.0}).modes()
    >>> len(modes), round(float(modes[0].period), 6)
    (2, 2.344372)
    >>> modes
    double_pendulum: modes
         mode       f [Hz]  omega [rad/s]  damped period [s]    damping  time constant [s]  kind
      0  q1       0.426553        2.68011            2.34437          0                     oscillation
      1  q2        1.14411        7.18867            0.87404          0                     oscillation
    shapes: q1, q2 in rad
    neutral: no exponent is positive, and those that are zero have as many eigenvectors (2 undamped oscillations)
    """

    def __init__(self, title: str, modes: Iterable[Mode], notes: Sequence[str] = ()) -> None:
        self.title = title
        self.modes = tuple(modes)
        self.notes = tuple(notes)

    def __len__(self) -> int:
        return len(self.modes)

    def __iter__(self) -> Any:
        return iter(self.modes)

    def __getitem__(self, key: Any) -> Mode:
        """Raises ArgumentError for a name that no mode, or more than one, has."""
        if isinstance(key, (int, np.integer)):
            if not -len(self) <= key < len(self):
                raise ArgumentError(f"{self.title}: mode {key} requested; there are {len(self)}, numbered from 0")
            return self.modes[key]
        name = name_of(key)
        exact = [m for m in self.modes if m.name == name] or [m for m in self.modes if m.name.split(", ")[0] == name]
        if len(exact) != 1:
            raise ArgumentError(f"{self.title}: {len(exact)} modes are named {shown(name)}; there are "
                                f"{'; '.join(f'{k}: {m.name}' for k, m in enumerate(self.modes))}; pass the number")
        return exact[0]

    @property
    def frequencies(self) -> np.ndarray:
        """Natural frequencies, Hz, (n_modes,).

        >>> modes = sd.systems.pendulum().compile(backend="numpy").linearize({"q1": 0.0}, params={"l": 9.81}).modes()
        >>> np.round(2 * np.pi * modes.frequencies, 6)
        array([1.])
        """
        return np.array([m.frequency for m in self.modes])

    @property
    def eigenvalues(self) -> np.ndarray:
        """(n_modes,) complex.

        >>> modes = sd.systems.pendulum().compile(backend="numpy").linearize({"q1": 0.0}, params={"l": 9.81}).modes()
        >>> np.round(modes.eigenvalues.imag, 6)
        array([1.])
        """
        return np.array([m.eigenvalue for m in self.modes], dtype=complex)

    def __repr__(self) -> str:
        width = max([4, *[len(m.name) for m in self.modes]])
        whirls = any(m.sense for m in self.modes)  # a column of its own where a mode goes round
        lines = [self.title, f"{'':>3}  {'mode':<{width}}  {'f [Hz]':>11}  {'omega [rad/s]':>13}  {'damped period [s]':>17}  "
                             f"{'damping':>9}  {'time constant [s]':>17}  " + (f"{'kind':<11}  whirl" if whirls else "kind")]
        for k, m in enumerate(self.modes):
            oscillates = bool(m.eigenvalue.imag)
            numbers = [f"{m.frequency:>11.6g}" if oscillates else f"{'':>11}",
                       f"{m.omega:>13.6g}" if oscillates else f"{'':>13}",
                       f"{m.period:>17.6g}" if oscillates else f"{'':>17}",
                       f"{m.damping:>9.4g}" if oscillates else f"{'':>9}",
                       f"{m.time_constant:>17.6g}" if np.isfinite(m.time_constant) else f"{'':>17}"]
            kind = f"{m.kind:<11}  {m.sense}".rstrip() if whirls else m.kind
            lines.append(f"{k:>3}  {m.name:<{width}}  {'  '.join(numbers)}  {kind}")
        return "\n".join([*lines, *self.notes])


def modes_of(spectrum: Spectrum, shapes: Shapes, title: str, notes: Sequence[str] = (), values: np.ndarray | None = None,
             seen: Sequence[Any] = ()) -> Modes:
    """The modes, one for each pair of complex eigenvalues; of a group of equal ones each with a shape of its own.

    values, seen   in place of the eigenvalues, and frames.Seen of each: of periodic motions, and in turning axes
    """
    values = settled_values(spectrum) if values is None else values
    right = _parted(values, spectrum.right, spectrum.left, shapes)
    undecided = set(spectrum.undecided.tolist())
    result = []
    for k in ordered(values).tolist():
        value = complex(values[k])
        if value.imag < 0:
            continue
        kind = "zero" if k in set(spectrum.zeros.tolist()) else "not decided" if k in undecided else \
            "unstable" if spectrum.signs[k] > 0 else "oscillation" if value.imag else "real"
        mode = _mode(shapes, value, right[:, k], spectrum.left[:, k], kind)
        result.append(replace(mode, harmonics=seen[k].harmonics, whirl=seen[k].whirl, whirls=seen[k].whirls) if seen else mode)
    result = _paired(result)
    names = [m.name for m in result]
    return Modes(title, [m if names.count(m.name) == 1 else replace(m, name=f"{m.name} ({names[:k + 1].count(m.name)})")
                         for k, m in enumerate(result)], notes)


def sense_of(whirl: float, whirls: tuple[float, float]) -> str:
    """The sense of a whirl: "forward" (with the rotation), "backward" (against it), or "" where nothing goes round.

    Translation and tilt may go round in opposite senses, as on bearings that are not isotropic. Each is named then, such as
    "forward (translation), backward (tilt)": one word for both would depend on the length that tilts are weighed by.
    Source: Muszynska, Forward and backward precession of a vertical anisotropically supported rotor, J. Sound Vib. 192 (1996).
    """
    def word(value: float) -> str:
        return "" if abs(value) < LEAST_WHIRL else "forward" if value > 0 else "backward"

    if whirls[0] * whirls[1] >= 0:
        return word(whirl)
    return ", ".join(f"{word(each)} ({what})" for each, what in zip(whirls, ("translation", "tilt"), strict=True) if word(each))


def ordered(values: np.ndarray) -> np.ndarray:
    """Indices of eigenvalues by size, those of one size by frequency, growing ones before decaying ones."""
    sizes = np.abs(values)
    with np.errstate(divide="ignore"):
        steps = np.where(sizes > 0, np.round(np.log(sizes), 9), -np.inf)
    return np.asarray(np.lexsort((-values.real, values.imag, steps)))


def settled_values(spectrum: Spectrum) -> np.ndarray:
    """Eigenvalues without what is rounding alone: zeros are zero, undamped oscillations have no real part, (m,) complex."""
    values = spectrum.values.copy()
    values[spectrum.zeros] = 0.0
    kept = [k for k in spectrum.imaginary if k not in set(spectrum.undecided.tolist())]
    values[kept] = 1j * values[kept].imag
    return values


def _parted(values: np.ndarray, right: np.ndarray, left: np.ndarray, shapes: Shapes) -> np.ndarray:
    """Eigenvectors of equal eigenvalues made different: each moves one coordinate that the others leave alone."""
    result = right.copy()
    scale = np.abs(values)
    done: set[int] = set()
    for k in range(len(values)):
        group = [j for j in range(len(values)) if abs(values[j] - values[k]) <= SAME * max(scale[k], scale[j])]
        if k in done or len(group) < 2:
            continue
        done |= set(group)
        weights = np.concatenate([np.sqrt(np.abs(np.diag(shapes.M))), np.zeros(len(right) - len(shapes.M))])
        rows = (right[:, group] * np.roll(weights, shapes.sizes[0] if shapes.by_speeds else 0)[:, None])
        if np.linalg.matrix_rank(rows, tol=1e-6 * np.abs(rows).max(initial=0.0)) < len(group):
            continue
        pivots = scipy.linalg.qr(rows.T, mode="r", pivoting=True)[1][:len(group)]
        result[:, group] = right[:, group] @ np.linalg.inv(right[np.ix_(pivots, group)])
    return result


def _paired(modes: list[Mode]) -> list[Mode]:
    """A zero eigenvalue comes twice, once for the position and once for the speed: listed once."""
    kept: list[Mode] = []
    for mode in modes:
        twin = [m for m in kept if mode.kind == m.kind == "zero" and abs(np.vdot(m.shape, mode.shape)) >
                (1 - 1e-6) * np.linalg.norm(m.shape) * np.linalg.norm(mode.shape)]
        if not twin:
            kept.append(mode)
    return kept


def _mode(shapes: Shapes, value: complex, right: np.ndarray, left: np.ndarray, kind: str) -> Mode:
    amplitudes = shapes.amplitudes(right)
    shape = shapes.Z @ amplitudes
    energies = np.abs(np.real(amplitudes.conj() * (shapes.M @ amplitudes)))
    inner = sum(shapes.sizes[:2])
    states = np.abs(right[inner:])
    if energies.sum() > 0 and not (states.size and np.abs(right[:inner]).max(initial=0.0) <= 1e-9 * states.max()):
        shares = energies / energies.sum()
        leader = int(np.argmax(np.round(shares, 6)))
        shape, right = shape / amplitudes[leader], right / amplitudes[leader]
        name = dominant(shares, shapes.labels)
    elif states.size:  # of the extra states alone
        shares = np.zeros(len(shapes.labels))
        name = shapes.state_labels[int(np.argmax(states))]
    else:  # displacements that carry no energy, of velocity constraints
        shares = np.zeros(len(shapes.labels))
        along, names = shapes.displaced
        leader = int(np.argmax(np.abs(right[:len(names)])))
        shape, right, name = along @ right[:len(names)] / right[leader], right / right[leader], names[leader]
    return Mode(value, shape, shares, kind, name, shapes.labels, right, left)


def dominant(shares: np.ndarray, labels: tuple[str, ...]) -> str:
    """Names of the coordinates with the largest shares, at most three; about equal ones in their order."""
    relative = shares / shares.max()
    order = np.argsort(-np.round(5 * relative), kind="stable")
    return ", ".join([labels[i] for i in order if relative[i] >= NAMED][:3])
