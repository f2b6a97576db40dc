"""Results of many trajectories."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.backend.metadata import ModuleMetadata
from symdyn.errors import ArgumentError
from symdyn.runtime.gpu.dlpack import DeviceArray
from symdyn.shown import name_of, shown

if TYPE_CHECKING:
    from symdyn.given import Key


class BatchSensitivity(Mapping[Any, np.ndarray]):
    """Sensitivities of many motions by name: what they are by -> derivatives of the states, (n, n_t, n_x); NaN where x is.

    names    what they are by, in order;  matrix: all of them, (n, n_t, n_x, n_names)
    """

    def __init__(self, metadata: ModuleMetadata, names: Sequence[str], matrix: np.ndarray) -> None:
        self.names, self.matrix, self._metadata = tuple(names), matrix, metadata

    def __getitem__(self, name: Any) -> np.ndarray:
        """By a parameter, an input or an initial value, by name or symbol. Raises ArgumentError for another."""
        return self.matrix[..., _index(name_of(name), self.names, f"{self._metadata.name}: the motions have no sensitivity by")]

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)

    def __contains__(self, name: object) -> bool:
        return name_of(name) in self.names

    def of(self, name: Key) -> np.ndarray:
        """Derivatives of one coordinate, speed or extra state by all, (n, n_t, n_names). Raises ArgumentError for another."""
        return self.matrix[..., _index(name_of(name), self._metadata.x, f"{self._metadata.name}: there is no state"), :]

    def __repr__(self) -> str:
        n, n_t, n_x, _ = self.matrix.shape
        return f"<Sensitivity of {n} motions, {n_x} states at {n_t} times, by {', '.join(self.names)}>"


def _index(name: str, known: Sequence[str], what: str) -> int:
    if name not in known:
        raise ArgumentError(f"{what} {shown(name)}; there are {', '.join(known)}")
    return known.index(name)


@dataclass(frozen=True)
class BatchSolution:
    """Motions of one mechanism from many starts, with many parameters.

    t          (n_t,) output times, s
    states     states where they lie, in the memory of this process or on a device, see `x` and `x_on_device`
    success    (n,) whether the end was reached; messages: of those that did not, when, where and why, by their number
    n_steps, n_rejected   (n,) steps of the integrator
    width      trajectories that were integrated at once on one processor core; note: why it is 1, where it is
    seconds    what the integration took
    columns    derivatives, of runs that were asked for them, see `sensitivity`
    doubts     what motions were warned of, by their number

    >>> motions = sd.systems.pendulum().compile(backend="numpy").simulate_batch({"q1": [0.1, 0.2]}, t=(0, 1))
    >>> motions.x.shape, motions.q.shape
    ((2, 1, 2), (2, 1, 1))
    """

    metadata: ModuleMetadata
    t: np.ndarray
    states: np.ndarray | DeviceArray
    success: np.ndarray
    messages: Mapping[int, str]
    n_steps: np.ndarray
    n_rejected: np.ndarray
    width: int = 1
    note: str = ""
    seconds: float = field(default=0.0, compare=False)
    columns: BatchSensitivity | None = None
    doubts: Mapping[int, Sequence[str]] = field(default_factory=dict)

    @cached_property
    def x(self) -> np.ndarray:
        """States [q; u; z], (n, n_t, n_x); NaN after a trajectory has failed, or an event has ended it, whose state is the end
        state where only that is kept. Those on a device are copied here, as doubles, at the first use.

        >>> motions = sd.systems.pendulum().compile(backend="numpy").simulate_batch({"q1": [0.1, 0.2]}, t=(0, 1))
        >>> motions.x.shape
        (2, 1, 2)
        """
        if isinstance(self.states, np.ndarray):
            return self.states
        return np.asarray(self.states.to_numpy(), dtype=float)

    @property
    def x_on_device(self) -> DeviceArray:
        """States (n, n_t, n_x) on the GPU, where they were computed from arrays there, of float64 or, in single precision, of
        float32. JAX, CuPy and PyTorch take them by `from_dlpack`, without a copy.

        Raises ArgumentError where they lie in the memory of this process.

        >>> motions = sd.systems.pendulum().compile(backend="numpy").simulate_batch({"q1": [0.1, 0.2]}, t=(0, 1))
        >>> from dataclasses import replace
        >>> from symdyn.runtime.gpu.dlpack import CPU, DeviceArray
        >>> there = DeviceArray(motions.x.ctypes.data, motions.x.shape, motions.x.dtype, (CPU, 0), lambda: None, motions.x.copy)
        >>> replace(motions, states=there).x_on_device
        <DeviceArray 2 x 1 x 2 of float64>
        """
        if isinstance(self.states, np.ndarray):
            raise ArgumentError(f"{self.metadata.name}: the states of these motions lie in the memory of this process; take x, "
                                "or pass simulate_batch(..., device='gpu') starts, parameters or inputs that lie on the GPU")
        return self.states

    @property
    def sensitivity(self) -> BatchSensitivity:
        """Derivatives of the states by what `simulate_batch` was asked for, by name, see BatchSensitivity.

        Raises ArgumentError if it was not asked for any.

        >>> module = sd.systems.pendulum().compile()
        >>> motions = module.simulate_batch({"q1": [0.1, 0.2]}, t=(0, 1), sensitivities=["l"])
        >>> motions.sensitivity["l"].shape
        (2, 1, 2)
        """
        if self.columns is None:
            raise ArgumentError(f"{self.metadata.name}: these motions have no sensitivities; pass simulate_batch(..., "
                                "sensitivities=[...]) the parameters, inputs and initial values that they are by")
        return self.columns

    @property
    def q(self) -> np.ndarray:
        """Coordinates, (n, n_t, n_q).

        >>> motions = sd.systems.pendulum().compile(backend="numpy").simulate_batch({"q1": [0.1, 0.2]}, t=(0, 1))
        >>> np.round(motions.q[:, 0], 6)
        array([[-0.099993],
               [-0.19997 ]])
        """
        return self.x[..., :self.metadata.sizes.q]

    @property
    def u(self) -> np.ndarray:
        """Speeds, (n, n_t, n_u).

        >>> motions = sd.systems.pendulum().compile(backend="numpy").simulate_batch({"q1": [0.1, 0.2]}, t=(0, 1))
        >>> np.round(motions.u[:, 0], 6)
        array([[-0.003585],
               [-0.01081 ]])
        """
        sizes = self.metadata.sizes
        return self.x[..., sizes.q:sizes.q + sizes.u]

    def __getitem__(self, name: Key) -> np.ndarray:
        """One coordinate, speed or extra state by name or symbol, (n, n_t)."""
        return self.x[..., _index(name_of(name), self.metadata.x, f"{self.metadata.name}: there is no state")]

    def __len__(self) -> int:
        return len(self.success)

    def __repr__(self) -> str:
        remark = f"; {self.note}" if self.note else ""
        return (f"<BatchSolution {self.metadata.name}: {len(self)} trajectories, {int(self.success.sum())} of them to the "
                f"end, {self.width} at once{remark}>")
