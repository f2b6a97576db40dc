"""Counts of the bench of batches in machine code."""

from __future__ import annotations

import platform
from dataclasses import replace

import pytest

import symdyn as sd
from symdyn.lab import batch
from symdyn.runtime.building.compiler import find_compiler

pytestmark = pytest.mark.native


def test_long_right_hand_sides_keep_vectors_on_the_stack(monkeypatch: pytest.MonkeyPatch) -> None:
    """A chain has more values at once than there are registers; fused products and sums count once, sines some times."""
    compiler = find_compiler()
    if platform.machine() not in ("x86_64", "AMD64") or compiler is None or compiler.kind != "gcc":
        pytest.skip("no gcc for x86")
    monkeypatch.setattr(batch, "require_compiler", lambda: replace(compiler, command=compiler.command[:1]))  # as users have it
    chain, pendulum = sd.systems.get("spatial_chain", n=5).embedding(), sd.systems.get("pendulum").embedding()
    found = batch.stack_traffic(chain)
    if not found:
        pytest.skip("no wide vectors")
    arithmetic, stores, loads = found.values()
    operations = chain.compile(backend="c").metadata.operations["rhs"]
    assert 0.5 * operations < arithmetic < 2 * operations + 60 * 5
    few = list(batch.stack_traffic(pendulum).values())
    assert few[0] < 0.2 * arithmetic and few[1] < 0.2 * stores < 0.2 * arithmetic and few[2] < 0.2 * loads
