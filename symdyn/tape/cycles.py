"""Number of cycles that a processor takes for a tape: an estimate from the steps alone, the same on every machine.

The processor is a model of current ones: in a cycle it begins at most WIDTH instructions of the tape, each as soon as what
it needs is there, and it looks no more than WINDOW instructions beyond the oldest that is not finished. This comes to
instructions / WIDTH where little waits, in a chain whose steps wait for each other to the sum of their latencies, else to
something in between.

Sources: latencies from A. Fog, Instruction tables (AMD Zen 3; cores of Intel and Arm differ by a cycle); WINDOW is the 64
operations that its schedulers for floating point hold; it dispatches six machine instructions in a cycle, and compiled right-
hand sides have about three for each one of the tape, with all that loads and stores.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from symdyn.tape.node import Node
from symdyn.tape.ops import OPERATIONS
from symdyn.tape.tape import Tape, unsigned

WIDTH = 2
WINDOW = 64
# Cycles until a result can be used, by kind; sines and cosines are not there, they are taken all at once before.
LATENCY = {"add": 3, "mul": 3, "div": 13, "sqrt": 20, "compare": 1, "function": 40}
FUSED_LATENCY = 4


def fused_products(tape: Tape) -> set[Node]:
    """Products that are computed together with the sum that takes them: used there alone, without a name or a check."""
    uses = Counter(core for node in tape.running for core in map(unsigned, node.args) if isinstance(core, Node))
    uses.update(core for o in tape.outputs.values() for core in map(unsigned, o.entries) if isinstance(core, Node))
    running, names, checks = set(tape.running), tape.recorder.names, tape.recorder.checks
    fused: set[Node] = set()
    for node in tape.running:
        if node.op in ("add", "sub"):
            for core in map(unsigned, reversed(node.args)):
                if (isinstance(core, Node) and core.op == "mul" and core in running and uses[core] == 1 and core not in names
                        and core not in checks):
                    fused.add(core)
                    break
    return fused


@dataclass(frozen=True)
class Schedule:
    """Cost of an evaluation after hoisting, sines and cosines left out.

    instructions   operations, a product and the sum that takes it counted once
    cycles         from when sines and cosines are known
    """

    instructions: int
    cycles: int


def schedule(tape: Tape) -> Schedule:
    """Begin every step as early as the processor can, in the order in which they are written."""
    fused = fused_products(tape)
    ready: dict[Node, int] = {}
    begun: Counter[int] = Counter()
    finished: list[int] = [0] * WINDOW
    for node in tape.running:
        cores = [core for core in map(unsigned, node.args) if isinstance(core, Node)]
        earliest = max((ready.get(core, 0) for core in cores), default=0)
        kind = OPERATIONS[node.op].kind
        if node.op == "call":  # nothing else goes on meanwhile
            took = node.args[0].operations
            ready[node] = max(earliest, finished[-1]) + took
            finished += [ready[node]] * took
            continue
        if node in fused or kind not in LATENCY:
            ready[node] = earliest
            continue
        start = max(earliest, finished[-WINDOW])
        while begun[start] == WIDTH:
            start += 1
        begun[start] += 1
        ready[node] = start + (LATENCY[kind] if fused.isdisjoint(cores) else FUSED_LATENCY)
        finished.append(max(finished[-1], ready[node]))
    return Schedule(len(finished) - WINDOW, finished[-1])
