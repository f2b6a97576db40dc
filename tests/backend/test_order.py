"""The order of statements on vectors: each stands behind what it needs, few values wait, and the bits stay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.backend import batch
from symdyn.backend.dialect import read_dialect
from symdyn.backend.order import few_waiting
from symdyn.backend.program import build
from symdyn.backend.writer import cores_of
from symdyn.emission import emit
from symdyn.folders import templates_folder
from symdyn.tape.node import Node
from symdyn.tape.tape import Tape


def waiting(order: Sequence[Node], entries: Sequence[Any]) -> list[int]:
    """Number of values that are still to be used, behind every step."""
    last = {core: k for k, node in enumerate(order) for core in cores_of(node.args)}
    last |= dict.fromkeys(cores_of(entries), len(order))
    return [sum(last.get(node, -1) > k for node in order[:k + 1]) for k in range(len(order))]


def tape_of(name: str, **sizes: int) -> Tape:
    return sd.systems.get(name, **sizes).equations().tape("rhs")


@pytest.mark.parametrize("name, sizes, most", [
    ("spatial_chain", {"n": 7}, 0.75), ("puma560", {}, 0.9), ("n_link_pendulum", {"n": 8}, 0.7)])
def test_fewer_values_wait(name: str, sizes: dict[str, int], most: float) -> None:
    """At the worst place."""
    tape = tape_of(name, **sizes)
    entries = next(iter(tape.outputs.values())).entries
    body = [node for node in tape.running if node.op not in ("leaf", "neg")]
    order = few_waiting(body, entries, ())
    assert sorted(map(id, order)) == sorted(map(id, body)) and order == few_waiting(body, entries, ())
    there: set[Node] = set()
    for node in order:
        assert not {core for core in cores_of(node.args) if core in body}.difference(there)
        there.add(node)
    assert max(waiting(order, entries)) <= most * max(waiting(body, entries))


def test_what_is_written_in_a_statement_stands_before_it() -> None:
    """Steps that get no variable have no place of their own, also where results are written with them."""
    tape = tape_of("spatial_chain", n=3)
    entries = next(iter(tape.outputs.values())).entries
    program = build(read_dialect(templates_folder() / "c"), {"rhs": tape}, {"rhs": ""}, places(tape))
    inlined = program.functions[0].inlined
    assert len(inlined) > 20
    order = few_waiting(tape.running, entries, inlined)
    assert sorted(map(id, order)) == sorted(map(id, tape.running))
    place = {node: k for k, node in enumerate(order)}
    for node in order:
        for core in cores_of(node.args):
            assert core not in place or place[core] < place[node]


def places(tape: Tape) -> dict[str, tuple[str, int]]:
    equations = sd.systems.get("spatial_chain", n=3).equations().symbols
    groups = {"q": equations.coordinates, "u": equations.speeds, "p": equations.parameters}
    return {"t": ("t", 0)} | {s.name: (group, k) for group, symbols in groups.items() for k, s in enumerate(symbols)}


@pytest.mark.native
def test_the_bits_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    """Statements of many states are those of one in another order, without headings of the derivation."""
    equations = sd.systems.get("spatial_chain", n=3).equations()
    text = _text(equations)
    assert "    // in an order in which few values wait for their uses\n" in text
    module = equations.compile(backend="c")
    x = np.random.default_rng(1).uniform(-1, 1, (11, module.metadata.sizes.x))
    assert np.array_equal(module.rhs_batch(0.0, x), module.evaluate("rhs", 0.0, x))
    monkeypatch.setattr(batch, "read_dialect", lambda folder: replace(read_dialect(folder), reordered=False))
    as_derived = _text(equations)
    assert as_derived != text and _operations(as_derived) == _operations(text)


def _text(equations: Any) -> str:
    return next(iter(emit(equations, "c", ["rhs"], standalone=False, integrator=False, batch=True).files.values()))


def _operations(text: str) -> list[int]:
    """Number of operations of each kind, without comments."""
    lines = "".join(line for line in text.splitlines() if "//" not in line)
    return [lines.count(word) for word in ("MADD(", "*", "/", " - ", " + ")]
