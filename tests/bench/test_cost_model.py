"""The fit of the cost model: it finds constants that are there, and counts what wrong ones lose."""

from __future__ import annotations

from dataclasses import replace

import pytest

from symdyn import systems
from symdyn.choice import COSTS, Candidate
from symdyn.lab import cost_model
from symdyn.lab.cost_model import Regret, Sample, cross_validated, fit, measure, predict
from symdyn.runtime.building.compiler import find_compiler

CANDIDATE = Candidate("embedding", "body", 0, 0, 0, 0.0)


def sample(system: str, ns: float, **terms: float) -> Sample:
    return Sample(system, CANDIDATE, terms, ns)


def test_constants_that_are_there_are_found() -> None:
    samples = [sample(f"system({k})", 3 * a + 0.5 * b, a=a, b=b) for k, (a, b) in enumerate([(1, 9), (4, 2), (2, 2)])]
    assert fit(samples, ["a", "b"]) == pytest.approx({"a": 3, "b": 0.5})
    assert fit([replace(s, terms={**s.terms, "c": -s.ns}) for s in samples], ["a", "b", "c"])["c"] == 0
    assert predict(samples[0], {"a": 3, "b": 0.5}) == samples[0].ns


def test_a_loss_is_that_of_the_predicted_over_the_fastest() -> None:
    samples = [sample("one", 10), sample("one", 11), sample("two", 20), sample("two", 20.5), sample("three", 5)]
    regret = Regret.of(samples, [2, 1, 4, 3, 5])
    assert (regret.good, regret.systems, regret.where) == (2, 3, "one")
    assert regret.worst == pytest.approx(0.1) and regret.mean == pytest.approx(0.125 / 3)
    assert "2 of 3 within 5% of the fastest, worst loss 10.0% (one)" in str(regret)


def test_a_family_is_predicted_from_the_others() -> None:
    samples = [sample("a(1)", 1, work=1), sample("a(2)", 2, work=2), sample("b(1)", 20, work=10), sample("b(2)", 40, work=20)]
    assert cross_validated(samples, ["work"]).error == pytest.approx(((2 * 1 + 2 * 0.25) / 4) ** 0.5)


def test_what_the_mass_matrix_takes_besides_its_factors() -> None:
    forms = [(formulation, frames) for formulation in ("embedding", "recursive") for frames in ("body", "parallel")]
    counts = dict(zip(forms, (40, 30, 20, 10), strict=True))
    samples = [Sample(system, Candidate(*form, 0, 0, 0, 0.0), {"instructions": n, "solving": 10, "speeds": speeds}, 1.0)
               for system, speeds in (("long", 3), ("short", 2)) for form, n in counts.items()]
    assert cost_model.forming(samples) == [(40 - 10) / 20, (30 - 10) / 10]


def test_systems_have_names_of_their_own_and_models_are_nested() -> None:
    assert len(cost_model.systems()) == 40
    assert cost_model.MODELS["cycles, decoding"] == tuple(COSTS)


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")
def test_a_system_is_counted_and_timed(capsys: pytest.CaptureFixture[str]) -> None:
    samples = measure("n_link_pendulum(2)", systems.get("n_link_pendulum", n=2), repeats=1)
    assert [(s.candidate.formulation, s.candidate.frames) for s in samples] == [
        (formulation, frames) for formulation in ("embedding", "recursive") for frames in ("body", "parallel")]
    assert all(s.ns == s.candidate.measured and s.candidate.predicted == pytest.approx(predict(s, COSTS)) for s in samples)
    assert all(set(names) <= set(samples[0].terms) for names in cost_model.MODELS.values())
    cost_model.print_system(samples)
    assert capsys.readouterr().out.count("chosen") == 1
