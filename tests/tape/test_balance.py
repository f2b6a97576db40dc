"""Reordering sums: same values, no more operations, shorter chains; names, checks and shared sums stay."""

from __future__ import annotations

import importlib

import pytest

import symdyn as sd
from symdyn.choice import choose
from symdyn.pipeline import emit
from symdyn.tape import Tape
from symdyn.tape import node as kinds
from symdyn.tape.balance import balance
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import unsigned
from tests import helpers

balancing = importlib.import_module("symdyn.tape.balance")


@pytest.mark.parametrize(("name", "options", "formulation"), [
    ("spatial_chain", {"n": 5}, "recursive"), ("spatial_chain", {"n": 5}, "embedding"), ("puma560", {}, "embedding"),
    ("n_link_pendulum", {"n": 6}, "recursive"), ("cart_pole", {}, "embedding")])
def test_same_values_shorter_chain(name: str, options: dict, formulation: str) -> None:
    equations = getattr(sd.systems.get(name, **options), formulation)()
    tape = equations.tape("rhs", "inverse_dynamics")
    ours = balance(tape)
    values = helpers.state(equations, 7)
    before, after = helpers.at(tape, values), helpers.at(ours, values)
    assert all(helpers.close(after[n], before[n]) for n in before)
    assert ours.operations <= tape.operations and ours.longest_chain() <= tape.longest_chain()
    assert {n.args[1] for n in ours.inputs} == {n.args[1] for n in tape.inputs}


def test_what_is_ready_first_is_added_first() -> None:
    r = Recorder()
    a, b, c, d = (r.leaf(name, kinds.COORDINATE) for name in "abcd")
    late = r.sin(a)
    tape = Tape.of(r, y=[late + b - c + d])
    assert tape.longest_chain() == 4
    assert balance(tape).longest_chain() == 3  # b - c + d while the sine is computed


def test_signs() -> None:
    r = Recorder()
    a, b, c, d = (r.leaf(name, kinds.COORDINATE) for name in "abcd")
    tape = Tape.of(r, y=[-a - b - c - d, a - (b - (c - d)), -(a + b) * c, 1 - (a + b)])
    values = dict(zip("abcd", (2, 3, 5, 7), strict=True))
    assert list(helpers.at(balance(tape), values)["y"]) == [-17, -3, -25, -4] and balance(tape).operations == tape.operations


def test_terms_that_cancel_and_numbers_among_terms() -> None:
    """a and -a are ready at once and leave nothing; numbers keep their sign wherever they stand."""
    r = Recorder()
    a, b, c = (r.leaf(name, kinds.COORDINATE) for name in "abc")
    late = r.sqrt(b)
    tape = Tape.of(r, y=[(a + late) - a, (c + late) - c - a * a, (-a - c) - late * c, 3 - (a - (b - late)), (c - 5) - (b - a)])
    ours = balance(tape)
    values = dict(zip("abc", (2, 9, 7), strict=True))
    assert list(helpers.at(ours, values)["y"]) == [3, -1, -30, 7, -5]
    first, second, *_ = ours.outputs["y"].entries
    assert first is ours.recorder.sqrt(ours.recorder.leaf("b", kinds.COORDINATE)) and first in unsigned(second).args


def test_named_checked_and_shared_sums_stay() -> None:
    r = Recorder()
    a, b, c, d = (r.leaf(name, kinds.COORDINATE) for name in "abcd")
    named, checked = r.name("kept", r.sin(a) + b), r.positive(r.cos(a) + c, "why")
    shared = r.sin(b) + d
    ours = balance(Tape.of(r, y=[named + c, d / checked, checked + d, shared + a, shared + c]))
    assert list(ours.recorder.names.values()) == ["kept"] and list(ours.recorder.checks.values()) == ["why"]
    assert ours.operations == 11


def test_what_was_balanced_last_is_handed_out_once_more() -> None:
    """The tape that a formulation is chosen by is the one that is emitted; a name or a check in between makes another one."""
    r = Recorder()
    a, b, c = (r.leaf(name, kinds.COORDINATE) for name in "abc")
    total = r.sin(a) + b + c
    tape = Tape.of(r, y=[total])
    first = balance(tape)
    assert balance(Tape.of(r, y=[total])) is first
    assert balance(tape) is not first
    r.name("sum", total)
    assert list(balance(tape).recorder.names.values()) == ["sum"]
    assert balance(Tape.of(r, y=[total, a])).operations == balance(Tape.of(r, y=[total])).operations == 3


def test_a_balanced_choice_is_emitted_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sums are reordered once, for the choice, and not again for the code of the right-hand side."""
    equations = choose(sd.systems.get("n_link_pendulum", n=6).check(), formulation="recursive")
    seen: list[Tape] = []

    class Counted(balancing._Balancer):
        def __init__(self, tape: Tape) -> None:
            seen.append(tape)
            super().__init__(tape)

    monkeypatch.setattr(balancing, "_Balancer", Counted)
    emit(equations, "c", ("rhs",), standalone=False, integrator=False)
    assert not seen
    emit(equations, "c", ("rhs",), standalone=False, integrator=False)  # what was balanced last is handed out once
    assert len(seen) == 1
