"""The steps of a tape as arrays: what is asked of all of many steps is answered without a loop over them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from itertools import chain, compress
from typing import Any

import numpy as np

from symdyn.tape.node import PARAMETER, Node
from symdyn.tape.ops import OPERATIONS

# Operations that are no statements.
_READ = ("leaf", "neg")
_NUMBERS = {op: k for k, op in enumerate(("leaf", *OPERATIONS))}


class Arrays:
    """Steps by their indices, arguments before use, with all steps that they read.

    steps    the nodes
    ops      (n,) number of each operation, see `does`
    masks    (n,) what each depends on
    begins   (n + 1,) where the arguments of each begin among all
    values   the arguments of all steps, one after the other, (m,)
    cores    (m,) of each argument the index of the step that it is without its sign; -1: it is a number or the like
    minus    (m,) whether it has a sign
    readers  (m,) the index of the step whose argument it is
    """

    def __init__(self, steps: Sequence[Node]) -> None:
        """Take steps in order of recording."""
        self.steps = steps
        n = len(steps)
        self.ops = np.array([_NUMBERS[step.op] for step in steps], dtype=np.int8)
        self.masks = np.array([step.mask for step in steps], dtype=np.int16)
        arguments = [step.args for step in steps]
        sizes = np.fromiter(map(len, arguments), dtype=np.int64, count=n)
        self.begins = np.concatenate(([0], np.cumsum(sizes)))
        self.values: list[Any] = list(chain.from_iterable(arguments))
        self.readers = np.repeat(np.arange(n), sizes)
        recorded = [step.index for step in steps]
        self._indices = np.full(recorded[-1] + 2 if steps else 1, -1)
        self._indices[recorded] = np.arange(n)
        read = self.indices(self.values)
        core = np.arange(n + 1)
        core[-1] = -1
        signs = np.flatnonzero(self.does("neg"))
        core[signs] = read[self.begins[signs]]
        self.cores = core[read]
        self.minus = self.cores != read

    @cached_property
    def running(self) -> np.ndarray:
        """Mask of the steps that must be evaluated at every state: those that depend on more than parameters, (n,)."""
        return (self.masks & ~PARAMETER != 0) & ~self.does(*_READ)

    @cached_property
    def prologue(self) -> np.ndarray:
        """Mask of the steps that depend on parameters only, (n,)."""
        return (self.masks == PARAMETER) & ~self.does(*_READ)

    def does(self, *ops: str) -> np.ndarray:
        """Mask of the steps with one of these operations, (n,)."""
        return np.isin(self.ops, [_NUMBERS[op] for op in ops])

    def indices(self, values: Iterable[Any]) -> np.ndarray:
        """The indices of values that are steps; -1: of all else."""
        recorded = np.array([value.index if isinstance(value, Node) else -1 for value in values], dtype=np.int64)
        return self._indices[np.minimum(recorded, len(self._indices) - 1)]

    def index(self, node: Node) -> int:
        """The index of a node among the steps; -1: it is no step."""
        return int(self._indices[min(node.index, len(self._indices) - 1)])

    def marked(self, values: Iterable[Any]) -> np.ndarray:
        """Mask of the steps among the values, (n,)."""
        result = np.zeros(len(self.steps) + 1, dtype=bool)
        result[self.indices(values)] = True
        return result[:-1]

    def chosen(self, which: np.ndarray) -> tuple[Node, ...]:
        """The steps that are marked, (n,)."""
        return tuple(compress(self.steps, which.tolist()))

    def read_by(self, which: np.ndarray) -> np.ndarray:
        """Number of times that the marked steps read each step, with or without a sign, (n,)."""
        cores = self.cores[which[self.readers]]
        return np.bincount(cores[cores >= 0], minlength=len(self.steps))
