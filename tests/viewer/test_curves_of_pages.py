"""Curves of pages: marks where something happens, curves that are hidden and shown, and which are there."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.runtime.solutions.solution import Solution
from tests.helpers import CONTRAST, swept, values_of

pytest.importorskip("matplotlib")

from symdyn.pictures.marks import MOST_MARKS, events_of, switches_of
from symdyn.pictures.panels import panels_of
from symdyn.viewer.page import page_of

G, MU, DROP = 9.81, 0.4, 0.1
# When the box lands, and when friction, in the impact and after it, has taken its speed of 1 m/s.
LANDS = float(np.sqrt(2 * DROP / G))
RESTS = LANDS + (1 - MU * G * LANDS) / (MU * G)
STORED = sorted((Path(__file__).parents[2] / "notebooks" / "results").glob("*_view_*.json"))


@pytest.fixture(scope="module")
def landing() -> Solution:
    """A box that falls flat and slides to rest; before it lands it passes x = 0.1 at 0.1 s."""
    system = sd.System("box", gravity=[0, -G])
    body = system.add_body("box", mass=2.0, inertia=0.03)
    x, y, theta = sd.coordinates("x y theta")
    system.add_joint(sd.Planar("free", system.ground, body, [x, y, theta]))
    for name, at in (("left", -0.2), ("right", 0.2)):
        system.add_contact(sd.Contact(name, body, system.ground, shape=sd.contacts.Point([at, -0.1]), friction=MU))
    system.add_event("passes", x - 0.1)
    return system.compile(backend="numpy").simulate((0, 0.5), q={"y": 0.1 + DROP}, u={"x_dot": 1.0}, rtol=1e-9)


def opened(chromium: Any, path: Path, **options: Any) -> tuple[Any, list[str]]:
    said: list[str] = []
    page = chromium.new_page(viewport={"width": 1200, "height": 900}, **options)
    page.on("pageerror", lambda error: said.append(str(error)))
    page.goto(path.as_uri())
    page.wait_for_function("window.symdyn && symdyn.stage.frames > 0", timeout=20_000)
    return page, said


def data_of(html: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(html.split('type="application/json">')[1].split("</script>")[0].replace("<\\/", "</"))
    return found


def pixels(page: Any, which: int = 0) -> np.ndarray:
    """Pixels of the canvas of a plot, (rows, columns, 4)."""
    high, wide = page.evaluate("which => (c => [c.height, c.width])(document.querySelectorAll('.plot canvas')[which])", which)
    return values_of(page, """which => { const c = document.querySelectorAll(".plot canvas")[which];
        return c.getContext("2d").getImageData(0, 0, c.width, c.height).data; }""", which).reshape(high, wide, 4)


def column(page: Any, t: float) -> float:
    """Where a time is on the first plot, from the left end of its axis to the right."""
    box = page.query_selector(".plot canvas").bounding_box()
    ends = page.evaluate("""() => { const t = [], p = symdyn.scenes[0].source.t; return [p[0], p[p.length - 1]]; }""")
    return 54 + (t - ends[0]) / (ends[1] - ends[0]) * (box["width"] - 70)


def test_marks_are_where_something_happens(landing: Solution) -> None:
    """Events of rigid contacts are left to the marks of their modes."""
    assert "left_closes" in landing.events
    (passes,) = events_of(landing)
    assert passes.name == "passes" and passes.t == pytest.approx(0.1, abs=1e-7)
    found = switches_of(landing)
    assert [mark.name for mark in found] == ["left: impact", "left: sliding", "right: impact", "right: sliding",
                                             "left: sticking", "right: sticking"]
    assert [mark.t for mark in found] == pytest.approx([LANDS] * 4 + [RESTS] * 2, abs=1e-6)
    (motion,) = data_of(landing.view().html)["motions"]
    assert motion["marks"] == {"events": [list(passes)], "modes": [list(one) for one in found]}


def test_more_marks_than_can_be_seen_are_left_out() -> None:
    system = sd.systems.pendulum()
    system.add_event("lowest", sd.coordinates("q1"))
    solution = system.compile(backend="numpy").simulate((0, 100), q=[0.5], rtol=1e-4)
    assert len(solution.events["lowest"].t) > MOST_MARKS
    assert events_of(solution) == []
    some = system.compile(backend="numpy").simulate((0, 10), q=[0.5], rtol=1e-4)
    assert [mark.t for mark in events_of(some)] == some.events["lowest"].t.tolist()


def test_marks_are_drawn_and_named_under_the_pointer(landing: Solution, chromium: Any, tmp_path: Path) -> None:
    landing.view(tmp_path / "view.html")
    page, said = opened(chromium, tmp_path / "view.html")
    paper = pixels(page)
    blank = page.evaluate("getComputedStyle(document.body).getPropertyValue('--quiet')")
    color = [int(blank.strip()[k:k + 2], 16) for k in (1, 3, 5)]
    # A line on a whole pixel or between two of them: there it is half as dark.
    dark = (np.abs(paper[8:60, :, :3].astype(int) - (np.array(color) + 255) / 2).max(axis=2) < 75).sum(axis=0)
    places = {t: round(column(page, t)) for t in (0.1, LANDS, RESTS)}
    counts = {t: int(dark[x - 1:x + 2].max()) for t, x in places.items()}
    assert counts[0.1] > 20 and counts[LANDS] > 10 and counts[RESTS] > 10
    assert dark[places[RESTS] + 10:-20].max() < 8
    box = page.query_selector(".plot canvas").bounding_box()
    for t, text in ((0.1, "passes at 0.1 s"), (RESTS, f"left: sticking, right: sticking at {RESTS:.4g} s"),
                    (LANDS, f"left: impact, left: sliding, right: impact, right: sliding at {LANDS:.4g} s")):
        page.mouse.move(box["x"] + places[t] + 3, box["y"] + 50)
        assert page.text_content(".plot .tip >> nth=0") == text
        assert page.is_visible(".plot .tip >> nth=0")
    page.mouse.move(box["x"] + places[RESTS] + 12, box["y"] + 50)
    assert not page.is_visible(".plot .tip >> nth=0")
    page.mouse.move(box["x"] + places[RESTS], box["y"] + 50)
    page.mouse.move(10, 10)
    assert not page.is_visible(".plot .tip >> nth=0")
    page.close()
    assert said == []


def test_the_keyboard_goes_from_mark_to_mark(landing: Solution, chromium: Any, tmp_path: Path) -> None:
    landing.view(tmp_path / "view.html")
    page, said = opened(chromium, tmp_path / "view.html")
    curves = page.query_selector(".plot .curves")
    curves.focus()
    impact = f"left: impact, left: sliding, right: impact, right: sliding at {LANDS:.4g} s"
    passes, rests = "passes at 0.1 s", f"left: sticking, right: sticking at {RESTS:.4g} s"
    for key, text, t in (("ArrowRight", passes, 0.1), ("ArrowRight", impact, LANDS), ("ArrowLeft", passes, 0.1),
                         ("ArrowLeft", passes, 0.1), ("End", rests, RESTS), ("Home", passes, 0.1)):
        page.keyboard.press(key)
        assert page.is_visible(".plot .tip >> nth=0") and page.text_content(".plot .tip >> nth=0") == text
        assert float(page.input_value("#player input[type=range]")) == pytest.approx(t, abs=1e-3)
    assert "arrow keys go to events" in curves.get_attribute("aria-label")
    page.keyboard.press("Tab")
    assert not page.is_visible(".plot .tip >> nth=0")
    page.close()
    assert said == []


@pytest.mark.parametrize("dark", swept([False, True], False))
def test_curves_are_hidden_and_shown_by_mouse_and_keyboard(dark: bool, landing: Solution, chromium: Any, tmp_path: Path) -> None:
    """x and y in metres: without y the axis ends at the greatest x."""
    landing.view(tmp_path / "view.html")
    page, said = opened(chromium, tmp_path / "view.html", color_scheme="dark" if dark else "light")
    first, second = page.query_selector_all(".plot >> nth=0 >> .entry button")
    colors = [[int(c[k:k + 2], 16) for k in (1, 3, 5)] for c in page.evaluate("PALETTE.slice(0, 2)")]

    def tops() -> list[int | None]:
        """The first row that each curve is in; a few pixels of its colour are none."""
        found = pixels(page)[..., :3].astype(int)
        own = [np.abs(found - color).max(axis=2) < 24 for color in colors]
        return [int(np.flatnonzero(one.any(axis=1))[0]) if one.sum() > 30 else None for one in own]

    assert [one.get_attribute("aria-label") for one in (first, second)] == ["x", "y"]
    assert [one.get_attribute("aria-pressed") for one in (first, second)] == ["true", "true"]
    whole = tops()
    # The greatest y, 0.2 m at the start, is at the top, the greatest x below.
    assert whole[1] is not None and whole[1] < 10 and whole[0] is not None and whole[0] > 20
    second.click()
    alone = tops()
    assert second.get_attribute("aria-pressed") == "false" and alone[0] is not None and alone[0] < 10 and alone[1] is None
    assert page.evaluate(CONTRAST) == []
    first.focus()
    page.keyboard.press("Space")
    assert first.get_attribute("aria-pressed") == "false" and tops() == [None, None]
    assert page.get_attribute("button.play", "aria-label") == "Play"
    page.keyboard.press("Enter")
    assert first.get_attribute("aria-pressed") == "true" and tops() == alone
    second.focus()
    page.keyboard.press("Enter")
    assert second.get_attribute("aria-pressed") == "true" and tops() == whole
    page.close()
    assert said == []


def test_the_curves_of_a_page_are_chosen_as_those_of_plots(landing: Solution) -> None:
    y = sd.coordinates("y")
    for show in (None, ["coordinates"], ["x", "energy"], [y, "speeds", "mechanism"]):
        (motion,) = data_of(landing.view(show=show).html)["motions"]
        assert [panel["names"] for panel in motion["panels"]] == [
            [name.replace("\n", " ") for name in panel.names] for panel in panels_of(landing, show)]
    assert data_of(landing.view(show=["mechanism"]).html)["motions"][0]["panels"] == []
    both = data_of(landing.view(compare=landing, show=["theta"]).html)["motions"]
    assert [[panel["names"] for panel in motion["panels"]] for motion in both] == [[["theta"]]] * 2


@pytest.mark.parametrize("show", [["omega", "x"], "energy", [1.0], ["outputs"], []])
def test_what_cannot_be_chosen_is_reported_as_by_plots(show: Any, landing: Solution) -> None:
    with pytest.raises(sd.ArgumentError) as of_plot:
        landing.plot(show=show)
    with pytest.raises(sd.ArgumentError) as of_page:
        landing.view(show=show)
    assert str(of_page.value) == str(of_plot.value)


@pytest.mark.parametrize("stored", swept(STORED, STORED[0]), ids=lambda path: path.stem)
def test_stored_pages_without_marks_are_drawn(stored: Path, chromium: Any, tmp_path: Path) -> None:
    view = json.loads(stored.read_text(encoding="utf-8"))
    for motion in view["data"].get("motions", ()):
        motion.pop("marks", None)
    page_of(view["name"], view["data"], view["functions"], tmp_path / "view.html")
    page, said = opened(chromium, tmp_path / "view.html")
    curves = sum(len(panel["names"]) for motion in view["data"].get("motions", ()) for panel in motion["panels"])
    assert len(page.query_selector_all(".plot .entry button[aria-pressed=true]")) == curves
    if curves:
        box = page.query_selector(".plot canvas").bounding_box()
        page.mouse.move(box["x"] + 300, box["y"] + 50)
        assert not page.is_visible(".plot .tip >> nth=0")
        assert len(np.unique(pixels(page)[..., :3].reshape(-1, 3), axis=0)) > 3
    page.close()
    assert said == []
