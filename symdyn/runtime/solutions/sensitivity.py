"""Derivatives of a motion by parameters, inputs and initial values, as they were integrated along with it."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.shown import name_of, shown

if TYPE_CHECKING:
    from symdyn.given import Times
    from symdyn.runtime.solutions.solution import Solution

OUTPUTS = "outputs_sensitivity"


class Sensitivity(Mapping[Any, np.ndarray]):
    """Sensitivities of a motion by name: what they are by -> derivative of the state at every time, (n_t, n_x).

    names    what they are by, in order: parameters, inputs, "q1(0)" for the initial value of q1
    matrix   all of them, (n_t, n_x, n_names): at each time the Jacobian of the state
    """

    def __init__(self, solution: Solution, names: Sequence[str], columns: Sequence[str], rows: np.ndarray) -> None:
        self.names = tuple(names)
        self.matrix = np.ascontiguousarray(np.swapaxes(rows, 1, 2))
        self._solution, self._columns = solution, tuple(columns)

    def __getitem__(self, name: Any) -> np.ndarray:
        """The derivative of the state by a parameter, an input or an initial value, by name or symbol, (n_t, n_x).

        Raises ArgumentError for what the run was not asked for.
        """
        return self.matrix[:, :, self._index(name)]

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)

    def __contains__(self, name: object) -> bool:
        return name_of(name) in self.names

    def of(self, name: Any) -> np.ndarray:
        """Derivatives of one coordinate, speed, extra state or output of the system, by name or symbol, (n_t, ..., n_names).

        Raises ArgumentError for an unknown name.
        """
        module = self._solution.module
        known, outputs = module.metadata.x, [output for output, _ in module.metadata.outputs]
        asked = name_of(name)
        if asked in known:
            return self.matrix[:, known.index(asked), :]
        if asked in outputs:
            return self._outputs()[asked]
        there = [*known, *outputs]
        near = difflib.get_close_matches(str(asked), there, 3)
        raise ArgumentError(f"{module.name}: derivatives of {shown(asked)} were asked for, which is neither a state nor an "
                            "output; " + (f"did you mean {' or '.join(near)}?" if near else f"there are {', '.join(there)}"))

    def at(self, t: Times) -> np.ndarray:
        """The Jacobian of the state at any times of the motion, (n_x, n_names) for a time, (..., n_x, n_names) for an array.

        The motion is integrated once more, as for a call of the solution, which see.
        """
        return np.ascontiguousarray(np.swapaxes(self._solution.states_and_columns(t)[1], -1, -2))

    def _index(self, name: Any) -> int:
        asked = name_of(name)
        if asked in self.names:
            return self.names.index(asked)
        near = difflib.get_close_matches(str(asked), self.names, 3)
        raise ArgumentError(f"{self._solution.module.name}: the motion has no sensitivity by {shown(asked)}; "
                            + (f"did you mean {' or '.join(near)}?" if near else f"it has those by {', '.join(self.names)}"))

    def _outputs(self) -> dict[str, np.ndarray]:
        """Derivatives of all outputs, by name, (n_t, ..., n_names)."""
        solution = self._solution
        metadata, inputs = solution.module.metadata, solution.inputs
        given = [*metadata.inputs, *metadata.parameters]
        parts, along = [], solution.input_slopes(np.swapaxes(self.matrix, 1, 2))
        for k, by in enumerate(self._columns):
            direction = np.zeros((len(solution.t), metadata.sizes.x + len(given)))
            direction[:, :metadata.sizes.x] = self.matrix[:, :, k]
            direction[:, metadata.sizes.x:metadata.sizes.x + metadata.sizes.inputs] = along[:, :, k]
            if by:
                direction[:, metadata.sizes.x + given.index(by)] = 1.0
            parts.append(solution.module.split_outputs(
                solution.module.evaluate(OUTPUTS, solution.t, solution.x, solution.params, inputs, direction)))
        return {name: np.stack([part[name] for part in parts], axis=-1) for name, _ in metadata.outputs}

    def __repr__(self) -> str:
        n_t, n_x, _ = self.matrix.shape
        return f"<Sensitivity of {n_x} states at {n_t} times by {', '.join(self.names)}>"
