"""Contacts in pictures: points and forces as arrows, and marks where modes change."""

import base64
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.pictures import arrows
from symdyn.pictures.drawing import Drawing
from symdyn.pictures.looks import looks_of
from symdyn.pictures.mechanism import mechanism_of

G = 9.81


@pytest.fixture(scope="module")
def landing() -> Any:
    """A box that falls flat and slides to rest."""
    system = sd.System("box", gravity=[0, -G])
    body = system.add_body("box", mass=2.0, inertia=0.03)
    system.add_joint(sd.Planar("free", system.ground, body, sd.coordinates("x y theta")))
    for name, x in (("left", -0.2), ("right", 0.2)):
        system.add_contact(sd.Contact(name, body, system.ground, shape=sd.contacts.Point([x, -0.1]), friction=0.4))
    return system.compile().simulate(np.linspace(0, 1, 101), q={"y": 0.2}, u={"x_dot": 1.0}, rtol=1e-10)


def test_arrows_are_at_the_contacts_along_their_forces(landing: Any) -> None:
    at, forces = arrows.touching(landing)
    lands = np.sqrt(0.2 / G)
    assert np.isnan(at[landing.t < lands]).all() and np.isfinite(at[landing.t > lands + 0.02]).all()
    assert at[-1] == pytest.approx(np.array([[landing["x"][-1] - 0.2, 0, 0], [landing["x"][-1] + 0.2, 0, 0]]), abs=1e-9)
    assert forces[-1].sum(axis=0) == pytest.approx([0, 2 * G, 0], abs=1e-9)
    slides = int(np.searchsorted(landing.t, lands)) + 1
    assert forces[slides].sum(axis=0) == pytest.approx([-0.4 * 2 * G, 2 * G, 0], rel=1e-9)
    drawing = Drawing.of(landing)
    assert drawing is not None
    (drawn,) = drawing.arrows
    ways = drawn.ways
    parallel = ways[slides, :, 0] * forces[slides, :, 1] - ways[slides, :, 1] * forces[slides, :, 0]
    assert np.abs(parallel).max() < 1e-12
    assert (ways[slides:, :, 1] > 0).all()


def test_heads_of_arrows_end_at_their_tips() -> None:
    for n in (2, 3):
        tails, tips = np.zeros((2, n)), np.eye(n)[[0, -1]] * 2.0
        curve = arrows.straight(tails, tips).reshape(2, -1, n)
        assert np.isnan(curve[:, -1]).all() and (curve[:, 1] == tips).all()
        barbs = curve[:, 2:-1:2]
        assert np.linalg.norm(barbs - tips[:, None], axis=2) == pytest.approx(2 * np.hypot(arrows.HEAD, arrows.WIDTH))
        assert barbs.shape[1] == 2 * (n - 1)
        torque = arrows.straight(tails, tips, 2).reshape(2, -1, n)
        assert np.nanmax(np.abs(torque[:, :-1] - tips[:, None] * (1 - arrows.BEHIND)).sum(axis=2).min(axis=1)) < 1e-12
    forces = np.array([[[1.0, 0, 0]], [[1.0, 0, 0]], [[100.0, 0, 0]]])
    ways = arrows.Arrows("contacts", ["one"], 0 * forces, forces, arrows.LENGTH, arrows.LENGTH * arrows.LONGEST).ways
    assert ways[:, 0, 0].tolist() == pytest.approx([arrows.LENGTH, arrows.LENGTH, 2 * arrows.LENGTH])


def test_plots_mark_changes_of_modes_and_films_have_arrows(landing: Any, tmp_path: Path) -> None:
    figure = landing.plot()
    lands, rests = landing.contacts["left"].switches[1][0], landing.contacts["left"].switches[-1][0]
    marks = {float(np.asarray(line.get_xdata())[0]) for line in figure.axes[0].lines if line.get_linestyle() == ":"}
    assert {lands, rests} <= marks
    shown = landing.picture(1.0).axes[0]
    curves = [line for line in shown.lines if line.get_color() == arrows.COLORS["contacts"]]
    assert len(curves) == 2 and np.asarray(curves[1].get_xdata()) == pytest.approx(landing["x"][-1] + np.array([-0.2, 0.2]))
    landing.animate(tmp_path / "film.gif", fps=5)
    assert (tmp_path / "film.gif").stat().st_size > 0


@pytest.mark.parametrize("formulation", ["recursive", "augmented", "absolute"])
def test_forces_are_the_same_in_every_formulation(formulation: str) -> None:
    system = sd.System("drop", gravity=[0, -G])
    y = sd.coordinates("y")
    body = system.add_body("ball", mass=2.0)
    system.add_joint(sd.Prismatic("height", system.ground, body, axis=[0, 1], coordinate=y))
    system.add_contact(sd.Contact("floor", body, system.ground))
    system.add_contact(sd.Contact("soft", body, system.ground, shape=(sd.contacts.Point(), sd.contacts.Plane([0, 1], [0, 0.01])),
                                  law="compliant", compliance=sd.contacts.Compliance(100.0, exponent=1)))
    absolute = formulation == "absolute"
    equations = system.augmented(coordinates="absolute") if absolute else getattr(system, formulation)()
    found = equations.compile().simulate((0, 0.1), rtol=1e-10)
    _, forces = arrows.touching(found)
    assert forces[-1] == pytest.approx(np.array([[0, 2 * G - 1, 0], [0, 1, 0]]), rel=1e-6)


def test_bodies_reach_to_the_corners_and_rims_that_they_touch_with(landing: Any) -> None:
    """A box of two corners is as large as they say, whatever its inertia; a wheel has the radius of its rim."""
    frames = landing.rows("frames").reshape(len(landing.t), -1, 12)
    mechanism = mechanism_of(landing, frames, 0)
    assert [body for body, _ in mechanism.corners] == [0, 0] and not mechanism.wheels
    items = [item for item in looks_of(mechanism)[0] if not item.layer]
    assert [item.kind for item in items] == ["box"] and items[0].size[:2] == pytest.approx((0.2, 0.1))
    system = sd.System("wheel", gravity=[0, -G])
    body = system.add_body("wheel", mass=2.0, inertia=0.03)
    system.add_joint(sd.Planar("free", system.ground, body, sd.coordinates("x y theta")))
    system.add_contact(sd.Contact("rim", body, system.ground, shape=sd.contacts.Sphere(0.3), friction=0.4))
    rolls = system.compile(backend="numpy").simulate((0, 0.5), q={"y": 0.3}, u={"x_dot": 1.0})
    mechanism = mechanism_of(rolls, rolls.rows("frames").reshape(len(rolls.t), -1, 12), 0)
    assert mechanism.wheels == pytest.approx({0: 0.3}) and not mechanism.corners
    (rod,) = [item for item in looks_of(mechanism)[0] if not item.layer]
    assert rod.kind == "rod" and rod.size == pytest.approx((0.3, 0.3))


def test_flat_ground_is_drawn_where_it_is_touched(landing: Any) -> None:
    axes = landing.picture(1.0).axes[0]
    strip = axes.patches[0].get_xy()
    assert strip[:, 1].max() == pytest.approx(0.0, abs=1e-9) and strip[:, 1].min() < -0.001
    (low, high), (left, right) = axes.get_xlim(), (strip[:, 0].min(), strip[:, 0].max())
    assert left < low and high < right


def test_pages_carry_the_forces_of_contacts(landing: Any) -> None:
    """As they are at the stored times, to sixteen bits."""
    data = json.loads(re.search(r'<script id="data"[^>]*>(.*?)</script>', landing.view().html, re.S)[1])["motions"][0]  # type: ignore[index]
    (contacts,) = data["arrows"]
    assert contacts["names"] == ["contact left", "contact right"] and contacts["layer"] == "contacts"
    assert data["grounds"] == [pytest.approx([0, 1, 0, 0], abs=1e-9)]
    packed = contacts["values"]
    columns = np.frombuffer(base64.b64decode(packed["data"]), "<u2").reshape(packed["columns"], -1)
    last = np.array(packed["low"]) + np.array(packed["step"]) * columns[:, -1]
    assert last.reshape(2, 2, 3)[:, 1].sum(axis=0) == pytest.approx([0, 2 * G, 0], abs=2e-3)
