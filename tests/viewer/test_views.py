"""Pages with mechanisms and motions, opened in a browser: what they draw, compute, ask for and can be used with."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import symdyn as sd
from symdyn.cli import main
from symdyn.runtime.solutions.solution import Solution
from symdyn.viewer import View
from tests.firefox import Firefox, FirefoxPage, firefox
from tests.helpers import CONTRAST, swept, values_of
from tests.user_functions import HEIGHT

pytest.importorskip("matplotlib")

from symdyn.pictures.looks import METAL


@pytest.fixture(scope="session")
def of_firefox() -> Iterator[Firefox]:
    with firefox() as opened:
        yield opened


@pytest.fixture(params=["chromium", "of_firefox"])
def every_browser(request: pytest.FixtureRequest) -> Any:
    return request.getfixturevalue(request.param)


# For tests that Firefox has in the sweep.
in_chromium = pytest.mark.parametrize("every_browser", swept(["chromium", "of_firefox"], "chromium"), indirect=True)


class Opened:
    """A page from the disk; what it asks for and says is a failure."""

    def __init__(self, opened: Any, path: Path, wide: int = 1280, high: int = 800, dark: bool = False) -> None:
        self.said: list[str] = []
        self.page = opened.new_page(viewport={"width": wide, "height": high}, color_scheme="dark" if dark else "light")
        if not isinstance(self.page, FirefoxPage):  # which is asked in the end
            self.page.on("pageerror", lambda error: self.said.append(str(error)))
            self.page.on("console", lambda message: self.said.append(message.text))
            own = (path.as_uri(), "data:")
            self.page.on("request", lambda request: request.url.startswith(own) or self.said.append(request.url))
        self.page.goto(path.as_uri())
        self.page.wait_for_function("window.symdyn && symdyn.stage.frames > 0", timeout=20_000)

    def __enter__(self) -> Opened:
        return self

    def __exit__(self, *error: object) -> None:
        if isinstance(self.page, FirefoxPage):
            self.said += self.page.said()
        self.page.close()
        if error[0] is None:
            assert self.said == []

    def pixels(self) -> np.ndarray:
        """The picture as the last frame has it, (n, 4)."""
        return values_of(self.page, """() => { const s = symdyn.stage, gl = s.renderer.gl; s.draw(false);
            const p = new Uint8Array(4 * s.canvas.width * s.canvas.height);
            gl.readPixels(0, 0, s.canvas.width, s.canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, p);
            return p; }""").reshape(-1, 4)

    def slide(self, name: str, value: float) -> None:
        """Move a slider as its user does."""
        self.page.evaluate("""([name, value]) => { const s = document.querySelector(`input[data-name="${name}"]`);
            s.step = "any"; s.value = value; s.dispatchEvent(new Event("input")); }""", [name, value])


@pytest.fixture(scope="module")
def arm() -> Solution:
    return sd.systems.two_link_arm().compile(backend="numpy").simulate((0, 3))


# -- the mechanism


@pytest.mark.every_value
@pytest.mark.parametrize("name", swept(["two_link_arm", "four_bar", "puma560"], "four_bar", "puma560"))
def test_a_mechanism_is_drawn_and_a_slider_moves_it(name: str, every_browser: Any, tmp_path: Path) -> None:
    system = sd.systems.get(name)
    view = system.show(tmp_path / "view.html")
    assert isinstance(view, View) and view.path == tmp_path / "view.html" and len(view.html) < 3e6
    with Opened(every_browser, tmp_path / "view.html") as opened:
        before = opened.pixels()
        assert len(np.unique(before[:, :3], axis=0)) > 50
        assert (before[:, :3] != before[0, :3]).any(axis=1).mean() > 0.01
        first = opened.page.evaluate("symdyn.scenes[0].data.sliders[0]")
        opened.slide(first["name"], first["value"] + 0.5)
        assert (opened.pixels() != before).any(axis=1).mean() > 0.005


@pytest.mark.parametrize("name", swept(["two_link_arm", "puma560", "floating_wind_turbine", "four_bar"], "puma560"))
def test_kinematics_of_the_page_are_those_of_the_module(name: str, chromium: Any, tmp_path: Path) -> None:
    system = sd.systems.get(name)
    system.show(tmp_path / "view.html")
    module = system.compile()
    rng = np.random.default_rng(4)
    p = module.parameters() * rng.uniform(0.9, 1.1, len(module.metadata.parameters))
    functions = [f for f in ("frames", "positions", "joint_points", "joint_axes") if f in module.functions]
    with Opened(chromium, tmp_path / "view.html") as opened:
        for _ in range(3):
            q = rng.uniform(-1.5, 1.5, module.metadata.sizes.q)
            found = opened.page.evaluate("""([names, q, p]) => { const f = symdyn.scenes[0].source.functions;
                const at = { q, p, inputs: [], u: [], t: 0 }; at.c = f.prologue(at);
                return names.map(n => f[n](at)); }""", [functions, q.tolist(), p.tolist()])
            x = np.concatenate([q, np.zeros(module.metadata.sizes.x - len(q))])
            inputs = np.zeros(module.metadata.sizes.inputs)
            for function, values in zip(functions, found, strict=True):
                wanted = module.evaluate(function, 0.0, x, p, inputs).ravel()
                np.testing.assert_allclose(values, wanted, rtol=0, atol=1e-13 * max(1.0, np.abs(wanted).max()))


@in_chromium
def test_loops_stay_closed(every_browser: Any, tmp_path: Path) -> None:
    """Dependent coordinates follow the one that is moved; where the loop cannot close, all stays."""
    system = sd.systems.four_bar()
    system.show(tmp_path / "view.html")
    module = system.compile(backend="numpy")
    with Opened(every_browser, tmp_path / "view.html") as opened:
        for name, value in (("q1", 1.6), ("q1", 0.7), ("l2", 2.2)):
            opened.slide(name, value)
            values = opened.page.evaluate("symdyn.scenes[0].source.values")
            order = module.metadata.q if name in module.metadata.q else module.metadata.parameters
            assert values["q" if name in module.metadata.q else "p"][order.index(name)] == pytest.approx(value, abs=1e-12)
            x = np.concatenate([values["q"], np.zeros(module.metadata.sizes.u)])
            assert np.abs(module.evaluate("C", 0.0, x, np.array(values["p"]), np.zeros(0))).max() < 1e-9
        q = opened.page.evaluate("symdyn.scenes[0].source.values.q")
        opened.slide("l2", 30.0)
        assert "cannot be closed" in opened.page.text_content("#note")
        np.testing.assert_allclose(opened.page.evaluate("symdyn.scenes[0].source.values.q"), q)


def test_numbers_of_sliders_are_not_rounded_to_zero(chromium: Any, tmp_path: Path) -> None:
    """A start that is small against the range of its slider is shown; what is rounding is zero."""
    sd.systems.floating_wind_turbine().show(tmp_path / "view.html", q={"x": -0.0123, "y": 1e-12})
    with Opened(chromium, tmp_path / "view.html") as opened:
        shown = opened.page.eval_on_selector_all("#sliders .slider output", "all => all.map(e => e.textContent)")
        ranges = [s["most"] - s["least"] for s in opened.page.evaluate("symdyn.scenes[0].data.sliders")[:2]]
        assert ranges[0] > 12.3, ranges
        assert shown[:2] == ["-0.012", "0"]


def test_names_with_several_indices_are_typeset(chromium: Any, tmp_path: Path) -> None:
    """Coordinates that joints name, as plots have them: the letter with its indices, without underscores."""
    system = sd.System("box", gravity=[0, -9.81])
    system.add_joint(sd.Planar("free", system.ground, system.add_body("box", mass=1, inertia=1)))
    system.show(tmp_path / "view.html")
    with Opened(chromium, tmp_path / "view.html") as opened:
        symbols = opened.page.eval_on_selector_all("#sliders .symbol", "all => all.map(e => e.innerHTML)")
        assert symbols == [f"<var>q</var><sub>free, {k}</sub>" for k in (1, 2, 3)]
        made = opened.page.evaluate("""["q_free_1_dot", "theta_1_dot", "x_dot", "steer_dot", "r_ball_p"].map(
            name => symbol(document.createElement("p"), name).innerHTML)""")
        assert made == ["<var>q\u0307</var><sub>free, 1</sub>", "<var>\u03b8\u0307</var><sub>1</sub>", "<var>x\u0307</var>",
                        "steer_dot", "<var>r</var><sub>ball, p</sub>"]


def test_euler_parameters_keep_unit_length(chromium: Any, tmp_path: Path) -> None:
    system = sd.System("top", gravity=[0, 0, -9.81])
    body = system.add_body("body", mass=1, inertia=[0.1, 0.2, 0.3])
    system.add_joint(sd.Free("free", system.ground, body, orientation=sd.EulerParameters()))
    system.show(tmp_path / "view.html")
    with Opened(chromium, tmp_path / "view.html") as opened:
        name = opened.page.evaluate("symdyn.scenes[0].data.sliders[symdyn.scenes[0].data.unit_groups[0][1]].name")
        opened.slide(name, 0.6)
        q = np.array(opened.page.evaluate("symdyn.scenes[0].source.values.q"))
        group = opened.page.evaluate("symdyn.scenes[0].data.unit_groups[0]")
        assert q[group[1]] == 0.6 and np.linalg.norm(q[group]) == pytest.approx(1.0, abs=1e-14)


def test_names_under_the_pointer(chromium: Any, tmp_path: Path) -> None:
    sd.systems.two_link_arm().show(tmp_path / "view.html")
    with Opened(chromium, tmp_path / "view.html") as opened:
        found = set()
        for point in ("0.5 * (p[0] + p[3])", "p[3]", "p[0]"):
            box = opened.page.locator("#canvas").bounding_box()
            x, y, _ = opened.page.evaluate(f"""() => {{ const s = symdyn.scenes[0].source, e = k => {{
                const p = [s.points[k], 0, 0, s.points[6 + k]]; return {point}; }};
                return symdyn.stage.project([e(0), e(1), e(2)]); }}""")
            opened.page.mouse.move(box["x"] + x, box["y"] + y)
            found.add(opened.page.text_content("#tip"))
        assert found == {"link1", "elbow (revolute)", "shoulder (revolute)"}


def test_names_over_the_picture_do_not_cover_each_other(chromium: Any, tmp_path: Path) -> None:
    sd.systems.puma560().show(tmp_path / "view.html")
    with Opened(chromium, tmp_path / "view.html", 700, 500) as opened:
        opened.page.get_by_label("names").check()
        opened.page.evaluate("symdyn.stage.draw(false)")
        boxes = np.array(opened.page.evaluate("""[...document.querySelectorAll("#names span")].filter(
            e => e.checkVisibility()).map(e => e.getBoundingClientRect()).map(b => [b.left, b.top, b.right, b.bottom])"""))
        over = (boxes[:, None, :2] < boxes[None, :, 2:]).all(axis=2) & (boxes[None, :, :2] < boxes[:, None, 2:]).all(axis=2)
        assert len(boxes) >= 8 and over.sum() == len(boxes)


# -- the motion


def test_a_motion_plays_and_is_scrubbed(arm: Solution, every_browser: Any, tmp_path: Path) -> None:
    arm.view(tmp_path / "view.html")
    with Opened(every_browser, tmp_path / "view.html") as opened:
        before = opened.pixels()
        opened.slide("t", 1.234)
        assert (opened.pixels() != before).any(axis=1).mean() > 0.001
        found = np.array(opened.page.evaluate("Array.from(symdyn.scenes[0].source.points)")).reshape(-1, 3)
        n_j = len(arm.module.metadata.reactions)
        x = arm(1.234)
        wanted = arm.module.evaluate("positions", 1.234, x, arm.params, np.zeros(arm.module.metadata.sizes.inputs)).reshape(-1, 3)
        np.testing.assert_allclose(found[2 * n_j:2 * n_j + 2], wanted, atol=3e-3)
        assert opened.page.evaluate("document.querySelector('.cursor').style.transform") != ""
        opened.page.click("button.play")
        opened.page.wait_for_function("symdyn.scenes[0].source.time > 1.3", timeout=20_000)
        opened.page.click("button.play")
        assert opened.page.get_attribute("button.play", "aria-label") == "Play"


def test_follow_trail_and_comparison(arm: Solution, chromium: Any, tmp_path: Path) -> None:
    other = arm.module.simulate((0, 2), q=[0.0, 0.1])
    arm.view(tmp_path / "view.html", compare=other, forces=True)
    with Opened(chromium, tmp_path / "view.html") as opened:
        before = opened.pixels()
        opened.page.select_option("#tools .choice >> nth=1 >> select", "-1")
        trails = opened.pixels()
        assert (trails != before).any(axis=1).sum() > 100
        opened.page.select_option("#tools .choice >> nth=0 >> select", "1")
        start = opened.page.evaluate("symdyn.stage.target")
        opened.slide("t", 1.0)
        moved = np.subtract(opened.page.evaluate("symdyn.stage.target"), start)
        body = arm.module.metadata.bodies.index("link2")
        way = arm(1.0)
        idle = np.zeros(arm.module.metadata.sizes.inputs)
        frames = [arm.module.evaluate("frames", t, x, arm.params, idle).reshape(-1, 12)[body, :3]
                  for t, x in ((0.0, arm.x[0]), (1.0, way))]
        np.testing.assert_allclose(moved, frames[1] - frames[0], atol=3e-3)
        force = np.array(opened.page.evaluate(
            "symdyn.scenes[0].source.arrows.find(a => a.layer === 'forces').now")).reshape(-1, 3)
        k = int(np.abs(arm.t - 1.0).argmin())
        wanted = arm.reactions["shoulder"]
        np.testing.assert_allclose(force[0], wanted[k, :3], atol=0.01 * np.abs(wanted).max())


def test_the_camera_goes_along_with_a_motion_that_goes_far(arm: Solution, chromium: Any, tmp_path: Path) -> None:
    """A disc that rolls many diameters is followed from the start, and stays as large; an arm on its stand is not followed."""
    rolled = sd.systems.rolling_disc().compile().simulate((0, 5), rtol=1e-6)
    radius = float(rolled.module.default_parameters[rolled.module.metadata.parameters.index("R")])
    assert np.linalg.norm(np.ptp(rolled.q[:, :2], axis=0)) > 8 * 2 * radius
    followed = "document.querySelector('#tools .choice select').value"
    rolled.view(tmp_path / "disc.html")
    with Opened(chromium, tmp_path / "disc.html") as opened:
        assert opened.page.evaluate(followed) == "0"
        for t in (0.0, 3.0, 5.0):
            opened.slide("t", t)
            target, eye = np.array(opened.page.evaluate("[symdyn.stage.target, symdyn.stage.eye[0]]"))
            assert np.linalg.norm(target - rolled(t)[:3]) < 0.1 * radius
            assert 2 * radius < np.linalg.norm(eye - target) < 10 * radius
        opened.page.keyboard.press("Home")
        assert opened.page.evaluate(followed) == "0"
    arm.view(tmp_path / "arm.html")
    with Opened(chromium, tmp_path / "arm.html") as opened:
        assert opened.page.evaluate(followed) == "-1"


def test_thinning_keeps_what_the_eye_sees(arm: Solution) -> None:
    from symdyn.viewer.recorded import _error, _quaternions, _rows

    frames = arm.frames.reshape(len(arm.t), -1, 12)
    rows = _rows(arm.t, frames, 1.0)
    assert len(rows) < len(arm.t) / 2 and _error(arm.t, frames, rows, 1.0) <= 1.0
    q = _quaternions(frames[..., 3:].reshape(*frames.shape[:2], 3, 3))
    w, x, y, z = np.moveaxis(q, -1, 0)
    np.testing.assert_allclose(1 - 2 * (y * y + z * z), frames[..., 3], atol=1e-12)
    np.testing.assert_allclose(2 * (x * y + w * z), frames[..., 6], atol=1e-12)


def test_ten_minutes_of_the_turbine() -> None:
    """Twenty stored times a second, its rotor turning."""
    module = sd.systems.floating_wind_turbine().compile()
    motion = module.simulate(np.linspace(0, 600, 12_001), u={"azimuth_dot": 1.2})
    assert len(motion.t) == 12_001 and len(motion.view().html) < 8e6


# -- the page as a page


@in_chromium
def test_forces_of_contacts_can_be_seen_and_hidden(every_browser: Any, tmp_path: Path) -> None:
    """A box that has come to rest on its corners: two arrows, with their names under the pointer; the ground stays."""
    system = sd.System("box", gravity=[0, -9.81])
    body = system.add_body("box", mass=2.0, inertia=0.03)
    system.add_joint(sd.Planar("free", system.ground, body, sd.coordinates("x y theta")))
    for name, x in (("left", -0.2), ("right", 0.2)):
        system.add_contact(sd.Contact(name, body, system.ground, shape=sd.contacts.Point([x, -0.1]), friction=0.4))
    system.compile(backend="numpy").simulate((0, 0.4), q={"y": 0.11}).view(tmp_path / "view.html")
    with Opened(every_browser, tmp_path / "view.html") as opened:
        opened.slide("t", 0.4)
        shown = opened.pixels()
        opened.page.click("#tools .check:last-of-type input")
        assert (opened.pixels() != shown).any(axis=1).sum() > 50
        opened.page.click("#tools .check:last-of-type input")
        assert (opened.pixels() == shown).all()
        # In the middle of the arrow, 0.22 of the length above the corner.
        name = opened.page.evaluate("""() => { const s = symdyn.stage, at = symdyn.scenes[0].source.arrows[0].now.slice(0, 3);
            return s.pick(...s.project([at[0], at[1] + 0.1 * s.length, at[2]])); }""")
        assert name == "contact left: 9.810 N"


def test_fingers_turn_and_zoom(arm: Solution, chromium: Any, tmp_path: Path) -> None:
    """One finger turns the picture; two that part come nearer."""
    arm.view(tmp_path / "view.html")
    with Opened(chromium, tmp_path / "view.html", 400) as opened:
        send = """([kind, id, x, y]) => { const box = symdyn.stage.canvas.getBoundingClientRect();
            symdyn.stage.canvas.setPointerCapture = () => {};
            symdyn.stage.canvas.dispatchEvent(new PointerEvent(kind, { pointerId: id, pointerType: "touch", clientX: box.left + x,
                clientY: box.top + y, buttons: 1, bubbles: true, cancelable: true })); }"""

        def touch(*moves: tuple[str, int, float, float]) -> dict[str, float]:
            for move in moves:
                opened.page.evaluate(send, list(move))
            found: dict[str, float] = opened.page.evaluate("({...symdyn.stage.camera})")
            return found

        before = touch()
        turned = touch(("pointerdown", 1, 100, 100), ("pointermove", 1, 150, 120))
        assert turned["azimuth"] != before["azimuth"] and turned["distance"] == before["distance"]
        near = touch(("pointerdown", 2, 170, 120), ("pointermove", 2, 190, 120))
        assert near["distance"] == pytest.approx(turned["distance"] / 2) and near["azimuth"] == turned["azimuth"]
        touch(("pointerup", 1, 150, 120), ("pointerup", 2, 190, 120))
        assert opened.page.evaluate("getComputedStyle(symdyn.stage.canvas).touchAction") == "none"


@pytest.mark.every_value
@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("wide", [1280, 400])
def test_nothing_is_wider_than_its_box(wide: int, dark: bool, arm: Solution, every_browser: Any, tmp_path: Path) -> None:
    arm.view(tmp_path / "motion.html")
    sd.systems.puma560().show(tmp_path / "mechanism.html")
    for name in ("motion.html", "mechanism.html"):
        with Opened(every_browser, tmp_path / name, wide, dark=dark) as opened:
            wider = opened.page.evaluate("""() => [...document.querySelectorAll("body, body *")].filter(e =>
                e.getBoundingClientRect().right > innerWidth + 1 || (e.scrollWidth > e.clientWidth + 1 && e.clientWidth
                && getComputedStyle(e).display !== "inline" && !["SELECT", "CANVAS", "VAR"].includes(e.tagName)))
                .map(e => e.tagName + "." + e.className)""")
            assert wider == []
            assert opened.page.evaluate(CONTRAST) == []


def test_the_keyboard_reaches_every_control(arm: Solution, chromium: Any, tmp_path: Path) -> None:
    arm.view(tmp_path / "view.html")
    with Opened(chromium, tmp_path / "view.html") as opened:
        count = opened.page.evaluate("document.querySelectorAll('button, input, select, summary, [tabindex]').length")
        reached = set()
        for _ in range(count):
            opened.page.keyboard.press("Tab")
            reached.add(opened.page.evaluate("""[...document.querySelectorAll('button, input, select, summary, [tabindex]')]
                .indexOf(document.activeElement)"""))
        assert reached == set(range(count))
        unnamed = opened.page.evaluate("""[...document.querySelectorAll('button, input, select, canvas')].filter(e =>
            !e.getAttribute("aria-label") && !(e.labels && e.labels.length)).map(e => e.outerHTML)""")
        assert unnamed == []
        opened.page.focus("#canvas")
        before = opened.page.evaluate("symdyn.stage.camera")
        for key in ("ArrowLeft", "ArrowUp", "+"):
            opened.page.keyboard.press(key)
        after = opened.page.evaluate("symdyn.stage.camera")
        assert all(after[k] != before[k] for k in ("azimuth", "elevation", "distance"))
        opened.page.keyboard.press("Home")
        assert opened.page.evaluate("symdyn.stage.camera.azimuth") == before["azimuth"]


def test_what_a_page_asks_for_and_throws_is_seen(every_browser: Any, tmp_path: Path) -> None:
    """In every browser: else the pages above would be judged by nothing."""
    page = tmp_path / "page.html"
    page.write_text("<!doctype html><link rel=icon href='data:,'><img src='http://127.0.0.1:8099/x.png' alt=''><script>"
                    "window.symdyn = { stage: { frames: 1 } }; setTimeout(() => { throw new Error('broken'); }, 0);</script>",
                    encoding="utf-8")
    with pytest.raises(AssertionError), Opened(every_browser, page) as opened:
        opened.page.wait_for_function("document.readyState === 'complete'")
    assert any("broken" in one for one in opened.said) and any("127.0.0.1:8099" in one for one in opened.said)


def test_a_notebook_shows_the_page(chromium: Any, tmp_path: Path) -> None:
    view = sd.systems.pendulum().show()
    text = view._repr_html_()
    assert re.match(r'<iframe srcdoc="[^"]*" title="pendulum"', text)
    page = tmp_path / "notebook.html"
    page.write_text(f"<!doctype html><link rel=icon href='data:,'>{text}", encoding="utf-8")
    opened = chromium.new_page()
    said: list[str] = []
    opened.on("pageerror", lambda error: said.append(str(error)))
    opened.goto(page.as_uri())
    frame = opened.frames[1]
    frame.wait_for_function("window.symdyn && symdyn.stage.frames > 0", timeout=20_000)
    assert said == []
    opened.close()


# -- a System in a notebook, and the command line


@pytest.mark.parametrize("name", swept(["two_link_arm", "flyball_governor", "stewart_platform"], "flyball_governor"))
def test_a_system_shows_a_picture_and_tables(name: str) -> None:
    system = sd.systems.get(name)
    text = system._repr_html_()
    assert text is not None
    svg = re.search(r"<svg .*?</svg>", text)
    assert svg is not None
    ElementTree.fromstring(svg[0])
    places = np.array([float(v) for points in re.findall(r'(?:polygon|polyline) points="([^"]*)"', svg[0])
                       for v in re.split("[ ,]", points)]).reshape(-1, 2)
    assert len(places) > 10 and np.ptp(places, axis=0).max() > 100
    assert all(f"<td>{body.name}</td>" in text for body in system.check().bodies[:12])


def test_numbers_of_tables_have_the_digits_that_they_were_given() -> None:
    """0.2 is not 0.200000000000000, by itself and within expressions."""
    system, m = sd.System("arm", gravity=[0, -9.81]), sd.parameters("m", positive=True)
    link = system.add_body("link", mass=2.5 + 0.1 * m, inertia=0.5, com=[0.2, 1e-3])
    system.add_joint(sd.Revolute("hinge", system.ground, link))
    text = system._repr_html_() or ""
    assert "<td>link</td><td>0.1*m + 2.5</td><td>0.2, 0.001, 0</td>" in text


def test_a_rail_goes_through_its_block() -> None:
    """In the small picture the block is in front of its rail, and does not fill the picture where it is alone."""
    svg = re.search(r"<svg .*?</svg>", sd.systems.vehicle_on_track()._repr_html_() or "")
    assert svg is not None and svg[0].index("<polyline") < svg[0].index("<polygon")
    (block,) = re.findall(r'polygon points="([^"]*)"', svg[0])
    assert np.ptp(np.array(re.split("[ ,]", block), dtype=float).reshape(-1, 2), axis=0).max() < 100


def test_small_pictures_have_loops_and_lines_to_other_bodies() -> None:
    """The rocker of a four-bar linkage stands on the ground; an axle goes from wheel to wheel, as wide as it is drawn."""
    loop = re.search(r"<svg .*?</svg>", sd.systems.four_bar()._repr_html_() or "")
    assert loop is not None and loop[0].count("<polyline") == 3 and loop[0].count(METAL) == 4  # two stands: fill and edge
    axle = sd.systems.car_axis()._repr_html_() or ""
    found = re.findall(r'<polyline points="([^"]*)"[^>]*stroke-width="([^"]*)"', axle)
    (ends,) = [np.array([v.split(",") for v in points.split()], dtype=float) for points, width in found if width == "4.0"]
    wheels = np.array(re.findall(r'cx="([^"]*)" cy="([^"]*)"', axle), dtype=float)
    assert len(ends) == 2 and all(np.abs(wheels - end).sum(axis=1).min() < 0.2 for end in ends)


def test_a_system_with_faults_shows_them() -> None:
    text = sd.System("empty <b>")._repr_html_()
    assert text is not None and "the system has no bodies" in text and "&lt;b&gt;" in text


def test_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", lambda address: bool(opened.append(address)))
    assert main(["view", "pendulum", "--output", str(tmp_path), "--q", "q1=0.4"]) == 0
    path = tmp_path / "view.html"
    assert opened == [path.as_uri()]
    assert capsys.readouterr().out == f"wrote {path}\nno browser was found; open the file in one\n"
    assert '"value":0.4' in path.read_text()
    motion = ["--motion", "--t", "2", "--backend", "numpy", "--no-browser"]
    assert main(["view", "pendulum", *motion, "--output", str(tmp_path)]) == 0
    assert len(opened) == 1 and '"kind":"recorded"' in path.read_text()
    for words, said in ((["--t", "2"], "--t and --forces go with --motion; without it the page has sliders"),
                        (["--motion", "--t", "0", "1", "2"], "--t takes END or START END, found 3 times")):
        assert main(["view", "pendulum", *words]) == 2
        assert said in capsys.readouterr().err


# -- what cannot be shown


def test_what_cannot_be_shown(arm: Solution, tmp_path: Path) -> None:
    with pytest.raises(sd.ModelError, match="the system has no bodies; add one with add_body"):
        sd.System("empty").show()
    with pytest.raises(sd.ArgumentError, match=r"cannot write the view to arm\.txt: the ending must be \.html"):
        arm.view(tmp_path / "arm.txt")
    with pytest.raises(sd.ArgumentError, match="two_link_arm: compare is 3; pass another solution"):
        arm.view(compare=3)  # type: ignore[arg-type]
    with pytest.raises(sd.ArgumentError, match="two_link_arm: forces is 'all'; pass True or False"):
        arm.view(forces="all")  # type: ignore[arg-type]
    with pytest.raises(sd.ArgumentError, match="params: there is no 'k'; there are g, m, l"):
        sd.systems.pendulum().show(params={"k": 3})
    q, k = sd.coordinates("q"), sd.parameters("k")
    system = sd.System("far")
    body = system.add_body("body", mass=1)
    system.add_joint(sd.Prismatic("rail", system.ground, body, coordinate=q, parent_point=[1 / k, 0, 0]))
    with pytest.raises(sd.ArgumentError, match=r"are not finite at the coordinates and parameters to be shown; pass others"):
        system.show(params={k: 0.0})
    with pytest.raises(sd.ArgumentError, match="pendulum: lengths of the picture are beyond the range of double precision"):
        sd.systems.pendulum().show(params={"l": 1e308})


def test_kinematics_that_cannot_run_in_a_page() -> None:
    x = sd.coordinates("x")
    system = sd.System("bead", gravity=[0, -9.81])
    bead = system.add_body("bead", mass=1)
    system.add_joint(sd.Planar("wire", system.ground, bead, coordinates=[x, HEIGHT(x), 0]))
    said = r"bead: the kinematics cannot run in a page: .*; simulate it and use solution\.view"
    with pytest.raises(sd.ArgumentError, match=said):
        system.show()


def test_without_matplotlib() -> None:
    """Views say how to get it; a System falls back to its text."""
    program = ("import sys; sys.modules['matplotlib'] = None; import symdyn; s = symdyn.systems.pendulum(); "
               "print(s._repr_html_()); s.show()")
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.stdout == "None\n"
    assert "MissingExtra: pictures need matplotlib: pip install 'symdyn[plot]'" in done.stderr


def test_parameters_without_a_number_are_noted(chromium: Any, tmp_path: Path) -> None:
    q, m, length = sd.coordinates("q"), *sd.parameters("m l")
    system = sd.System("bare", gravity=[0, -9.81])
    bob = system.add_body("bob", mass=m, com=[0, -length])
    system.add_joint(sd.Revolute("pin", system.ground, bob, coordinate=q))
    system.show(tmp_path / "view.html")
    with Opened(chromium, tmp_path / "view.html") as opened:
        assert opened.page.text_content("#note") == "No value is known of m, l: 1 is shown."
        opened.slide("l", 2.0)
        centre = opened.page.evaluate("Array.from(symdyn.scenes[0].source.points).slice(6, 9)")
        np.testing.assert_allclose(centre, [0, -2, 0], atol=1e-12)


def test_a_motion_without_finite_positions(arm: Solution, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = arm.rows

    def broken(name: str) -> np.ndarray:
        found = rows(name).copy()
        if name == "frames":
            found[7] = np.nan
        return found

    monkeypatch.setattr(arm, "rows", broken, raising=False)
    with pytest.raises(sd.ArgumentError, match=f"not finite at t = {arm.t[7]:.6g} s; end the motion before it"):
        arm.view()
