"""Ropes and mooring lines in pictures: straight while they are taut, else as they hang."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.pictures.drawing import Drawing
from symdyn.pictures.mechanism import mechanism_of
from symdyn.pictures.ropes import mooring, rope
from symdyn.runtime.solutions.solution import Solution
from tests.viewer.test_grounds import data_of
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


def test_a_rope_sags_until_it_is_taut(chromium: Any, tmp_path: Path) -> None:
    solution = tethered().compile(backend="numpy").simulate((0, 2))
    (connection,) = solution.module.metadata.connections
    assert connection == ("rope 'tether'", "ball", "ground", "rope")
    solution.view(tmp_path / "view.html")
    lowest = """() => { symdyn.stage.draw(false); const own = symdyn.scenes[0].picks.filter(p => p.name === "rope 'tether'");
        return [own.length, Math.min(...own.map(p => Math.min(p.a[2], p.b[2]))), own.map(p => [...p.a, ...p.b])]; }"""
    with Opened(chromium, tmp_path / "view.html") as page:
        pieces, low, ways = page.page.evaluate(lowest)
        assert pieces == 24 and low < -0.2
        wanted = rope(np.array([0, 0, 0.2]), np.array([0.8, 0, 0]), 1.5, UP)
        np.testing.assert_allclose(np.reshape(ways, (-1, 2, 3))[:, 1], wanted[1:], atol=2e-3)
        page.page.evaluate("t => { symdyn.scenes[0].source.seek(t) }", 2.0)
        pieces, low, _ = page.page.evaluate(lowest)
        assert pieces == 1 and low == pytest.approx(0, abs=1e-3)


def test_pictures_and_the_page_of_the_mechanism_show_ropes(chromium: Any, tmp_path: Path) -> None:
    system = tethered()
    assert "polyline" in (system._repr_html_() or "")
    system.show(tmp_path / "show.html", params={"l": 2.5})
    with Opened(chromium, tmp_path / "show.html") as page:
        (item,) = [item for item in page.page.evaluate("symdyn.scenes[0].data.items") if item["kind"] == "rope"]
        assert item["size"][1] == pytest.approx(2.5)


# -- mooring lines


@pytest.mark.parametrize("reach, height, length", [(0.3, 0.2, 1.0), (2.0, 150.0, 470.0), (400.0, 50.0, 900.0)])
def test_a_mooring_line_touches_down_as_the_closed_form_has_it(reach: float, height: float, length: float) -> None:
    """A stiff line on a seabed without friction: with the horizontal force w a its hanging part is sqrt(z^2 + 2 a z) long, and is
    the catenary a (cosh(x / a) - 1) from where it touches down."""
    a = reach
    hangs = np.sqrt(height**2 + 2 * a * height)
    lies = length - hangs
    x = lies + a * np.arccosh(1 + height / a)
    found = mooring(np.array([0.6 * x, 0.8 * x, height]), np.zeros(3), length, 0.0, 0.0, True)
    np.testing.assert_allclose(found[[0, -1]], [[0.6 * x, 0.8 * x, height], [0, 0, 0]], atol=1e-7 * length)
    np.testing.assert_allclose(found[:, 0] * 0.8, found[:, 1] * 0.6, atol=1e-9 * length)
    along = found[:, :2] @ [0.6, 0.8]
    wanted = np.where(along > lies, a * (np.cosh((along - lies) / a) - 1), 0.0)
    np.testing.assert_allclose(found[:, 2], wanted, atol=1e-6 * length)
    assert along[-2] == pytest.approx(lies, rel=1e-6) and (along[:-2] > lies).all()


def test_a_mooring_line_that_hangs_freely_is_the_catenary_of_ropes() -> None:
    """Stiff, and without a seabed; it sags below both of its ends."""
    a, b = np.array([3.0, 1.0, 1.0]), np.array([0.0, 0.0, 0.5])
    found, wanted = mooring(a, b, 4.0, 0.0, 0.0, False), rope(a, b, 4.0, UP)
    np.testing.assert_allclose(found, wanted, atol=1e-8)
    assert found[:, 2].min() < -0.3


@pytest.mark.parametrize("friction", [0.0, 0.4, 1.0])
def test_an_elastic_mooring_line_is_in_equilibrium(friction: float) -> None:
    """Slopes dz/dx are the vertical force, which grows by the weight, over the horizontal one. On the seabed friction takes
    tension: of the line that lies the length r = h / C_B is stretched, by h r - C_B r^2 / 2."""
    give, length = 0.02, 100.0
    found = mooring(np.array([95.0, 0.0, 20.0]), np.zeros(3), length, give, friction, True)
    np.testing.assert_allclose(found[[0, -1]], [[95, 0, 20], [0, 0, 0]], atol=1e-6)
    way = np.diff(found[:-1], axis=0)[::-1]
    slopes, chords = way[:, 2] / way[:, 0], np.linalg.norm(way, axis=1)
    np.testing.assert_allclose(np.diff(slopes, 2), 0.0, atol=3e-3 * np.ptp(slopes))
    # A piece of the unstretched length L d weighs d: it changes the slope by d / h; where it leaves the seabed its tension is h.
    growth = float(np.diff(slopes).mean())
    d = chords[0] / length
    for _ in range(20):
        d = chords[0] / length / (1 + give * d / growth)
    h, lies = d / growth, 1 - 23 * d
    tense = min(lies, h / friction) if friction else lies
    assert found[-2, 2] == pytest.approx(0, abs=1e-9) and lies > 0.1
    assert found[-2, 0] / length == pytest.approx(lies + give * (h * tense - friction * tense**2 / 2), abs=5e-4)


def test_slack_mooring_lines_hang_straight_down_and_without_a_shape_are_straight() -> None:
    slack = mooring(np.array([2.0, 0.0, 5.0]), np.zeros(3), 20.0, 0.0, 1.0, True)
    above = slack[slack[:, 2] > 0]
    assert len(above) == 23 and slack[-2] == pytest.approx([2, 0, 0])
    np.testing.assert_allclose(above[:, 0], 2.0, atol=1e-9)
    assert (np.diff(slack[:, 0]) <= 0).all() and slack[-1] == pytest.approx(np.zeros(3))
    below = mooring(np.array([2.0, 0.0, -1.0]), np.zeros(3), 20.0, 0.0, 1.0, True)
    np.testing.assert_allclose(below, np.linspace(1, 0, 25)[:, None] * [2, 0, -1], atol=1e-12)


@pytest.fixture(scope="module")
def buoy() -> Iterator[Solution]:
    """One line, whose fairlead heaves."""
    z, length = sd.coordinates("z"), sd.parameters("L")
    system = sd.System("buoy", gravity=[0, 0, -9.81])
    body = system.add_body("buoy", mass=500.0, inertia=[50.0] * 3)
    system.add_joint(sd.Prismatic("heave", system.ground, body, axis=[0, 0, 1], coordinate=z))
    system.add_force(body, [0, 0, 7000 - 2000 * z])
    system.add_load(sd.MooringLine(body, [0.5, 0, 0], [60, 0, -20], length=length, weight=100, stiffness=1e6, friction=0.5))
    system.set_defaults({length: 66.0})
    yield system.compile(backend="numpy").simulate((0, 3), q=[0.5])


def test_mooring_lines_hang_in_stills_at_every_time(buoy: Solution) -> None:
    """As far as is shown of them, by the length that is a parameter."""
    drawing = Drawing.of(buoy)
    assert drawing is not None and drawing.solids is not None and drawing.solids.forms is not None
    (number,) = [k for k, form in enumerate(drawing.solids.forms.forms) if form.item.kind == "mooring"]
    shown = drawing.solids.forms.forms[number].item.size[1]
    for k in (0, len(buoy.t) // 2, -1):
        top = np.array([0.5, 0, buoy["z"][k]])
        found = drawing.solids.forms.vertices(drawing.solids.origins[k], drawing.solids.rotations[k])[number]
        np.testing.assert_allclose(found, mooring(top, np.array([60.0, 0, -20]), 66.0, 66 * 100 / 1e6, 0.5, True, shown))
        assert found[0] == pytest.approx(top) and np.linalg.norm(np.diff(found, axis=0), axis=1).sum() == pytest.approx(
            shown, rel=0.02
        )


def test_pages_draw_mooring_lines_as_python_does(buoy: Solution, chromium: Any, tmp_path: Path) -> None:
    """In a motion at two of its times; and for lines of all kinds: to the tolerance of Newton's method."""
    buoy.view(tmp_path / "view.html")
    rng = np.random.default_rng(8)
    lines = [
        (rng.uniform(0.01, 1.2), rng.uniform(0.02, 0.9), rng.choice([0, 1e-3, 0.05]), rng.choice([0.0, 0.3, 1.0]), bool(s))
        for s in rng.integers(0, 2, 200)
    ]
    with Opened(chromium, tmp_path / "view.html") as page:
        for k in (0, -1):
            ways = page.page.evaluate(
                """t => { symdyn.scenes[0].source.seek(t); symdyn.stage.draw(false);
                return symdyn.scenes[0].picks.filter(p => p.name.includes("mooring")).map(p => p.b); }""",
                float(buoy.t[k]),
            )
            wanted = mooring(np.array([0.5, 0, buoy["z"][k]]), np.array([60.0, 0, -20]), 66.0, 66 * 100 / 1e6, 0.5, True)
            np.testing.assert_allclose(ways, wanted[1:], atol=2e-3)
        found = page.page.evaluate(
            "ls => ls.map(([x, z, e, f, s]) => mooringOf([x, 0, z], [0, 0, 0], 1, e, f, s))",
            [[float(v) if not isinstance(v, bool) else v for v in one] for one in lines],
        )
    straight = 0
    for (x, z, e, f, seabed), points in zip(lines, found, strict=True):
        wanted = mooring(np.array([x, 0, z]), np.zeros(3), 1.0, e, f, seabed)
        if len(points) == 2:  # no shape at rest: straight in both
            straight += 1
            np.testing.assert_allclose(np.diff(wanted, 2, axis=0), 0, atol=1e-12)
        else:
            np.testing.assert_allclose(points, wanted, atol=1e-9)
    assert straight < 60


def test_the_page_of_the_mechanism_has_its_mooring_lines(buoy: Solution) -> None:
    """Those of the barge, in the order of the loads."""
    frames = buoy.rows("frames").reshape(len(buoy.t), -1, 12)
    (line,) = mechanism_of(buoy, frames, 0).around.lines.values()
    assert (line.length, line.give, line.friction, line.seabed) == (66.0, pytest.approx(6.6e-3), 0.5, True)
    data = data_of(sd.systems.floating_wind_turbine().show().html)
    own = [item for item in data["items"] if item["kind"] == "mooring"]
    assert [item["name"] for item in own] == [f"mooring line {k} (mooring line)" for k in range(1, 9)]
    assert own[0]["size"][2] == pytest.approx(473.312)
