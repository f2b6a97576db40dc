"""The ground that contacts have is found, and drawn before anything is simulated."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.interpolate import CubicSpline, RectBivariateSpline

import symdyn as sd
from tests.user_functions import HEIGHT

pytest.importorskip("matplotlib")

from symdyn.pictures.drawing import Drawing
from symdyn.pictures.scene import Scene


def data_of(html: str) -> dict[str, Any]:
    """Data that a page draws."""
    found = re.search(r'<script id="data" type="application/json">(.*?)</script>', html, re.DOTALL)
    assert found is not None
    data: dict[str, Any] = json.loads(found[1])
    return data


def grounds(system: sd.System) -> list[list[float]]:
    """Normals and levels in the page of a mechanism."""
    found: list[list[float]] = data_of(system.show().html)["grounds"]
    return found


def vertices(mesh: dict[str, Any]) -> np.ndarray:
    """Those of a mesh of a page but the eight corners of the box around it, (n, 3)."""
    own = mesh["vertices"]
    return np.frombuffer(base64.b64decode(own["single"]), "<f4").reshape(own["columns"], -1).T[:-8].astype(float)


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


X, Y, A, K = sp.Symbol("x along"), sp.Symbol("y along"), *sd.parameters("a k")
ALONG = np.linspace(-5.0, 8.0, 60)
CURVES: dict[str, tuple[Any, Callable[[np.ndarray], np.ndarray]]] = {
    "expression": (0.1 * sp.sin(2 * X), lambda x: 0.1 * np.sin(2 * x)),
    "parameters": (A * sp.sin(K * X), lambda x: 0.15 * np.sin(1.5 * x)),
    "spline": (CubicSpline(ALONG, 0.1 * np.sin(2 * ALONG)), lambda x: CubicSpline(ALONG, 0.1 * np.sin(2 * ALONG))(x)),
    "rim": (0.8 - sp.sqrt(0.64 - X**2), lambda x: 0.8 - np.sqrt(0.64 - x**2)),
}


@pytest.mark.parametrize("kind", CURVES)
def test_curves_are_drawn_where_they_are_described(kind: str) -> None:
    """In the page of the mechanism and in that of a motion, there as far as the wheel gets."""
    height, f = CURVES[kind]
    system = ball(True, (sd.contacts.Curve(height, X), {"friction": 0.5}))
    system.defaults = {A: 0.15, K: 1.5} if kind == "parameters" else {}
    end = 0.1 if kind == "rim" else 1.0
    solution = system.compile().simulate((0, end), q={"y": 0.5}, u={"x_dot": 0.0 if kind == "rim" else 2.0})
    for page in (data_of(system.show().html), *data_of(solution.view().html)["motions"]):
        (mesh,) = [mesh for mesh in page["meshes"] if mesh["ground"]]
        x, y = vertices(mesh)[::4, :2].T
        assert mesh["body"] == -1 and page["grounds"] == []
        np.testing.assert_allclose(y, f(x), atol=1e-5)
        if kind == "rim":  # the bowl ends there
            assert -0.8 <= x.min() < -0.78 and 0.78 < x.max() <= 0.8
        else:
            assert x.min() < -0.3 and x.max() > (solution["x"].max() + 0.3 if page["kind"] == "recorded" else 0.3)


@pytest.mark.parametrize(
    "height",
    [X**2 / 2 + Y**2 / 3, RectBivariateSpline(ALONG, ALONG, ALONG[:, None] ** 2 / 2 + ALONG[None, :] ** 2 / 3)],
    ids=["expression", "spline"],
)
def test_surfaces_are_drawn_in_pages_and_stills(height: Any, tmp_path: Path) -> None:
    system = ball(False, (sd.contacts.Surface(height, X, Y), {"friction": 0.5}))
    solution = system.compile().simulate((0, 0.3), q=[0.3, 0.2, 0.5, 1, 0, 0, 0])
    for page in (data_of(system.show().html), *data_of(solution.view().html)["motions"]):
        (mesh,) = [mesh for mesh in page["meshes"] if mesh["ground"]]
        x, y, z = vertices(mesh).T
        np.testing.assert_allclose(z, x**2 / 2 + y**2 / 3, atol=1e-5)
    assert 0.3 < x.max() < 2 and 0.2 < y.max() < 2
    drawing = Drawing.of(solution)
    assert drawing is not None and drawing.solids is not None
    assert [part.ground for part in drawing.solids.parts].count(True) == 1
    figure = solution.picture([0.3])
    (scene,) = [artist for artist in figure.axes[0].collections if isinstance(artist, Scene)]
    figure.canvas.draw()
    assert len(scene.get_paths()) > 500  # its facets are seen from above


def test_cams_turn_with_their_bodies(tmp_path: Path) -> None:
    """All around at their radius, in the axes of the body, whose own disc gives way to it."""
    system, angle = sd.System("follower", gravity=[0, -9.81]), sp.Symbol("angle")
    cam = system.add_body("cam", mass=1, inertia=0.1)
    system.add_joint(sd.Revolute("axle", system.ground, cam, coordinate=sd.coordinates("phi")))
    rod = system.add_body("rod", mass=0.5)
    system.add_joint(sd.Prismatic("guide", system.ground, rod, axis=[0, 1], coordinate=sd.coordinates("h")))
    shapes = sd.contacts.Sphere(0.05), sd.contacts.Cam(0.2 + 0.05 * sp.cos(2 * angle), angle)
    system.add_contact(sd.Contact("touch", rod, cam, shape=shapes))
    solution = system.compile(backend="numpy").simulate((0, 0.5), q={"h": 0.31}, u={"phi_dot": 2.0})
    (motion,) = data_of(solution.view().html)["motions"]
    (mesh,) = motion["meshes"]
    x, y = vertices(mesh)[:-2, :2].T
    assert mesh["body"] == 0 and not mesh["ground"] and len(x) == 360
    np.testing.assert_allclose(np.hypot(x, y), 0.2 + 0.05 * np.cos(2 * np.arctan2(y, x)), atol=1e-6)
    assert not [item for item in motion["items"] if item["kind"] == "disc"]
    drawing = Drawing.of(solution)
    assert drawing is not None and drawing.solids is not None
    first, last = (drawing.solids.vertices(k)[0] for k in (0, -1))
    turned = np.arctan2(last[0, 1], last[0, 0]) - np.arctan2(first[0, 1], first[0, 0])
    assert turned == pytest.approx(solution["phi"][-1] - solution["phi"][0])


def test_inclined_planes_are_in_stills_and_pages_of_motions() -> None:
    system = ball(True, (sd.contacts.Plane([-1, 2], [0, 0.5]), {"friction": 0.5}))
    solution = system.compile(backend="numpy").simulate((0, 0.5), q={"x": 1.0, "y": 1.5})
    (motion,) = data_of(solution.view().html)["motions"]
    np.testing.assert_allclose(motion["grounds"], [[*(np.array([-1, 2, 0]) / np.sqrt(5)), 1 / np.sqrt(5)]], atol=1e-7)
    corners = solution.picture(0.5).axes[0].patches[0].get_xy()[:2]
    np.testing.assert_allclose(corners[:, 1] - 0.5, corners[:, 0] / 2, atol=1e-9)
    spatial = ball(False, (sd.contacts.Plane([0.3, 0, 1]), {"friction": 0.5}))
    drawing = Drawing.of(spatial.compile(backend="numpy").simulate((0, 0.2), q=[0, 0, 0.3, 1, 0, 0, 0]))
    assert drawing is not None and drawing.solids is not None
    (floor,) = [part for part in drawing.solids.parts if part.ground]
    np.testing.assert_allclose(floor.vertices[:-8] @ [0.3, 0, 1], 0, atol=1e-9)


def test_hollow_and_full_balls_that_are_touched_are_drawn() -> None:
    page = data_of(ball(True, (sd.contacts.Bore(3.0, [0.1, 0.2]), {}), (sd.contacts.Sphere(0.4, [0, -2]), {})).show().html)
    (mesh,) = page["meshes"]
    np.testing.assert_allclose(np.hypot(*(vertices(mesh)[::4, :2] - [0.1, 0.2]).T), 3.0, atol=1e-6)
    assert [(item["ends"], item["size"]) for item in page["items"] if item["name"] == "ground"] == [([[-1, 0, -2, 0]], [0.4])]
    spatial = data_of(ball(False, (sd.contacts.Bore(3.0), {})).show().html)
    threads = [item for item in spatial["items"] if item["name"] == "line of ground"]
    assert len(threads) == 3 * 180
    np.testing.assert_allclose([np.linalg.norm(item["ends"][0][1:]) for item in threads], 3.0, rtol=1e-6)


def test_a_plane_on_a_body_that_moves_goes_with_it() -> None:
    system = sd.System("lift", gravity=[0, -9.81])
    plate = system.add_body("plate", mass=1.0, inertia=0.1)
    system.add_joint(sd.Prismatic("lift", system.ground, plate, axis=[0, 1], coordinate=sd.coordinates("h")))
    block = system.add_body("block", mass=1.0, inertia=0.1)
    system.add_joint(sd.Planar("free", system.ground, block, list(sd.coordinates("x y theta"))))
    system.add_contact(sd.Contact("on", block, plate, shape=(sd.contacts.Point([0, -0.1]), sd.contacts.Plane([0, 1], [0, 0.05]))))
    (mesh,) = data_of(system.show().html)["meshes"]
    assert mesh["body"] == 0
    np.testing.assert_allclose(vertices(mesh)[::4, 1], 0.05, atol=1e-7)


def test_heights_without_a_text_are_left_out() -> None:
    """A function of the user's has no value in pages; the mechanism is drawn without it."""
    system = ball(True)
    system.add_contact(sd.Contact("on", "ball", system.ground, shape=(sd.contacts.Point(), sd.contacts.Curve(HEIGHT(X), X))))
    assert system.check().surroundings == ()


def test_a_saved_module_has_the_surroundings(tmp_path: Path) -> None:
    system = ball(True, (sd.contacts.Curve(A * sp.sin(K * X), X), {}))
    system.defaults = {A: 0.15, K: 1.5}
    module = system.compile(backend="numpy")
    about = module.metadata
    assert type(about).of_plain(json.loads(json.dumps(about.as_plain()))).surroundings == about.surroundings
    (record,) = about.surroundings
    assert record["height"] == "p1*sin(p2*x)" and record["values"] == {"parameters": [[None, None]]}
    np.testing.assert_allclose(module.evaluate("drawn_lengths", 0.0, np.zeros(6), module.parameters(), np.zeros(0)), [0.15, 1.5])
