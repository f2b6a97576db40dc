"""Bending of flexible bodies in pictures: mode shapes times elastic coordinates."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.pictures.meshes import Part

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution


@dataclass(frozen=True)
class Bending:
    """Displacements in body axes of points (n, 3), to second order in eta (n_t, n_eta).

    coordinates   names of the elastic coordinates
    shapes   (n, 3, n_eta), first derivatives by eta; second: (n, 3, n_eta, n_eta), second ones, the foreshortening
    """

    points: np.ndarray
    shapes: np.ndarray
    second: np.ndarray
    eta: np.ndarray
    coordinates: tuple[str, ...]

    def of(self, part: Part) -> Bending:
        """The displacements of a part's vertices: those of the beam's points next to them."""
        return self.at_stations(part.stations)

    def at_stations(self, stations: np.ndarray) -> Bending:
        """The displacements of other points (n, 3) along the beam."""
        axis = int(np.ptp(self.points, axis=0).argmax())
        order = np.argsort(self.points[:, axis])
        along = self.points[order, axis]

        def nearest(values: np.ndarray) -> np.ndarray:
            columns = values[order].reshape(len(order), -1).T
            result = np.column_stack([np.interp(stations[:, axis], along, column) for column in columns])
            return result.reshape(len(stations), *values.shape[1:])

        return replace(self, points=stations, shapes=nearest(self.shapes), second=nearest(self.second))

    def between(self, a: np.ndarray, b: np.ndarray, w: np.ndarray) -> Bending:
        """At other times: a share w (n, 1) of the way from the times a to the times b."""
        return replace(self, eta=self.eta[a] * (1 - w) + self.eta[b] * w)

    def displacements(self, index: int) -> np.ndarray:
        """At one of the times, (n, 3)."""
        eta = self.eta[index]
        return np.asarray(self.shapes @ eta + self.second @ eta @ eta / 2)


def bendings(solution: Solution) -> dict[int, Bending]:
    """The flexible bodies of a motion, by their place among the bodies.

    metadata.flexible lists them: `body` and `tip`, the names of the bodies at its ends; `stations` (n, 3), points of the
    undeformed beam in the axes of `body`; `shapes` (n, 3, n_eta), their displacements by each of `coordinates`, the names of the
    elastic coordinates, and `second` (n, 3, n_eta, n_eta), the second derivatives.
    """
    metadata = solution.module.metadata
    return bent_bodies(metadata.flexible, metadata.bodies, lambda name: solution[name])


def bent_bodies(records: Sequence[Mapping[str, Any]], bodies: Sequence[str],
                values: Callable[[str], np.ndarray]) -> dict[int, Bending]:
    """Flexible bodies by their index among bodies; values: of an elastic coordinate over time, (n_t,)."""
    result = {}
    for record in records:
        eta = np.column_stack([values(name) for name in record["coordinates"]])
        points, shapes, second = (np.array(record[name], dtype=float) for name in ("stations", "shapes", "second"))
        result[list(bodies).index(record["body"])] = Bending(points, shapes, second, eta, tuple(record["coordinates"]))
    return result
