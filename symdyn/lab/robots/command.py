"""The table of robots: how far symdyn and Pinocchio are apart, operations, and times."""

from __future__ import annotations

import sys
import time as clock
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np

from symdyn.errors import ArgumentError, ModelWarning, SymdynError
from symdyn.functions.tapes import function_tape
from symdyn.lab.peers.program import State
from symdyn.lab.peers.symdyn_peer import symdyn_program
from symdyn.lab.robots.agreement import NAMES, differences, random_states
from symdyn.lab.robots.collection import ROBOTS, Listed, folder
from symdyn.lab.robots.pinocchio_aba import PinocchioAba
from symdyn.lab.robots.pinocchio_robot import PinocchioRobot
from symdyn.timing.loops import best_times
from symdyn.urdf.read import read_urdf

STATES = 100
REPEATS = 20
AGREEMENT = 1e-12
HEADING = (f"{'robot':26}{'n_u':>4}{'links':>6}{'read s':>8}{'derive s':>9}{'ops tau':>9}{'ops M':>8}{'ops ud':>8}"
           f"{'ops ABA':>9}{'ns':>8}{'ns ABA':>8}{'ratio':>7}  " + "".join(f"{name:>9}" for name in NAMES) + "  form")


@dataclass(frozen=True)
class Row:
    """One robot.

    speeds, links        numbers of them
    read, derived        seconds to read the file and to derive the equations in every candidate form
    operations           of tau, M and the accelerations; counted: of Pinocchio's articulated bodies, as it does them
    ours, theirs         ns of one evaluation of the accelerations; None where it is not timed or not there
    worst                of each quantity, see `differences`
    form                 in which symdyn computes the accelerations
    """

    name: str
    speeds: int
    links: int
    read: float
    derived: float
    operations: tuple[int, int, int]
    counted: int | None
    ours: float | None
    theirs: float | None
    worst: dict[str, float]
    form: str

    def __str__(self) -> str:
        ratio = "-" if self.ours is None or self.theirs is None else f"{self.theirs / self.ours:.1f}"
        times = ["-" if t is None else f"{t:.0f}" for t in (self.ours, self.theirs)]
        tau, M, ud = self.operations
        counted = "-" if self.counted is None else self.counted
        return (f"{self.name:26}{self.speeds:>4}{self.links:>6}{self.read:>8.2f}{self.derived:>9.2f}{tau:>9}{M:>8}{ud:>8}"
                f"{counted:>9}{times[0]:>8}{times[1]:>8}{ratio:>7}  "
                + "".join(f"{value:>9.1e}" for value in self.worst.values()) + f"  {self.form}")


def measure(robot: Listed, states: int = STATES, aba: PinocchioAba | None = None, timed: bool = True) -> Row:
    """The row of a robot. aba: Pinocchio's compiled algorithm; without it its operations and time are left out."""
    path = folder() / robot.file
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        begun = clock.perf_counter()
        system = read_urdf(path, root="floating" if robot.floating else "fixed")
        model = system.check()
        read = clock.perf_counter() - begun
        begun = clock.perf_counter()
        equations = system.equations()
        derived = clock.perf_counter() - begun
        recursive = equations if equations.formulation == "recursive" else system.recursive("parallel")
        peer = PinocchioRobot(path, model, robot.floating)
    sources = ((recursive, "inverse_dynamics"), (recursive, "mass_matrix"), (equations, "rhs"))
    tau, M, ud = (function_tape(form, name).operations for form, name in sources)
    q, u, _ = random_states(model, 1, np.random.default_rng(0))
    fed = model.coordinates.index(peer.joints[-1][0].coordinates[0])
    ours = theirs = counted = None
    there = aba is not None and not peer.mimics
    if aba is not None and there:
        counted = aba.operations(peer, q[0], u[0])
    if timed:
        runs = [symdyn_program(equations, State(q[0], u[0], fed)).run]
        if aba is not None and there:
            runs.append(aba.run(peer, q[0], u[0]))
        times = [seconds * 1e9 for seconds in best_times(runs, REPEATS)]
        ours, theirs = times[0], times[1] if there else None
    worst = differences(recursive, model, peer, states)
    return Row(robot.name, len(model.speeds), len(model.bodies), read, derived, (tau, M, ud), counted, ours, theirs, worst,
               f"{equations.formulation}, {equations.frames}")


def run(only: Sequence[str] | None = None, states: int = STATES, no_times: bool = False) -> int:
    """Print the table; returns the number of robots that could not be compared or differ by more than AGREEMENT.

    only       names, with * and ? (default: all)
    states     random states of each robot;  no_times: compile nothing
    Raises ArgumentError if no robot has such a name, MissingExtra if there are no robots.
    """
    chosen = [r for r in ROBOTS if any(fnmatchcase(r.name, p) for p in only or "*")]
    if not chosen:
        raise ArgumentError(f"no robot is named {', '.join(only or ())}; there are {', '.join(r.name for r in ROBOTS)}")
    if states < 1:
        raise ArgumentError(f"{states} states were asked for; pass 1 or more")
    folder()
    aba, failed = None, 0
    if not no_times:
        try:
            aba = PinocchioAba()
        except SymdynError as error:
            print(f"Pinocchio's times and operations are left out: {error}", file=sys.stderr)
    print(HEADING, flush=True)
    for robot in chosen:
        try:
            row = measure(robot, states, aba, not no_times)
        except SymdynError as error:
            failed += 1
            print(f"{robot.name:26}{error}", flush=True)
            continue
        print(row, flush=True)
        failed += not max(row.worst.values()) <= AGREEMENT
    print(f"{len(chosen)} robots, {states} random states each; {failed} differ by more than {AGREEMENT:.0e} or failed.\n"
          "ops: + - * / sqrt sin cos, one each; ABA: Pinocchio's articulated bodies in C++, as it does them (it has none with\n"
          "joints that mimic). ratio: its time over symdyn's. tau M ud J com energy: norm of the difference over the norm, the\n"
          "worst state; ud divided by the condition number of M.")
    return failed
