"""The options of a right-hand side that is more than the function `rhs`; they identify the library that holds it."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass

# The method of the integrator that is compiled with a right-hand side where none is chosen.
METHOD = "dop853"


@dataclass(frozen=True)
class RightSide:
    """A right-hand side with its integrator.

    work        whether one more state integrates the work of all loads but gravity and springs
    baumgarte   whether it is stabilized by Baumgarte's method, with one more parameter: its gain, 1/s
    method      of the integrator, one of symdyn.backend.methods.METHODS
    sensitivities   what the state is differentiated by along the motion, a column each: parameters, inputs, "" for initial values
    held        inputs whose derivatives along the columns are parameters: those of x_dot by them count, too
    followed    inputs that follow the state by a function of the user, whose derivatives along the columns are further inputs
    open_contacts   whether all rigid contacts are open, whatever their parameters say: what they do is left out
    threads     whether it is a text for devices, with a kernel that integrates many motions by a thread each
    lanes       whether many motions are integrated at once, too, a motion in each SIMD lane
    looks       whether its integrator looks for events
    single      whether it computes in single precision, of texts for devices
    integrated  whether it has an integrator; of a text for devices: with a kernel that computes many right-hand sides if not
    adjoint     what weights of x_dot are carried back to besides x: parameters and inputs; None: nothing is carried back
    """

    work: bool = False
    baumgarte: bool = False
    method: str = METHOD
    sensitivities: tuple[str, ...] = ()
    adjoint: tuple[str, ...] | None = None
    held: tuple[str, ...] = ()
    followed: tuple[str, ...] = ()
    open_contacts: bool = False
    threads: bool = False
    lanes: bool = False
    looks: bool = True
    single: bool = False
    integrated: bool = True

    @property
    def in_lanes(self) -> bool:
        """Whether sensitivities may be columns in SIMD lanes: a series takes every statement of x_dot, and inputs that
        follow the state have derivatives of their own in every column."""
        return bool(self.sensitivities) and self.method != "taylor" and not self.followed

    @property
    def label(self) -> str:
        """Plain words for messages."""
        parts = (("the work of the loads", self.work), ("Baumgarte's stabilization", self.baumgarte),
                 (f"the method {self.method}", self.method != METHOD),
                 (f"sensitivities in {len(self.sensitivities)} columns", bool(self.sensitivities)),
                 ("the way back", self.adjoint is not None), ("all contacts open", self.open_contacts),
                 ("a kernel of many motions" if self.integrated else "a kernel of many states", self.threads),
                 ("many motions at once", self.lanes),
                 ("single precision", self.single))
        added = " and ".join(text for text, there in parts if there)
        return f"rhs with {added}" if added else "rhs"


def key_of(what: str | RightSide) -> str:
    """A text that identifies what a library is made for, as a name in files."""
    return what if isinstance(what, str) else json.dumps(asdict(what), sort_keys=True)
