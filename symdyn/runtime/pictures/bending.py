"""How flexible bodies bend in pictures: mode shapes times elastic coordinates."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from symdyn.runtime.pictures.meshes import Part

if TYPE_CHECKING:
    from symdyn.runtime.solution import Solution


@dataclass(frozen=True)
class Bending:
    """Displacements shapes @ eta in body axes: shapes (n, 3, n_eta) of points, (n, 3); eta (n_t, n_eta)."""

    points: np.ndarray
    shapes: np.ndarray
    eta: np.ndarray

    def of(self, part: Part) -> Bending:
        """The displacements of a part's vertices: those of the beam's points beside them."""
        axis = int(np.ptp(self.points, axis=0).argmax())
        order = np.argsort(self.points[:, axis])
        along, flat = self.points[order, axis], self.shapes[order].reshape(len(order), -1)
        shapes = np.column_stack([np.interp(part.stations[:, axis], along, column) for column in flat.T])
        return Bending(part.stations, shapes.reshape(len(part.stations), 3, -1), self.eta)

    def between(self, a: np.ndarray, b: np.ndarray, w: np.ndarray) -> Bending:
        """At other times: a share w (n, 1) of the way from the times a to the times b."""
        return replace(self, eta=self.eta[a] * (1 - w) + self.eta[b] * w)

    def displacements(self, index: int) -> np.ndarray:
        """At one of the times, (n, 3)."""
        return np.asarray(self.shapes @ self.eta[index])


def bendings(solution: Solution) -> dict[int, Bending]:
    """The flexible bodies of a motion, by their place among the bodies.

    metadata["flexible"] lists them: `body`, its name; `stations` (n, 3), points of the undeformed beam in body axes;
    `shapes` (n, 3, n_eta), their displacements by each of `coordinates`, the names of the elastic coordinates.
    """
    metadata = solution.module.metadata
    found = {}
    for record in metadata.get("flexible", ()):
        eta = np.column_stack([solution[name] for name in record["coordinates"]])
        points, shapes = np.array(record["stations"], dtype=float), np.array(record["shapes"], dtype=float)
        found[metadata["bodies"].index(record["body"])] = Bending(points, shapes.reshape(len(points), 3, -1), eta)
    return found
