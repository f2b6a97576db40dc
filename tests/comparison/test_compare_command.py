"""`symdyn compare`."""

import sys
from pathlib import Path

import pytest

from symdyn.cli import main
from symdyn.comparison import compare_lecture
from symdyn.lecture import cases, names

MINE = """
import sympy as sp
import symdyn as sd

q = sd.coordinates("q")
CASES = [sd.Case("mine", "My pendulum", sd.Slide("7", "Pendulum", 3),
                 [sd.Formula("rate", sp.cos(q) * q.dot, sd.rate(sp.sin(q)))])]
"""


def write(folder: Path, text: str) -> str:
    path = folder / "slides.py"
    path.write_text(text, encoding="utf-8")
    return str(path)


def test_without_names_the_cases_are_listed(capsys):
    assert main(["compare"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == names()
    assert any(line.split()[1] == "3.5" for line in lines)


def test_one_case_is_printed_formula_by_formula(capsys):
    assert main(["compare", "newtons-law"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("newtons-law") and "equal" in said


def test_a_file_of_ones_own(capsys, tmp_path):
    assert main(["compare", write(tmp_path, MINE), "--output", str(tmp_path / "report")]) == 0
    said = capsys.readouterr().out
    assert "mine (My pendulum)" in said and "1 equal" in said
    assert (tmp_path / "report" / "comparison.html").is_file() and "errata.md" in said


def test_a_case_that_is_not_decided_is_not_a_success(capsys, tmp_path):
    assert main(["compare", write(tmp_path, MINE.replace("sd.rate(sp.sin(q))", "-sd.rate(sp.sin(q))"))]) == 1
    assert "different, not proven wrong" in capsys.readouterr().out


@pytest.mark.parametrize("text, message", [
    ("CASES = 3", "must define CASES, a list of symdyn.Case; found 3"), ("x = 1", "must define CASES"),
    ("raise ValueError('no')", "ended with ValueError")])
def test_files_that_are_no_cases(capsys, tmp_path, text, message):
    assert main(["compare", write(tmp_path, text)]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("arguments, message", [
    (["compare", "newtons-lew"], "there is no case 'newtons-lew'; the nearest are newtons-law"),
    (["compare", "newtons-law", "--all"], "name cases, or pass --all, not both"),
    (["compare", "newtons-law", "--jobs", "0"], "--jobs takes a number of processes from 1 on, found 0"),
    (["compare", "newtons-law", "--no-pages"], "--no-pages goes with --all, without --output"),
    (["compare", "--all", "--no-pages", "--output", "x"], "--no-pages goes with --all, without --output"),
    (["compare", "9.9"], "there is no case of section 9.9; sections with cases are 1.1"),
    (["compare", "missing.py"], "there is no file missing.py")])
def test_what_is_asked_wrongly(capsys, arguments, message):
    assert main(arguments) == 2
    assert message in capsys.readouterr().err


SEVERAL = MINE + """
def fails():
    raise ValueError("no such body")

CASES = [sd.Case("first", formulas=[sd.Formula("late", q, fails)]), *CASES, sd.Case("third", formulas=[("a", q, q)])]
"""


def test_a_section_is_all_of_its_cases(capsys):
    assert main(["compare", "1.5", "1.1"]) == 0
    said = capsys.readouterr().out
    wanted = [c for c in cases() if c.slide.section in ("1.5", "1.1")]
    assert len(wanted) == 3 and all(f"{c.name} ({c.title})" in said for c in wanted)


def test_an_error_in_one_case_does_not_hide_the_others(capsys, tmp_path):
    assert main(["compare", write(tmp_path, SEVERAL), "--output", str(tmp_path / "report")]) == 2
    said = capsys.readouterr()
    assert "mine (My pendulum)" in said.out and "1 equal" in said.out
    assert "the case 'first': what is derived for late ended with ValueError: no such body" in said.err
    assert "the case 'third': formulas[0] is ('a', q, q) of type tuple" in said.err
    assert "mine" in (tmp_path / "report" / "comparison.html").read_text(encoding="utf-8")


def test_a_file_whose_only_case_has_faults(capsys, tmp_path):
    text = MINE.replace("sd.rate(sp.sin(q))", "None")
    assert main(["compare", write(tmp_path, text), "--output", str(tmp_path / "report")]) == 2
    said = capsys.readouterr()
    assert said.out == "" and "the case 'mine': nothing is derived for rate" in said.err


def test_names_are_looked_up_before_anything_is_compared(capsys, tmp_path):
    assert main(["compare", write(tmp_path, MINE), "newtons-lew", "--output", str(tmp_path / "report")]) == 2
    said = capsys.readouterr()
    assert said.out == "" and "the nearest are newtons-law" in said.err and not (tmp_path / "report").exists()


def test_processes_are_for_the_lecture(capsys, tmp_path):
    path = write(tmp_path, MINE)
    assert main(["compare", path, "--jobs", "2"]) == 2
    assert f"--jobs shares cases of the lecture, and {path} is a file of your own" in capsys.readouterr().err
    assert main(["compare", path, "--jobs", "1"]) == 0


@pytest.fixture
def nothing_is_compared(monkeypatch):
    def compared(*_):
        raise AssertionError("compared before it was clear that the reports can be written")

    monkeypatch.setattr("symdyn.comparison.run.judge", compared)


@pytest.mark.usefixtures("nothing_is_compared")
@pytest.mark.parametrize("asked", [["newtons-law"], ["--all", "--jobs", "1"]])
def test_what_the_reports_need_is_looked_at_first(capsys, tmp_path, monkeypatch, asked):
    (tmp_path / "file").write_text("")
    assert main(["compare", *asked, "--output", str(tmp_path / "file" / "folder")]) == 2
    assert "for the reports cannot be made" in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "latex2mathml.converter", None)
    assert main(["compare", *asked, "--output", str(tmp_path / "report")]) == 1
    said = capsys.readouterr()
    assert "pip install 'symdyn[report]'" in said.err and said.out == "" and not (tmp_path / "report").exists()


def test_the_table_alone(capsys, monkeypatch, tmp_path):
    asked = []
    monkeypatch.chdir(tmp_path)
    one = compare_lecture(["newtons-law"])
    monkeypatch.setattr("symdyn.comparison.compare_lecture", lambda *given: asked.append(given) or one)
    assert main(["compare", "--all", "--no-pages", "--jobs", "3"]) == 0
    assert asked == [(None, 3)] and list(tmp_path.iterdir()) == []
    assert "6 of 6 decided entries are proved equal" in capsys.readouterr().out


def test_help_lists_the_exit_codes(capsys):
    with pytest.raises(SystemExit):
        main(["compare", "--help"])
    said = " ".join(capsys.readouterr().out.split())
    assert "Exit codes: 0 all is decided; 1 an entry is different or not decided" in said and "2 it was asked wrongly" in said
