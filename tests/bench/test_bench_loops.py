"""The measurement of loops: bounds, table, command; and every mechanism stays on its constraints."""

from __future__ import annotations

import dataclasses
import json
import math

import pytest

import symdyn as sd
from symdyn.cli import main
from symdyn.errors import SymdynError
from symdyn.lab import loops
from symdyn.lab.loop_cases import CASES, REFERENCE, chosen, largest
from symdyn.lab.loops import Point, fastest, measure
from symdyn.runtime.building.compiler import find_compiler

needs_c = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")
# One of each kind: a constraint, loops, folds and lost rank, a redundant loop, time, constraints of the velocity.
KINDS = ["pendulum_absolute", "andrews_squeezer", "n_four_bar(2)", "bricard", "skate"]


def test_every_mechanism_with_constraints_is_measured():
    assert {case.name for case in CASES.values()} == {*sd.systems.names(constrained=True), "flyball_governor"}


def test_every_published_motion_is_compared():
    """And says where it is from."""
    assert {case.name for case in CASES.values() if case.reference} >= set(REFERENCE)
    for case in CASES.values():
        if case.reference is not None:
            reference = case.reference()
            assert reference.source and reference.times[-1] <= case.duration()


def test_names():
    assert [case.label for case in chosen(["n_four_bar"])] == [f"n_four_bar({n})" for n in (1, 2, 40, 100)]
    assert [case.label for case in chosen(["n_four_bar(2)", "skate"])] == ["n_four_bar(2)", "skate"]
    assert [case.label for case in chosen(None)] == list(CASES)
    with pytest.raises(SymdynError, match="did you mean bricard"):
        chosen(["brickard"])


def test_fastest_of_those_that_are_good_enough():
    points = [Point(1e-4, 1, 1e-4, 1e-3), Point(1e-6, 1, 3e-4, 1e-7), Point(1e-8, 1, 5e-4, 1e-9)]
    assert fastest(points) == 3e-4
    assert fastest(points[:1]) == math.inf


@needs_c
@pytest.mark.parametrize("label", KINDS)
def test_stays_on_its_constraints(label):
    """The short form of what the measurement does over 100 s."""
    case = CASES[label]
    sol = case.system().equations().compile().simulate((0, min(case.long, 5.0)), rtol=loops.LONG_RTOL)
    assert sol.success
    assert largest(sol.constraint_violation) <= loops.VIOLATION
    assert largest(sol.velocity_violation) <= loops.VIOLATION


@needs_c
def test_a_bound_that_is_missed_is_reported():
    row = measure(dataclasses.replace(CASES["skate"], bounds={"error_q": 1e-20, "error_u": 1e-9}), repeats=1, long=0.5)
    assert row.misses == ("MISSED error_q <= 1e-20",)
    assert str(row).endswith("MISSED error_q <= 1e-20")


@needs_c
def test_command(tmp_path, capsys):
    path = tmp_path / "loops.json"
    assert main(["bench", "loops", "--systems", "skate", "--repeats", "1", "--json", str(path)]) == 0
    out = capsys.readouterr().out
    assert "closed form" in out and "MISSED" not in out
    row = json.loads(path.read_text())["rows"][0]
    assert row["name"] == "skate" and row["rank"] == [1, 1] and row["error_u"] <= 1e-10
    assert main(["bench", "loops", "--systems", "nothing of the kind"]) != 0


@needs_c
def test_andrews_over_tolerances():
    """Errors fall with the tolerance."""
    points = loops.sweep(repeats=1, tolerances=(1e-5, 1e-7, 1e-9, 1e-11))
    errors = [p.error for p in points]
    assert errors == sorted(errors, reverse=True) and errors[-1] <= 1e-10
    assert [p.steps for p in points] == sorted(p.steps for p in points)
