"""Steps across kinks of the equations: the derivative of such a step is off by its length, so that the way back takes short ones.

The error control of a run keeps the state, which a kink changes by the square of the step, and knows nothing of its derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from symdyn.runtime.module import Module
    from symdyn.tape.tape import Tape

# The length of a step across a kink that is short enough, of the span; no shorter than so many units of the last place of its
# time. Steps that a gradient may take again at the most.
SHORT, LEAST, WORK = 1e-9, 1e3, 50_000


@dataclass
class Breaks:
    """Surfaces on which the right-hand side has kinks or jumps; work: steps that may still be taken again, left: where steps
    were not, s."""

    module: Module
    tape: Tape
    span: float
    work: int = field(default_factory=lambda: WORK)
    left: list[float] = field(default_factory=list)

    @classmethod
    def of(cls, module: Module, span: tuple[float, float]) -> Breaks | None:
        """None where there are none, or none are known."""
        tape = module.breaks()
        metadata = module.metadata
        known = {"t", *metadata.x, *metadata.inputs, *metadata.parameters}
        if tape is None or not known.issuperset(leaf.args[1] for leaf in tape.inputs):
            return None
        return cls(module, tape, abs(span[1] - span[0]))

    def crossed(self, h: np.ndarray, t: np.ndarray, x: np.ndarray, p: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """Mask of the steps of lengths h (n,) that cross a surface and are too long, by times, states and inputs at all
        stages."""
        from symdyn.tape.floats import evaluate_rows

        metadata = self.module.metadata
        values = {"t": t, **dict(zip(metadata.x, x.T, strict=True)), **dict(zip(metadata.inputs, inputs.T, strict=True)),
                  **dict(zip(metadata.parameters, p.tolist(), strict=True))}
        above: np.ndarray = (evaluate_rows(self.tape, values, len(t))["surfaces"] > 0).reshape(len(h), len(t) // len(h), -1)
        across = np.any(np.any(above, axis=1) & ~np.all(above, axis=1), axis=1)
        begins = t.reshape(len(h), -1)[:, 0]
        across &= np.abs(h) > np.maximum(SHORT * self.span, LEAST * np.spacing(np.abs(begins)))
        if self.work <= 0:
            self.left += begins[across].tolist()
            across[:] = False
        return np.asarray(across)

    def doubts(self) -> list[str]:
        """Warnings."""
        if not self.left:
            return []
        return [f"{self.module.name}: the motion passes kinks of the equations too often for a gradient across all of them: at "
                f"{len(self.left)} of them, the first near t = {min(self.left):.6g} s, one step goes across, and derivatives are "
                "less exact; add events there, system.add_event, or take simulate(..., sensitivities=[...])"]
