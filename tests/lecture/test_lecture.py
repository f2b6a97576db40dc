"""Every case of the lecture: all entries are decided, and verdicts and errata are those that are committed."""

import csv
from pathlib import Path

import pytest
from compared import compared

import symdyn as sd
from symdyn.comparison import Comparisons, Verdict, compare_lecture
from symdyn.comparison.reports import report
from symdyn.lecture import cases, names

REFERENCE = Path(__file__).parents[2] / "generated" / "reference" / "lecture"
ERRATA, VERDICTS = REFERENCE / "errata.md", REFERENCE / "verdicts.csv"
AGAIN = "; look at the difference, and keep it with `pytest tests/lecture/test_lecture.py --update`"


def sections(text):
    """Sections of an errata page: the head, and what every case has in it, each erratum with its slip, and labels and words."""
    head, *parts = text.split("\n## ")
    found = {}
    for part in parts:
        slip, *errata = part.split("\n### ") if "\n### " in part else part.split("\n- ")
        for erratum in errata:
            name = erratum.split("ase `", 1)[1].split("`", 1)[0]
            found.setdefault(name, []).append((slip.strip(), erratum.strip()))
    return head, {name: sorted(errata) for name, errata in found.items()}


def test_the_committed_errata_and_verdicts_are_of_the_cases_there_are(update):
    if update:
        found = compare_lecture()
        REFERENCE.mkdir(exist_ok=True)
        ERRATA.write_text(report(found, "errata.md"), encoding="utf-8")
        with VERDICTS.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows(found.rows())
    head, of_cases = sections(ERRATA.read_text(encoding="utf-8"))
    errata = [slip for every in of_cases.values() for slip, _ in every if not slip.startswith("Labels and words")]
    assert f"{len(errata)} formulas that are wrong as printed, {len(set(errata))} slips in all" in head
    assert set(of_cases) <= set(names())
    assert [row[0] for row in csv.reader(VERDICTS.open(encoding="utf-8"))] == ["case", *names()]


@pytest.mark.parametrize("name", names())
def test_every_entry_is_decided_as_committed(name, update):
    if update:
        pytest.skip("the committed files are being rewritten")
    found = compared(name)
    assert found.decided, str(found)
    assert found.sampled == [], str(found)
    for formula in found.formulas:
        for entry in formula.entries:
            if entry.verdict in (Verdict.WRONG, Verdict.CONVENTION, Verdict.UNREADABLE):
                assert len(entry.note.split()) >= 3, f"{name}, {formula.name}: tell in a sentence"
        for erratum in formula.errata:
            assert erratum.evidence.holds and erratum.evidence.sentence
        assert formula.slide.section and formula.slide.title and formula.slide.line
    alone = Comparisons((found,))
    committed = {row[0]: row for row in csv.reader(VERDICTS.open(encoding="utf-8"))}
    assert list(alone.rows()[1]) == committed[name], f"the verdicts of {name} are others than committed" + AGAIN
    _, kept = sections(ERRATA.read_text(encoding="utf-8"))
    _, now = sections(report(alone, "errata.md"))
    assert now.get(name, []) == kept.get(name, []), f"the errata of {name} are others than committed" + AGAIN


def test_names_are_unique_and_the_order_is_that_of_the_lecture():
    assert len(set(names())) == len(names())
    lines = [case.slide.line for case in cases()]
    assert lines == sorted(lines)


def test_processes_share_the_cases():
    some = ["newtons-law", "pendulum-augmented"]
    alone, shared = compare_lecture(some), compare_lecture(some, jobs=2)
    assert [c.name for c in shared] == some
    assert alone.rows() == shared.rows() and report(alone, "errata.md") == report(shared, "errata.md")
    with pytest.raises(sd.UnknownCase, match="there is no case 'newton'"):
        compare_lecture(["newton"], jobs=2)
