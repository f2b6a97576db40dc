"""A flexible beam from its distributed table and its shape functions."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError, ModelError
from symdyn.flexible.clamped import clamped
from symdyn.flexible.hermite import HermiteBasis
from symdyn.flexible.integrals import AXES, integrate, modes_of
from symdyn.flexible.modal_body import ModalBody
from symdyn.flexible.shape import Basis, Shape
from symdyn.flexible.table import Table, numbers, table
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.given import Matrix, Row

_INTEGRATIONS = ("exact", "stations")
_MOST_MODES, _MOST_DRAWN = 40, 100_000
_DEPENDENT = 1e-13  # least eigenvalue of the modal mass matrix, scaled to a unit diagonal


class Beam:
    """A slender beam, clamped at the origin of its frame, along its axis; `modal` is the ModalBody for the equations.

    stations          from the clamp to the tip: m, from 0; with `length`: fractions of it, from 0 to 1
    mass_per_length   kg/m at the stations; tables are linear between stations; one number stands for all stations
    stiffness         bending stiffness EI at the stations, N m^2; or a tuple of two such lists, (EI_1, EI_2), of which
                      EI_1 resists deflection along the first transverse direction and EI_2 along the second
    shapes            shape functions (Shape), or how many of the beam's own clamped modes to take: see modes()
    length            m
    axis              "x", "y" or "z" of the frame, along the beam, clamp to tip; the transverse directions are the next two
                      in cyclic order: x and y for "z", y and z for "x"
    twist             rad at the stations: the principal axes of bending are turned by it about the axis
    damping_ratio     of the clamped modes, below 1: one number, or one for each mode in the order of rising frequency. D is
                      Me Phi diag(2 zeta omega) Phi^T Me with the modes Phi of (Me, K) of unit modal mass, no tip body
    integration       "exact": Gauss-Legendre between all stations, exact for piecewise polynomials, thus everything but the
                      twist's sines. "stations": mass and stiffness integrals on the table's stations alone, products of
                      density and shape being linear between them; as some programs do, coarser. The foreshortening is exact
    draw              how many stations to draw the beam with

    Kinetic energy is complete to second order in the elastic coordinates and speeds, with the foreshortening that gives
    centrifugal and gravity stiffening; see ModalBody for what is neglected. Raises ModelError with all faults.

    >>> beam = sd.Beam([0, 1], mass_per_length=2.0, stiffness=50.0, shapes=1, length=3.0)
    >>> beam.modal.Me.round(6)
    array([[1.5]])
    """

    def __init__(self, stations: Row, mass_per_length: float | Row, stiffness: float | Row | tuple[Row, Row],
                 shapes: Sequence[Shape] | int, *, length: float | None = None, axis: str = "z", twist: Row | None = None,
                 damping_ratio: float | Row = 0.0, integration: str = "exact", draw: int = 21, name: str = "beam") -> None:
        faults: list[str] = []
        self.name, self.axis, self.integration = str(name), axis, integration
        if not isinstance(axis, str) or axis not in AXES:
            faults.append(f"axis is {shown(axis)}; pass 'x', 'y' or 'z'")
        if not isinstance(integration, str) or integration not in _INTEGRATIONS:
            faults.append(f"integration is {shown(integration)}; pass 'exact' or 'stations'")
        if not _whole(draw, 2) or draw > _MOST_DRAWN:
            faults.append(f"draw is {shown(draw)}; pass a whole number of stations, 2 or more, {_MOST_DRAWN} at most")
        result = table(stations, mass_per_length, stiffness, twist, length, faults)
        self._scale = 1.0 if length is None or result is None else result.length
        count = int(shapes) if isinstance(shapes, (int, np.integer)) and _whole(shapes, 1) else None
        given = [] if count is not None else self._shapes(shapes, None if result is None else result.length / self._scale, faults)
        if count is not None and count > _MOST_MODES:
            faults.append(f"shapes asks for {count} modes; at most {_MOST_MODES} are computed")
        n = min(count, _MOST_MODES) if count is not None else len(given)
        self._ratios = _ratios(damping_ratio, n, faults)
        self._raise(faults)
        self.table: Table = result  # type: ignore[assignment]  # without faults there is one
        self._draw = draw
        self.shapes = tuple(self.modes(count) if count is not None else given)
        self._raise(self._dependent())

    @cached_property
    def modal(self) -> ModalBody:
        """The integrals over the table and the shapes.

        >>> beam = sd.Beam([0, 1], mass_per_length=2.0, stiffness=50.0, shapes=1, length=3.0)
        >>> round(float(beam.modal.m), 6)
        6.0
        """
        names = tuple(shape.name or f"mode {k}" for k, shape in enumerate(self.shapes, start=1))
        basis = Basis(self.shapes, AXES[self.axis][:2], self.table.length, self._scale)
        X = np.linspace(0, self.table.length, self._draw)
        return integrate(self.table, basis, self.axis, self._ratios, self.integration, X, self.name, names)

    def modes(self, count: int, *, tip_mass: float = 0.0, tip_com: Row = (0, 0, 0), tip_inertia: Matrix | None = None,
              omega: Row = (0, 0, 0), gravity: Row = (0, 0, 0)) -> list[Shape]:
        """The shapes of the first modes of the clamped beam, by finite elements on its table; the largest deflection is 1.

        The tip body, the angular velocity of the root and gravity are as for `clamped`; gyroscopic terms are left out, so
        that the modes are real. At least 24 cubic elements, 4 for each mode, with nodes at all stations.

        >>> beam = sd.Beam([0, 1], mass_per_length=2.0, stiffness=50.0, shapes=1, length=3.0)
        >>> [shape.name for shape in beam.modes(4)]
        ['mode 1', 'mode 2', 'mode 3', 'mode 4']
        """
        if not _whole(count, 1) or count > _MOST_MODES:
            raise ArgumentError(f"count is {shown(count)}; pass a whole number of modes from 1 to {_MOST_MODES}")
        basis = HermiteBasis(self.table, max(24, 4 * count))
        names = tuple(map(str, range(basis.n)))
        body = integrate(self.table, basis, self.axis, np.zeros(basis.n), "exact", self.table.x[[0, -1]], self.name, names)
        M, _, K = clamped(body, tip_mass=tip_mass, tip_com=tip_com, tip_inertia=tip_inertia, omega=omega, gravity=gravity)
        vectors = _separate_modes(M, K, count)
        return [basis.shape(vector, AXES[self.axis][:2], self._scale, f"mode {k}") for k, vector in enumerate(vectors.T, start=1)]

    def _shapes(self, shapes: Any, end: float | None, faults: list[str]) -> list[Shape]:
        """The shapes that were given, their faults reported with their place."""
        if not isinstance(shapes, (list, tuple)) or not shapes or any(not isinstance(s, Shape) for s in shapes):
            faults.append(f"shapes is {shown(shapes, 60)}; pass a list of sd.Shape, or how many modes to take")
            return []
        across = AXES.get(self.axis, "xyz")[:2]
        for k, shape in enumerate(shapes, start=1):
            where = f"shape {k}" + (f" ({shape.name})" if shape.name else "")
            faults.extend(f"{where}: {fault}" for fault in shape.faults)
            for direction, curve, sampled in shape.parts:
                if direction not in across:
                    faults.append(f"{where} deflects along {shown(direction)}; pass {shown(across[0])} or {shown(across[1])}, "
                                  "across the axis "
                                  f"{shown(self.axis)}")
                if sampled and end is not None and abs(curve.x[-1] - end) > 1e-9 * end:
                    faults.append(f"{where}: its stations end at {curve.x[-1]:g}; they must end at {end:g}, the tip")
        return list(shapes)

    def _dependent(self) -> list[str]:
        """A fault if some shapes can be put together from others."""
        size = np.sqrt(np.diag(self.modal.Me))
        if (size == 0).any():
            return [f"shape {int(np.argmin(size)) + 1} is zero; leave it out"]
        values, vectors = np.linalg.eigh(self.modal.Me / np.outer(size, size))
        if values[0] > _DEPENDENT:
            return []
        mixed = [str(k + 1) for k in np.flatnonzero(np.abs(vectors[:, 0]) > 0.1)]
        return [f"the shapes {', '.join(mixed)} depend on each other (least eigenvalue of the modal mass matrix scaled to a unit "
                f"diagonal: {values[0]:.1e}); leave one out"]

    def _raise(self, faults: list[str]) -> None:
        if faults:
            raise ModelError([f"beam {shown(self.name)}: {fault}" for fault in faults], self.name)


def _separate_modes(M: np.ndarray, K: np.ndarray, count: int) -> np.ndarray:
    """The first modes; of each direction alone where the directions are not coupled, even if they are alike."""
    half = len(M) // 2
    cross = max(np.abs(A[:half, half:]).max() / np.abs(A).max() for A in (M, K))
    if cross > 1e-14:
        return modes_of(M, K, count)[1]
    (first, U), (second, V) = (modes_of(M[k, k], K[k, k], count) for k in (slice(half), slice(half, None)))
    vectors = np.block([[U, np.zeros_like(V)], [np.zeros_like(U), V]])
    # Frequencies alike in all but rounding are sorted by direction.
    squares = np.round(np.concatenate([first, second]) / np.abs(first).min(), 6)
    return vectors[:, np.lexsort([np.repeat([0, 1], count), squares])[:count]]


def _ratios(value: Any, n: int, faults: list[str]) -> np.ndarray:
    """(n,) damping ratios."""
    several = isinstance(value, (list, tuple)) or bool(getattr(value, "ndim", 0))
    row = numbers(value, "damping_ratio", faults, None if several else n or 1)
    if row is None:
        return np.zeros(n)
    if n and row.size != n:
        faults.append(f"damping_ratio has {row.size} values for {n} modes; pass one number, or one for each mode")
    if (row < 0).any():
        faults.append(f"damping_ratio is {row.min():g}; it must not be negative")
    if (row >= 1).any():
        faults.append(f"damping_ratio is a fraction of critical damping below 1, {row.max():g} given; 5 % is 0.05")
    return row


def _whole(value: Any, least: int) -> bool:
    return isinstance(value, (int, np.integer)) and not isinstance(value, bool) and bool(value >= least)
