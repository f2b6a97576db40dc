"""`symdyn compare`."""

from pathlib import Path

import pytest

from symdyn.cli import main
from symdyn.lecture import names

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
    (["compare", "missing.py"], "there is no file missing.py")])
def test_what_is_asked_wrongly(capsys, arguments, message):
    assert main(arguments) == 2
    assert message in capsys.readouterr().err
