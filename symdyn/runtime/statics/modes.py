"""Natural modes of a linear model: frequencies, damping ratios, shapes named by the coordinates that carry their energy."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
import scipy.linalg

from symdyn.errors import ArgumentError

# Eigenvalues below this part of the largest are zero but for rounding: double ones split by the root of it.
ZERO = 1e-7
# Entries of the state matrix below this part of the largest are rounding.
NOISE = 1e-18
# Coordinates with at least this share of the kinetic energy of the largest are named.
NAMED = 0.35


class Linear(Protocol):
    """M zeta_dot + C zeta + K eta + ... = 0, as linear.Reduced and multiblade.Averaged give it.

    inertia, Z     of all velocities v, (n_u, n_u), and v = Z eta; labels: names of eta; state_labels: of the extra states
    second_order   whether M, C, K say all
    """

    @property
    def M(self) -> np.ndarray: ...

    @property
    def C(self) -> np.ndarray: ...

    @property
    def K(self) -> np.ndarray: ...

    @property
    def Z(self) -> np.ndarray: ...

    @property
    def inertia(self) -> np.ndarray: ...

    @property
    def labels(self) -> tuple[str, ...]: ...

    @property
    def state_labels(self) -> tuple[str, ...]: ...

    @property
    def second_order(self) -> bool: ...

    def state_matrices(self) -> tuple[np.ndarray, np.ndarray]: ...


@dataclass(frozen=True, eq=False)
class Mode:
    """One mode.

    eigenvalue   1/s, of a pair the one with positive imaginary part
    shape        (n_u,) complex amplitudes of all velocities v (see linear); that of the leading coordinate is 1
    coordinates  names of the independent ones; shares: of each in the kinetic energy, sum 1, (n,)
    kind         "oscillation", "real" (creeps back), "zero" (neither returns nor leaves) or "unstable"
    name         coordinates with the largest shares
    right, left  eigenvectors of the state matrix
    """

    eigenvalue: complex
    shape: np.ndarray
    shares: np.ndarray
    kind: str
    name: str
    coordinates: tuple[str, ...]
    right: np.ndarray
    left: np.ndarray

    @property
    def omega(self) -> float:
        """|eigenvalue|, natural frequency without its damping, rad/s."""
        return abs(self.eigenvalue)

    @property
    def frequency(self) -> float:
        """|eigenvalue| / 2 pi, Hz."""
        return self.omega / (2 * np.pi)

    @property
    def damped_frequency(self) -> float:
        """|Im eigenvalue| / 2 pi: what a free decay shows, Hz."""
        return abs(self.eigenvalue.imag) / (2 * np.pi)

    @property
    def period(self) -> float:
        """Of the damped oscillation, s; infinite for real eigenvalues."""
        return 1 / self.damped_frequency if self.eigenvalue.imag else np.inf

    @property
    def damping(self) -> float:
        """Damping ratio, -Re / |eigenvalue|; 0 of a zero eigenvalue."""
        return 0.0 - self.eigenvalue.real / self.omega if self.kind != "zero" else 0.0

    def __repr__(self) -> str:
        return f"<Mode {self.name}: {self.frequency:.6g} Hz, damping {self.damping:.3g}, {self.kind}>"


class Modes:
    """Modes in the order of their natural frequencies; prints as a table. An index is a number, a name, or its first part."""

    def __init__(self, title: str, modes: list[Mode]) -> None:
        self.title = title
        self.modes = tuple(modes)

    def __len__(self) -> int:
        return len(self.modes)

    def __iter__(self) -> Any:
        return iter(self.modes)

    def __getitem__(self, key: Any) -> Mode:
        """Raises ArgumentError for a name that no mode, or more than one, has."""
        if isinstance(key, (int, np.integer)):
            if not -len(self) <= key < len(self):
                raise ArgumentError(f"{self.title}: mode {key} asked for; there are {len(self)}, numbered from 0")
            return self.modes[key]
        name = str(getattr(key, "name", key))
        exact = [m for m in self.modes if m.name == name] or [m for m in self.modes if m.name.split(", ")[0] == name]
        if len(exact) != 1:
            raise ArgumentError(f"{self.title}: {len(exact)} modes are named {name!r}; there are "
                                f"{'; '.join(f'{k}: {m.name}' for k, m in enumerate(self.modes))}; pass the number")
        return exact[0]

    @property
    def frequencies(self) -> np.ndarray:
        """Natural frequencies, Hz, (n_modes,)."""
        return np.array([m.frequency for m in self.modes])

    @property
    def eigenvalues(self) -> np.ndarray:
        """(n_modes,) complex."""
        return np.array([m.eigenvalue for m in self.modes], dtype=complex)

    def __repr__(self) -> str:
        width = max([4, *[len(m.name) for m in self.modes]])
        lines = [self.title, f"{'':>3}  {'mode':<{width}}  {'f [Hz]':>11}  {'omega [rad/s]':>13}  {'period [s]':>11}  "
                             f"{'damping':>9}  kind"]
        for k, m in enumerate(self.modes):
            lines.append(f"{k:>3}  {m.name:<{width}}  {m.frequency:>11.6g}  {m.omega:>13.6g}  {m.period:>11.6g}  "
                         f"{m.damping:>9.4g}  {m.kind}")
        return "\n".join(lines)


def eigen(linear: Linear) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Eigenvalues (m,), right (m, m) and left (m, m) eigenvectors of the state matrix, columns; w^H A = lambda w^H.

    Without damping and with symmetric K by the symmetric problem, whose eigenvalues carry no damping from rounding.
    """
    M, C, K = linear.M, linear.C, linear.K
    size = float(np.abs(K).max(initial=0.0))
    loose = np.abs(C).max(initial=0.0) <= 1e-14 * np.sqrt(size * np.abs(M).max(initial=0.0))
    if linear.second_order and loose and np.abs(K - K.T).max(initial=0.0) <= 1e-11 * size:
        squares, shapes = scipy.linalg.eigh((K + K.T) / 2, (M + M.T) / 2)
        squares = np.where(np.abs(squares) <= ZERO**2 * np.abs(squares).max(initial=0.0), 0.0, squares)
        roots = np.sqrt(-squares.astype(complex))
        values = np.concatenate([roots, -roots]) + 0.0  # no negative zeros
        right = np.vstack([np.hstack([shapes, shapes]), np.hstack([shapes * roots, -shapes * roots])])
        # w = M x (conj(lambda), 1), up to a factor: from w^H A = lambda w^H with symmetric M and K.
        pulled = M @ shapes
        left = np.vstack([np.hstack([pulled * roots.conj(), -pulled * roots.conj()]), np.hstack([pulled, pulled])])
        return values, right, left
    A, _ = linear.state_matrices()
    # Metres and radians on one footing.
    scale = np.sqrt(np.abs(np.diag(M)))
    scale = np.concatenate([scale, scale, np.ones(len(A) - 2 * len(scale))])
    scaled = A * scale[:, None] / scale
    # Rounding in place of zeros misleads the balancing of LAPACK, which would scale it up.
    scaled[np.abs(scaled) < NOISE * np.abs(scaled).max(initial=0.0)] = 0.0
    values, left, right = scipy.linalg.eig(scaled, left=True)
    return values, right / scale[:, None], left * scale[:, None]


def modes_of(linear: Linear, title: str) -> Modes:
    """The modes, one for each pair of complex eigenvalues."""
    values, right, left = eigen(linear)
    largest = np.abs(values).max(initial=0.0)
    found = []
    for k in np.lexsort((values.imag, np.abs(values))):
        value = complex(values[k])
        if abs(value.imag) <= 1e-12 * abs(value):
            value = complex(value.real)
        if value.imag < 0:
            continue
        found.append(_mode(linear, value, right[:, k], left[:, k], largest))
    found = _paired(found)
    names = [m.name for m in found]
    return Modes(title, [m if names.count(m.name) == 1 else replace(m, name=f"{m.name} ({names[:k + 1].count(m.name)})")
                         for k, m in enumerate(found)])


def _paired(modes: list[Mode]) -> list[Mode]:
    """A zero eigenvalue comes twice, once for the place and once for the speed: told once."""
    kept: list[Mode] = []
    for mode in modes:
        twin = [m for m in kept if mode.kind == m.kind == "zero" and abs(np.vdot(m.shape, mode.shape)) >
                (1 - 1e-6) * np.linalg.norm(m.shape) * np.linalg.norm(mode.shape)]
        if not twin:
            kept.append(mode)
    return kept


def _mode(linear: Linear, value: complex, right: np.ndarray, left: np.ndarray, largest: float) -> Mode:
    n = linear.Z.shape[1]
    amplitudes = right[:n] if np.abs(right[:n]).max(initial=0.0) > 1e-9 * np.abs(right).max(initial=0.0) else right[n:2 * n]
    shape = linear.Z @ amplitudes
    energies = np.abs(np.real(amplitudes.conj() * (linear.M @ amplitudes)))
    states = np.abs(right[2 * n:])
    if energies.sum() > 0 and not (states.size and np.abs(right[:2 * n]).max(initial=0.0) <= 1e-9 * states.max()):
        shares = energies / energies.sum()
        leader = int(np.argmax(np.round(shares, 6)))
        shape, right = shape / amplitudes[leader], right / amplitudes[leader]
        name = dominant(shares, linear.labels)
    else:  # of the extra states alone
        shares = np.zeros(n)
        name = linear.state_labels[int(np.argmax(states))]
    if abs(value) <= ZERO * largest:
        kind = "zero"
    else:
        kind = "unstable" if grows(value, largest) else "oscillation" if value.imag else "real"
    return Mode(value, shape, shares, kind, name, linear.labels, right, left)


def dominant(shares: np.ndarray, labels: tuple[str, ...]) -> str:
    """Names of the coordinates with the largest shares, at most three; about equal ones in their order."""
    relative = shares / shares.max()
    order = np.argsort(-np.round(5 * relative), kind="stable")
    return ", ".join([labels[i] for i in order if relative[i] >= NAMED][:3])


def grows(value: complex, largest: float) -> bool:
    """Whether motion along an eigenvector grows: by more than rounding, which is that of the largest eigenvalue if real."""
    oscillates = abs(value.imag) > 1e-12 * abs(value)
    return bool(value.real > ZERO * (abs(value) if oscillates else max(abs(value), largest / 10)))


def stable(values: np.ndarray) -> bool | None:
    """Whether nothing grows; zero eigenvalues do not count. None without eigenvalues."""
    largest = float(np.abs(values).max(initial=0.0))
    return not any(grows(v, largest) for v in values if abs(v) > ZERO * largest) if len(values) else None
