"""The stress test of contacts: it passes, and finds friction and impacts that are not those described."""

from typing import Any

import pytest

import symdyn as sd
from symdyn.stress import touching
from symdyn.stress.record import FAIL, PASS
from tests.helpers import swept


@pytest.mark.parametrize("short", swept([True, False], True))
def test_contacts_pass_under_stress(short: bool) -> None:
    rows = list(touching.contacts(short))
    assert [row.system for row in rows] == ["block", "thrown", "bar", "bar", "four_feet", "table", "lifted", *["bouncing"] * 2]
    assert {row.verdict for row in rows} == {PASS}


def test_other_friction_and_restitution_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    def changed(*places: Any, friction: Any = 0, restitution: Any = 0, **more: Any) -> sd.Contact:
        return sd.Contact(*places, friction=1.000001 * friction, restitution=1.000001 * restitution, **more)

    monkeypatch.setattr(touching, "Contact", changed)
    assert touching._friction().verdict == touching._grazing().verdict == FAIL


def test_checks_of_a_mechanism_with_rigid_contacts() -> None:
    system = sd.System("ball", gravity=[0, -9.81])
    body = system.add_body("ball", mass=1.0)
    y = sd.coordinates("y")
    system.add_joint(sd.Prismatic("height", system.ground, body, axis=[0, 1], coordinate=y))
    system.add_contact(sd.Contact("floor", body, system.ground, restitution=0.5))
    system.initial[y], system.duration = 1.0, 2.0
    report = sd.stress(system, checks=["energy", "reversal", "divergence", "steps"])
    assert {row.verdict for row in report.rows} == {PASS}
    assert [reason.partition(",")[0] for reason in report.left_out] == ["reversal", "divergence"]
