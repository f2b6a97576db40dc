"""Forces and torques of loads on their bodies: what they are worth together, and as arrows in the page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.runtime.module import Module
from tests.viewer.test_views import Opened

pytest.importorskip("matplotlib")

from matplotlib.colors import to_rgb

from symdyn.pictures.arrows import COLORS, LARGEST, arrows_of
from symdyn.pictures.drawing import Drawing


def of_all_kinds(gravity: float = 0.0) -> sd.System:
    """A slider and two links in space, with a load of every kind."""
    system = sd.System("loaded", gravity=[0, 0, -gravity])
    cart = system.add_body("cart", mass=2, com=[0, 0.1, 0])
    arm = system.add_body("arm", mass=1, inertia=[0.1, 0.2, 0.3], com=[0.4, 0.1, 0])
    fore = system.add_body("fore", mass=1, inertia=[0.1, 0.2, 0.3], com=[0.3, 0, 0.2])
    system.add_joint(sd.Prismatic("rail", system.ground, cart, axis=[1, 0, 0], coordinate=sd.coordinates("x")))
    system.add_joint(sd.Revolute("shoulder", cart, arm, axis=[0, 1, 0], coordinate=sd.coordinates("a"), parent_point=[0, 0, 0.3]))
    system.add_joint(sd.Revolute("elbow", arm, fore, axis=[0.6, 0.8, 0], coordinate=sd.coordinates("b"),
                                 parent_point=[0.9, 0, 0], child_point=[0, 0, -0.1]))
    system.add_force(fore, [3, -2, 5], point=[0.7, 0.2, 0.1], frame=fore, reaction=arm)
    system.add_force(cart, [1, 2, 3], name="push")
    system.add_torque(arm, [0.5, 1.5, -2], frame=fore, reaction=cart)
    system.add_joint_force("rail", 7.0)
    system.add_joint_force("elbow", -4.0)
    system.add_spring_damper(fore, cart, [0.5, 0, 0], [0, 1, 1], stiffness=30.0, damping=2.0, length=0.2)
    system.add_force_between(arm, system.ground, 11.0, point_a=[0.2, 0.3, 0], point_b=[3, 1, 2])
    system.add_load(sd.LinearDamping(fore, np.diag([1, 2, 3, 0.4, 0.5, 0.6]).tolist(), name="water"))
    return system


@pytest.fixture(scope="module")
def module() -> Module:
    return of_all_kinds().compile(backend="numpy")


@pytest.mark.parametrize("gravity", [0.0, 9.81])
def test_loads_on_bodies_are_worth_the_generalized_forces(gravity: float) -> None:
    """By virtual power: J^T of all forces, weights and torques on the bodies, from their points, is F_tilde."""
    rng = np.random.default_rng(3)
    module = of_all_kinds(gravity).compile(backend="numpy")
    assert ("weights" in module.functions) == bool(gravity)
    bodies = module.metadata.bodies
    assert {kind for _, _, kind in module.metadata.acting} == {"force", "torque"}
    for _ in range(3):
        x = rng.uniform(-1, 1, 6)
        rows = module.evaluate("applied_loads", 0.0, x).reshape(-1, 2, 3)
        assert len(rows) == len(module.metadata.acting)
        centres = module.evaluate("positions", 0.0, x).reshape(-1, 3)
        wrenches = np.zeros((len(bodies), 6))
        for (at, acts), (_, body, kind) in zip(rows, module.metadata.acting, strict=True):
            k = bodies.index(body)
            wrenches[k] += np.concatenate([acts, np.cross(at - centres[k], acts)] if kind == "force" else [np.zeros(3), acts])
        if gravity:
            wrenches[:, :3] += module.evaluate("weights", 0.0, x).reshape(-1, 3)
        J = module.evaluate("J", 0.0, x).reshape(-1, 3)
        np.testing.assert_allclose(J.T @ wrenches.ravel(), module.evaluate("F_tilde", 0.0, x).ravel(), rtol=1e-12, atol=1e-12)


def test_loads_can_be_seen_and_hidden(module: Module, chromium: Any, tmp_path: Path) -> None:
    """Each arrow begins where its load acts, and reaches as far as its force by the largest says."""
    solution = module.simulate((0, 0.2))
    solution.view(tmp_path / "view.html", forces=True)
    with Opened(chromium, tmp_path / "view.html") as opened:
        layers = {one["layer"]: one for one in opened.page.evaluate("symdyn.scenes[0].source.arrows")}
        assert set(layers) == {"forces", "moments", "loads", "torques"}
        data = layers["loads"]
        assert len(layers["torques"]["names"]) == 5 and "push on cart" in data["names"]
        rows = module.evaluate("applied_loads", 0.0, solution.x[0]).reshape(-1, 6)
        every = solution.rows("applied_loads").reshape(len(solution.t), -1, 6)
        own = [k for k, (*_, kind) in enumerate(module.metadata.acting) if kind == "force" and every[:, k, 3:].any()]
        load = np.array(data["now"]).reshape(-1, 6)
        np.testing.assert_allclose(load, rows[own], atol=2e-3 * np.abs(rows).max())
        k = data["names"].index("push on cart")
        picks = opened.page.evaluate("symdyn.scenes[0].picks.filter(p => p.name.startsWith('push on cart'))")
        assert picks[0]["name"] == "push on cart: 3.742 N"
        np.testing.assert_allclose(picks[0]["a"], load[k, :3], atol=1e-6)
        swatch = opened.page.locator("label.check", has_text="forces of loads").locator("i")
        assert swatch.evaluate("e => getComputedStyle(e).backgroundColor") == "rgb(4, 120, 87)"
        seen = opened.pixels()
        assert (seen[:, :3] == (4, 120, 87)).all(axis=1).sum() > 50  # light and shade do not change it
        opened.page.get_by_label("forces of loads").uncheck()
        assert (seen != opened.pixels()).any(axis=1).sum() > 300
        assert not opened.page.evaluate("symdyn.scenes[0].picks.some(p => p.name.startsWith('push'))")


def test_stills_films_and_pages_have_the_same_arrows(chromium: Any, tmp_path: Path) -> None:
    """Where they begin, along what, and how long, of every layer; the largest force and the largest torque as the page's length
    says."""
    solution = of_all_kinds(9.81).compile(backend="numpy").simulate((0, 0.2))
    solution.view(tmp_path / "view.html", forces=True)
    drawing = Drawing.of(solution, True)
    assert drawing is not None and drawing.spatial
    drawn = {one.arrows.layer: one for one in drawing.arrows}
    with Opened(chromium, tmp_path / "view.html") as opened:
        opened.page.evaluate("() => { symdyn.scenes[0].source.seek(0.1); symdyn.stage.draw(false); }")
        length = opened.page.evaluate("symdyn.stage.length")
        shown = {one["layer"]: one for one in opened.page.evaluate("symdyn.scenes[0].source.arrows")}
        picks = opened.page.evaluate("symdyn.scenes[0].picks")
    assert set(shown) == set(drawn) == {"forces", "moments", "loads", "torques", "weights"}
    still = drawing.at(solution.t, np.array([0.1])).arrows
    largest = [one.ways for one in drawing.arrows if not one.arrows.turns]
    assert max(np.linalg.norm(ways, axis=2).max() for ways in largest) == pytest.approx(LARGEST * length)
    for one in still:
        layer = shown[one.arrows.layer]
        assert layer["names"] == one.arrows.names and layer["color"] == pytest.approx(to_rgb(one.arrows.color))
        for name, tail, way in zip(one.arrows.names, one.tails[0], one.ways[0], strict=True):
            if np.linalg.norm(way) < 0.02 * length:
                continue
            arrow = next(pick for pick in picks if pick["name"].startswith(f"{name}: ")
                         and pick["name"].endswith(f" {one.arrows.unit}"))
            np.testing.assert_allclose(arrow["a"], tail, atol=3e-3 * length)
            stem = np.subtract(arrow["b"], arrow["a"])
            # Between stored times arrows are off by 2 % of the largest, along each axis.
            np.testing.assert_allclose(np.cross(stem, way), 0, atol=0.02 * 2**0.5 * LARGEST * length * np.linalg.norm(way))
            assert 0.3 * np.linalg.norm(way) < np.linalg.norm(stem) < np.linalg.norm(way)
    weights = drawn["weights"].arrows
    np.testing.assert_allclose(weights.vectors[0], [[0, 0, -9.81 * m] for m in (2, 1, 1)])
    np.testing.assert_allclose(weights.tails[0], solution.rows("positions").reshape(len(solution.t), -1, 3)[0])


def test_stills_and_films_explain_their_arrows(tmp_path: Path) -> None:
    solution = of_all_kinds(9.81).compile(backend="numpy").simulate((0, 0.2))
    figure = solution.picture([0.0, 0.1], tmp_path / "forces.png", forces=True)
    (legend,) = figure.legends
    texts = [text.get_text() for text in legend.get_texts()]
    assert texts[-1] == "weights, up to 19.6 N" and texts[3].startswith("torques of loads, up to") and texts[3].endswith(" N m")
    assert texts[1].startswith("torques in joints, up to")
    colors = {line.get_color() for line in figure.axes[0].lines}
    assert {line.get_color() for line in legend.get_lines()} <= colors
    assert not solution.picture(0.0).legends
    solution.animate(tmp_path / "forces.gif", fps=10, forces=True)
    assert (tmp_path / "forces.gif").stat().st_size > 0
    for show in (solution.picture, solution.animate):
        with pytest.raises(sd.ArgumentError, match="loaded: forces is 'all'; pass True or False"):
            show(forces="all")  # type: ignore[operator]


def test_a_torque_in_a_plane_is_an_arc_that_turns_as_it_does(chromium: Any, tmp_path: Path) -> None:
    """Counter-clockwise where it is positive, half the length of the arrow away from its point, with a head."""
    tau = sd.inputs("tau")
    system = sd.System("wheel", gravity=[0, -9.81])
    wheel = system.add_body("wheel", mass=1, inertia=0.1)
    system.add_joint(sd.Revolute("pin", system.ground, wheel, sd.coordinates("q")))
    system.add_torque(wheel, tau, name="drive")
    solution = system.compile(backend="numpy").simulate((0, 1), inputs={"tau": lambda t, x: 1 - 2 * t})
    drawing = Drawing.of(solution, True)
    assert drawing is not None and not drawing.spatial
    (one,) = [one for one in drawing.arrows if one.arrows.turns]
    length = LARGEST * drawing.solids.forms.length  # type: ignore[union-attr]
    solution.view(tmp_path / "view.html", forces=True)
    with Opened(chromium, tmp_path / "view.html") as opened:
        for index, sense in ((0, 1), (-1, -1)):
            curve = one.curve(index)[:25]
            np.testing.assert_allclose(np.linalg.norm(curve, axis=1), length / 2, rtol=1e-9)
            assert sense * np.cross(np.pad(curve[0], (0, 1)), np.pad(curve[1], (0, 1)))[2] > 0
            opened.page.evaluate("t => { symdyn.scenes[0].source.seek(t); symdyn.stage.draw(false); }", float(solution.t[index]))
            picks = opened.page.evaluate("symdyn.scenes[0].picks.filter(p => p.name.startsWith('drive'))")
            found = np.array([pick["a"] for pick in picks])
            np.testing.assert_allclose(found[:, :2], curve[:len(found)], atol=1e-3 * length)


def test_a_clamp_holds_its_beam_by_a_torque() -> None:
    """M = m g l about the clamp, to the scale of the torque that a load exerts; nothing of a hinge in the plane."""
    system = sd.System("clamped", gravity=[0, 0, -9.81])
    beam = system.add_body("beam", mass=2.0, inertia=[0.1, 0.1, 0.1], com=[1.5, 0, 0])
    system.add_joint(sd.Fixed("clamp", system.ground, beam))
    wheel = system.add_body("wheel", mass=1.0, inertia=[0.1, 0.1, 0.1])
    system.add_joint(sd.Revolute("axle", system.ground, wheel, axis=[0, 0, 1], coordinate=sd.coordinates("q"),
                                 parent_point=[0, 1, 0]))
    system.add_torque(wheel, [0, 0, 10.0], name="drive")
    found = {one.layer: one for one in arrows_of(system.compile(backend="numpy").simulate((0, 0.1)), 3.0, forces=True)}
    moments, torques = found["moments"], found["torques"]
    assert moments.names == ["torque of clamp"] and torques.names == ["drive on wheel"]
    np.testing.assert_allclose(moments.vectors[:, 0], [[0, -2 * 9.81 * 1.5, 0]] * len(moments.vectors), atol=1e-9)
    np.testing.assert_allclose(moments.tails, 0.0, atol=1e-12)
    assert moments.turns and moments.unit == "N m"
    assert moments.scale == torques.scale == pytest.approx(LARGEST * 3.0 / (2 * 9.81 * 1.5))
    plane = sd.systems.four_bar().compile(backend="numpy").simulate((0, 0.5))
    assert "moments" not in {one.layer for one in arrows_of(plane, 1.0, forces=True)}


def test_arrows_of_contacts_are_not_shown_twice() -> None:
    """Contacts with points have arrows of their own; what remains is the load."""
    system = sd.System("ball", gravity=[0, 0, -9.81])
    ball = system.add_body("ball", mass=1, inertia=[0.1, 0.1, 0.1])
    system.add_joint(sd.Free("free", system.ground, ball))
    system.add_contact(sd.Contact("floor", ball, system.ground, shape=sd.contacts.Sphere(0.2), friction=0.3))
    system.add_force(ball, [1, 0, 0], name="push")
    assert system.embedding().acting == (("push", "ball", "force"),)


def test_rounding_in_joints_without_forces_is_no_arrow() -> None:
    """A joint that leaves a body free transmits nothing but rounding, which has neither an arrow nor a check box."""
    solution = sd.systems.rocking_block().compile(backend="numpy").simulate((0, 0.5))
    assert 0 < np.abs(solution.rows("reactions")).max() < 1e-6
    contacts, weights = arrows_of(solution, 1.0, forces=True)
    assert (contacts.layer, weights.layer) == ("contacts", "weights")
    # Equal forces are equally long.
    assert contacts.scale == weights.scale == pytest.approx(LARGEST / (1000 * 9.81))
    assert arrows_of(solution, 1.0)[0].scale < weights.scale


def test_colours_of_arrows_can_be_distinguished() -> None:
    """By readers who see all colours, and by those without long or middle cones (Machado, Oliveira and Fernandes, 2009): by 15 of
    CIELAB, of which 2 can just be seen."""
    no_long = np.array([[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]])
    no_middle = np.array([[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]])
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    to_lab = np.array([[0, 116, 0], [500, -500, 0], [0, 200, -200]])
    for lighter in (0.0, 0.2):  # on a dark ground
        colors = lighter + (1 - lighter) * np.array([to_rgb(color) for color in COLORS.values()])
        linear = np.where(colors <= 0.04045, colors / 12.92, ((colors + 0.055) / 1.055)**2.4)
        for eyes in (np.eye(3), no_long, no_middle):
            xyz = np.clip(linear @ eyes.T, 0, 1) @ to_xyz.T / [0.9505, 1, 1.089]
            lab = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116) @ to_lab.T
            apart = np.linalg.norm(lab[:, None] - lab, axis=2)[np.triu_indices(len(lab), 1)]
            assert apart.min() > 15, (lighter, apart.min())


def test_arrows_are_within_the_window(chromium: Any, tmp_path: Path) -> None:
    """From tail to tip, while the grid stays below the bodies: the weight reaches further down than the rod."""
    system = sd.System("held", gravity=[0, 0, -9.81])
    rod = system.add_body("rod", mass=2.0, inertia=[0.2, 0.2, 0.2], com=[1.0, 0, 0])
    system.add_joint(sd.Fixed("clamp", system.ground, rod))
    ball = system.add_body("ball", mass=0.01)
    system.add_joint(sd.Prismatic("rail", system.ground, ball, axis=[0, 1, 0], coordinate=sd.coordinates("y")))
    system.compile(backend="numpy").simulate((0, 0.1)).view(tmp_path / "view.html", forces=True)
    with Opened(chromium, tmp_path / "view.html") as opened:
        inside, floor, lowest = opened.page.evaluate("""() => { const s = symdyn.stage, [scene] = symdyn.scenes;
            s.draw(false);
            const tips = s.tips(scene).map(p => s.project(p)), { clientWidth: w, clientHeight: h } = s.canvas;
            return [tips.map(p => p[0] > 0 && p[0] < w && p[1] > 0 && p[1] < h), s.floor,
                Math.min(...s.tips(scene).map(p => p[2]))]; }""")
    assert len(inside) >= 3 and all(inside)
    assert floor > lowest + 0.1
