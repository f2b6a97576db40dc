"""Rotors with blades: multi-blade coordinates, in which a spinning rotor of three or more equal blades is constant in time.

q_k = a_0 + a_c cos psi_k + a_s sin psi_k + ..., psi_k = psi + 2 pi k / N. With q = T(psi) a and psi_dot = Omega:
    q_dot = T a_dot + Omega T' a,  q_ddot = T a_ddot + 2 Omega T' a_dot + Omega^2 T'' a,
so the matrices in a are T^T M T, T^T (2 Omega M T' + C T), T^T (Omega^2 M T'' + Omega C T' + K T). They are the same at all
azimuths for a rotor of three or more like blades; what differs (weight on the blades) shows in their spread, and the equations
are periodic then. The mean over the azimuths has a steady state, the a that balances the mean forces, where the search for the
periodic motion begins.
Source: Coleman and Feingold, NACA Report 1351 (1958); Bir, Multi-blade coordinate transformation and its application to wind
turbine analysis, AIAA 2008-1300.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import scipy.linalg

from symdyn.errors import ArgumentError, EvaluationError, NoEquilibrium
from symdyn.runtime.constraints import turning
from symdyn.statics.modes import Shapes
from symdyn.statics.search import LARGEST_TURN
from symdyn.statics.selection import Selection
from symdyn.statics.terms import OperatingPoint, coordinate_names

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

ITERATIONS = 50
# Inertia and stiffness of blades, averaged over the azimuths, may differ by this part. Over fewer than three azimuths weight
# does not average out.
EQUAL, LEAST_AZIMUTHS = 1e-3, 3
SOLVED = 1e-11


@dataclass(frozen=True, eq=False)
class Rotor:
    """A rotor of a module, by indices of its states.

    speed, azimuth   among the speeds and the coordinates; free: speeds that are free
    blades           among the speeds, set by set; coordinates: those of all of these among the coordinates
    """

    module: Module
    speed: int
    azimuth: int
    blades: tuple[tuple[int, ...], ...]
    coordinates: tuple[int, ...]
    free: tuple[int, ...]

    @property
    def moving(self) -> list[int]:
        """The speeds of all blades."""
        return [k for group in self.blades for k in group]

    @property
    def rows(self) -> list[int]:
        """Indices of the blades among what is free."""
        return [self.free.index(k) for k in self.moving]

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """Names of the free coordinates in the fixed frame."""
        names = list(coordinate_names(self.module.metadata))
        for group in self.blades:
            for point, name in zip(group, _harmonics(len(group)), strict=True):
                names[point] = f"{coordinate_names(self.module.metadata)[group[0]]} {name}"
        return tuple(names[k] for k in self.free)

    def transform(self, psi: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """T, T' and T'' by the azimuth, of the free coordinates, (n, n)."""
        n = len(self.free)
        T, first, second = np.eye(n), np.zeros((n, n)), np.zeros((n, n))
        for group in self.blades:
            count = len(group)
            indices = [self.free.index(k) for k in group]
            angles = psi + 2 * np.pi * np.arange(count) / count
            columns: list[tuple[np.ndarray, ...]] = [(np.ones(count), np.zeros(count), np.zeros(count))]
            for j in range(1, (count - 1) // 2 + 1):
                c, s = np.cos(j * angles), np.sin(j * angles)
                columns += [(c, -j * s, -j * j * c), (s, j * c, -j * j * s)]
            if count % 2 == 0:
                columns.append(((-1.0) ** np.arange(count), np.zeros(count), np.zeros(count)))
            for matrix, which in ((T, 0), (first, 1), (second, 2)):
                matrix[np.ix_(indices, indices)] = np.array([column[which] for column in columns]).T
        return T, first, second


def _harmonics(count: int) -> list[str]:
    names = ["collective"]
    for j in range(1, (count - 1) // 2 + 1):
        order = "" if j == 1 else f" {j}"
        names += [f"cosine{order}", f"sine{order}"]
    return names + ["alternating"] * (count % 2 == 0)


def _state_matrix(M: np.ndarray, C: np.ndarray, K: np.ndarray) -> np.ndarray:
    n = len(M)
    inverse = scipy.linalg.inv(M)
    return np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ K, -inverse @ C]])


@dataclass(frozen=True, eq=False)
class Averaged:
    """M a_ddot + C a_dot + K a = 0 of a rotor in the fixed frame, averaged; spread (2 n, 2 n): the largest difference of an entry
    of the state matrix at an azimuth from the mean."""

    M: np.ndarray
    C: np.ndarray
    K: np.ndarray
    labels: tuple[str, ...]
    spread: np.ndarray

    def A(self) -> np.ndarray:
        """State matrix of [a; a_dot]."""
        return _state_matrix(self.M, self.C, self.K)

    @property
    def shapes(self) -> Shapes:
        """Shapes that name its modes."""
        n = len(self.M)
        return Shapes(self.M, np.eye(n), (n, n, 0), self.labels, (), (np.eye(n), self.labels))


@dataclass(frozen=True, eq=False)
class Steady:
    """A steadily turning rotor: coordinates of all but the blades, a of the free ones (blades: multi-blade coordinates)."""

    rotor: Rotor
    point: OperatingPoint
    a: np.ndarray
    omega: float
    azimuths: np.ndarray
    iterations: int = 0

    def at(self, psi: float) -> tuple[OperatingPoint, tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """The state with the rotor at an azimuth, and the transformation there."""
        rotor, point = self.rotor, self.point
        transform = rotor.transform(psi)
        n_q = point.sizes[0]
        x, ud = point.x.copy(), point.ud.copy()
        x[list(rotor.coordinates)], x[[n_q + k for k in rotor.moving]], ud[rotor.moving] = (
            (self.omega**order * matrix @ self.a)[rotor.rows] for order, matrix in enumerate(transform))
        x[rotor.azimuth] = psi
        x[n_q + rotor.speed] = self.omega
        return point.at(x=x, ud=ud), transform

    def averages(self) -> tuple[np.ndarray, Averaged]:
        """Forces and matrices in the fixed frame."""
        omega = self.omega
        index = np.ix_(self.rotor.free, self.rotor.free)
        free = list(self.rotor.free)
        result = []
        for psi in self.azimuths:
            point, (T, first, second) = self.at(float(psi))
            m, c, k = point.M[index], point.by_u[index], point.by_v[index]
            result.append((T.T @ point.forces[free], T.T @ m @ T, T.T @ (2 * omega * m @ first + c @ T),
                          T.T @ (omega**2 * m @ second + omega * c @ first + k @ T)))
        r, M, C, K = (np.mean([each[i] for each in result], axis=0) for i in range(4))
        mean = _state_matrix(M, C, K)
        spread = np.max([np.abs(_state_matrix(*each[1:]) - mean) for each in result], axis=0)
        return np.asarray(r), Averaged(M, C, K, self.rotor.labels, spread)

    def stepped(self, step: np.ndarray, iterations: int) -> Steady:
        """After a change of a; coordinates other than the blades' move along their speeds."""
        point, rotor = self.point, self.rotor
        v = np.zeros(point.sizes[1])
        v[list(rotor.free)] = step
        v[rotor.moving] = 0.0
        x = point.x.copy()
        x[:point.sizes[0]] = point.moved(v)
        return Steady(rotor, point.at(x=x), self.a + step, self.omega, self.azimuths, iterations)


def demand_equal_blades(state: Steady) -> None:
    """Raises ArgumentError for a set whose members do not have the same inertia and stiffness."""
    rotor, name = state.rotor, state.point.module.name
    if len(state.azimuths) < LEAST_AZIMUTHS:
        return
    points = [state.at(float(psi))[0] for psi in state.azimuths]
    M = np.mean([np.diag(point.M) for point in points], axis=0)
    K = np.mean([np.diag(point.by_v[:len(M)]) for point in points], axis=0)
    size = np.abs(K) + state.omega**2 * M
    labels = coordinate_names(state.point.module.metadata)
    for group in (list(g) for g in rotor.blades):
        for what, values, sizes in (("inertia", M[group], M[group]), ("stiffness", K[group], size[group])):
            if np.ptp(values) > EQUAL * sizes.max():
                result = ", ".join(f"{labels[k]}: {v:.6g}" for k, v in zip(group, values, strict=True))
                raise ArgumentError(f"{name}: blades: a set holds the same coordinate of every blade, one set per shape, such as "
                                    f"[('flap1', 'flap2', 'flap3'), ('edge1', 'edge2', 'edge3')], but these differ in {what}: "
                                    f"{result}; group them by shape")


def steady(start: Steady) -> tuple[Steady, Averaged]:
    """The steady state near a start, by Newton's method. Raises NoEquilibrium, ArgumentError."""
    demand_equal_blades(start)
    name, turns = start.point.module.name, turning(start.point.module)[list(start.rotor.free)]
    result = start
    try:
        for k in range(ITERATIONS):
            r, linear = result.averages()
            scale = 1 / np.sqrt(np.maximum(np.diag(linear.M), 1e-12 * np.diag(linear.M).max()))
            K = linear.K * np.outer(scale, scale)
            _, values, Vt = np.linalg.svd(K)
            if values[-1] <= 1e-11 * values[0]:
                shares = Vt[-1]**2
                raise NoEquilibrium(f"{name}: there is no stiffness along {linear.labels[int(np.argmax(shares))]} "
                                    f"({shares.max():.2f}) at {start.omega:g} rad/s: the steady state is not unique; fix it")
            step = -scale * np.linalg.solve(K, scale * r)
            if float(np.linalg.norm(step / scale)) <= SOLVED * max(1.0, float(np.linalg.norm(result.a / scale))):
                return result, linear
            largest = float(np.abs(step[turns]).max(initial=0.0))
            result = result.stepped(step * min(1.0, LARGEST_TURN / largest) if largest else step, k + 1)
    except EvaluationError as error:
        raise NoEquilibrium(f"{name}: no steady state at {start.omega:g} rad/s: {error}") from error
    raise NoEquilibrium(f"{name}: no steady state at {start.omega:g} rad/s after {ITERATIONS} iterations: the last step was "
                        f"{np.abs(step).max():.3g} along {linear.labels[int(np.argmax(np.abs(step)))]}; begin nearer, with start")


def rotor_of(module: Module, selection: Selection, speed: str, azimuth: str, blades: Sequence[Sequence[str]]) -> Rotor:
    """The rotor with these names. Raises ArgumentError for what cannot be seen from the fixed frame."""
    metadata, owner = module.metadata, module.name
    if metadata.constraints or metadata.z:
        raise ArgumentError(f"{owner}: multi-blade coordinates are for systems without constraints and extra states; derive "
                            "it in relative coordinates, or leave blades out")
    labels = list(coordinate_names(metadata))
    free = tuple(k for k, (label, u) in enumerate(zip(labels, metadata.u, strict=True))
                 if label not in selection.kept and u not in selection.kept)
    faults = []
    groups = []
    for group in blades:
        if len(group) < 3:
            faults.append(f"{len(group)} blades ({', '.join(group)}) are named; multi-blade coordinates need at least 3")
        for name in (n for n in group if n not in metadata.q or n not in labels):
            faults.append(f"{name} is no coordinate whose rate is a speed")
        for name in (n for n in group if n in labels and labels.index(n) not in free):
            faults.append(f"{name} is kept, but a coordinate of a blade has to be free")
        groups.append(tuple(labels.index(n) for n in group if n in labels))
    flat = [k for group in groups for k in group]
    if len(set(flat)) < len(flat):
        faults.append("a coordinate is named for two blades")
    if faults:
        raise ArgumentError(f"{owner}: blades: {'; '.join(faults)}")
    coordinates = tuple(metadata.q.index(labels[k]) for k in flat)
    return Rotor(module, metadata.u.index(speed), metadata.q.index(azimuth), tuple(groups), coordinates, free)
