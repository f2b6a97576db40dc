"""Programs that take part: evaluations of the accelerations, or of their derivatives, at one state, in a compiled loop."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from symdyn.lab.peers.description import Description


@dataclass(frozen=True)
class Program:
    """One that takes part.

    run           run(n): n evaluations; one coordinate of each depends on the result of the one before, so latency counts
    result        of the last evaluation, in symdyn's order of speeds: accelerations (n_u,), or their derivatives by q and u
                  (n_u, 2 n_u)
    multipliers   (n_c,) of the last evaluation, as in M u_dot + k + C_r^T lam = F; None if it computes none
    """

    name: str
    run: Callable[[int], None]
    result: Callable[[], np.ndarray]
    multipliers: Callable[[], np.ndarray] | None = None


@dataclass(frozen=True)
class State:
    """Where they are evaluated: q (n_q,) and u (n_u,) in symdyn's order.

    fed   index of the coordinate that carries the result of an evaluation on to the next
    """

    q: np.ndarray
    u: np.ndarray
    fed: int = 0


def address(array: np.ndarray) -> ctypes.c_void_p:
    """An array as the argument of a C function; the array must outlive the call."""
    return ctypes.c_void_p(array.ctypes.data)


def unsorted(values: np.ndarray, order: tuple[int, ...]) -> np.ndarray:
    """Values in the order of a peer, in symdyn's; `order` holds symdyn's index of each."""
    result = np.empty_like(values)
    result[list(order)] = values
    return result


def unsorted_derivatives(values: np.ndarray, description: Description) -> np.ndarray:
    """Derivatives of accelerations by q and u (n_u, 2 n_u) in the order of a peer, in symdyn's."""
    n, u_order = len(values), list(description.u_order)
    result = np.empty_like(values)
    result[np.ix_(u_order, [*description.q_order, *[n + k for k in u_order]])] = values
    return result
