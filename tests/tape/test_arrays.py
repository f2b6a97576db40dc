"""Steps as arrays say what a loop over them says."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

import symdyn as sd
from symdyn.tape import Recorder, Tape
from symdyn.tape.arrays import Arrays
from symdyn.tape.node import COORDINATE, PARAMETER, Node
from symdyn.tape.tape import MANY, reachable, unsigned
from tests.helpers import swept


def test_a_step_reads_others_with_and_without_a_sign() -> None:
    """Numbers have no index, and neither has what the outputs do not reach."""
    r = Recorder()
    a, b, unused = (r.leaf(name, COORDINATE) for name in "abu")
    product, twice = a * b, 2 * a
    quotient = -product / twice
    arrays = Arrays(Tape.of(r, y=[quotient - product, r.sin(quotient)]).steps)
    index = arrays.index
    assert [index(n) for n in (a, b, product, twice)] == [0, 1, 2, 3] and index(unused) == -1
    assert arrays.indices([b, 3, None, unused, product]).tolist() == [1, -1, -1, -1, 2]
    assert arrays.index(r.cos(b)) == -1  # recorded later than all of these
    assert arrays.marked([product, 7, unused]).tolist() == [n is product for n in arrays.steps]
    assert arrays.chosen(arrays.does("mul", "div")) == (product, twice, unsigned(quotient))
    everything = np.ones(len(arrays.steps), dtype=bool)
    assert arrays.read_by(~arrays.does("neg"))[index(product)] == 2
    assert arrays.read_by(everything)[index(twice)] == 1
    assert not arrays.read_by(~everything).any()


@pytest.mark.parametrize("name", ["pendulum", "spatial_chain", "four_bar", *swept(["bicycle"])])
def test_arrays_agree_with_the_nodes(name: str) -> None:
    tape = sd.systems.get(name).equations().tape("rhs")
    arrays, steps = tape.arrays, tape.steps
    flat = [(k, a) for k, node in enumerate(steps) for a in node.args]
    assert arrays.readers.tolist() == [k for k, _ in flat] and arrays.values == [a for _, a in flat]
    cores = [unsigned(a) for _, a in flat]
    assert [steps[c] if c >= 0 else None for c in arrays.cores.tolist()] == [c if isinstance(c, Node) else None for c in cores]
    assert arrays.minus.tolist() == [core is not a for core, (_, a) in zip(cores, flat, strict=True)]
    assert tape.running == tuple(n for n in steps if n.mask & ~PARAMETER and n.op not in ("leaf", "neg"))
    assert tape.prologue == tuple(n for n in steps if n.mask == PARAMETER and n.op not in ("leaf", "neg"))
    uses = Counter(unsigned(a) for n in tape.running for a in n.args if isinstance(a, Node))
    assert arrays.read_by(arrays.running).tolist() == [uses[n] for n in steps]


def test_a_tape_of_numbers_has_no_steps() -> None:
    tape = Tape.of(Recorder(), y=[1, 2])
    assert tape.arrays.steps == () and tape.running == () and tape.longest_chain() == 0
    assert tape.arrays.indices([1, 2]).tolist() == [-1, -1]


def test_many_nodes_are_reached_as_few_are() -> None:
    recorder = Recorder()
    x, y = (recorder.leaf(name, PARAMETER) for name in "xy")
    total, left_out = x, 0
    for k in range(MANY):
        total, left_out = total * x + k, left_out + recorder.sin(y * (k + 2))
    needed, waiting = set(), [total]
    while waiting:
        node = waiting.pop()
        if isinstance(node, Node) and node not in needed:
            needed.add(node)
            waiting += node.args
    assert len(needed) > MANY and left_out not in needed
    assert reachable([total, 3, total]) == tuple(sorted(needed, key=lambda node: node.index))
