"""Self-tests of written files: they find corrupted statements, in all branches and in the singular fallback."""

from __future__ import annotations

import re

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.backend.exercised import singular_states
from symdyn.backend.reference import make_reference
from symdyn.lab.mutants import Mutant, main, measure, mutants
from symdyn.pipeline import emit
from symdyn.tape.node import COORDINATE, PARAMETER
from symdyn.tape.recorder import Recorder
from symdyn.tape.sympy_bridge import record_expression
from symdyn.tape.tape import Tape, unsigned


def reference(expression: sp.Expr, defaults: dict[str, float] | None = None):
    """Reference vectors of one function of q."""
    recorder, q = Recorder(), sp.Symbol("q")
    leaf = recorder.leaf("q", COORDINATE)
    tape = Tape.of(recorder, f=record_expression(recorder, expression, {q: leaf}))
    groups = {"q": ["q"], "u": [], "z": [], "ud": [], "inputs": [], "p": []}
    return make_reference({"f": tape}, groups, defaults or {}, {"f": "q, out"})


def test_every_branch_of_a_choice_is_visited():
    q = sp.Symbol("q")
    steps = sp.Piecewise((sp.sin(3 * q), q < -40), (q**2, q < -5), (sp.cos(q), q < sp.Rational(1, 100)), (sp.exp(-q), q < 8),
                         (7 * q, True))
    found = reference(steps)
    visited = [float(dict(sample.arrays)["q"][0]) for sample in found.samples]
    for low, high in ((-1e9, -40), (-40, -5), (-5, 0.01), (0.01, 8), (8, 1e9)):
        assert any(low <= x < high for x in visited), (low, visited)
    assert found.exercised == found.statements and not found.idle and "statements exercised" in found.coverage


def test_statements_that_no_state_exercises_are_counted_and_named():
    q = sp.Symbol("q")
    found = reference(sp.Piecewise((sp.sin(q) * q, q > 10**9), (q + 1, True)))
    assert found.idle == {"f": 3} and found.coverage.endswith("not exercised: 3 of f; 1 more only decide validity or a branch")


def test_reference_states_vary_parameters():
    text = emit(sd.systems.get("pendulum").embedding(), "numpy").files["pendulum.py"]
    namespace: dict = {"__name__": "pendulum"}
    exec(text, namespace)
    first, second = (sample["p"] for sample in namespace["REFERENCE"])
    assert first == namespace["METADATA"]["defaults"]
    assert all(a != b and 0.79 < b / a < 1.26 for a, b in zip(first, second))


def test_states_of_loops_lie_in_the_singular_fallback():
    text = emit(sd.systems.get("four_bar").augmented(), "numpy", ("rhs",)).files["four_bar.py"]
    broken = re.sub(r"(def rhs_singular\(.*?cos_q1 = )cos\(", r"\1sin(", text, count=1, flags=re.DOTALL)
    assert broken != text
    for written, wrong in ((text, False), (broken, True)):
        namespace: dict = {"__name__": "four_bar"}
        exec(written, namespace)
        assert (namespace["selftest"]() > 0) is wrong


@pytest.mark.parametrize("backend", ["numpy", "c"])
def test_corruptions_are_made_in_the_functions_alone(backend):
    source = emit(sd.systems.get("pendulum").embedding(), backend)
    text = next(content for name, content in source.files.items() if name in ("pendulum.py", "pendulum.c"))
    made = mutants(text, backend)
    assert len(made) > 20 and len({mutant.text for mutant in made}) == len(made)
    assert all(isinstance(mutant, Mutant) and mutant.text.count("\n") == text.count("\n") for mutant in made)
    assert any("sin(" in m.before and "cos(" in m.after for m in made) and any("0.50390625" in m.after for m in made)


def test_the_self_test_finds_corruptions():
    count = measure("double_pendulum", "numpy", count=12, seed=3)
    assert not count.missed and count.found + len(count.equivalent) == 12 and count.found >= 11
    assert "corruptions found" in str(count)


def test_the_command_prints_its_counts(capsys):
    assert main(["pendulum", "--backend", "numpy", "--count", "5"]) == 0
    assert "pendulum (numpy): 5 of 5 corruptions found, 0 equivalent, 0 missed" in capsys.readouterr().out


def test_points_where_guarded_divisors_vanish_are_found_together():
    """Roots in closed form: q^2 = a and cos q = 0; parameters stay, divisors that are known or keep their sign are left out."""
    recorder = Recorder()
    q, a = recorder.leaf("q", COORDINATE), recorder.leaf("a", PARAMETER)
    divisors = [q * q - a, recorder.cos(q), q * q + 1]
    guarded = [unsigned(recorder.guard(d, d * d, f"divisor {k}")) for k, d in enumerate(divisors)]
    tape = Tape.of(recorder, f=[1 / g for g in guarded])
    values = {"q": np.array([0.5, 3.0, 2.0]), "a": np.array([2.0, 3.0, 3.0])}
    found = singular_states(tape, values, 3, set())
    assert set(found["a"]) <= {2.0, 3.0}
    np.testing.assert_allclose(found["q"], [np.sqrt(found["a"][0]), np.pi / 2], rtol=1e-15)
    assert singular_states(tape, values, 3, {guarded[0]})["q"].tolist() == found["q"][1:].tolist()
    assert singular_states(tape, values, 3, set(guarded))["q"].shape == (0,)
