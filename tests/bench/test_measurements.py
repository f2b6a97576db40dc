"""The words after `symdyn bench`: arguments, results, and reports of wrong arguments."""

from __future__ import annotations

import importlib.util
import inspect
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from symdyn.bench.work import converged, store
from symdyn.bench.work.cases import known
from symdyn.cli import main
from symdyn.cli.measurements import MEASUREMENTS, Measurement, overview
from symdyn.errors import ArgumentError
from symdyn.lab.figures import print_figures

ROOT = Path(__file__).parents[2]
TEXTS = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").glob("*.md")),
         *sorted((ROOT / "notebooks").glob("*.py"))]


@pytest.mark.parametrize("word", MEASUREMENTS)
def test_a_word_is_in_help_and_takes_what_its_function_takes(word: str, capsys: pytest.CaptureFixture[str]) -> None:
    measurement = MEASUREMENTS[word]
    with pytest.raises(SystemExit) as stopped:
        main(["bench", word, "--help"])
    said = " ".join(capsys.readouterr().out.split())
    assert stopped.value.code == 0 and said.startswith(f"usage: symdyn bench {word}") and measurement.text in said
    takes = inspect.signature(measurement.function()).parameters
    for option in measurement.options:
        assert option.parameter in takes
        default = re.search(r"\(default: (\d+)\)", option.settings["help"])
        if default and takes[option.parameter].default is not None:
            assert int(default[1]) == takes[option.parameter].default
    needed = {name for name, p in takes.items() if p.default is p.empty}
    assert needed == {o.parameter for o in measurement.options if o.settings.get("nargs") == "+" and not o.flag}


@pytest.mark.parametrize("arguments", [["bench"], ["bench", "published"]])
def test_help_explains_comparisons_and_what_a_budget_counts(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main([*arguments, "--help"])
    said = " ".join(capsys.readouterr().out.split())
    assert "of which the least time is compared" in said and "median" not in said
    assert re.search(r"after this time, in which derivation,.* compilation .*count", said)


def test_help_has_every_word_and_no_mechanism_is_called_like_one(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["bench", "--help"])
    assert overview() in capsys.readouterr().out
    assert not set(MEASUREMENTS) & set(known())


def test_a_missed_bound_is_a_failure_and_what_is_not_given_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[dict[str, object]] = []

    def function(**options: object) -> int:
        given.append(options)
        return len(given) - 1

    monkeypatch.setattr(Measurement, "function", lambda self: function)
    assert main(["bench", "loops"]) == 0
    assert main(["bench", "loops", "--systems", "skate", "bricard", "--repeats", "3", "--json", "rows.json"]) == 1
    assert main(["bench", "extended", "skate", "--t", "0.5"]) == 1
    assert given == [{}, {"names": ["skate", "bricard"], "repeats": 3, "to_json": Path("rows.json")},
                     {"names": ["skate"], "end": 0.5, "print_only": False}]


@pytest.mark.parametrize("arguments, said", [
    (["figurs"], "no measurement 'figurs'; did you mean symdyn bench figures?"),
    (["pendulum", "turbin"], "no measurement 'turbin'; did you mean symdyn bench turbine?"),
    (["pendulum", "loops"], "loops is a measurement of its own, which comes first and alone: symdyn bench loops"),
    (["--progress", "growth"], "growth is a measurement of its own"),
    (["pendulm"], "there is no mechanism 'pendulm'; did you mean pendulum"),
    (["figures", "--only", "chian"], "there is no group chian of figures; did you mean chain? There are chain, compilation, "),
    (["flexible", "--only", "of_no_kind_at_all"], "there is no group of_no_kind_at_all of figures; there are rotating_beam"),
    (["sweep", "--count", "9"], "9 motions were asked for; pass 10 or more"),
    (["predictions", "--rows", "9"], "9 rows and the part 1 of the motions were asked for; pass 10 rows or more"),
    (["references", "nothing_of_the_kind"], "there is no mechanism 'nothing_of_the_kind'; there are pendulum"),
    (["extended", "skat"], "did you mean skate"),
    (["extended", "skate", "--t", "nan"], "the end is nan; pass a positive time, s"),
    (["extended", "skate", "--digits", "0"], "0 digits were asked for; pass 1 or more"),
    (["references", "pendulum", "--digits", "0"], "0 digits were asked for; pass 1 or more"),
    (["costs", "--repeats", "0"], "0 repeats were asked for; pass 1 or more"),
    (["pendulum", "--end", "0"], "the end 0.0 of pendulum must be a positive time, s"),
    (["pendulum", "--rtol", "0.5"], "the tolerance 0.5 does not lie between 1e-15 and 0.1"),
    (["published", "--only", "A99", "--against", "nobody"], "there is no published mechanism 'A99'"),
    (["published", "--output", f"{__file__}/there"], "test_measurements.py is a file, not a folder"),
    (["pendulum", "--methods", "bs54", "--steps", "0.1"], "none of the methods bs54 has steps of one length; add gauss"),
])
def test_wrong_arguments_are_reported(arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", *arguments]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("arguments, said", [(["growth", "--sizes", "many"], "invalid int value: 'many'"),
                                             (["extended"], "the following arguments are required: NAME"),
                                             (["turbine", "pendulum"], "unrecognized arguments: pendulum")])
def test_what_cannot_be_read_is_reported(arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["bench", *arguments])
    assert said in capsys.readouterr().err


def test_figures_with_their_bounds(capsys: pytest.CaptureFixture[str]) -> None:
    def small() -> Iterator[tuple[str, float, str, str]]:
        yield "within", 1.5, "s", "< 2"
        yield "on the edge", 2.0, "s", "< 2"

    def not_there() -> Iterator[tuple[str, float, str, str]]:
        yield "no number", float("nan"), "", ">= 1"
        yield "a count", 24736.0, "", ""

    groups = (small, not_there)
    assert print_figures(groups) == 2 and print_figures(groups, ["small"]) == 1 and print_figures(groups, ["not_there"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert [line.endswith("MISSED") for line in lines[:4]] == [False, True, True, False] and len(lines) == 8
    assert lines[3].split() == ["a", "count", "24736"]
    with pytest.raises(ArgumentError, match="did you mean small"):
        print_figures(groups, ["smal"])


def test_references_are_made(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(store, "STORE", tmp_path / "references.json")
    assert main(["bench", "references", "pendulum", "--digits", "6"]) == 0
    assert list(store.stored()) == ["pendulum"] and capsys.readouterr().out.startswith("pendulum: ")

    def too_long(*given: object) -> None:
        raise converged.TooLong("it would take too long")

    monkeypatch.setattr(converged, "converged", too_long)
    assert main(["bench", "references", "double_pendulum"]) == 1
    assert capsys.readouterr().out == "double_pendulum: it would take too long\n" and list(store.stored()) == ["pendulum"]


def test_stress_reports_what_is_missing_before_anything_is_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mine = tmp_path / "mine.py"
    mine.write_text("import symdyn as sd\n\n\ndef system():\n    found = sd.systems.get('pendulum')\n"
                    "    found.defaults = dict(list(found.defaults.items())[1:])\n    return found\n")
    assert main(["stress", str(mine), "--short", "--output", str(tmp_path / "out")]) == 2
    told = capsys.readouterr()
    assert "pendulum: parameters: no value for m, which has no default; give every parameter a number" in told.err
    assert not told.out and not (tmp_path / "out").exists()
    assert main(["stress", "pendulum", "--short", "--output", str(mine)]) == 2
    assert "mine.py is a file, not a folder" in capsys.readouterr().err


@pytest.mark.parametrize("path", TEXTS, ids=lambda path: path.name)
def test_commands_in_texts_are_there(path: Path) -> None:
    """Calls in README, pages, notebooks and the change log have a word or a mechanism; every word is on the page of figures."""
    text = path.read_text(encoding="utf-8")
    named = set(re.findall(r"symdyn bench (\w+)\b(?!\.py)", text))
    assert named <= {*MEASUREMENTS, *known(), "NAME"}
    modules = re.findall(r"python -m (symdyn[\w.]*)", text)
    assert all(re.fullmatch(r"symdyn\.lab\.\w+", m) and importlib.util.find_spec(m) for m in modules)
    assert path.name != "measured.md" or set(MEASUREMENTS) <= named | set(re.findall(r"`(\w+)`", text))
