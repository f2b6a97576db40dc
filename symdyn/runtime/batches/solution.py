"""What many trajectories have come to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from symdyn.backend.metadata import ModuleMetadata
from symdyn.errors import ArgumentError
from symdyn.shown import name_of, shown

if TYPE_CHECKING:
    from symdyn.given import Key


@dataclass(frozen=True)
class BatchSolution:
    """Motions of one mechanism from many starts, with many parameters.

    t          (n_t,) output times, s
    x          (n, n_t, n_x) states [q; u; z]; NaN after a trajectory has failed, or an event has ended it, whose state is the end
               state where only that is kept
    success    (n,) whether the end was reached; messages: of those that did not, when, where and why, by their number
    n_steps, n_rejected   (n,) steps of the integrator
    width      trajectories that were integrated at once on one processor core; note: why it is 1, where it is
    seconds    what the integration took
    """

    metadata: ModuleMetadata
    t: np.ndarray
    x: np.ndarray
    success: np.ndarray
    messages: Mapping[int, str]
    n_steps: np.ndarray
    n_rejected: np.ndarray
    width: int = 1
    note: str = ""
    seconds: float = field(default=0.0, compare=False)

    @property
    def q(self) -> np.ndarray:
        """Coordinates, (n, n_t, n_q)."""
        return self.x[..., :self.metadata.sizes.q]

    @property
    def u(self) -> np.ndarray:
        """Speeds, (n, n_t, n_u)."""
        sizes = self.metadata.sizes
        return self.x[..., sizes.q:sizes.q + sizes.u]

    def __getitem__(self, name: Key) -> np.ndarray:
        """One coordinate, speed or extra state by name or symbol, (n, n_t)."""
        text = name_of(name)
        if text not in self.metadata.x:
            raise ArgumentError(f"{self.metadata.name}: there is no state {shown(text)}; there are "
                                f"{', '.join(self.metadata.x)}")
        return self.x[..., self.metadata.x.index(text)]

    def __len__(self) -> int:
        return len(self.x)

    def __repr__(self) -> str:
        remark = f"; {self.note}" if self.note else ""
        return (f"<BatchSolution {self.metadata.name}: {len(self)} trajectories, {int(self.success.sum())} of them to the "
                f"end, {self.width} at once{remark}>")
