"""Exact derivatives of equilibria and eigenvalues by parameters.

The equilibrium by the implicit function theorem; a simple eigenvalue of A x = lambda E x by its left eigenvector y,
    lambda' = y^H (A' - lambda E') x / (y^H E x),
with the constraints as rows of the problem, so that the null space need not be differentiated.
Source: Murthy and Haftka, Derivatives of eigenvalues and eigenvectors of a general complex matrix, Int. J. Numer. Meth. Eng. 26
(1988); Seyranian and Mailybaev, Multiparameter Stability Theory with Mechanical Applications, section 2.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.statics.manifold import Manifold
from symdyn.statics.modes import Mode
from symdyn.statics.search import Trial
from symdyn.statics.selection import Selection
from symdyn.statics.spectrum import Spectrum
from symdyn.statics.terms import OperatingPoint, multiplier

# Two eigenvalues closer than so many of their roundings have no derivatives of their own.
DOUBLE = 1e4


@dataclass(frozen=True)
class Sensitivity:
    """Derivatives by one parameter, in units per unit of it.

    eigenvalue         complex, 1/s; frequency: of |eigenvalue| / 2 pi, Hz; damped_frequency: of |Im| / 2 pi, Hz
    damping            of the damping ratio
    """

    eigenvalue: complex
    frequency: float
    damped_frequency: float
    damping: float


def shift(point: OperatingPoint, selection: Selection, parameter: str) -> dict[str, float]:
    """Derivatives by a parameter of everything an equilibrium consists of: coordinates, extra states, what was solved for,
    multipliers, by their names in the direction of `second_variation`."""
    metadata = point.module.metadata
    _, n_u, _, n_c = point.sizes
    trial = Trial(point, selection)
    J = trial.derivative()
    pulls = np.vstack([trial.tested.T @ point.C_r.T, np.zeros((len(J) - trial.tested.shape[1], n_c))])
    right = point.by([parameter])[:, 0]
    right = np.concatenate([trial.tested.T @ right[:n_u], right[n_u:n_u + n_c] * point.scale,
                            right[n_u + n_c:][selection.states]])
    whole = np.hstack([J, pulls])
    rows = np.abs(whole).max(axis=1, initial=0.0)
    rows = np.where(rows > 0, rows, 1.0)
    columns = np.abs(whole / rows[:, None]).max(axis=0, initial=0.0)
    columns = np.where(columns > 0, columns, 1.0)
    result = np.linalg.lstsq(whole / rows[:, None] / columns, -right / rows, rcond=1e-13)[0] / columns
    n = trial.directions.shape[1]
    parts = np.split(result, np.cumsum([n, len(selection.states), len(selection.unknown)]))
    changes = dict(zip(metadata.q, point.N @ trial.directions @ parts[0], strict=True))
    changes |= {metadata.z[k]: v for k, v in zip(selection.states, parts[1], strict=True)}
    changes |= dict(zip(selection.unknown, parts[2], strict=True))
    changes |= {multiplier(k): v for k, v in enumerate(parts[3] * point.scale)}
    return {name: float(v) for name, v in changes.items() if v}


def of_eigenvalue(reduced: Manifold, spectrum: Spectrum, mode: Mode, changes: Mapping[str, float]) -> Sensitivity:
    """Sensitivity of the eigenvalue of a mode of a manifold's spectrum, for the direction `changes`."""
    point, n, value = reduced.point, reduced.n_d, mode.eigenvalue
    apart = np.sort(np.abs(spectrum.values - value))[:2]
    k = int(np.argmin(np.abs(spectrum.values - value)))
    # A defective eigenvalue moves by the root of a change: its first-order bound is no bound any more.
    if mode.kind == "zero":
        raise ArgumentError(f"{point.module.name}: mode {mode.name} has the eigenvalue zero, to rounding, whose size has no "
                            "derivative; ask for another mode, or add a load that holds it")
    if len(apart) > 1 and (apart[1] <= DOUBLE * spectrum.radii[k] or not np.isfinite(spectrum.radii[k])):
        raise ArgumentError(f"{point.module.name}: mode {mode.name} has a double eigenvalue, {value:.9g} 1/s, to rounding: it "
                            "has no derivative of its own; change a parameter a little, so that the two part")
    _, n_u, n_z, n_c = point.sizes
    x_v, x_z = reduced.Z_v @ mode.right[:n], np.zeros(n_z, dtype=complex)
    x_z[reduced.states] = mode.right[2 * n:]
    y_u = reduced.Z_v @ np.linalg.solve(reduced.M.T, mode.left[n:2 * n].conj())
    y_z = np.zeros(n_z, dtype=complex)
    y_z[reduced.states] = mode.left[2 * n:].conj()
    mu, nu = _multipliers(reduced, value, x_v, x_z, y_u, y_z)
    changed = np.zeros(n_u + n_c + n_z, dtype=complex)
    for part, unit in ((np.real, 1.0), (np.imag, 1j)):
        changed += unit * second(point, changes, part(x_v), part(value * x_v), part(value**2 * x_v), part(x_z), part(mu))
    top, middle, bottom = np.split(changed, [n_u, n_u + n_c])
    scale = np.vdot(mode.left, mode.right)
    derivative = complex((-(y_u @ top) - nu @ middle + y_z @ bottom) / scale)
    size = abs(value)
    by_size = (value.conjugate() * derivative).real / size if size else np.nan
    damping = -derivative.real / size + value.real * by_size / size**2 if size else np.nan
    damped = np.sign(value.imag) * derivative.imag
    return Sensitivity(derivative, by_size / (2 * np.pi), float(damped / (2 * np.pi)), damping)


def _multipliers(reduced: Manifold, value: complex, x_v: np.ndarray, x_z: np.ndarray, y_u: np.ndarray,
                 y_z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Right and left multipliers of the constraints in the eigenvalue problem, (n_c,) each."""
    point = reduced.point
    _, n_u, _, n_c = point.sizes
    if not n_c:
        return np.zeros(0, dtype=complex), np.zeros(0, dtype=complex)
    pencil = point.by_v[:n_u] + value * point.by_u[:n_u] + value**2 * point.M
    of_z = point.by_v[n_u + n_c:] + value * point.by_u[n_u + n_c:]
    pulls = reduced.P.T.astype(complex)
    right = np.linalg.lstsq(pulls, -(pencil @ x_v + point.by_z[:n_u] @ x_z), rcond=None)[0]
    left = np.linalg.lstsq(pulls, -(pencil.T @ y_u - of_z.T @ y_z), rcond=None)[0]
    return right[:n_c] * point.scale, left[:n_c] * point.scale


def second(point: OperatingPoint, changes: Mapping[str, float], v: np.ndarray, u: np.ndarray, ud: np.ndarray, z: np.ndarray,
           lam: np.ndarray) -> np.ndarray:
    """Derivative of the statics along (v, u, ud, z, lam), differentiated along `changes` of what is named, (n_u + n_c + n_z,)."""
    names = point.module.metadata
    vary = {f"{group} {name}": value for group, values, of in (("v", v, "u"), ("u", u, "u"), ("ud", ud, "u"), ("z", z, "z"))
            for name, value in zip(names.names(of), values, strict=True)}
    vary |= {multiplier(k): value for k, value in enumerate(lam)}
    return point.along("second_variation", vary=vary, along=dict(changes))
