"""Work against error: what was measured is not lost where less, or something else, is asked for next."""

import json

import pytest

from symdyn.bench.work import plan, resume
from symdyn.bench.work.asked import checked
from symdyn.bench.work.benchmark import Benchmark, run
from symdyn.bench.work.cases import named_case
from symdyn.bench.work.record import Row

WIDE, NARROW = (1e-4, 1e-7, 1e-10), (1e-5,)


@pytest.fixture()
def bench(tmp_path, monkeypatch):
    """Runs of the simple pendulum into one folder, which give the result and what was measured for it."""
    about, made, original = named_case("pendulum", end=2.0), [], plan.own

    def own(formulation, method, tolerance, *others):
        made.append((formulation.name, tolerance))
        return original(formulation, method, tolerance, *others)

    monkeypatch.setattr(plan, "own", own)

    def measured(tolerances, formulations=("embedding",), **others):
        made[:] = []
        asked = checked([about], list(formulations), ["dop853"], list(tolerances), repeats=1, **others)
        return run(about, asked, tmp_path), list(made)

    return measured


@pytest.fixture(scope="module")
def wide(tmp_path_factory):
    """Text of the results of a run at all tolerances."""
    about, folder = named_case("pendulum", end=2.0), tmp_path_factory.mktemp("wide")
    run(about, checked([about], ["embedding"], ["dop853"], list(WIDE), repeats=1), folder)
    return (folder / "results.json").read_text()


def stored(folder):
    data = json.loads((folder / "results.json").read_text())
    return {m: {(r["formulation"], r["tolerance"]) for r in rows} for m, rows in {
        **data["carried"], "": data["rows"]}.items()}


def test_a_narrower_command_keeps_what_a_later_one_goes_on_with(bench, tmp_path, monkeypatch):
    wide, made = bench(WIDE)
    assert len(made) == 3 and stored(tmp_path) == {"": {("embedding", t) for t in WIDE}}
    narrow, made = bench(NARROW)
    assert made == [("embedding", 1e-5)] and [r.tolerance for r in narrow.rows] == [1e-5]
    assert stored(tmp_path) == {"": {("embedding", 1e-5)}, wide.fingerprint: {("embedding", t) for t in WIDE}}
    assert narrow.table().count("dop853      1e-") == 1  # it shows what was asked for
    # Too long to time them again: they stay, marked.
    data = json.loads((tmp_path / "results.json").read_text())
    for row in data["carried"][wide.fingerprint]:
        row["took"] = 1e9
    (tmp_path / "results.json").write_text(json.dumps(data))
    both, made = bench((*WIDE, *NARROW, 1e-12))
    assert made == [("embedding", 1e-12)] and {r.tolerance for r in both.earlier} == {*WIDE, *NARROW}
    assert {r.key: r.least for r in wide.rows}.items() <= {r.key: r.least for r in both.rows}.items()
    assert stored(tmp_path) == {"": {("embedding", t) for t in (*WIDE, *NARROW, 1e-12)}}
    # All of it was done: measured again.
    again, made = bench((*WIDE, *NARROW, 1e-12))
    assert len(made) == 5 and not again.earlier
    monkeypatch.setattr(resume, "code", lambda: "another")
    bench(NARROW)
    assert stored(tmp_path) == {"": {("embedding", 1e-5)}}  # of other code nothing is kept


def test_rows_by_another_measure_and_other_times_are_carried_over(bench, tmp_path):
    own, _ = bench(NARROW)
    bodies, made = bench(NARROW, ("embedding", "absolute"))  # errors are of bodies: the row is another one
    assert len(made) == 2 and own.fingerprint != bodies.fingerprint and own.motion == bodies.motion
    timed, made = bench(NARROW, at=[0.3])
    assert len(made) == 1 and len(stored(tmp_path)) == 3
    again, made = bench((*NARROW, 1e-8))
    assert {r.tolerance for r in again.rows} == {1e-5, 1e-8} and len(made) == 2  # that of 1e-5 is cheap, and timed again
    assert stored(tmp_path) == {"": {("embedding", 1e-5), ("embedding", 1e-8)}, timed.fingerprint: {("embedding", 1e-5)},
                                bodies.fingerprint: {("embedding", 1e-5), ("absolute", 1e-5)}}


def test_an_unfinished_run_keeps_rows_that_the_next_does_not_ask_for(bench, tmp_path):
    bench(WIDE)
    data = json.loads((tmp_path / "results.json").read_text())
    data["complete"], data["rows"] = False, [{**row, "took": 1e9} for row in data["rows"][:2]]
    (tmp_path / "results.json").write_text(json.dumps(data))
    bench(NARROW)
    whole, made = bench(WIDE)
    assert made == [("embedding", 1e-10)] and [r.tolerance for r in whole.earlier] == [1e-4, 1e-7]


def test_what_a_run_carries_is_read_as_it_was_written(bench, tmp_path):
    bench(WIDE)
    bench(NARROW)
    data = json.loads((tmp_path / "results.json").read_text())
    assert Benchmark.of(data).record() == data
    assert data["asked"] == [["embedding", "dop853", 1e-5, None]]


@pytest.mark.parametrize("damage", [{"carried": 3}, {"carried": {"x": [3]}}, {"asked": [3]}, {"asked": None}, {"motion": "other"},
                                    {"rows": [{"method": None}]}])
def test_damaged_files_carry_nothing(bench, wide, tmp_path, damage):
    data = json.loads(wide)
    (tmp_path / "results.json").write_text(json.dumps({**data, **damage}))
    _, made = bench((*WIDE, 1e-5))
    assert len(made) == 4
    assert all(isinstance(Row.of(r), Row) for r in json.loads((tmp_path / "results.json").read_text())["rows"])
