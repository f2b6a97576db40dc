"""One mechanism, every program: exact counts of operations, and times measured side by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from symdyn.formulation.equations import Equations
from symdyn.functions.tapes import function_tape
from symdyn.lab.peers.casadi_peer import CasadiPeer
from symdyn.lab.peers.description import describe
from symdyn.lab.peers.models import Bound, Case, Timed
from symdyn.lab.peers.pinocchio_peer import PinocchioPeer
from symdyn.lab.peers.program import State
from symdyn.lab.peers.symdyn_peer import symdyn_program
from symdyn.lab.peers.timing import agree, timed
from symdyn.model.system import System
from symdyn.tape.tape import Tape

SEED = 20


@dataclass(frozen=True)
class Row(Timed):
    """Measurements of one mechanism.

    formulation       of symdyn's equations; operations, prologue, chain: of its right-hand side
    leanest           operations of the candidate with the fewest, of which the fastest was taken
    times             program -> ns of one evaluation; casadi_operations: form -> count
    difference        of the accelerations, relative to their norm, the largest between programs
    """

    model: str
    formulation: str
    operations: int
    leanest: int
    prologue: int
    chain: int
    times: dict[str, float]
    casadi_operations: dict[str, int]
    difference: float
    bound: Bound = field(default=Bound())

    def misses(self) -> list[str]:
        """Bounds that are missed, in words; what was not measured misses nothing."""
        return self.bound.missed(self.leanest, self.over("symdyn", "casadi runtime"), self.over("pinocchio", "symdyn"), 2)


def fastest(system: System) -> Equations:
    """symdyn's equations in the formulation that it would choose."""
    make: Callable[[], Equations] = getattr(system, "equations", system.embedding)
    return make()


def benchmark(name: str, case: Case, peers: Sequence[CasadiPeer | PinocchioPeer], repeats: int,
            make_equations: Callable[[System], Equations] = fastest) -> Row:
    """Count and time symdyn and the peers on a mechanism.

    Raises SymdynError if they do not compute the same accelerations at the state of the measurement.
    """
    system = case.make()
    equations, description = make_equations(system), describe(system.check())
    state = random_state(equations)
    programs, counts = [symdyn_program(equations, state)], {}
    for peer in peers:
        if isinstance(peer, CasadiPeer):
            forms = peer.forms(description)
            counts = {form.name: form.operations for form in forms}
            programs += [peer.program(form, description, state) for form in forms]
        else:
            programs.append(peer.program(description, state))
    difference = agree(programs, name)
    times = {who: seconds * 1e9 for who, seconds in timed(programs, repeats).items()}
    tape = function_tape(equations, "rhs")
    leanest = min([tape.operations, *[c.operations for c in equations.candidates]])
    return Row(name, equations.formulation, tape.operations, leanest, sum(tape.count_prologue().values()),
               tape.longest_chain(), times, counts, difference, case.bound)


def random_state(equations: Equations) -> State:
    """A state within 1 rad, 1 m and their rates; Euler parameters of unit norm.

    A coordinate that the accelerations do not depend on, such as one along which nothing changes, would not make an
    evaluation wait for the one before; the first that they depend on is fed.
    """
    symbols = equations.symbols
    rng = np.random.default_rng(SEED)
    q, u = (rng.uniform(-1, 1, len(group)) for group in (symbols.coordinates, symbols.speeds))
    for group in equations.unit_groups:
        places = [symbols.coordinates.index(s) for s in group]
        q[places] /= np.linalg.norm(q[places])
    accelerations = Tape.of(equations.recorder, u_dot=equations.quantity("rhs")[len(q):])
    used = {leaf.args[1] for leaf in accelerations.inputs}
    fed = next((k for k, s in enumerate(symbols.coordinates) if s.name in used), 0)
    return State(q, u, fed)
