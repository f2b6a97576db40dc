"""Interface to another program that is compared with symdyn: the same motion, at its own fair best."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Protocol

import numpy as np

from symdyn.errors import SymdynError

# A run that would take longer is not made, s.
LONGEST = 15.0
# Seconds inside the integrator, evaluations of the right-hand side (0: unknown), state at the end in symdyn's order,
# (n_x,), or states (n_t, n_x).
Ran = tuple[float, int, np.ndarray]


# In the place of a formulation, of programs that derive the motion themselves.
BODIES = "bodies"


class Runner(Protocol):
    """Function that runs a motion with a tolerance."""

    def __call__(self, tolerance: float, times: np.ndarray | None = None) -> Ran:
        """Run it to the end; or, with times (n_t,), increasing, s, of which the last is the end, give the states there.

        Such a run takes the same steps, but what it takes is no measure: it may also look at every step. Raises Failed.
        """
        ...


class Unfit(SymdynError):
    """A peer that cannot run a mechanism; the message says why, in one short sentence."""


class Failed(SymdynError):
    """A run of a peer that did not reach the end at this tolerance; the message says what the peer said."""


@contextmanager
def fitting(program: str) -> Iterator[None]:
    """A failure while a program is prepared is a reason why it is left out: raises Unfit."""
    try:
        yield
    except Unfit:
        raise
    except (SymdynError, ArithmeticError, RuntimeError, ValueError) as error:
        raise Unfit(f"{program} does not take it: {next(iter(str(error).strip().splitlines()), type(error).__name__)}") from None


class Peer(Protocol):
    """One program with one integrator.

    name    of the row, such as "heyoka" or "scipy LSODA"; title: the same with versions, for the legend
    bodies  it takes bodies and joints, not a formulation of ours
    """

    name: str
    title: str
    bodies: bool

    def available(self) -> bool | str:
        """True, or why it cannot run here and what to install."""
        ...

    def prepare(self, equations: Any, params: np.ndarray, x0: np.ndarray, end: float, system: Any = None) -> Runner:
        """Function that runs the motion; everything that is done once (derivation, compilation) is done here, outside the timing.

        equations   of one formulation, symdyn.formulation.equations.Equations; its symbols give the order of params and x
        params      (n_p,);  x0: (n_x,) consistent start [q; u; z] at t = 0;  end: s
        system      the System they were derived from, for peers that take bodies and joints; None if there is none
        Raises Unfit if the peer has no way to run this mechanism.
        """
        ...


def taken_as(peer: Peer, formulation: str) -> str:
    """Model that a program runs: a formulation of ours, or bodies and joints."""
    return BODIES if peer.bodies else formulation
