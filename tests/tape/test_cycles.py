"""The cycles of a tape: throughput where nothing waits, latency where everything does, the window in between."""

from __future__ import annotations

from typing import Any

import pytest

from symdyn import systems
from symdyn.functions.tapes import function_tape
from symdyn.pipeline import emit
from symdyn.tape import Tape
from symdyn.tape.cycles import FUSED_LATENCY, LATENCY, WIDTH, WINDOW, fused_products, schedule
from symdyn.tape.node import COORDINATE, PARAMETER
from symdyn.tape.recorder import Recorder


def leaves(recorder: Recorder, n: int) -> list[Any]:
    return [recorder.leaf(f"q{k}", COORDINATE) for k in range(n)]


def test_a_chain_takes_the_sum_of_its_latencies() -> None:
    r = Recorder()
    x, y = leaves(r, 2)
    value = x
    for _ in range(10):
        value = (value + y) / y
    found = schedule(Tape.of(r, out=value))
    assert (found.instructions, found.cycles) == (20, 10 * (LATENCY["add"] + LATENCY["div"]))


def test_independent_steps_take_turns() -> None:
    r = Recorder()
    first, *others = leaves(r, 1001)
    found = schedule(Tape.of(r, out=[first * q for q in others]))
    assert (found.instructions, found.cycles) == (1000, 1000 // WIDTH - 1 + LATENCY["mul"])


def test_a_product_and_its_only_sum_are_one_instruction() -> None:
    r = Recorder()
    a, b, c, d = leaves(r, 4)
    alone = Tape.of(r, out=a * b + c)
    assert (schedule(alone).instructions, schedule(alone).cycles) == (1, FUSED_LATENCY)
    assert schedule(Tape.of(r, out=a * b - c * d)).instructions == 2
    assert schedule(Tape.of(r, out=[a * b + c, a * b + d])).instructions == 3
    assert schedule(Tape.of(r, out=[a * b + c, a * b])).instructions == 2
    r.name("ab", a * b)
    assert fused_products(alone) == set()


def test_parameters_signs_and_angles_are_no_instructions() -> None:
    r = Recorder()
    q, u = leaves(r, 2)
    m, l = (r.leaf(name, PARAMETER) for name in "ml")
    assert schedule(Tape.of(r, out=[-(m * l), -r.sin(q), r.cos(q)])).instructions == 0
    assert schedule(Tape.of(r, out=-(m * l) * r.sin(q) * u)).instructions == 2


def test_what_stands_too_far_behind_is_not_begun_early() -> None:
    r = Recorder()
    x, *others = leaves(r, 200)
    slow = r.sqrt(r.sqrt(r.sqrt(x)))
    late = [x * q for q in others]
    hidden = schedule(Tape.of(r, out=[slow, *late[:WINDOW - 3]])).cycles
    assert hidden == 3 * LATENCY["sqrt"]
    # One begins when the first root is there, one when the second is, all others after the third.
    waiting = len(late) - (WINDOW - 3) - 2
    assert schedule(Tape.of(r, out=[slow, *late])).cycles == hidden + waiting // WIDTH - 1 + LATENCY["mul"]


@pytest.mark.parametrize("formulation", ["embedding", "recursive"])
def test_fused_products_are_about_those_of_the_c_code(formulation: str) -> None:
    equations = getattr(systems.get("spatial_chain", n=5), formulation)()
    (text,) = emit(equations, "c", ("rhs",), standalone=False, integrator=False).files.values()
    written = text[text.index("_rhs("):].count("MADD(")
    assert written == pytest.approx(len(fused_products(function_tape(equations, "rhs"))), rel=0.15)
