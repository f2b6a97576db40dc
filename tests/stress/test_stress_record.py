"""Rows and reports of stress: verdicts, table, files; which checks run, and what a crash becomes."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.cli import main
from symdyn.stress import run as stress_run
from symdyn.stress.record import DEGRADE, FAIL, LEGEND, PASS, Interrupted, NotApplicable, Row, StressReport, within


def row(verdict: str = PASS, check: str = "energy") -> Row:
    return Row(check, "arm", "10 s in 5 steps", 1e-9, 1e-6, "steps times tolerance", verdict, "energy is kept")


def test_verdict_follows_the_bound() -> None:
    assert within("a", "b", "done", 1.0, 1.0, "", "why").verdict == PASS
    beyond = within("a", "b", "done", 1.1, 1.0, "", "why", "too much")
    assert (beyond.verdict, beyond.why) == (FAIL, "too much")
    assert within("a", "b", "done", float("nan"), 1.0, "", "why").verdict == FAIL


def test_report_passes_unless_a_row_fails() -> None:
    assert StressReport([row(), row(DEGRADE)]).passed
    assert not StressReport([row(), row(FAIL)]).passed
    assert not StressReport().passed and "nothing was looked at, which does not count as passed" in StressReport().summary()
    assert StressReport([row(), row(), row(FAIL)]).count() == {"pass": 2, "degrade": 0, "fail": 1}


def test_table_and_files(tmp_path: Path) -> None:
    report = StressReport([row(), Row("gimbal", "<top>", "stopped", None, None, "", DEGRADE, "named")], ["units, arm: no "
                                                                                                         "unit"], 3.2)
    table = report.table()
    assert "pass    energy" in table and "1e-09     1e-06" in table and "bound: steps times tolerance" in table
    assert "left out: units, arm: no unit" in table and "2 rows: 1 pass, 1 degrade, 0 fail; 1 left out; 3 s" in table
    assert report.save(tmp_path / "a" / "s.txt").read_text(encoding="utf-8").strip() == table
    stored = json.loads(report.save(tmp_path / "s.json").read_text(encoding="utf-8"))
    assert stored["rows"][0]["figure"] == 1e-9 and stored["count"]["degrade"] == 1
    page = report.save(tmp_path / "s.html").read_text(encoding="utf-8")
    assert "&lt;top&gt;" in page and page.index("&lt;top&gt;") < page.index("energy is kept") and "steps times tolerance" in page
    with pytest.raises(sd.ArgumentError, match=r"the ending must be \.json, \.txt or \.html"):
        report.save(tmp_path / "s.csv")


def test_numbers_that_json_lacks_are_text(tmp_path: Path) -> None:
    endless = Row("a", "b", "c", float("inf"), 1.0, "", FAIL, "d")
    text = StressReport([endless]).save(tmp_path / "s.json").read_text(encoding="utf-8")
    assert json.loads(text, parse_constant=lambda name: pytest.fail(name))["rows"][0]["figure"] == "inf"


def test_page_folds_what_passes_and_explains_verdicts(tmp_path: Path) -> None:
    report = StressReport([row(), row(check="units"), row(DEGRADE), row(FAIL)])
    page = report.save(tmp_path / "s.html").read_text(encoding="utf-8")
    assert page.index("fail: 1</h2>") < page.index("degrade: 1</h2>") < page.index("pass: 2</h2>")
    assert page.count("<details>") == 2 and "<summary>units: 1</summary>" in page
    for verdict, meaning in LEGEND.items():
        assert meaning in page and f"{verdict}: " in report.table()


def test_parameters_without_numbers_are_reported() -> None:
    bare = sd.System("bare", gravity=[0, -9.81])
    q, m = sd.coordinates("q"), sd.parameters("m")
    bare.add_joint(sd.Revolute("hinge", bare.ground, bare.add_body("rod", mass=m, com=[1, 0]), q))
    for system in (bare, bare.embedding(), ["pendulum", bare]):
        with pytest.raises(sd.ArgumentError, match="bare: parameters: no value for m, which has no default"):
            sd.stress(system, short=True, checks=["rounding"])


def test_unknown_check_is_reported_with_near_ones() -> None:
    with pytest.raises(sd.ArgumentError, match="there is no check 'rouding'; did you mean rounding"):
        sd.stress("pendulum", checks=["rouding"])
    with pytest.raises(sd.ArgumentError, match="the checks flips have mechanisms of their own; leave out the system"):
        sd.stress("pendulum", checks=["energy", "flips"])


def test_what_is_no_mechanism_or_no_list_is_reported() -> None:
    for arguments, told in (({"system": 3}, "stress was given 3; pass a System"), ({"system": ["pendulum", "nope"]},
                             "there is no mechanism 'nope'; there are"),
                            ({"system": "n_link_pendulum(x)"}, "option n of n_link_pendulum must be of the kind int"),
                            ({"system": "pendulum", "jobs": "x"}, "jobs is 'x'; pass a number of processes, 1 or more"),
                            ({"jobs": 0}, "jobs is 0"), ({"jobs": True}, "jobs is True"), ({"jobs": 1.5}, "jobs is 1.5"),
                            ({"checks": 3}, "checks is 3; pass names of checks"),
                            ({"checks": []}, r"checks is \[\]; pass names of checks"),
                            ({"checks": "unit"}, "there is no check 'unit'; did you mean units"),
                            ({"system": []}, "stress was given no system")):
        with pytest.raises(sd.SymdynError, match=told):
            sd.stress(**arguments)


def test_crash_is_a_row_and_the_others_go_on(monkeypatch: pytest.MonkeyPatch) -> None:
    def crashes(short: bool) -> Iterator[Row]:
        yield row(check="first")
        raise RuntimeError("out of paper")

    def leaves_out(short: bool) -> Iterator[Row]:
        raise NotApplicable("no paper at all")
        yield row()

    checks = {"a": stress_run.Check("a", crashes), "b": stress_run.Check("b", leaves_out),
              "c": stress_run.Check("c", lambda short: iter([row(check="last")]))}
    monkeypatch.setattr(stress_run, "CHECKS", checks)
    seen: list[Row] = []
    report = sd.stress(show=seen.append)
    assert [r.check for r in report.rows] == ["first", "a", "last"] and seen == report.rows
    assert report.rows[1].verdict == FAIL and "RuntimeError in test_stress_record.py" in report.rows[1].done
    assert "out of paper" in report.rows[1].why and report.left_out == ["b, -: no paper at all"]


def test_command(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: Any) -> None:
    monkeypatch.setattr(stress_run, "CHECKS", {"a": stress_run.Check("a", lambda short: iter([row(FAIL)]))})
    assert main(["stress", "--jobs", "1", "--output", str(tmp_path)]) == 1
    told = capsys.readouterr().out
    assert told.startswith("verdict") and "fail    energy" in told and "1 rows: 0 pass" in told
    assert sorted(p.name for p in tmp_path.iterdir()) == ["stress.html", "stress.json", "stress.txt"]
    assert main(["stress", "--jobs", "0"]) == 2 and "--jobs must be 1 or more, found 0" in capsys.readouterr().err
    assert main(["stress", "no_such_system"]) == 2
    told = capsys.readouterr().err
    assert "there is no mechanism 'no_such_system'" in told
    assert "a Python file that defines system(), or of a TOML data file, is taken too" in told


def test_names_and_options_are_those_of_bench(tmp_path: Path, capsys: Any) -> None:
    (tmp_path / "mine.py").write_text("import symdyn as sd\n\ndef system(n):\n    return sd.systems.n_link_pendulum(n=n)\n")
    asked = ["--short", "--checks", "condition", "--jobs", "1", "--output", str(tmp_path)]
    for names, systems in ((["n_link_pendulum(2)", "heavy_top"], ["n_link_pendulum_2", "heavy_top"]),
                           (["n_link_pendulum", "--option", "n=3"], ["n_link_pendulum_3"]),
                           ([str(tmp_path / "mine.py"), "--option", "n=2"], ["n_link_pendulum_2"])):
        assert main(["stress", *names, *asked]) == 0
        stored = json.loads((tmp_path / "stress.json").read_text(encoding="utf-8"))
        assert [r["system"] for r in stored["rows"]] == systems
    assert [r.system for r in sd.stress("n_link_pendulum(2)", short=True, checks="condition").rows] == ["n_link_pendulum_2"]
    capsys.readouterr()
    for names, why in ((["n_link_pendulum(a)"], "option n of n_link_pendulum must be of the kind int"),
                       ([str(tmp_path / "mine.py")], "needs --option n=..."), (["--option", "n=3"], "goes with names")):
        assert main(["stress", *names, *asked]) == 2 and why in capsys.readouterr().err


def test_nothing_looked_at_is_a_failure(tmp_path: Path, capsys: Any) -> None:
    assert main(["stress", "pendulum", "--checks", "constraints", "inputs", "--output", str(tmp_path)]) == 1
    assert "nothing was looked at, which does not count as passed: 0 rows" in capsys.readouterr().out


def test_one_name_is_a_list_of_one() -> None:
    report = sd.stress("pendulum", short=True, checks="condition")
    assert [r.check for r in report.rows] == ["condition"] and report.passed


def test_checks_that_are_named_are_run_in_the_short_form_too(monkeypatch: pytest.MonkeyPatch) -> None:
    checks = {"a": stress_run.Check("a", lambda short: iter([row(check="quick")])),
              "b": stress_run.Check("b", lambda short: iter([row(check="long")]), short=False)}
    monkeypatch.setattr(stress_run, "CHECKS", checks)
    assert [r.check for r in sd.stress(short=True).rows] == ["quick"]
    assert [r.check for r in sd.stress(short=True, checks=["b"]).rows] == ["long"]
    assert [r.check for r in sd.stress().rows] == ["quick", "long"]


def test_list_names_every_check(capsys: Any) -> None:
    assert main(["stress", "--list"]) == 0
    told = capsys.readouterr().out
    assert all(name in told for name in stress_run.CHECKS) and "any mechanism" in told


def test_a_question_that_is_wrong_is_reported_before_the_table(tmp_path: Path, capsys: Any) -> None:
    for asked, why in ((["--checks", "zork"], "there is no check 'zork'"), (["pendulum", "--checks", "flips"], "of their own")):
        assert main(["stress", *asked, "--output", str(tmp_path)]) == 2
        told = capsys.readouterr()
        assert told.out == "" and why in told.err


def test_what_is_finished_is_kept_when_interrupted(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: Any) -> None:
    def stops(short: bool) -> Iterator[Row]:
        raise KeyboardInterrupt
        yield row()

    checks = {"a": stress_run.Check("a", lambda short: iter([row()])), "b": stress_run.Check("b", stops)}
    monkeypatch.setattr(stress_run, "CHECKS", checks)
    with pytest.raises(Interrupted, match="interrupted; 1 of 2 checks were done") as caught:
        sd.stress()
    report = caught.value.report
    assert report.rows == [row()] and report.summary().startswith("unfinished: 1 of 2 checks were done; ")
    assert main(["stress", "--jobs", "1", "--output", str(tmp_path)]) == 130
    told = capsys.readouterr()
    assert "pass    energy" in told.out and told.err == "symdyn: interrupted; 1 of 2 checks were done\n"
    stored = json.loads((tmp_path / "stress.json").read_text(encoding="utf-8"))
    assert stored["unfinished"] == "1 of 2 checks were done" and len(stored["rows"]) == 1
    for name in ("stress.txt", "stress.html"):
        assert "unfinished: 1 of 2 checks were done" in (tmp_path / name).read_text(encoding="utf-8")


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="there are no groups of processes")
def test_processes_end_silently_when_interrupted(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "symdyn", "stress", "--short", "--jobs", "2", "--checks", "denormals", "chaos", "--output",
               str(tmp_path)]
    started = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)
    assert started.stdout is not None and started.stdout.readline().startswith("verdict")
    os.killpg(started.pid, signal.SIGINT)  # as the key does
    out, err = started.communicate(timeout=20)
    assert started.returncode == 130 and re.fullmatch(r"symdyn: interrupted; \d of 3 checks were done\n", err)
    assert "unfinished: " in out and (tmp_path / "stress.html").exists()


def test_a_motion_that_stops_is_reported_once() -> None:
    def fails(v: np.ndarray) -> np.ndarray:
        return np.where(v > 0.5, np.nan, 1.0)

    system = sd.System("stopping", planar=True)
    x = sd.coordinates("x")
    system.add_joint(sd.Prismatic("way", system.ground, system.add_body("block", mass=1, inertia=1), x))
    system.add_joint_force("way", sd.External("fails", ["v"], python=fails, c="""
static int fails(const double *in, double *out) { out[0] = in[0] > 0.5 ? 0.0/0.0 : 1.0; return 0; }""")(x.dot))
    system.duration = 20
    report = sd.stress(system, short=True, checks=["condition", "energy", "reversal", "denormals"])
    (told,) = report.rows
    assert (told.check, told.system, told.verdict) == ("usual motion", "stopping", DEGRADE)
    assert told.done.startswith("the usual motion stops at t = 0.5") and "fails failed or gave what is not finite" in told.done
    assert [text.split(",")[0] for text in report.left_out] == ["condition", "energy", "reversal", "denormals"]
