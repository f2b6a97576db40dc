"""The ground that contacts have is found, and drawn before anything is simulated."""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np
import pytest

import symdyn as sd

pytest.importorskip("matplotlib")


def grounds(system: sd.System) -> list[list[float]]:
    """Normals and levels in the page of a mechanism."""
    found = re.search(r'<script id="data" type="application/json">(.*?)</script>', system.show().html, re.DOTALL)
    assert found is not None
    data: dict[str, Any] = json.loads(found[1])
    return data["grounds"]


def ball(planar: bool, *contacts: tuple[Any, dict[str, Any]]) -> sd.System:
    """A ball of radius 0.2 that may touch planes of the ground."""
    gravity = [0, -9.81] if planar else [0, 0, -9.81]
    system = sd.System("ball", gravity=gravity)
    body = system.add_body("ball", mass=1.0, inertia=0.016 if planar else [0.016] * 3)
    joint = sd.Planar("free", system.ground, body, list(sd.coordinates("x y theta"))) if planar else (
        sd.Free("free", system.ground, body, orientation=sd.EulerParameters()))
    system.add_joint(joint)
    for k, (plane, law) in enumerate(contacts):
        system.add_contact(sd.Contact(f"c{k}", body, system.ground, shape=(sd.contacts.Sphere(0.2), plane), **law))
    return system


COMPLIANT = {"law": "compliant", "compliance": sd.contacts.Compliance(stiffness=1e4, dissipation=1.0), "friction": 0.3}


@pytest.mark.parametrize("law", [{"friction": 0.3}, COMPLIANT])
@pytest.mark.parametrize(("planar", "normal", "point"), [
    (True, [0, 1], [0, 0]), (True, [-3, 4], [1, 2]), (False, [0, 0, 1], [0, 0, -0.7]), (False, [2, -1, 2], [0.3, 0.1, 0.2])])
def test_planes_are_where_they_are_described(planar: bool, normal: list[float], point: list[float], law: dict[str, Any]) -> None:
    unit = np.array(normal) / np.linalg.norm(normal)
    (found,) = grounds(ball(planar, (sd.contacts.Plane(normal, point), law)))
    np.testing.assert_allclose(found, [*unit, *[0.0] * (3 - len(unit)), float(unit @ point)], atol=1e-6)


def test_every_plane_is_drawn_once() -> None:
    """Rigid and compliant contacts with the same floor, and one with a wall; stops of joints have no place."""
    floor, wall = sd.contacts.Plane([0, 1], [0, 0.5]), sd.contacts.Plane([1, 0], [-2, 0])
    system = ball(True, (floor, {}), (wall, {}), (floor, COMPLIANT))
    lever = system.add_body("lever", mass=1.0, inertia=0.1, com=[0.5, 0])
    system.add_joint(sd.Revolute("pin", system.ground, lever, coordinate=sd.coordinates("phi")))
    system.add_contact(sd.Stop("stop", "pin", lower=-1.0))
    np.testing.assert_allclose(sorted(grounds(system)), [[0, 1, 0, 0.5], [1, 0, 0, -2]], atol=1e-6)


def test_what_is_curved_moves_or_is_drawn_by_the_user_has_no_plane() -> None:
    hollow = ball(True, (sd.contacts.Bore(3.0), {}))
    table = sd.System("table", gravity=[0, -9.81])
    plate = table.add_body("plate", mass=1.0, inertia=0.1)
    table.add_joint(sd.Prismatic("lift", table.ground, plate, axis=[0, 1], coordinate=sd.coordinates("h")))
    block = table.add_body("block", mass=1.0, inertia=0.1)
    table.add_joint(sd.Planar("free", table.ground, block, list(sd.coordinates("x y theta"))))
    table.add_contact(sd.Contact("on", block, plate, shape=sd.contacts.Point([0, -0.1])))
    drawn = ball(True, (sd.contacts.Plane(), {}))
    drawn.draw(drawn.ground, sd.shapes.Box([3, 0.1, 1], center=[0, -0.05, 0]))
    assert [grounds(system) for system in (hollow, table, drawn)] == [[], [], []]


def test_small_pictures_have_the_ground() -> None:
    """Below the block of the catalogue from one edge of the picture to the other."""
    svg = sd.systems.rocking_block()._repr_html_()
    corners = re.search(r'<polygon points="([^"]+)" fill="#d1d5db"', svg)
    assert corners is not None
    places = np.array([[float(v) for v in pair.split(",")] for pair in corners[1].split()])
    block = max(float(pair.split(",")[1]) for pair in re.findall(r'<polygon points="([^"]+)" fill="#4a6a8a"', svg)[0].split())
    assert places[:, 0].min() <= 0 and places[:, 0].max() >= 260
    assert places[:, 1].min() == pytest.approx(block, abs=0.2)  # its lowest corner stands on it
