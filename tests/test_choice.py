"""The choice of a formulation: its table is exact, it is the same everywhere, and a formulation that is named is taken."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import symdyn as sd
from symdyn import choice, systems
from symdyn.choice import FORMULATIONS, HEADING, Candidate, choose, derived_in_frames, formulated
from symdyn.cli import main
from symdyn.errors import CompilerNotFound, EvaluationError, ModelError, SymdynError
from symdyn.formulation.trees.embedding import embed
from symdyn.formulation.trees.recursive import recursive
from symdyn.functions.tapes import function_tape
from symdyn.lab.random_tree import random_tree
from symdyn.lab.rolled import cable
from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.building.recall import recall
from symdyn.tape.cycles import fused_products
from symdyn.timing.side_by_side import times_side_by_side
from tests.helpers import close, quantities, state
from tests.mechanisms import kitchen_sink

needs_c = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Times need not be good here."""
    monkeypatch.setattr("symdyn.timing.loops.TIMING_SECONDS", 1e-5)


def taken(equations: Any) -> Candidate:
    (chosen,) = [c for c in equations.candidates if c.chosen]
    assert (chosen.formulation, chosen.frames) == (equations.formulation, equations.frames)
    return chosen


def arms(*lengths: int, axes: tuple[Any, ...] = ([0, 0, 1], [0, 1, 0], [1, 0, 0])) -> sd.System:
    """Arms of so many bodies with full inertia on one turning base."""
    m, l, I = sd.parameters("m l I", positive=True)
    s = sd.System("arms", gravity=[0, 0, -9.81])
    s.defaults = {m: 1.0, l: 0.5, I: 0.1}
    base = s.add_body("base", mass=m, inertia=[I, 2 * I, 3 * I], com=[l, l / 2, l / 3])
    s.add_joint(sd.Revolute("pedestal", s.ground, base, axis=[1, 0, 0]))
    for arm, length in enumerate(lengths):
        parent = base
        for k in range(length):
            body = s.add_body(f"body_{arm}_{k}", mass=m, inertia=[I, 2 * I, 3 * I], com=[l, l / 2, l / 3])
            s.add_joint(sd.Revolute(f"joint_{arm}_{k}", parent, body, axis=axes[k % len(axes)], parent_point=[l, l / 3, l / 4]))
            parent = body
    return s


def geared(n: int = 3) -> sd.System:
    """A chain whose second joint turns twice as far as its first."""
    q = sd.coordinates("q1:" + str(n + 1))
    m, l, g = sd.parameters("m l g", positive=True)
    s = sd.System("geared", gravity=[0, -g])
    parent: Any = s.ground
    for k in range(n):
        body = s.add_body(f"link_{k}", mass=m, inertia=m * l**2, com=[l, 0])
        s.add_joint(sd.Revolute(f"joint_{k}", parent, body, 2 * q[0] if k == 1 else q[k], parent_point=[l if k else 0, 0]))
        parent = body
    s.defaults = {m: 1.0, l: 0.5, g: 9.81}
    return s


# -- the table


@pytest.mark.parametrize("system", [systems.get("spatial_chain", n=4), systems.get("n_link_pendulum", n=3), random_tree(6, 4)],
                         ids=lambda s: s.name)
def test_the_table_is_exact_and_the_least_time_is_chosen(system: sd.System) -> None:
    equations = system.equations()
    for candidate in equations.candidates:
        tape = function_tape(getattr(system, candidate.formulation)(candidate.frames), "rhs")
        assert candidate.operations == tape.operations and candidate.prologue == sum(tape.count_prologue().values())
        assert candidate.chain == tape.longest_chain() and candidate.predicted == choice.predicted_time(tape)
        assert candidate.measured is None
    assert taken(equations).time == min(c.time for c in equations.candidates)
    assert function_tape(equations, "rhs").operations == taken(equations).operations


@pytest.mark.parametrize("name, n, wanted", [
    ("n_link_pendulum", 5, "embedding"), ("n_link_pendulum", 8, "embedding"), ("n_link_pendulum", 20, "recursive"),
    ("spatial_chain", 4, "embedding"), ("spatial_chain", 7, "embedding"), ("spatial_chain", 12, "recursive"),
    ("spatial_chain", 16, "recursive")])
def test_what_was_measured_to_be_faster_is_chosen(name: str, n: int, wanted: str) -> None:
    assert systems.get(name, n=n).equations().formulation == wanted


def test_lines_stand_under_the_heading() -> None:
    plain, timed = Candidate("recursive", "parallel", 1200, 34, 567, 890.4), Candidate("embedding", "body", 1, 2, 3, 4, 5.6, True)
    assert HEADING.split("  ")[-1].strip() == "measured ns"
    assert str(plain).split() == ["recursive", "parallel", "1200", "34", "567", "890", "-"] and len(str(plain)) == len(HEADING)
    assert str(timed).split() == ["embedding", "body", "1", "2", "3", "4", "6", "chosen"]
    assert plain.time == 890.4 and timed.time == 5.6


def test_candidates_compute_the_same_accelerations() -> None:
    system = random_tree(6, 4)
    candidates = system.equations().candidates
    assert len(candidates) == 4
    derived = [getattr(system, c.formulation)(c.frames) for c in candidates]
    values = [quantities(e, state(e), "accelerations")[0] for e in derived]
    assert all(close(value, values[0]) for value in values[1:])


def test_the_choice_does_not_depend_on_the_process() -> None:
    code = ("from symdyn import systems\nfor name in ('double_pendulum', 'three_link_arm'):\n"
            "    print([repr(c) for c in getattr(systems, name)().equations().candidates])")
    seed = "1" if os.environ.get("PYTHONHASHSEED") != "1" else "2"
    there = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True, env={
        **os.environ, "PYTHONPATH": str(Path(sd.__file__).parents[1]), "PYTHONHASHSEED": seed}).stdout
    here = [getattr(systems, name)().equations().candidates for name in ("double_pendulum", "three_link_arm")]
    assert there.splitlines() == [str([repr(c) for c in candidates]) for candidates in here]


# -- when the mass matrix is tried


def written_instructions(equations: Any) -> int:
    """Instructions of factorizing and solving on the tape, in the prologue or not."""
    tape = equations.tape("rhs")
    fused = fused_products(tape)
    return sum(node.section.startswith(("factors of the mass matrix", "accelerations:")) and node not in fused
               for node in (*tape.running, *tape.prologue))


def counted_instructions(system: sd.System) -> int:
    return choice.factorizing_instructions(system.check()) + choice.solving_instructions(system.check())


@pytest.mark.parametrize("system", [systems.get("spatial_chain", n=5), systems.get("n_link_pendulum", n=6), arms(4),
                                    arms(2, 3), arms(1, 2)], ids=lambda s: f"{s.name}_{len(s.bodies)}")
def test_instructions_of_the_factorization(system: sd.System) -> None:
    assert counted_instructions(system) == written_instructions(system.embedding())


def test_only_independent_speeds_are_factorized() -> None:
    pair, single = 8, 2
    assert counted_instructions(kitchen_sink()) == pair + single
    assert counted_instructions(geared(1)) == counted_instructions(geared(2)) == single


@pytest.mark.parametrize("system", [systems.get("n_link_pendulum", n=4), systems.get("prismatic_chain", n=4), systems.cart_pole(),
                                    systems.get("spatial_chain", n=3), arms(2, 3), kitchen_sink()],
                         ids=lambda s: s.name)
def test_the_bound_is_below_the_time_of_the_embedding(system: sd.System) -> None:
    model = system.check()
    best = min(derived_in_frames(recursive, model), key=lambda d: d.predicted)
    assert choice.least_time_with_mass_matrix(model, best) <= min(d.predicted for d in derived_in_frames(embed, model))


@pytest.mark.parametrize("make", [lambda: systems.get("spatial_chain", n=30), lambda: random_tree(40, 4)])
def test_large_systems_are_not_derived_with_a_mass_matrix(make: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(choice, "embed", lambda *_: pytest.fail("derived the mass matrix"))
    equations = make().equations()
    assert equations.formulation == "recursive" and len(equations.candidates) == 1


@pytest.mark.parametrize("system", [systems.get("n_link_pendulum", n=4), systems.get("spatial_chain", n=3), arms(2, 3),
                                    systems.four_bar()], ids=lambda s: s.name)
def test_no_prediction_is_above_the_most(system: sd.System) -> None:
    tape = function_tape(system.equations(), "rhs")
    assert 0 < choice.predicted_time(tape) <= choice.most_time(tape)


def test_where_the_mass_matrix_is_hopeless_nothing_is_predicted(monkeypatch: pytest.MonkeyPatch) -> None:
    model = systems.get("n_link_pendulum", n=24).check()
    recursion = choice.Derived.of(recursive(model, "parallel"))
    assert not choice.hopeless(model, recursion)
    monkeypatch.setattr(choice, "most_time", lambda tape: 1.0)
    monkeypatch.setattr(choice, "LONG", 100)
    monkeypatch.setattr(choice, "schedule", lambda tape: pytest.fail("predicted a time"))
    equations = choose(model)
    assert equations.formulation == "recursive"
    monkeypatch.undo()
    assert taken(equations).predicted == choice.predicted_time(function_tape(equations, "rhs"))


def test_the_only_formulation_is_predicted_when_its_table_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patched:
        patched.setattr(choice, "schedule", lambda tape: pytest.fail("predicted a time"))
        equations = choose(cable(3).check(), formulation="recursive")
    tape = function_tape(equations, "rhs")
    assert len(equations.candidates) == 1 and equations.candidates[0] is next(iter(equations.candidates))
    assert pickle.loads(pickle.dumps(equations)).candidates == tuple(equations.candidates)
    assert taken(equations).predicted == choice.predicted_time(tape) and taken(equations).chain == tape.longest_chain()


# -- tuning


@needs_c
def test_tuning_takes_the_least_measured_time(capsys: pytest.CaptureFixture[str]) -> None:
    equations = systems.get("n_link_pendulum", n=2).equations(tune=True)
    assert len(equations.candidates) == 4 and all(1 < c.measured < 1e5 for c in equations.candidates)
    assert taken(equations).measured == min(c.measured for c in equations.candidates)
    lines = str(equations.compile().report()).splitlines()
    above = lines.index(f"    {HEADING}")
    assert lines[above + 1:above + 5] == [f"    {c}" for c in equations.candidates]


@needs_c
def test_each_evaluation_waits_for_the_one_before() -> None:
    """Accelerations do not depend on the place of the cart, nor on the first angle of a chain about the vertical."""
    from symdyn.timing.side_by_side import _fed

    assert _fed(systems.cart_pole().embedding()) == 1 and _fed(systems.get("spatial_chain", n=2).embedding()) == 1
    assert _fed(systems.get("prismatic_chain").embedding()) == 0


@needs_c
def test_what_cannot_be_evaluated_cannot_be_timed() -> None:
    system = systems.get("n_link_pendulum", n=2)
    system.defaults = {p: -50.0 if p.name == "m1" else value for p, value in system.defaults.items()}
    with pytest.raises(EvaluationError, match=r"n_link_pendulum_2 was to be timed in its embedding form, but the mass matrix is "
                                              r"not positive definite at q1_dot; give all parameters numbers that make sense"):
        times_side_by_side([system.embedding()], repeats=1)


def test_tuning_needs_a_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SYMDYN_CC", "none")
    with pytest.raises(CompilerNotFound, match="SYMDYN_CC='none'"):
        systems.pendulum().equations(tune=True)


# -- what is named is taken


@pytest.mark.parametrize("formulation", FORMULATIONS[1:])
def test_a_named_formulation_is_taken(formulation: str) -> None:
    for n in (2, 9):
        equations = formulated(systems.get("spatial_chain", n=n), formulation)
        assert equations.formulation == formulation and not equations.candidates


@needs_c
@pytest.mark.parametrize("formulation", FORMULATIONS[1:])
def test_tuning_a_named_formulation_compares_its_frames(formulation: str) -> None:
    equations = formulated(systems.get("n_link_pendulum", n=2), formulation, tune=True)
    assert [(c.formulation, c.frames) for c in equations.candidates] == [(formulation, "body"), (formulation, "parallel")]
    assert taken(equations).measured == min(c.measured for c in equations.candidates)


def test_an_unknown_formulation_is_reported() -> None:
    with pytest.raises(SymdynError, match="formulation 'newton' asked for; there are auto, embedding, recursive"):
        formulated(systems.pendulum(), "newton")


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_constraints_are_for_the_augmented_formulation(formulation: str) -> None:
    system = systems.get("four_bar")
    if formulation in ("auto", "augmented"):
        equations = formulated(system, formulation)
        assert equations.formulation == "augmented" and len(equations.constraints) == 2
        return
    with pytest.raises(ModelError, match="trees only"):
        formulated(system, formulation)


def test_candidates_under_constraints() -> None:
    equations = systems.get("four_bar").equations()
    assert {c.formulation for c in equations.candidates} == {"augmented"} and taken(equations).chosen
    assert taken(equations).operations == function_tape(equations, "rhs").operations
    absolute = choose(systems.get("four_bar").check(), coordinates="absolute", formulation="augmented")
    assert len(absolute.symbols.speeds) == 9 and absolute.candidates


def test_absolute_coordinates_imply_the_augmented_formulation() -> None:
    equations = formulated(systems.pendulum(), coordinates="absolute")
    assert equations.formulation == "augmented" and len(equations.constraints) == 2
    with pytest.raises(SymdynError, match="'absolute' asked for with the formulation 'recursive'"):
        formulated(systems.pendulum(), "recursive", coordinates="absolute")


def test_gears_have_a_mass_matrix_once() -> None:
    equations = geared().equations()
    assert {c.formulation for c in equations.candidates} == {"embedding"} and equations.formulation == "embedding"
    named = geared().recursive()
    a, b = (quantities(e, state(e), "accelerations")[0] for e in (equations, named))
    assert close(a, b)


def test_prescribed_joints_are_chosen_for() -> None:
    equations = kitchen_sink().equations()
    assert {c.formulation for c in equations.candidates} == {"embedding", "recursive"}
    a, b = (quantities(e, state(e), "accelerations")[0] for e in (equations, kitchen_sink().recursive()))
    assert close(a, b)


# -- from the command line


def said(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert main(["report", "n_link_pendulum", "--option", "n=2", "--no-verify", *arguments]) == 0
    return capsys.readouterr().out


def test_the_report_shows_what_was_compared(capsys: pytest.CaptureFixture[str]) -> None:
    text = said(capsys)
    rows = text[text.index(HEADING):].splitlines()[1:5]
    assert "Chosen for the least time" in text and sum(row.endswith("chosen") for row in rows) == 1
    assert all(row.split()[6] == "-" for row in rows)


def test_the_report_of_a_named_formulation_compares_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    text = said(capsys, "--formulation", "recursive")
    assert "recursive equations of motion" in text and HEADING not in text


@needs_c
def test_the_report_shows_what_was_measured(capsys: pytest.CaptureFixture[str]) -> None:
    text = said(capsys, "--tune")
    assert all(float(row.split()[6]) > 1 for row in text[text.index(HEADING):].splitlines()[1:5])


def test_what_is_recalled_depends_on_the_formulation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SYMDYN_CACHE_DIR", str(tmp_path))
    for _ in range(2):
        modules = {f: recall("n_link_pendulum", {"n": 2}, "numpy", f) for f in FORMULATIONS}
        assert modules["embedding"].metadata.formulation == "embedding"
        assert modules["recursive"].metadata.formulation == "recursive"
        values = [module.rhs(0.0, [0.1, 0.2, 0.3, 0.4]) for module in modules.values()]
        assert all(value == pytest.approx(values[0], rel=1e-12) for value in values)
        assert len(list(tmp_path.glob("n_link_pendulum-*.json"))) == len(FORMULATIONS)


def test_choosing_leaves_the_model_alone() -> None:
    model = systems.get("n_link_pendulum", n=2).check()
    assert [c.operations for c in choose(model).candidates] == [c.operations for c in choose(model).candidates]
