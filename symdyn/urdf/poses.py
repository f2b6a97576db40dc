"""Where a frame is in another."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

# Entries nearer to 0, 1 and -1 are the rounding of products of rotations.
_ROUNDING = 1e-15


@dataclass(frozen=True)
class Pose:
    """Rotation (3, 3), components to the other frame's, and origin (3,) of a frame in another, m."""

    R: np.ndarray = field(default_factory=lambda: np.eye(3))
    p: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def __matmul__(self, other: Pose) -> Pose:
        return Pose(self.R @ other.R, self.p + self.R @ other.p)

    def inverse(self) -> Pose:
        return Pose(self.R.T, -(self.R.T @ self.p))

    def point(self, at: np.ndarray) -> np.ndarray:
        """A point of the frame in the other."""
        return np.asarray(self.p + self.R @ at)

    def rounded(self) -> Pose:
        """The pose without what rounding has left of zeros and ones."""
        near = np.round(self.R)
        return Pose(np.where(np.abs(self.R - near) <= _ROUNDING, near, self.R),
                    np.where(np.abs(self.p) <= _ROUNDING * np.abs(self.p).max(initial=0.0), 0.0, self.p))

    @property
    def quaternion(self) -> np.ndarray:
        """The unit quaternion (4,), w first and not negative. Source: the largest of its four components first (Shepperd
        1978)."""
        R = self.R
        squares = np.array([1 + R[0, 0] + R[1, 1] + R[2, 2], 1 + R[0, 0] - R[1, 1] - R[2, 2], 1 - R[0, 0] + R[1, 1] - R[2, 2],
                            1 - R[0, 0] - R[1, 1] + R[2, 2]])
        products = np.array([[0, R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]],
                             [0, 0, R[0, 1] + R[1, 0], R[0, 2] + R[2, 0]], [0, 0, 0, R[1, 2] + R[2, 1]], [0, 0, 0, 0]])
        products = products + products.T + np.diag(squares)
        k = int(squares.argmax())
        e = products[k] / np.linalg.norm(products[k])
        return np.asarray(-e if e[0] < 0 else e)
