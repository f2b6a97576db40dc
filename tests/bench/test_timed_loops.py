"""The clock of the benchmarks: interruptions do not count, and programs take turns."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from symdyn import systems
from symdyn.runtime.building.compiler import find_compiler
from symdyn.timing import loops


class FakeTime:
    """A clock that runs by the work that is done, and by interruptions at some of the calls."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, interrupted: tuple[int, ...]) -> None:
        self.now, self.calls, self.interrupted = 0.0, 0, interrupted
        self.counts: list[int] = []
        monkeypatch.setattr(loops, "clock", SimpleNamespace(perf_counter=lambda: self.now))

    def run(self, n: int, seconds: float) -> None:
        self.now += n * seconds + 0.01 * (self.calls in self.interrupted)
        self.calls += 1
        self.counts.append(n)


def test_interruptions_do_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    time = FakeTime(monkeypatch, interrupted=(0, 7, 150))
    fast, slow = loops.best_times([lambda n: time.run(n, 1e-7), lambda n: time.run(n, 3e-7)], 20)
    assert (fast, slow) == pytest.approx((1e-7, 3e-7))
    assert time.counts[-4:] == pytest.approx([20_000, 6667] * 2)


def test_given_number_of_evaluations(monkeypatch: pytest.MonkeyPatch) -> None:
    time = FakeTime(monkeypatch, interrupted=())
    assert loops.best_times([lambda n: time.run(n, 1e-7)], 3, loops=5) == pytest.approx([1e-7])
    assert time.counts == [5, 5, 5]


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")
def test_loop_evaluates_the_right_hand_side() -> None:
    equations = systems.double_pendulum().embedding()
    x = np.array([0.1, 0.2, 0.3, 0.4])
    loop = loops.compiled_loop(equations, x)
    loop.run(1)
    assert loop.evaluator.out == pytest.approx(equations.compile(backend="numpy").rhs(0.0, x), rel=1e-12)
    once = loop.evaluator.out.copy()
    loop.run(3)
    assert list(loop.evaluator.x) == list(x)
    assert 0 < np.abs(loop.evaluator.out - once).max() < 1e-6
