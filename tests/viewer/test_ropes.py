"""Ropes in pictures: straight while they are taut, else catenaries of their length."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import symdyn as sd
from symdyn.pictures.ropes import rope
from tests.helpers import browser
from tests.viewer.test_views import Opened

pytest.importorskip("matplotlib")
UP = np.array([0.0, 0.0, 1.0])


def tethered() -> sd.System:
    """A ball that a force lifts from where its rope, whose length is the parameter l, is slack."""
    z, length = sd.coordinates("z"), sd.parameters("l")
    system = sd.System("tethered", gravity=[0, 0, -9.81])
    ball = system.add_body("ball", mass=1.0)
    system.add_joint(sd.Prismatic("guide", system.ground, ball, axis=[0, 0, 1], coordinate=z))
    system.add_force(ball, [0, 0, 15])
    system.add_contact(sd.Rope("tether", ball, "ground", length=length, point_b=[0.8, 0, 0]))
    system.set_defaults({length: 1.5})
    system.initial = {z: 0.2}
    return system


@pytest.mark.parametrize("a, b, length", [
    ([0, 0, 0], [1, 0, 0], 1.0002), ([0, 0, 0], [1, 0.5, 0.7], 1.9), ([0, 1, 2], [0.3, 0, -4], 6.5),
    ([0, 0, 0], [0.01, 0, 0], 8.0), ([0, 0, 0], [0, 0, 1], 3.0), ([2, 1, 0], [2, 1, 0], 1.0)])
def test_a_slack_rope_hangs_at_rest(a: list[float], b: list[float], length: float) -> None:
    """Its length is its own, and it holds its weight: horizontal forces are equal, vertical ones grow evenly along it."""
    found = rope(np.array(a, dtype=float), np.array(b, dtype=float), length, UP)
    np.testing.assert_allclose(found[[0, -1]], [a, b], atol=1e-9 * length)
    way = np.diff(found, axis=0)
    arcs = np.linalg.norm(way, axis=1)
    assert arcs.sum() == pytest.approx(length, rel=0.02) and arcs.sum() <= length * (1 + 1e-9)
    across = np.linalg.norm(way[:, :2], axis=1)
    if across.min() > 0.1 * arcs.min():  # chords have the slopes of their middles, but for the curvature
        np.testing.assert_allclose(np.diff(way[:, 2] / across, n=2), 0.0, atol=2e-2 * np.ptp(way[:, 2] / across))


def test_a_taut_rope_is_straight() -> None:
    found = rope(np.zeros(3), np.array([3.0, 0.0, 4.0]), 5.0, UP)
    np.testing.assert_allclose(np.linalg.norm(np.diff(found, axis=0), axis=1), 5 / 24)


def test_a_rope_sags_until_it_is_taut(tmp_path: Path) -> None:
    solution = tethered().compile(backend="numpy").simulate((0, 2))
    (connection,) = solution.module.metadata.connections
    assert connection == ("rope 'tether'", "ball", "ground", "rope")
    solution.view(tmp_path / "view.html")
    lowest = """() => { symdyn.stage.draw(false); const own = symdyn.scenes[0].picks.filter(p => p.name.startsWith("rope"));
        return [own.length, Math.min(...own.map(p => Math.min(p.a[2], p.b[2]))), own.map(p => [...p.a, ...p.b])]; }"""
    with browser() as opened, Opened(opened, tmp_path / "view.html") as page:
        pieces, low, ways = page.page.evaluate(lowest)
        assert pieces == 24 and low < -0.2
        wanted = rope(np.array([0, 0, 0.2]), np.array([0.8, 0, 0]), 1.5, UP)
        np.testing.assert_allclose(np.reshape(ways, (-1, 2, 3))[:, 1], wanted[1:], atol=2e-3)
        page.page.evaluate("t => { symdyn.scenes[0].source.seek(t) }", 2.0)
        pieces, low, _ = page.page.evaluate(lowest)
        assert pieces == 1 and low == pytest.approx(0, abs=1e-3)


def test_pictures_and_the_page_of_the_mechanism_show_ropes(tmp_path: Path) -> None:
    system = tethered()
    assert "polyline" in (system._repr_html_() or "")
    system.show(tmp_path / "show.html", params={"l": 2.5})
    with browser() as opened, Opened(opened, tmp_path / "show.html") as page:
        (item,) = [item for item in page.page.evaluate("symdyn.scenes[0].data.items") if item["kind"] == "rope"]
        assert item["size"][1] == pytest.approx(2.5)
