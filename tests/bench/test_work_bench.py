"""Work against error: what is asked for, rows, runs that go on, tables, pictures, the page, the command."""

import json
import math
import multiprocessing
import os
import re
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

import symdyn as sd
from symdyn.bench import kept
from symdyn.bench.work import against, benchmark, methods, picture, plan, resume
from symdyn.bench.work.against.apart import TooLong, prepared
from symdyn.bench.work.against.peer import Failed, Unfit
from symdyn.bench.work.asked import checked, grid
from symdyn.bench.work.benchmark import Benchmark, finished, run
from symdyn.bench.work.cases import CASES, from_maker, named_case
from symdyn.bench.work.command import nothing
from symdyn.bench.work.picture import COLORS, styles_of
from symdyn.bench.work.plan import Job, Walk, spread
from symdyn.bench.work.record import Reference, Row
from symdyn.bench.work.reference import agreement
from symdyn.bench.work.system_under_test import Comparison, SystemUnderTest
from symdyn.bench.work.timing import Timing, one_pass
from symdyn.cli import main
from symdyn.errors import ArgumentError, SymdynError
from symdyn.runtime.building.compiler import LINUX

ASKED = {"method_names": ["dop853"], "tolerances": [1e-4, 1e-7, 1e-10], "repeats": 2}


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """The simple pendulum over 2 s in two formulations, and the folder of the results."""
    folder = tmp_path_factory.mktemp("bench")
    about = named_case("pendulum", end=2.0)
    result = run(about, checked([about], ["embedding", "augmented", "absolute"], at=[0.4], **ASKED), folder)
    return result, folder


def test_errors_fall_with_the_tolerance_and_work_rises(measured):
    result, _ = measured
    assert [(r.formulation, r.tolerance) for r in result.rows] == [
        (f, t) for f in ("embedding", "absolute") for t in (1e-4, 1e-7, 1e-10)]
    for rows in (result.rows[:3], result.rows[3:]):
        assert rows[0].error > 100 * rows[1].error > 1e4 * rows[2].error
        assert rows[0].evaluations < rows[1].evaluations < rows[2].evaluations
        for row in rows:
            assert row.error == max(row.error_q, row.error_u) == row.errors[-1] and len(row.errors) == 10
            assert row.worst >= row.error < 100 * row.tolerance and row.energy_error < 100 * row.tolerance
            assert 0 < row.least <= row.seconds < 1 and row.repeats >= 2 and row.steps > 0
            assert row.operations == row.evaluations * result.operations[row.formulation]
    assert all(math.isnan(r.constraint_error) for r in result.rows[:3])
    assert all(r.constraint_error < 1e-13 for r in result.rows[3:])


def test_what_a_mechanism_does_not_have_is_left_out_with_the_reason(measured):
    (skipped,) = measured[0].skipped
    assert skipped.formulation == "augmented" and "has no constraints" in skipped.why
    (_,), (planar,) = named_case("double_pendulum").formulated(["recursive", "absolute:angles"])
    assert "one angle is all there is" in planar.why
    _, (tied,) = named_case("four_bar").formulated(["embedding"])
    assert "takes trees only" in tied.why


def test_the_best_below_an_error(measured):
    result, _ = measured
    good = [r for r in result.rows if r.error <= 1e-6]
    assert result.best(1e-6) is min(good, key=lambda r: r.time)
    assert result.best(1e-30) is None and result.best(1e-6, peer=True) is None
    assert result.best(1.0, at=0.4).error_at(result.index(0.4)) <= 1.0
    with pytest.raises(ArgumentError, match=r"errors are known at t = 0.2, 0.4, .*, not at 0.3"):
        result.index(0.3)


def test_runs_until_an_earlier_time_are_timed_alone(measured):
    result, _ = measured
    early = result.index(0.4)
    for row in result.rows:
        assert 0 < row.evaluations_at(early) < row.evaluations == row.evaluations_at(None)
        assert row.time_at(early) > 0 and row.time_at(None) == row.time == row.time_at(len(row.errors) - 1)
        assert math.isnan(row.time_at(early - 1)) and math.isnan(row.time_at(99)) and row.evaluations_at(99) == 0
    good = [r for r in result.rows if r.error_at(early) <= 1e-6]
    assert result.best(1e-6, at=0.4) is min(good, key=lambda r: r.time_at(early))


def test_repeats_are_spread_over_passes_and_the_least_time_counts():
    took = iter([3.0, 1.0, 1.1, 1.2, 9.0, 9.0])
    timing, row = Timing(), Row("a", "b", 1e-6, errors=(0.1, 0.2))
    timing.add(1, lambda repeats: (one_pass(lambda: next(took), repeats), 7), 3)
    assert timing.reported(row, 2).repeats == 1 and timing.reported(row, 2).time == 3.0
    assert timing.again(row, 3).repeats == 1  # a run of over ENOUGH seconds is not made again
    quick = iter([0.5, 0.1, 0.11, 0.12, 0.1])
    timing = Timing()
    timing.add(1, lambda repeats: (one_pass(lambda: next(quick), repeats), 7), 3)
    twice = timing.again(timing.again(row, 3), 3)
    assert (twice.seconds, twice.least, twice.time, twice.repeats, twice.evaluations) == (0.11, 0.1, 0.1, 3, 7)
    assert twice.time_at(1) == 0.1 and math.isnan(twice.time_at(0))


def test_more_tolerances_to_a_decade_begin_looser():
    assert [f"{v:.0e}" for v in grid(1)] == [f"{10.0**-k:.0e}" for k in range(3, 16)]
    dense = grid(4)
    assert len(dense) == 57 and dense[0] == 0.1 and math.isclose(dense[1] / dense[2], 10**0.25) and math.isclose(dense[-1], 1e-15)
    about = named_case("pendulum", end=2.0)
    assert len(checked([about], per_decade=4).tolerances) == 57
    with pytest.raises(ArgumentError, match="0 tolerances to a decade were asked for; pass a number from 1 to 10"):
        checked([about], per_decade=0)
    with pytest.raises(ArgumentError, match="tolerances are named and 4 to a decade are asked for; pass one of both"):
        checked([about], tolerances=[1e-4], per_decade=4)


def test_table_has_all(measured):
    text = measured[0].table()
    assert "reference: closed form, 15.9 digits" in text and "t=0.4" in text
    assert text.endswith("of poses (q) and velocities (u) of all bodies")  # absolute coordinates take part
    assert "left out: augmented" in text and "least time below an error, at t = 0.4 s" in text
    assert str(measured[0]) == text


def test_files_are_whole_and_stand_alone(measured):
    result, folder = measured
    paths = result.save(folder)
    assert [p.name for p in paths] == ["results.json", "work_precision.png", "work_precision.svg", "report.html"]
    data = json.loads((folder / "results.json").read_text())
    assert data["complete"] and [Row.of(row).record() for row in data["rows"]] == data["rows"]
    assert (folder / "work_precision.png").read_bytes()[:4] == b"\x89PNG"
    page = (folder / "report.html").read_text()
    assert "http" not in page.replace("http://www.w3.org", "") and "data:image/svg+xml;base64," in page
    assert page.count("<tr") == page.count("</tr>") and "closed form, 15.9 digits" in page


def test_an_unfinished_run_goes_on(tmp_path, monkeypatch, drawn):
    about = named_case("pendulum", end=2.0)
    asked = checked([about], ["embedding"], **ASKED)
    made, original = [], plan.own

    def stopping(*arguments):
        if len(made) == 2:
            raise KeyboardInterrupt
        made.append(original(*arguments))
        return made[-1]

    monkeypatch.setattr(plan, "own", stopping)
    with pytest.raises(KeyboardInterrupt):
        run(about, asked, tmp_path)
    left = json.loads((tmp_path / "results.json").read_text())
    assert not left["complete"] and len(left["rows"]) == 2
    more = []
    monkeypatch.setattr(plan, "own", lambda *arguments: more.append(original(*arguments)) or more[-1])
    (tmp_path / "long").mkdir()
    data = json.loads((tmp_path / "results.json").read_text())
    data["timed"], data["rows"][0]["took"] = "2001-02-03 04:05", 1e9  # too long to time it again
    (tmp_path / "long" / "results.json").write_text(json.dumps(data))
    mixed = run(about, asked, tmp_path / "long")
    assert len(more) == 1 and not mixed.unfinished and {r.tolerance for r in mixed.earlier} == {r.tolerance for r in made}
    assert {r.key: r.seconds for r in made} == {r.key: r.seconds for r in mixed.earlier}
    told = "2 of 3 rows, marked ^, were timed in an earlier run, of 2001-02-03 04:05"
    assert told in mixed.table() and mixed.table().count("^") == 3
    assert [row["earlier"] for row in mixed.record()["rows"]].count("2001-02-03 04:05") == 2
    assert told in (mixed.save(tmp_path / "long")[-1]).read_text()
    # Cheap runs are timed again, with the others: the times of a row are of one run.
    result = run(about, asked, tmp_path)
    assert len(more) == 4 and [r.tolerance for r in result.rows] == [1e-4, 1e-7, 1e-10] and not result.earlier
    assert {r.key: r.error for r in made}.items() <= {r.key: r.error for r in result.rows}.items()
    run(about, asked, tmp_path)  # complete: measured again
    assert len(more) == 7


def test_what_a_run_left_stays_when_the_next_is_stopped_at_once(tmp_path, monkeypatch):
    about = named_case("pendulum", end=2.0)
    asked = checked([about], ["embedding"], budget=1e-9, **ASKED)
    run(about, asked, tmp_path)
    data = json.loads((tmp_path / "results.json").read_text())
    data["rows"] = [Row("embedding", "dop853", 1e-10, seconds=1.0).record()]
    (tmp_path / "results.json").write_text(json.dumps(data))

    def stopped(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(plan, "own", stopped)
    with pytest.raises(KeyboardInterrupt):
        run(about, checked([about], ["embedding"], **ASKED), tmp_path)
    assert [row["tolerance"] for row in json.loads((tmp_path / "results.json").read_text())["rows"]] == [1e-10]


def test_results_of_another_motion_are_not_gone_on_with(tmp_path):
    about = named_case("pendulum", end=2.0)
    tight = checked([about], ["embedding"], **{**ASKED, "tolerances": [1e-5]}, budget=1e-9)
    assert run(about, tight, tmp_path).rows == []
    data = json.loads((tmp_path / "results.json").read_text())
    data["rows"] = [Row("embedding", "dop853", 1e-5, seconds=1.0).record()]
    (tmp_path / "results.json").write_text(json.dumps(data))
    assert run(about, tight, tmp_path).rows[0].seconds == 1.0
    other = named_case("pendulum", end=2.5)
    assert run(other, tight, tmp_path).rows == []


@pytest.mark.parametrize("damaged", [{"until": [["x", "y"]]}, {"tolerance": "1e-5"}, {"seconds": "long"}, {"until": [3]},
                                     {"errors": 3}, 3, {"method": None}])
def test_damaged_results_are_not_there(tmp_path, damaged):
    about = named_case("pendulum", end=2.0)
    tight = checked([about], ["embedding"], **{**ASKED, "tolerances": [1e-5]}, budget=1e-9)
    run(about, tight, tmp_path)
    data = json.loads((tmp_path / "results.json").read_text())
    row = Row("embedding", "dop853", 1e-5, seconds=1.0).record()
    data["rows"] = [{**row, **damaged} if isinstance(damaged, dict) else damaged]
    (tmp_path / "results.json").write_text(json.dumps(data))
    assert run(about, tight, tmp_path).rows == []


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """A command that measures two mechanisms, and the folder of its results."""
    folder = tmp_path_factory.mktemp("pair")
    return ["bench", "pendulum", "double_pendulum", "--formulations", "embedding", "--methods", "dop853", "--rtol", "1e-4",
            "--repeats", "1", "--end", "1", "--output", str(folder)], folder


def test_what_was_done_before_a_stop_is_kept(pair, drawn, monkeypatch, capsys):
    arguments, folder = pair
    made, original = [], plan.own

    def own(formulation, *others):
        if len(made) == limit[0]:
            raise KeyboardInterrupt
        made.append(formulation.equations.name)
        return original(formulation, *others)

    limit = [1]
    monkeypatch.setattr(plan, "own", own)
    main(arguments)
    first, second = folder / "pendulum" / "results.json", folder / "double_pendulum" / "results.json"
    before = first.read_text()
    assert made == ["pendulum"] and json.loads(before)["complete"] and not json.loads(second.read_text())["complete"]
    second.unlink()  # not begun at all
    limit[:], made[:] = [9], []
    capsys.readouterr()
    assert main([*arguments, "--budget", "1e-9"]) == 0  # nothing new; what there is is shown
    told = capsys.readouterr()
    when = json.loads(before)["timed"]
    assert f"all of it was measured in an earlier run, of {when}; to have it measured again delete {first}" in told.out
    assert made == [] and "double_pendulum was not begun" in told.err and first.read_text() == before
    assert main(arguments) == 0
    told = capsys.readouterr().out
    assert made == ["double_pendulum"] and told.count("all of it was measured in an earlier run") == 1
    assert first.read_text() == before and json.loads(second.read_text())["complete"]
    page = (folder / "report.html").read_text()
    assert "pendulum" in page and "double_pendulum" in page
    made[:] = []
    main(arguments)  # all of it was done: measured again
    assert made == ["pendulum", "double_pendulum"] and "earlier run" not in capsys.readouterr().out
    # Something else is asked for, or the code is another: nothing of it is taken.
    second.unlink()
    made[:] = []
    main([one if one != "1e-4" else "1e-5" for one in arguments])
    assert made == ["pendulum", "double_pendulum"]
    main(arguments)
    second.unlink()
    made[:] = []
    monkeypatch.setattr(resume, "code", lambda: "another")
    main(arguments)
    assert made == ["pendulum", "double_pendulum"]


def test_finished_results_that_are_damaged_are_not_there(tmp_path, measured):
    about = named_case("pendulum", end=2.0)
    asked = checked([about], ["embedding", "augmented", "absolute"], at=[0.4], **ASKED)
    data = {**measured[0].record(), "command": "this"}
    for change, there in (({}, True), ({"rows": [3]}, False), ({"reference": None}, False), ({"command": "other"}, False),
                          ({"fingerprint": "x"}, False), ({"complete": False}, False)):
        (tmp_path / "results.json").write_text(json.dumps({**data, **change}))
        found = finished(about, asked, tmp_path, "this")
        assert (found is not None) == there
        if found is not None:
            assert found.record() == json.loads((tmp_path / "results.json").read_text())
            assert found.table() == measured[0].table()
    (tmp_path / "results.json").write_text("[3]")
    assert finished(about, asked, tmp_path, "this") is None and finished(about, asked, tmp_path / "none", "") is None


def test_code_of_every_method_is_in_the_fingerprint(tmp_path, monkeypatch):
    template = tmp_path / "dop853.c.jinja"
    template.write_text("one")
    before = resume.digest({"dop853": template})
    template.write_text("two")
    assert resume.digest({"dop853": template}) != before
    seen = {}
    monkeypatch.setattr(resume, "digest", lambda files: seen.update(files) or "")
    resume.code.__wrapped__()
    methods = {"backend/methods/taylor.py", "backend/methods/radau.py", "backend/methods/bs54.py",
               "runtime/integrating/methods.py"}
    assert methods < set(seen) and any(name.endswith(".jinja") for name in seen) and "cli/parser.py" not in seen


def test_a_budget_counts_from_the_beginning(monkeypatch):
    about = named_case("pendulum", end=2.0)
    original = benchmark.find_reference

    def slow(*given):
        time.sleep(0.3)
        return original(*given)

    monkeypatch.setattr(benchmark, "find_reference", slow)
    result = run(about, checked([about], ["embedding"], budget=0.25, **ASKED))
    assert result.rows == [] and re.fullmatch(
        r"3 of 3 runs were not made within the budget of 0\.25 s, which derivation, compilation and reference used up: they took "
        r"0\.\d+ s", result.unfinished)


def test_two_runs_that_agree_are_all_there_is_time_for():
    formulation, = named_case("pendulum", end=1.0).formulated(["embedding"])[0]
    quick = agreement([formulation], [1.0], "late", 0.0)
    assert quick.how.startswith("embedding with dop853 at 1e-12 and embedding with Radau at 1e-12 differ by ")


def test_budget_is_honoured_and_reported(tmp_path):
    about = named_case("pendulum", end=2.0)
    result = run(about, checked([about], ["embedding"], budget=1e-9, **ASKED))
    assert result.rows == [] and result.unfinished.startswith("3 of 3 runs were not made within the budget of 1e-09 s, which ")
    assert "unfinished: 3 of 3 runs" in result.table()


def test_other_work_on_the_machine_is_reported():
    quiet, busy = Row("a", "b", 1e-6, seconds=1.2, least=1.0, repeats=5), Row("a", "b", 1e-6, seconds=3.0, least=1.0, repeats=5)
    assert (quiet.disturbed, quiet.time) == (False, 1.0) and (busy.disturbed, busy.time) == (True, 1.0)
    text = Benchmark("a", 1.0, [quiet, busy], [], Reference("x", (1.0,), [[0.0]], 3.0, "")).table()
    assert "of 1 of 2 rows, marked *, the median is over 1.25 times the least time" in text and "3000*" in text


def test_a_coarse_grid_comes_first():
    assert spread(range(10)) == [0, 4, 8, 2, 6, 1, 3, 5, 7, 9]


def test_a_method_that_does_not_fit_is_left_out(monkeypatch):
    about = named_case("pendulum", end=2.0)

    def unfit(*_):
        raise ArgumentError("pendulum: the method takes no pendulums")

    monkeypatch.setattr(plan, "own", unfit)
    result = run(about, checked([about], ["embedding"], **ASKED))
    assert result.rows == [] and str(result.skipped[-1]) == "embedding, dop853: pendulum: the method takes no pendulums"


def test_slow_tolerances_leave_steps_and_slow_steps_leave_tolerances():
    def job(tolerance, step, took):
        key = ("embedding", "gauss", tolerance, step)
        return Job(key, lambda timing: Row(*key, seconds=took, least=took, error=1e-3, repeats=1))

    def measured(jobs, kept=()):
        walk = Walk(jobs, [], {row.key: row for row in kept}, math.inf)
        walk.measure()
        return [row.key[2:] for row in walk.rows[len(kept):]], [s.why for s in walk.skipped]

    jobs = [job(1e-3, None, 0.1), job(1e-9, None, 3.0), job(1e-12, None, 9.0), job(None, 0.1, 0.01), job(None, 0.01, 4.0),
            job(None, 0.001, 9.0)]
    assert measured(jobs) == ([(1e-3, None), (1e-9, None), (None, 0.1), (None, 0.01)],
                              ["not at tighter tolerances: a run took 3 s", "not with shorter steps: a run took 4 s"])
    slow = Row("embedding", "gauss", None, 0.001, seconds=3.0, least=3.0)
    assert measured([job(None, 0.001, 3.0), job(1e-3, None, 0.1)], [slow]) == ([(1e-3, None)], [])


def test_slow_methods_are_not_asked_for_more(monkeypatch):
    about = named_case("pendulum", end=2.0)
    monkeypatch.setattr(plan, "own", lambda f, m, t, *_: Row(f.name, m, t, seconds=3.0, least=3.0))
    result = run(about, checked([about], ["embedding"], **ASKED))
    assert [r.tolerance for r in result.rows] == [1e-4]
    assert "not at tighter tolerances: a run took 3 s" in str(result.skipped[-1])


class _Exact:
    """A peer that is always right, and one that never fits."""

    name = title = "exact"
    bodies = False

    def available(self):
        return True

    def prepare(self, equations, params, x0, end, system=None):
        assert system.name == "pendulum" and params.tolist() and x0.tolist() == [2.0, 0.0]
        x = np.array(CASES["pendulum"].closed([end])[0])
        return lambda tolerance: (1e-3, 7, x + tolerance)


class _Unfit(_Exact):
    name = title = "unfit"

    def prepare(self, *_):
        raise Unfit("it takes no pendulums")


class _Broken(_Exact):
    name = title = "broken"

    def prepare(self, *_):
        def run(tolerance):
            raise RuntimeError("it broke")

        return run


class _Missing(_Exact):
    name = title = "missing"

    def available(self):
        return "it is not installed"


def test_other_programs_run_for_comparison(monkeypatch):
    monkeypatch.setattr(against, "names", lambda: ["some"])
    monkeypatch.setattr(against, "peers", lambda name: (_Exact(), _Unfit(), _Broken(), _Missing()))
    about = named_case("pendulum", end=2.0)
    result = run(about, checked([about], ["embedding"], peers=["some"], at=[0.4, 2.0], **ASKED))
    assert [r.message for r in result.rows if r.method == "broken"] == ["it broke"] * 3
    rows = [r for r in result.rows if r.method == "exact"]
    assert [(r.method, r.seconds, r.evaluations) for r in rows] == [("exact", 1e-3, 7)] * 3
    size = max(abs(x[0]) for x in result.reference.x)
    assert math.isclose(rows[0].error_q, 1e-4 / size, rel_tol=1e-9)
    assert math.isclose(rows[0].error_at(result.index(0.4)), max(rows[0].error_q, rows[0].error_u), rel_tol=1e-9)
    assert math.isnan(rows[0].error_at(0))
    assert {str(s) for s in result.skipped} == {"unfit: it takes no pendulums", "missing: it is not installed"}
    assert "times ours)" in result.table()


class _Slow(_Exact):
    """One that compiles for ever: before anything, or at the tightest tolerance."""

    title = "slow"

    def __init__(self, name):
        self.name = name

    def prepare(self, equations, params, x0, end, system=None):
        if self.name == "slow at once":
            time.sleep(60)
        run = super().prepare(equations, params, x0, end, system)

        def motion(tolerance, times=None):
            if tolerance < 1e-9:
                subprocess.run(["sleep", "60"])
            return run(tolerance)

        return motion


class _Dying(_Slow):
    """One that ends its process: at once, or later."""

    def prepare(self, *_):
        return (lambda tolerance: os._exit(3)) if self.name == "later" else os._exit(3)


@pytest.mark.skipif(not LINUX, reason="processes of their own are forked")
def test_a_budget_ends_what_other_programs_prepare(monkeypatch, tmp_path):
    monkeypatch.setattr(against, "names", lambda: ["some"])
    peers = _Slow("slow at once"), _Exact(), _Slow("slow later"), _Broken(), _Dying("dying")
    monkeypatch.setattr(against, "peers", lambda name: peers)
    about = named_case("pendulum", end=2.0)
    begun = time.perf_counter()
    result = run(about, checked([about], ["embedding"], peers=["all"], budget=3.0, **ASKED), tmp_path)
    assert time.perf_counter() - begun < 4.5
    rows = {name: [r.tolerance for r in result.rows if r.method == name] for name in ("exact", "slow later", "broken", "dop853")}
    assert rows == {"exact": [1e-4, 1e-7, 1e-10], "slow later": [1e-4], "broken": [1e-4, 1e-7, 1e-10],
                    "dop853": [1e-4, 1e-7, 1e-10]}
    told = {s.method: s.why for s in result.skipped}
    assert re.fullmatch(r"its preparation was not done after 0\.\d+ s, its part of the budget", told["slow at once"])
    assert told["slow later"].startswith("what it does for a tolerance of 1e-10 was not done after 1 s")
    assert told["dying"] == "its process died with code 3"
    assert result.unfinished == "2 of 12 runs were not made and slow at once was not ready within the budget of 3 s"
    assert all(r.seconds == 1e-3 and r.error < 2e-4 for r in result.rows if r.method == "exact")
    assert not multiprocessing.active_children()


@pytest.mark.skipif(not LINUX, reason="processes of their own are forked")
def test_a_process_of_its_own_gives_what_this_one_gives():
    equations = sd.systems.get("pendulum").embedding()
    module = equations.compile()
    x0 = np.array([2.0, 0.0])
    (peer,) = [p for p in against.peers("scipy") if p.name == "scipy DOP853"]
    motion, far = (equations, module.default_parameters, x0, None), time.perf_counter() + 1e3
    here, apart = prepared(peer, motion, [1.0, 2.0]), prepared(peer, motion, [1.0, 2.0], far, far)
    for place in (0, 1):
        (seconds, n, x), (known, n_known, x_known) = apart.timed(place, 1e-8, 9), here.timed(place, 1e-8, 9)
        assert n == n_known and x.tolist() == x_known.tolist() and len(seconds) >= 1 and 0.1 < min(seconds) / min(known) < 10
    assert apart.timed(1, 1e-8, 9, deadline=0.0)[0] == []
    np.testing.assert_array_equal(apart.states(1e-8, np.array([1.0, 2.0]))[1], here.states(1e-8, np.array([1.0, 2.0]))[1])
    with pytest.raises(Failed, match="index out of range"):
        apart.timed(5, 1e-8, 9)
    folder = Path(apart.folder.name)
    assert folder.is_dir()
    apart.close()
    assert not folder.exists() and not apart.process.is_alive()
    with pytest.raises(TooLong, match="its process was ended"):
        apart.timed(0, 1e-8, 9)
    apart = prepared(_Dying("later"), motion, [1.0], far, far)
    for _ in range(2):  # it is reported again
        with pytest.raises(Failed, match="its process died with code 3"):
            apart.timed(0, 1e-8, 9)
    with pytest.raises(TooLong, match="the budget was used up before it was prepared"):
        prepared(peer, motion, [1.0], 0.0, 0.0)


def test_auto_is_measured_and_reports_what_it_chose(tmp_path, drawn):
    result = sd.bench("pendulum", formulations=["embedding"], methods=["auto", "taylor"], tolerances=[1e-3, 1e-9], end=2.0,
                      repeats=1, folder=tmp_path)
    auto = [r for r in result.rows if r.method == "auto"]
    assert [r.chosen for r in auto] == ["bs54", "taylor"] and all(r.why and r.seconds > 0 for r in auto)
    assert auto[1].error == result.rows[-1].error and result.rows[-1].chosen == ""
    text, page = result.table(), (tmp_path / "report.html").read_text()
    for told in ("auto (bs54)", "auto (taylor)", "auto chose by short trial runs"):
        assert told in text and told in page
    kept = json.loads((tmp_path / "results.json").read_text())["rows"]
    assert [Row.of(row).chosen for row in kept] == ["bs54", "taylor", "", ""]


def test_steps_need_a_method_that_has_them():
    about = named_case("pendulum")
    with pytest.raises(ArgumentError, match=r"none of the methods dop853, auto has steps of one length; add gauss, or leave"):
        checked([about], method_names=["dop853", "auto"], steps=[0.1])
    assert checked([about], method_names=["dop853", "gauss"], steps=[0.1]).steps == checked([about], steps=[0.1]).steps == (0.1,)


def test_a_folder_that_cannot_be_written_is_rejected_before(tmp_path, monkeypatch, capsys):
    (tmp_path / "file").write_text("")
    with pytest.raises(ArgumentError, match=r"results cannot be written into .*file/deep: .*file is a file, not a folder"):
        sd.bench("pendulum", folder=tmp_path / "file" / "deep")
    assert main(["bench", "pendulum", "--rtol", "3", "--output", str(tmp_path / "file")]) == 2
    told = capsys.readouterr().err
    assert "the tolerance 3.0" in told and "is a file, not a folder" in told
    assert resume.unwritable(tmp_path / "new" / "deep") == "" and not (tmp_path / "new").exists()
    (tmp_path / "report.html").mkdir()
    assert "report.html is closed to writing (Is a directory); name another one" in resume.unwritable(tmp_path, ["report.html"])
    assert resume.unwritable(tmp_path, ["results.json"]) == "" and {p.name for p in tmp_path.iterdir()} == {"file", "report.html"}

    def full(*given, **options):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("symdyn.bench.kept.tempfile.TemporaryFile", full)
    assert f"{tmp_path} is closed to writing (No space left on device)" in resume.unwritable(tmp_path / "new")


@pytest.mark.skipif(not LINUX, reason="there is no /proc")
def test_what_no_one_may_write_into_is_rejected_for_root_too(tmp_path):
    assert "/proc is closed to writing" in resume.unwritable(Path("/proc/none"), ["results.json"])
    with pytest.raises(ArgumentError, match=r"references /proc/none/own.json cannot be written: /proc is closed to writing"):
        kept.writable(Path("/proc/none/own.json"), tmp_path / "own.json")
    assert kept.writable(tmp_path / "new" / "own.json", tmp_path) and not (tmp_path / "new").exists()


def test_command_that_measures_nothing_fails(tmp_path, capsys, drawn):
    assert main(["bench", "four_bar", "--formulations", "augmented", "--methods", "gauss", "--output", str(tmp_path)]) == 1
    told = capsys.readouterr().err
    assert "four_bar: nothing was measured, everything was left out or stopped:\n  - augmented, gauss: " in told
    assert main(["bench", "pendulum", "--methods", "dop853", "--rtol", "1e-6", "--formulations", "embedding", "--budget", "1e-9",
                 "--output", str(tmp_path / "b")]) == 1
    assert "the budget of 1e-09 s is used up: pendulum" in capsys.readouterr().err
    late = Benchmark("a", 1.0, [], [], Reference("x", (1.0,), [[0.0]], 3.0, ""), unfinished="2 of 2 runs were not made")
    assert nothing(late) == "nothing was measured: 2 of 2 runs were not made"


@pytest.mark.parametrize(("asked", "told"), [({"end": "late"}, "the end is 'late'; pass a time, s"),
                                             ({"folder": 3}, "of the folder is 3")])
def test_end_and_folder_that_make_no_sense(asked, told):
    with pytest.raises(ArgumentError, match=told):
        sd.bench("pendulum", **asked)


def test_all_faults_are_reported_at_once():
    with pytest.raises(ArgumentError) as caught:
        sd.bench("pendulum", formulations=["embeding"], methods=["dop85", "x"], tolerances=[2.0, 1e-20, "a"], steps=[-1.0],
                 repeats=0, against=["heyok"], budget=-1.0, at=[50.0])
    text = str(caught.value)
    for part in ("11 faults", "no formulation 'embeding'; did you mean embedding", "no method 'dop85'; did you mean dop853",
                 "no method 'x'; there are dop853", "the tolerance 2.0", "the tolerance 1e-20", "the tolerance 'a'",
                 "the step -1.0", "50.0 at which errors", "0 repeats", "no peer 'heyok'; did you mean heyoka", "the budget -1.0"):
        assert part in text
    with pytest.raises(ArgumentError, match=r"the end -1\.0 of pendulum must be a positive time"):
        sd.bench("pendulum", end=-1.0)
    with pytest.raises(ArgumentError, match="takes a System, equations or a name of the catalogue, found 3"):
        sd.bench(3)
    with pytest.raises(ArgumentError, match="no mechanism 'double_pendulm'; did you mean double_pendulum"):
        sd.bench("double_pendulm")
    with pytest.raises(ArgumentError, match="pendulum takes no option, found 'pendulum\\(3\\)'"):
        sd.bench("pendulum(3)")


def test_bodies_that_carry_joints_in_absolute_coordinates_do_not_count():
    times = np.array([0.1, 0.2])
    first, other = named_case("slider_crank").formulated(["augmented", "absolute"])[0]
    assert len(other.module.metadata.bodies) == 4 > len(first.module.metadata.bodies) == 2
    x, y = (f.module.simulate(np.r_[0.0, times], rtol=1e-11).x[1:] for f in (first, other))
    comparison = Comparison(Reference("agreement", tuple(times), x.tolist(), 11.0, ""), first, bodies=True)
    for wrong, bound in ((0.0, 1e-9), (1e-3, 1e-2)):
        y[:, :3] += wrong  # pose of the first rod
        q, u = comparison.errors(other, y)
        assert (q <= bound).all() and (q >= 0.1 * wrong).all() and (u <= bound).all()


def test_formulations_none_of_which_fits():
    with pytest.raises(SymdynError, match="none of the formulations that were asked for fits"):
        sd.bench("four_bar", formulations=["embedding", "recursive"])


def test_mechanisms_of_the_list_and_their_variants():
    tops = named_case("heavy_top")
    assert tops.names[-3:] == ["embedding:parameters", "recursive:parameters", "augmented:parameters"]
    assert list(named_case("floating_wind_turbine").variants) == ["angles", "parameters"]
    assert named_case("n_link_pendulum(3)").name == "n_link_pendulum_3" and list(named_case("four_bar").variants) == [""]
    made = from_maker("own", lambda n=1: sd.systems.get("pendulum"), end=1.0)
    assert isinstance(made, SystemUnderTest) and made.end == 1.0 and list(made.variants) == [""]


def test_equations_by_hand():
    equations = sd.systems.get("pendulum").embedding()
    result = sd.bench(equations, methods=["dop853"], tolerances=[1e-6], repeats=1, end=1.0)
    assert [r.formulation for r in result.rows] == ["given"] and result.rows[0].error < 1e-4


def test_lines_differ_by_colour_marker_and_line():
    rows = [Row(f, m, 1e-6) for f in ("embedding", "recursive", "absolute") for m in ("a", "b", "c", "d")]
    styles = styles_of([*rows, Row("embedding", "other", 1e-6, peer=True)])
    assert len(styles) == 13 and len({(s["color"], s["marker"], str(s["linestyle"])) for s in styles.values()}) == 13
    assert {s["color"] for name, s in styles.items() if name != "other"} == set(COLORS[:4])


def test_command(tmp_path, capsys, drawn):
    text = "import symdyn as sd\n\ndef system():\n    return sd.systems.get('pendulum')\n"
    (tmp_path / "mine.py").write_text(text)
    code = main(["bench", str(tmp_path / "mine.py"), "pendulum", "--formulations", "embedding", "--methods", "dop853", "--rtol",
                 "1e-6", "--repeats", "1", "--end", "1", "--output", str(tmp_path / "out")])
    told = capsys.readouterr()
    assert code == 0 and "mine, 1 s" in told.out and "pendulum, 1 s" in told.out
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"mine", "pendulum", "report.html"}
    assert (tmp_path / "out" / "mine" / "report.html").is_file()


def test_command_reports_all_faults(capsys):
    assert main(["bench", "nothing_of_the_kind", "--methods", "none", "--rtol", "3"]) == 2
    told = capsys.readouterr().err
    assert "no mechanism 'nothing_of_the_kind'" in told and "no method 'none'" in told and "the tolerance 3.0" in told
    assert main(["bench"]) == 2
    assert "nothing is named" in capsys.readouterr().err
    assert main(["bench", "nothing_of_the_kind", "--formulations", "recursive"]) == 2
    assert "formulation" not in capsys.readouterr().err  # what it has is not known


def test_parameters_without_values_are_reported_with_what_to_do(tmp_path, capsys):
    (tmp_path / "mine.py").write_text("import symdyn as sd\n\n\ndef system():\n    found = sd.systems.get('pendulum')\n"
                                      "    found.defaults = dict(list(found.defaults.items())[1:])\n    return found\n")
    assert main(["bench", str(tmp_path / "mine.py"), "--rtol", "3", "--output", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err
    assert "mine: parameters: no value for m, which has no default; give every parameter a number in the system's `de" in told
    assert "the tolerance 3.0" in told and not (tmp_path / "out").exists()
    system = sd.systems.get("pendulum")
    system.defaults = {}
    for lacking in (system, system.embedding()):
        with pytest.raises(ArgumentError, match=r"no value for .*, which have no default; give every parameter a number"):
            sd.bench(lacking)


def test_reference_prints():
    assert str(Reference("closed form", (1.0,), [[0.0]], 15.9, "known")) == "closed form, 15.9 digits: known"
    assert isinstance(Benchmark("a", 1.0, [], [], Reference("x", (1.0,), [[0.0]], 3.0, "")).record(), dict)


def test_without_a_compiler_methods_of_scipy_are_taken_and_that_is_reported(monkeypatch):
    for module in (methods, benchmark):
        monkeypatch.setattr(module, "find_compiler", lambda: None)
    about = named_case("pendulum", end=1.0)
    asked = checked([about], ["embedding"], tolerances=[1e-4], repeats=1)
    assert asked.methods == ("RK45", "DOP853", "Radau", "LSODA")
    result = run(about, asked)
    assert [r.method for r in result.rows] == list(asked.methods) and result.table().count("there is no C compiler") == 1


def test_an_interrupt_reports_that_the_same_command_goes_on(monkeypatch, tmp_path, capsys):
    def stopped(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(plan, "own", stopped)
    assert main(["bench", "pendulum", "--end", "1", "--formulations", "embedding", "--output", str(tmp_path)]) == 130
    assert "interrupted; what was measured is kept, the same command goes on" in capsys.readouterr().err


def test_the_budget_that_was_asked_for_is_reported(tmp_path, capsys, drawn, monkeypatch):
    original = benchmark.find_reference
    monkeypatch.setattr(benchmark, "find_reference", lambda *given: time.sleep(0.3) or original(*given))
    small = ["--end", "1", "--formulations", "embedding", "--methods", "dop853", "--rtol", "1e-4", "--budget", "0.25", "--output"]
    main(["bench", "pendulum", *small, str(tmp_path / "one")])
    assert "1 of 1 runs were not made within the budget of 0.25 s, which derivation" in capsys.readouterr().out
    main(["bench", "pendulum", "double_pendulum", *small, str(tmp_path / "two")])
    assert re.search(r"within the budget of 0\.25 s, of which this mechanism has 0\.1\d* s, which", capsys.readouterr().out)


def test_evaluations_of_series_have_no_operations():
    result = sd.bench("pendulum", formulations=["embedding"], methods=["taylor", "dop853"], tolerances=[1e-6], end=1.0, repeats=1)
    series, other = result.rows
    assert series.evaluations > 0 == series.operations and other.operations == other.evaluations * result.operations["embedding"]
    line = next(line for line in result.table().splitlines() if line.startswith("embedding") and "taylor" in line)
    assert line.split()[6] == "-" and "with taylor orders of its series; operations" in result.table().replace("\n", " ")


def test_more_methods_than_colours_are_distinguished():
    names = [f"m{k}" for k in range(13)]
    styles = styles_of([Row("embedding", name, 1e-6) for name in names])
    looks = {(s["color"], s.get("markerfacecolor", "")) for s in styles.values()}
    assert len(looks) == 13 and [s.get("markerfacecolor") for s in styles.values()] == [None] * 8 + ["white"] * 5
    rows = [Row("embedding", name, 10.0**-k, least=1e-3, seconds=1e-3, error=10.0**-k, evaluations=9, errors=(10.0**-k,),
                until=((1e-3, 9),)) for name in names for k in (3, 6)]
    shown = picture.picture(Benchmark("a", 1.0, rows, [], Reference("x", (1.0,), [[0.0]], 3.0, "")))
    handles = {h.get_label(): h for h in shown.legends[0].legend_handles}
    assert handles["m0"].get_color() == handles["m8"].get_color()
    assert (handles["m0"].get_marker(), handles["m8"].get_marker()) == ("None", "o")


def test_where_no_run_gets_below_any_error_that_is_reported(tmp_path, drawn):
    rows = [Row("embedding", "dop853", 1e-3, error=0.5, least=1.0, seconds=1.0, errors=(0.5,), until=((1.0, 3),))]
    text = Benchmark("a", 1.0, rows, [], Reference("x", (1.0,), [[0.0]], 3.0, "")).table()
    assert "least time below an error, at the end: none, no run got below 0.01" in text


def test_programs_that_take_bodies_show_no_formulation_of_ours(monkeypatch):
    class Bodies(_Exact):
        bodies = True
        name = title = "from bodies"

    monkeypatch.setattr(against, "names", lambda: ["some"])
    monkeypatch.setattr(against, "peers", lambda name: (Bodies(), _Exact()))
    about = named_case("pendulum", end=2.0)
    result = run(about, checked([about], ["embedding"], peers=["some"], **ASKED))
    assert {(r.formulation, r.method) for r in result.rows if r.peer} == {("bodies", "from bodies"), ("embedding", "exact")}
    assert picture.title("bodies") == "bodies and joints"
