"""A four-bar linkage, every program: exact counts of operations, and times measured side by side.

Programs compute accelerations and multipliers, but for SymPy's Kane's method, which eliminates the multipliers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from symdyn.formulation.equations import Equations
from symdyn.functions.tapes import function_tape
from symdyn.lab.peers.benchmark import fastest
from symdyn.lab.peers.description import describe
from symdyn.lab.peers.kane_peer import KanePeer
from symdyn.lab.peers.kkt_peer import KktPeer
from symdyn.lab.peers.models import LOOP
from symdyn.lab.peers.pinocchio_peer import PinocchioLoopPeer
from symdyn.lab.peers.program import State
from symdyn.lab.peers.symdyn_peer import constrained_program, symdyn_program, with_multipliers
from symdyn.lab.peers.timing import agree, timed
from symdyn.model.system import System
from symdyn.systems import get

# At most, the time for accelerations and multipliers over that of the fastest generated code of CasADi and SymPy.
BOUND = 0.90
# ns on the machine where the peers' times were published; there accelerations and multipliers are to take less than DEMAND.
PUBLISHED = {"casadi": 78.0, "kane": 67.0, "pinocchio": 1450.0}
DEMAND = 70.0

Peer = KktPeer | KanePeer | PinocchioLoopPeer


@dataclass(frozen=True)
class LoopRow:
    """Measurements of a closed loop.

    times        program -> ns of one evaluation; operations: of those that are generated code, after hoisting
    difference   of accelerations and of multipliers, relative to their norm, the largest between programs
    """

    model: str
    formulation: str
    times: dict[str, float]
    operations: dict[str, int]
    difference: float

    def fastest(self, start: str) -> str | None:
        """The fastest program whose name begins so."""
        return min((name for name in self.times if name.startswith(start)), key=lambda name: self.times[name], default=None)

    @property
    def ratio(self) -> float | None:
        """Accelerations and multipliers, symdyn's time over that of the fastest generated code compared with it."""
        rivals = [self.times[name] for name in map(self.fastest, ("casadi", "kane")) if name is not None]
        return self.times["symdyn with multipliers"] / min(rivals) if rivals else None

    def misses(self) -> list[str]:
        """The bound in words if it is missed."""
        return [f"{self.ratio:.2f} > {BOUND:.2f}"] if self.ratio is not None and self.ratio > BOUND else []

    def scaled(self) -> dict[str, float]:
        """symdyn's time in ns on the machine of PUBLISHED, by each of the peers' times there and here."""
        result = {start: self.fastest(start) for start in PUBLISHED}
        return {start: self.times["symdyn with multipliers"] * PUBLISHED[start] / self.times[name]
                for start, name in result.items() if name is not None}


def four_bar_benchmark(peers: Sequence[Peer], repeats: int,
                     make_equations: Callable[[System], Equations] = fastest) -> LoopRow:
    """Count and time symdyn and the peers. Raises SymdynError if they do not compute the same."""
    system = get(LOOP)
    equations = with_multipliers(make_equations(system))
    state = moving_state(equations)
    programs = [constrained_program(equations, state), symdyn_program(equations, state)]
    counts = {c.name: function_tape(equations, f).operations for c, f in zip(programs, ("rhs_lam", "rhs"), strict=True)}
    values = {symbol.name: float(number) for symbol, number in system.defaults.items()}
    for peer in peers:
        if isinstance(peer, PinocchioLoopPeer):
            point, ground = ([values[name], 0.0, 0.0] for name in ("l3", "d"))
            programs.append(peer.program(describe(system.check()), state, 3, point, ground))
        else:
            made, operations = peer.programs(values, state)
            programs += made
            counts |= operations
    difference = agree(programs, LOOP)
    times = {who: seconds * 1e9 for who, seconds in timed(programs, repeats).items()}
    return LoopRow(LOOP, equations.formulation, times, counts, difference)


def moving_state(equations: Equations) -> State:
    """The closed linkage at its initial coordinates, in motion: q1_dot = 1 rad/s, the others as the loop has them."""
    symbols = equations.symbols
    q = np.array([symbols.initial[c] for c in symbols.coordinates], dtype=float)
    C_r = equations.lambdify("C_r")(q, np.zeros(len(symbols.speeds)), {})
    u = np.linalg.svd(C_r)[2][-1]
    return State(q, u / u[0])
