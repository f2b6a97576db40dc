"""symdyn bench contacts: closed forms, errors, and what counts as behind."""

import functools
import json
from pathlib import Path

import numpy as np
import pytest

from symdyn.cli import main
from symdyn.lab import contact_costs, contacts
from symdyn.lab.contacts import EXUDYN, LOCATED, STEPPED, Point


def test_closed_forms_begin_and_end_where_they_should() -> None:
    at = np.array([0.0, np.sqrt(2 * 0.5 / 9.81), 3.0])
    assert contacts.ball_heights(at) == pytest.approx([0.5, 0, 0], abs=1e-12)
    half = np.pi / 5
    expected = [0.5, -0.44, 0.38, 0.02, 0.02]
    assert contacts.oscillator_places(half * np.array([0, 1, 2, 8, 9])) == pytest.approx(expected, abs=1e-12)
    places = contacts.billiard_places(np.array([0.0, 1.0, 1.25, 1.5]))
    assert places[0] == pytest.approx([0, 0]) and places[3] - places[2] == pytest.approx(places[2] - places[1])
    # rolling: 5/7 of the speed and 2/7 of that of the turning
    assert (places[3] - places[2]) / 0.25 == pytest.approx([5 / 7 * 2 - 2 / 7 * 0.03 * 20, 2 / 7 * 0.03 * 30])


def test_runs_are_listed_with_their_errors(monkeypatch: pytest.MonkeyPatch, tmp_path: Path,
                                           capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(contacts, "TOLERANCES", (1e-8,))
    monkeypatch.setattr(contacts, "STEPS", (1e-2, 1e-3))
    arguments = ["bench", "contacts", "--only", "ball", "billiard", "--repeats", "1", "--output", str(tmp_path)]
    main(arguments)
    points = [Point(**one) for one in json.loads((tmp_path / "contacts.json").read_text())]
    errors = {(p.motion, p.program, p.setting): p.error for p in points}
    assert errors["ball", LOCATED, 1e-8] < 1e-11 and errors["billiard", LOCATED, 1e-8] < 1e-8
    assert errors["billiard", STEPPED, 1e-3] < 0.02 * errors["billiard", STEPPED, 1e-2]  # of second order
    assert errors["ball", STEPPED, 1e-3] < 0.5 * errors["ball", STEPPED, 1e-2]
    assert (tmp_path / "contacts.svg").is_file() and str(points[0]) in capsys.readouterr().out


def test_what_contacts_cost_is_listed_with_bounds(monkeypatch: pytest.MonkeyPatch, tmp_path: Path,
                                                  capsys: pytest.CaptureFixture[str]) -> None:
    once = {name: functools.cache(lambda repeats, cost=cost: tuple(cost(repeats))) for name, cost in contact_costs.COSTS.items()}
    monkeypatch.setattr(contacts, "COSTS", once)
    monkeypatch.setattr(contact_costs, "LINKS", (1,))
    monkeypatch.setattr(contact_costs, "SPANS", (1.0,))
    for factor, code in ((1e-9, 1), (1e9, 0)):
        monkeypatch.setattr(contact_costs, "BOUNDS", {contact_costs.WALKER: 5.0 * factor, contact_costs.OPEN: 1.02 * factor})
        assert main(["bench", "contacts", "--only", "walker", "open", "--repeats", "1", "--output", str(tmp_path)]) == code
    walker, open_contacts = json.loads((tmp_path / "costs.json").read_text())
    assert 900 < int(walker["of"].split()[0]) < 1200 and ", 87 heel strikes" in walker["of"] and walker["value"] > 0
    assert 0.5 < open_contacts["value"] < 5 and "1 link, 1 s" in capsys.readouterr().out


def test_another_program_that_is_quicker_at_an_error_counts(capsys: pytest.CaptureFixture[str]) -> None:
    own, other = Point("ball", LOCATED, 1e-6, 1e-6, 2e-3), Point("ball", EXUDYN, 1e-4, 1e-4, 1e-3)
    assert contacts.behind([own, other]) == [other]
    assert contacts.behind([own, Point("ball", EXUDYN, 1e-4, 1e-2, 1e-3)]) == []
    assert contacts.behind([own, Point("ball", EXUDYN, 1e-4, 1e-4, 3e-3)]) == []
    assert main(["bench", "contacts", "--only", "woodpecker", "--repeats", "0"]) != 0
    said = capsys.readouterr().err
    assert "no motion 'woodpecker'; pass some of ball, oscillator, billiard" in said and "0 repeats were asked for" in said
