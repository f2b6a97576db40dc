"""Analysis of constant linear equations about a state: eigenvalues with proof, verdict, modes, and why."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from symdyn.statics.manifold import Manifold
from symdyn.statics.modes import Modes, Shapes, modes_of, ordered, settled_values
from symdyn.statics.noise import Noise, noise
from symdyn.statics.spectrum import Spectrum, spectrum
from symdyn.statics.terms import coordinate_names

# Coordinates with less than this part of the amplitude of a mode do not move in it, but for rounding.
UNMOVED = 1e-12
WORDS = {
    "stable": "all exponents are proved negative",
    "neutral": "no exponent is positive, and those that are zero have as many eigenvectors",
    "drifts": "an exponent that is zero has a Jordan block: a disturbance grows with time, not exponentially",
    "unstable": "an exponent is proved positive",
    "not decided": "rounding decides the sign of an exponent",
    "": "nothing is free to move",
}


class Analysis:
    """The eigenvalue problem of a manifold's constant linear equations."""

    def __init__(self, manifold: Manifold) -> None:
        self.manifold = manifold

    @cached_property
    def noise(self) -> Noise:
        return noise(self.manifold)

    @cached_property
    def spectrum(self) -> Spectrum:
        return spectrum(self.manifold.matrices[0], self.noise.A, driven=self.driven)

    @cached_property
    def eigenvalues(self) -> np.ndarray:
        """(m,) complex, by size, zeros and undamped oscillations without rounding."""
        values = settled_values(self.spectrum)
        return np.asarray(values[ordered(values)])

    @property
    def verdict(self) -> str:
        return self.spectrum.verdict

    def modes(self, title: str) -> Modes:
        return modes_of(self.spectrum, shapes_of(self.manifold), title, self.notes())

    def notes(self) -> list[str]:
        """Units of shapes, what is held, and the verdict with its reason."""
        lines = [*unit_note(self.manifold), *held_note(self.manifold)]
        return [*lines, f"{self.verdict}: {self.reason()}" if self.verdict else self.reason()]

    def reason(self) -> str:
        """Why the verdict is what it is, with numbers."""
        return reason(self.spectrum)

    def driven(self, right: np.ndarray, left: np.ndarray, turned: np.ndarray | None = None, error: float = 0.0) -> np.ndarray:
        """Effect on each mode of damping, circulatory forces and extra states that are more than rounding, without their signs.

        turned   S of a change of variables, known to `error` (1/s): damping and stiffness in the variables that it makes constant
        """
        manifold, n = self.manifold, self.manifold.n_d
        if n != manifold.n_s or manifold.W.any():
            return np.zeros(right.shape[1])
        noise = self.noise
        C, K, open_C, open_K = manifold.C, manifold.K, noise.C, noise.K
        if turned is not None:  # eta = e^(st) w: M w_ddot + (C + 2 M s) w_dot + (K + C s + M s^2) w = 0
            s, M = turned[:n, :n], manifold.M
            C, K = C + 2 * M @ s, K + C @ s + M @ s @ s
            grown = np.abs(s) + error
            open_C = open_C + error * 2 * np.abs(M).sum(axis=1)[:, None]
            open_K = open_K + open_C @ grown + error * (np.abs(M) @ grown).sum(axis=1)[:, None]
        damping = _beyond((C + C.T) / 2, (open_C + open_C.T) / 2)
        circulating = _beyond((K - K.T) / 2, (open_K + open_K.T) / 2)
        x = np.abs(right[:n])
        sizes = np.sqrt(np.abs(np.diag(manifold.M)))[:, None] * x
        x = np.where(sizes > UNMOVED * sizes.max(axis=0, initial=0.0), x, 0.0)
        energies = np.abs(np.einsum("ik,ij,jk->k", right[:n].conj(), manifold.M, right[:n]))
        sizes = np.abs(np.einsum("ik,ij,jk->k", right.conj(), np.eye(len(right)), right))
        result = np.zeros(right.shape[1])
        moving = energies > 1e-20 * sizes
        result[moving] = np.einsum("ik,ij,jk->k", x, damping, x)[moving] / (2 * energies[moving])
        speed = np.abs(_quotients(manifold.matrices[0] - (0.0 if turned is None else turned), right))
        turning = np.einsum("ik,ij,jk->k", x, circulating, x)
        fast = moving & (speed > 0)
        result[fast] += turning[fast] / (2 * energies[fast] * speed[fast])
        A, m = _beyond(manifold.matrices[0], noise.A.rounding), len(right)
        coupled = np.zeros((m, m))
        coupled[2 * n:], coupled[:, 2 * n:] = A[2 * n:], A[:, 2 * n:]
        if coupled.any():
            below = np.abs(np.einsum("ik,ik->k", left.conj(), right))
            above = np.einsum("ik,ij,jk->k", np.abs(left), np.abs(coupled), np.abs(right))
            result += np.where(below > 0, above / np.where(below > 0, below, 1.0), 0.0)
        return result


def _quotients(A: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Rayleigh quotients of eigenvectors."""
    squares = np.einsum("ik,ik->k", right.conj(), right)
    return np.asarray(np.einsum("ik,ij,jk->k", right.conj(), A, right) / np.where(squares != 0, squares, 1.0))


def _beyond(values: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """Absolute values of the entries that are more than rounding, else 0."""
    result = np.abs(values)
    return np.asarray(np.where(result > noise, result, 0.0))


def shapes_of(manifold: Manifold) -> Shapes:
    """Shapes that name the modes of a manifold."""
    sizes = (manifold.n_d, manifold.n_s, len(manifold.states))
    displaced = (manifold.Z_v, manifold.labels)
    if manifold.Z_u is manifold.Z_v:
        return Shapes(manifold.M, manifold.Z_v, sizes, manifold.labels, manifold.state_labels, displaced)
    names = coordinate_names(manifold.point.module.metadata)
    return Shapes(manifold.M, manifold.Z_u, sizes, tuple(names[k] for k in manifold.speeds), manifold.state_labels, displaced,
                  by_speeds=True)


def decade(error: float) -> str:
    """An error as the power of ten above it, at least 1e-15: what a reader needs of it."""
    return f"{10.0 ** np.ceil(np.log10(max(error, 1e-15)) - 1e-9):.0e}" if np.isfinite(error) else "nothing"


def unit_note(manifold: Manifold) -> list[str]:
    """A line with the units of what shapes of modes consist of."""
    units = manifold.point.module.metadata.units
    by_unit: dict[str, list[str]] = {}
    speeds = manifold.point.module.metadata.u
    for label, k in zip(manifold.labels, manifold.displacements, strict=True):
        own = units.get(label, "") if label != speeds[k] else units.get(label, "").removesuffix("/s")
        by_unit.setdefault(own or "1", []).append(label)
    parts = [", ".join(names) + f" in {unit}" for unit, names in by_unit.items()]
    return [f"shapes: {'; '.join(parts)}"] if parts else []


def held_note(manifold: Manifold) -> list[str]:
    """A line that names what is held, if anything."""
    return [f"held: {', '.join(manifold.selection.held)}"] if manifold.selection.held else []


def reason(result: Spectrum) -> str:
    """Why the verdict of a spectrum is what it is, with numbers."""
    verdict = result.verdict
    text = WORDS[verdict]
    margins = np.array([result.boundary.margin(complex(v)) for v in result.values])
    if verdict == "stable":
        return f"{text}: the largest is {margins.max():.6g} 1/s"
    if verdict == "unstable":
        k = int(np.argmax(np.where(result.signs > 0, margins, -np.inf)))
        known = float(min(result.radii[k], abs(margins[k])))
        return f"{text}: {margins[k]:.6g} 1/s" + (f", known to {decade(known)}" if known > 1e-6 * margins[k] else "")
    if verdict == "not decided":
        k = int(result.undecided[np.argmax(result.radii[result.undecided])])
        if result.boundary.neutral:
            return f"{text}: a multiplier has the size 1 + {margins[k]:.3g}, known to {decade(float(result.radii[k]))} only"
        known = float(min(result.radii[k], max(abs(result.values[k]), 1e-15)))
        return f"{text}: {result.values[k].real:.3g} 1/s is known to {decade(known)} only"
    if verdict in ("neutral", "drifts"):
        zeros, pairs = len(result.zeros), int((result.values[result.imaginary].imag > 0).sum())
        parts = [f"{zeros} zero" if zeros else "", f"{pairs} undamped oscillation{'s' * (pairs != 1)}" if pairs else ""]
        return f"{text} ({', '.join(p for p in parts if p)})"
    return text
