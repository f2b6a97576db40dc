"""Work against error: motions that begin off their constraints, and motions that stand still."""

import json
import math

import numpy as np
import pytest

import symdyn as sd
from symdyn.bench.work import start
from symdyn.bench.work.cases import of_equations, of_system
from symdyn.bench.work.record import Reference
from symdyn.bench.work.start import ELSEWHERE, STILL, on_constraints, stands_still
from symdyn.bench.work.system_under_test import SystemUnderTest
from symdyn.errors import SymdynError
from tests.mechanisms import four_bar_linkage

SMALL = {"methods": ["dop853"], "tolerances": [1e-6, 1e-9], "repeats": 1, "end": 1.0}


def test_all_formulations_begin_at_the_nearest_state_on_the_constraints(tmp_path, drawn):
    system = four_bar_linkage()
    before = dict(system.initial)
    result = sd.bench(system, folder=tmp_path, **SMALL)
    assert system.initial == before  # the user's stays as it is
    module = four_bar_linkage().augmented().compile()
    q, u = module.consistent()
    exact = module.simulate((0, 1.0), q, u, rtol=1e-12)
    np.testing.assert_allclose(result.reference.x[-1], exact.x[-1], rtol=0, atol=1e-9)
    assert [r.formulation for r in result.rows] == ["augmented"] * 2 + ["absolute"] * 2
    for row in result.rows:
        assert not row.message and row.error < 1e3 * row.tolerance
    note, = result.notes
    assert note == ("the initial state violates the constraints; the motion begins at the nearest one that does not: "
                    f"q1 from 1 to {q[0]:.6g}, q2 from -0.5 to {q[1]:.6g}, q3 from -2 to {q[2]:.6g}")
    assert "note: the initial state violates" in result.table() and "The initial state violates" in (
        tmp_path / "report.html").read_text()
    assert json.loads((tmp_path / "results.json").read_text())["notes"] == [note]


def test_equations_begin_there_too_and_a_start_that_fits_stays():
    equations = four_bar_linkage().augmented()
    result = sd.bench(equations, **SMALL)
    assert "q1 from 1 to" in result.notes[0] and all(r.error < 1e3 * r.tolerance for r in result.rows)
    assert equations.symbols.initial == four_bar_linkage().augmented().symbols.initial
    for about in (of_system(sd.systems.get("four_bar")), of_equations(sd.systems.get("four_bar").augmented())):
        moved, told = on_constraints(about, about.first())
        assert moved is about and told == ""
    moved, told = on_constraints(of_equations(equations), of_equations(equations).first())
    again = moved.given.again()  # files are made of equations that are derived again
    assert told and again.symbols.initial == moved.given.symbols.initial != equations.symbols.initial


def test_other_orientations_than_the_first_would_begin_elsewhere():
    about = SystemUnderTest("linkage", {"angles": four_bar_linkage(), "parameters": four_bar_linkage()}, 1.0)
    moved, told = on_constraints(about, about.first())
    assert told and list(moved.variants) == ["angles"]
    from symdyn.bench.work.asked import checked
    from symdyn.bench.work.benchmark import run

    asked = checked([about], ["augmented", "augmented:parameters"], ["dop853"], [1e-6], repeats=1)
    result = run(about, asked)
    assert [r.formulation for r in result.rows] == ["augmented"]
    assert str(result.skipped[-1]) == f"augmented:parameters: {ELSEWHERE}"
    with pytest.raises(SymdynError, match="linkage: the initial state violates the constraints, and the nearest"):
        run(about, checked([about], ["augmented:parameters"], ["dop853"], [1e-6], repeats=1))


def test_a_motion_that_stands_still_is_reported_and_has_no_best(tmp_path, drawn):
    system = sd.systems.get("pendulum")
    system.initial = {}
    result = sd.bench(system, formulations=["embedding"], folder=tmp_path, **SMALL)
    assert result.notes == (STILL,) and result.still and "set system.initial to a state that moves" in STILL
    text, page = result.table(), (tmp_path / "report.html").read_text()
    assert "note: the motion stands still" in text and "least time below an error, at the end: none, nothing moves" in text
    assert "1e-13 " not in text and "The motion stands still" in page and "<p>None.</p>" in page
    moving = sd.bench("pendulum", formulations=["embedding"], **SMALL)
    assert moving.notes == () and not moving.still and "1e-02  " in moving.table()


def test_what_settles_or_comes_back_does_not_stand_still(monkeypatch):
    first = of_system(sd.systems.get("pendulum")).first()
    at = lambda *q: Reference("closed form", (1.0, 2.0), [[v, 0.0] for v in q], 15.0, "")
    x = float(first.x0[0])
    assert stands_still(at(x, x), first) and stands_still(at(x, x + 1e-13), first)
    assert not stands_still(at(0.0, 0.0), first) and not stands_still(at(x + 1e-9, x), first)
    assert not stands_still(at(math.nan, x), first)
    assert start._NEAR < 1e-9
