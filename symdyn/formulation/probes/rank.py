"""Whether a mass matrix has full rank, tried at a random state with so many digits that rounding cannot hide it."""

from __future__ import annotations

import random

import numpy as np

from symdyn.tape.evaluate import evaluate
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import Tape

DIGITS = 40
# Elimination takes n^3 / 3 steps at many digits; longer mechanisms are left to the pivots of the generated code.
LARGEST = 30


def first_dependent(recorder: Recorder, M: np.ndarray) -> int | None:
    """The last row of a symmetric matrix that depends on the rows after it at every state, or None.

    M   (n, n) nodes and numbers; leaves are given random values, so that the matrix need not be definite
    """
    if not 0 < len(M) <= LARGEST:
        return None
    tape = Tape.of(recorder, M=M)
    stream = random.Random(1)
    A = evaluate(tape, {leaf.args[1]: stream.uniform(0.5, 1.5) for leaf in tape.inputs}, DIGITS)["M"]
    size = np.abs(np.diagonal(A))
    for k in reversed(range(len(A))):
        if abs(A[k, k]) < size[k] * 10 ** (8 - DIGITS):
            return k
        A[:k, :k] = A[:k, :k] - np.outer(A[k, :k], A[k, :k]) / A[k, k]
    return None
