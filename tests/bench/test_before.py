"""Figures of a benchmark next to those of another commit: what is read, what is printed."""

from __future__ import annotations

import contextlib
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from tests.checks import before
from tests.checks.before import WHOLE, Cells, cells_of, table, typical
from tests.checks.commits import ROOT, tree_of

NETS = """\
 side  speeds  rows  derive s       us     error
    5      69    40       0.7     2.41   4.6e-16
   10     294   180       2.7    10.26   8.3e-16
error relative to equations by hand
"""
FIGURES = """\
double_pendulum: derivation             0.12 s   <= 0.5
double_pendulum: operations                38
"""


def test_cells_are_called_by_row_and_column() -> None:
    cells = cells_of(NETS)
    assert cells["5", "derive s"] == "0.7" and cells["10", "us"] == "10.26" and len(cells) == 2 * 5
    cells = cells_of(FIGURES)
    assert cells["double_pendulum: derivation", "measured"] == "0.12 s"
    assert cells["double_pendulum: operations", "measured"] == "38"


def test_rows_are_called_by_as_many_cells_as_tell_them_apart() -> None:
    lines = ["system  n code      us", "cable  2 loops     1.5", "cable  2 straight  2.5", "legs  4 loops  0.5"]
    assert list(cells_of("\n".join(lines))) == [("cable  2 loops", "us"), ("cable  2 straight", "us"), ("legs  4 loops", "us")]
    again = cells_of("\n".join([*lines, "legs  4 loops  0.7"]))
    assert list(again)[2:] == [("legs  4 loops", "us"), ("legs  4 loops (2)", "us")] and again["legs  4 loops (2)", "us"] == "0.7"
    again = cells_of("error: of a motion    4.2e-10    < 1e-08\nerror: of a motion    4.3e-10    < 1e-08\n")
    assert list(again)[::2] == [("error: of a motion", "measured"), ("error: of a motion (2)", "measured")]


def test_numbers_outside_tables_are_called_by_what_is_before_and_above_them() -> None:
    lines = ("mechanism     steps   ms   error", "cable(2)        100  0.5", "legs             90  0.7   2e-11",
             "killed after 17 s")
    assert cells_of("\n".join(lines)) == {("cable(2)", "steps"): "100", ("cable(2)", "ms"): "0.5", ("legs", "steps"): "90",
                                          ("legs", "ms"): "0.7", ("legs", "error"): "2e-11", ("killed after", "number 1"): "17"}
    assert cells_of("100 motions, 4.9 s each\n") == {("line 1", "number 1"): "100", ("line 1", "number 2"): "4.9"}


def test_what_has_no_figures_is_an_error() -> None:
    with pytest.raises(ValueError, match=r"no figures were found in what was printed; it begins 'wrote it'$"):
        cells_of("wrote it\nand more\n")


def test_the_median_of_each_figure_counts() -> None:
    runs = [{("5", "derive s"): seconds, ("5", "message"): text}
            for seconds, text in (("0.9 s", "a"), ("0.5 s", "b"), ("0.6 s", "c"))]
    assert typical(runs) == {("5", "derive s"): "0.6 s", ("5", "message"): "a"}
    assert typical(runs[:1]) == runs[0]
    assert typical([*runs, {}])["5", "derive s"] == "0.6 s"


def test_figures_that_differ_are_printed_with_their_ratio() -> None:
    then = cells_of(NETS.replace("0.7", "1.4").replace("10.26", "10.26 ms").replace("   10  ", "   20  "))
    assert table(cells_of(NETS), then) == [
        "row  figure        now      then  ratio",
        "5    derive s      0.7       1.4    0.5",
        "10   speeds        294         -",
        "10   rows          180         -",
        "10   derive s      2.7         -",
        "10   us          10.26         -",
        "10   error     8.3e-16         -",
        "20   speeds          -       294",
        "20   rows            -       180",
        "20   derive s        -       2.7",
        "20   us              -  10.26 ms",
        "20   error           -   8.3e-16",
        "4 figures are the same"]
    now, then = ({("5", "us"): us, ("5", "e"): e, ("5", "n"): n} for us, e, n in (("3 ms", "2", "nan"), ("3 us", "0", "1")))
    assert table(now, then) == [
        "row  figure   now  then  ratio", "5    us      3 ms  3 us", "5    e          2     0", "5    n        nan     1",
        "0 figures are the same"]
    assert table({WHOLE: "1,200"}, {WHOLE: "1,000"})[1].split()[-1] == "1.2"


def test_runs_take_turns(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    seen: list[tuple[Path, list[str]]] = []

    @contextlib.contextmanager
    def tree(commit: str) -> Iterator[Path]:
        assert commit == "v1"
        yield tmp_path

    def run(root: Path, words: Sequence[str]) -> Cells:
        seen.append((root, list(words)))
        return {("5", "us"): "2" if root == ROOT else "4"}

    monkeypatch.setattr(before, "tree_of", tree)
    monkeypatch.setattr(before, "run", run)
    assert before.main(["--against", "v1", "--rounds", "2", "nets", "--sizes", "5"]) == 0
    assert seen == [(root, ["nets", "--sizes", "5"]) for root in (ROOT, tmp_path) * 2]
    said = capsys.readouterr()
    assert said.out.splitlines()[1].split() == ["5", "us", "2", "4", "0.5"] and "round 2 of 2: v1" in said.err
    with pytest.raises(SystemExit):
        before.main(["--rounds", "2"])
    assert "give a benchmark, such as nets --sizes 5, and 1 round or more" in capsys.readouterr().err


def test_a_benchmark_that_fails_is_named(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    @contextlib.contextmanager
    def tree(commit: str) -> Iterator[Path]:
        yield ROOT

    monkeypatch.setattr(before, "tree_of", tree)
    assert before.main(["nets", "--sizes", "1"]) == 1
    assert "symdyn bench nets --sizes 1 failed in the working tree: " in (said := capsys.readouterr().err)
    assert "3 or more; found 1" in said


def test_a_tree_of_a_commit_is_removed() -> None:
    if subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True, check=False).returncode:
        pytest.skip("no repository here")
    with tree_of("HEAD") as tree:
        assert (tree / "symdyn" / "__init__.py").exists()
    assert not tree.exists()
    listed = subprocess.run(["git", "worktree", "list"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert str(tree) not in listed
