"""What the bench of batches counts in machine code."""

from __future__ import annotations

import platform

import pytest

import symdyn as sd
from symdyn.lab.batch import stack_traffic
from symdyn.runtime.building.compiler import find_compiler

pytestmark = pytest.mark.native


def test_long_right_hand_sides_keep_vectors_on_the_stack() -> None:
    """A chain has more values at once than there are registers; fused products and sums count once, sines some times."""
    chain, pendulum = sd.systems.get("spatial_chain", n=5).embedding(), sd.systems.get("pendulum").embedding()
    compiler, module = find_compiler(), chain.compile(backend="c")
    if platform.machine() not in ("x86_64", "AMD64") or compiler is None or compiler.kind != "gcc" or module.batch_width < 4:
        pytest.skip("no gcc for x86 with wide vectors")
    arithmetic, stores, loads = stack_traffic(chain).values()
    operations = module.metadata.operations["rhs"]
    assert 0.25 * operations < arithmetic < 2 * operations + 60 * 5
    few = list(stack_traffic(pendulum).values())
    assert few[0] < 0.2 * arithmetic and few[1] < 0.2 * stores < 0.2 * arithmetic and few[2] < 0.2 * loads
