"""Pictures: what they show, that bodies are drawn rigid and joined, and that nothing but the picture is touched."""

from __future__ import annotations

import base64
import dataclasses
import io
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symdyn
from symdyn import systems
from symdyn.errors import ArgumentError, SimulationWarning
from symdyn.runtime.module import Module
from symdyn.runtime.solutions.solution import Solution
from tests.helpers import swept

pytest.importorskip("matplotlib")
image = pytest.importorskip("PIL.Image")

from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402

from symdyn.pictures import animate, plot  # noqa: E402
from symdyn.pictures.drawing import Drawing  # noqa: E402
from symdyn.pictures.points import points_of  # noqa: E402
from symdyn.pictures.scene import Scene  # noqa: E402
from symdyn.pictures.solids import Solids  # noqa: E402
from symdyn.pictures.symbols import typeset  # noqa: E402

ROOT = str(Path(symdyn.__file__).parents[1])
OPTIONS: dict[str, dict[str, Any]] = {"n_link_pendulum": {"n": 3}, "spatial_chain": {"n": 4}, "prismatic_chain": {"n": 3}}
_modules: dict[str, Module] = {}


@pytest.fixture(scope="module", autouse=True)
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SYMDYN_CACHE_DIR", str(tmp_path_factory.mktemp("cache")))
        yield


def motion(name: str, t: Any = (0.0, 1.0), **options: Any) -> Solution:
    """A short motion of a system of the catalogue; each module is made once."""
    options = options or OPTIONS.get(name, {})
    key = f"{name} {options}"
    if key not in _modules:
        _modules[key] = systems.get(name, **options).embedding().compile("numpy")
    return _modules[key].simulate(t, rtol=1e-5)


def guessed(solution: Solution) -> Drawing:
    """The picture where a module lists no joints and has no shapes: its lines come from the motion."""
    metadata = solution.module.metadata
    listed = ("joint_points", "joint_axes")
    fewer = dataclasses.replace(metadata, functions=tuple(f for f in metadata.functions if f not in listed), drawn=())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(solution.module, "metadata", fewer)
        found = Drawing.of(solution)
    assert found is not None and found.sticks is not None
    return found


def ends_of_items(solution: Solution, body: str) -> np.ndarray:
    """Where the solids of a body begin and end at every time, (n_t, n, 3)."""
    solids = Solids.of(solution)
    assert solids is not None and solids.forms is not None
    k = solution.module.metadata.bodies.index(body)
    refs = [end for form in solids.forms.forms if form.item.body == k for end in form.item.ends]
    posed = [solids.forms.hung.at(*pose) for pose in zip(solids.origins, solids.rotations, strict=True)]
    return np.array([[at.at(ref) for ref in refs] for at in posed])


def labels(figure: Any) -> list[str]:
    return [axes.get_ylabel() for axes in figure.axes]


# -- curves


def test_curves_have_names_and_units(tmp_path: Path) -> None:
    path = tmp_path / "motion.png"
    figure = plot(motion("double_pendulum"), path)
    assert labels(figure) == ["$q_{1}$, $q_{2}$ [rad]", r"$\dot{q}_{1}$, $\dot{q}_{2}$ [rad/s]", "energy [J]", "y [m]"]
    shown = [[text.get_text() for text in axes.get_legend().get_texts()] for axes in figure.axes[:3]]
    assert shown == [["$q_{1}$", "$q_{2}$"], [r"$\dot{q}_{1}$", r"$\dot{q}_{2}$"],
                     ["kinetic", "potential\n(0 at start)", "total"]]
    assert "double_pendulum" in figure.get_suptitle()
    with image.open(path) as picture:
        assert picture.width > 800 and len(picture.convert("RGB").getcolors(1 << 24)) > 100


@pytest.mark.parametrize(("name", "text"), [
    ("steer", "steer"), ("steer_dot", r"$\dot{\mathrm{steer}}$"), ("hub_yaw_ddot", r"$\ddot{\mathrm{hub\_yaw}}$"),
    ("theta_2_dot", r"$\dot{\theta}_{2}$"), ("a b_dot", "a b_dot")])
def test_rates_have_dots(name: str, text: str) -> None:
    """Also those of words, which matplotlib can set."""
    assert typeset(name) == text
    Figure().text(0.5, 0.5, typeset(name)).get_window_extent(FigureCanvasAgg(Figure()).get_renderer())


def test_each_unit_has_its_axes_and_inputs_are_shown() -> None:
    module = motion("cart_pole").module
    figure = plot(module.simulate((0.0, 1.0), inputs={"F": 2.0}))
    assert labels(figure)[:6] == ["$q_{1}$ [m]", "$q_{2}$ [rad]", r"$\dot{q}_{1}$ [m/s]", r"$\dot{q}_{2}$ [rad/s]", "$F$ [N]",
                                  "energy [J]"]
    assert labels(plot(module.simulate((0.0, 1.0))))[4] == "energy [J]"


def test_curves_are_the_solution() -> None:
    solution = motion("double_pendulum")
    coordinates, speeds, energy, _ = plot(solution).axes
    start = solution.energies[0, 1]
    kinetic, potential = solution.energies[:, 0], solution.energies[:, 1] - start
    assert start != 0 and potential[0] == 0 and np.allclose(kinetic + potential, solution.energy - start)
    for axes, values in ((coordinates, solution.q), (speeds, solution.u), (energy, np.column_stack(
            [kinetic, potential, kinetic + potential]))):
        for line, column in zip(axes.lines, values.T, strict=True):
            assert np.array_equal(line.get_xdata(), solution.t) and np.array_equal(line.get_ydata(), column)


@pytest.fixture(scope="module")
def many_curves() -> Any:
    return plot(motion("n_link_pendulum", (0.0, 0.01), n=24))


def test_many_curves_are_divided_by_joints(many_curves: Any) -> None:
    """Each set of axes has as many of 24 coordinates as its legend can name in colours of their own."""
    curves = [axes for axes in many_curves.axes if axes.get_ylabel() == "coordinates [rad]"]
    assert [axes.get_title(loc="left") for axes in curves] == [f"hinge{k} \N{EN DASH} hinge{k + 7}" for k in (1, 9, 17)]
    for k, axes in enumerate(curves):
        names = [text.get_text() for text in axes.get_legend().get_texts()]
        assert names == [f"$q_{{{8 * k + j}}}$" for j in range(1, 9)]
        assert len({line.get_color() for line in axes.lines}) == 8


def test_time_axes_are_aligned(many_curves: Any) -> None:
    many_curves.canvas.draw()
    curves = [axes for axes in many_curves.axes if "[m]" not in axes.get_ylabel()]
    assert len(curves) == 7 and len({axes.get_xlim() for axes in curves}) == 1
    edges = [{round(float(edge), 6) for edge in (axes.get_position().x0, axes.get_position().x1)} for axes in curves]
    assert all(edge == edges[0] for edge in edges[:4]) and all(edge == edges[4] for edge in edges[4:])


def test_what_is_shown_can_be_chosen() -> None:
    solution = motion("double_pendulum")
    assert labels(plot(solution, show=["q2", "total"])) == ["$q_{2}$ [rad]", "total [J]"]
    assert labels(plot(solution, show=[symdyn.coordinates("q1"), "speeds", "mechanism"])) == [
        "$q_{1}$ [rad]", r"$\dot{q}_{1}$, $\dot{q}_{2}$ [rad/s]", "y [m]"]
    with pytest.raises(ArgumentError, match=r"'omega', which are no curves of this motion; there are kinetic, potential, q1,"):
        plot(solution, show=["omega", "q1"])
    for wrong in ("energy", [1.0]):
        with pytest.raises(ArgumentError, match="pass a list of names"):
            plot(solution, show=wrong)  # type: ignore[arg-type]
    with pytest.raises(ArgumentError, match=r"nothing of show = .'outputs'. is in this motion"):
        plot(solution, show=["outputs"])


def test_on_paper_curves_are_as_wide_as_a_column_with_their_letters(tmp_path: Path) -> None:
    path = tmp_path / "column.pdf"
    figure = motion("double_pendulum").plot(path, style="paper")
    assert figure.get_figwidth() == pytest.approx(86 / 25.4, abs=0.01)
    assert labels(figure)[-1] == "energy [J]" and not figure.get_suptitle()
    written = path.read_bytes()
    assert b"/FontFile2" in written and b"/Type3" not in written
    lines = figure.axes[0].lines
    assert len({line.get_linestyle() for line in lines}) == len(lines) == 2
    with pytest.raises(ArgumentError, match="style is 'print'; pass 'screen' or 'paper'"):
        motion("double_pendulum").plot(style="print")


def test_on_paper_long_names_leave_the_curves_their_width() -> None:
    """A legend stands in as many columns as fit, and above the power of ten of large numbers."""
    figure = motion("floating_wind_turbine").plot(style="paper")
    figure.canvas.draw()
    renderer, wide = figure.canvas.get_renderer(), figure.bbox.width
    assert {"acceleration [m/s²]", "energy [J]"} <= set(labels(figure))
    for axes in figure.axes:
        assert axes.get_window_extent().width > 0.7 * wide, axes.get_ylabel()
        legend, power = axes.get_legend(), axes.yaxis.get_offset_text()
        if legend is not None:
            assert legend.get_window_extent(renderer).x1 <= wide, axes.get_ylabel()
            assert not power.get_text() or not legend.get_window_extent(renderer).overlaps(power.get_window_extent(renderer))
    assert any(axes.yaxis.get_offset_text().get_text() for axes in figure.axes)


def test_events_are_marked_with_their_names() -> None:
    system = systems.pendulum()
    system.add_event("lowest", symdyn.coordinates("q1"))
    solution = system.embedding().compile("numpy").simulate((0.0, 3.0), q=[0.5])
    top, *others = plot(solution).axes[:3]
    times = [float(t) for t in solution.events["lowest"].t]
    assert len(times) >= 2
    for axes in (top, *others):
        assert [float(np.asarray(line.get_xdata())[0]) for line in axes.lines if line.get_linestyle() == "--"] == times
    assert [note.get_text() for note in top.texts] == ["lowest"] * len(times) and not others[0].texts


def test_rounding_errors_of_a_constant_do_not_fill_the_axes() -> None:
    solution = motion("pendulum")
    solution.__dict__["energies"] = np.column_stack([np.full(len(solution.t), 5.0), np.zeros(len(solution.t))])
    solution.__dict__["energies"][3, 0] += 1e-14
    low, high = next(axes for axes in plot(solution).axes if axes.get_ylabel() == "energy [J]").get_ylim()
    assert high - low > 0.5


def test_states_and_outputs_have_axes() -> None:
    system = systems.pendulum()
    q, z = symdyn.coordinates("q1 z")
    system.add_state(z, q - z)
    system.add_output("height", 1 - q)
    system.add_output("pair", [q, z])
    solution = system.embedding().compile("numpy").simulate((0.0, 0.2))
    figure = plot(solution)
    assert {"$z$", "height", "output"} <= {re.sub(r" \[.*", "", label) for label in labels(figure)}
    pair = next(axes for axes in figure.axes if axes.get_ylabel() == "output")
    assert [line.get_label() for line in pair.lines] == ["pair[0]", "pair[1]"]


def test_equations_without_bodies_have_curves_alone() -> None:
    x = symdyn.coordinates("x")
    m, g = symdyn.parameters("m g")
    solution = symdyn.embedding([x], [x], [m], [-m * g], defaults={m: 1, g: 9.81}).compile("numpy").simulate((0, 1))
    assert labels(plot(solution)) == ["$x$", r"$\dot{x}$"]
    with pytest.raises(ArgumentError, match="nothing to animate"):
        animate(solution)


# -- outputs that are points


@pytest.mark.parametrize("rest", [False, True])
def test_points_are_distinguished_from_other_outputs(rest: bool) -> None:
    system = systems.double_pendulum()
    q1, q2 = symdyn.coordinates("q1:3")
    system.add_output("tip", symdyn.position(system.bodies[1], [1.0, 0.2]))
    system.add_output("elbow", symdyn.position(system.bodies[0], [1.0, 0.0]))
    system.add_output("fast", symdyn.velocity(system.bodies[1], [1.0, 0.2]))
    system.add_output("angles", [q1, q2])
    system.add_output("rates", [q1.dot, q2.dot])
    system.add_output("squares", [q1**2, q2 * q1, q2])
    module = system.embedding().compile("numpy")
    start: dict[str, Any] = {"q": [-np.pi / 2, 0.0], "u": [0.0, 0.0]} if rest else {}
    solution = module.simulate((0.0, 0.5), **start)
    found = points_of(solution)
    assert {name: (point.quantity, point.unit) for name, point in found.items()} == {
        "tip": ("position", "m"), "elbow": ("position", "m"), "fast": ("velocity", "m/s")}
    assert found["tip"].body == found["fast"].body == 1
    figure = plot(solution)
    shown = {axes.get_ylabel(): [line.get_label() for line in axes.lines] for axes in figure.axes if axes.lines}
    assert shown["velocity [m/s]"] == ["fast x", "fast y"] and shown["output"] == ["squares[0]", "squares[1]", "squares[2]"]


def test_points_in_space_are_found_on_bodies_with_euler_parameters_and_moving_ground() -> None:
    system = symdyn.System("free", gravity=[0, 0, -9.81])
    body = system.add_body("b", mass=1, inertia=[1, 2, 3])
    system.add_joint(symdyn.Free("j", system.ground, body, symdyn.coordinates("x y z e0 e1 e2 e3"),
                                 orientation=symdyn.EulerParameters()))
    system.move_ground(position=[symdyn.t**2, 0, 0])
    system.add_output("corner", symdyn.position(body, [0.1, 0.2, 0.3]))
    system.add_output("fast", symdyn.velocity(body, [0.1, 0.2, 0.3]))
    solution = system.embedding().compile("numpy").simulate((0.0, 0.5), q={"e0": 1.0}, u=[0, 0, 0, 1, 2, 3])
    assert {name: (p.body, p.quantity) for name, p in points_of(solution).items()} == {
        "corner": (0, "position"), "fast": (0, "velocity")}


def test_bodies_reach_to_their_points() -> None:
    for name in ("two_link_arm", "three_link_arm"):
        solution = motion(name)
        tip = np.pad(solution.outputs["tip"], ((0, 0), (0, 3 - solution.outputs["tip"].shape[1])))
        assert missed(ends_of_items(solution, solution.module.metadata.bodies[-1]), tip) < 1e-6
        sticks = guessed(solution).sticks
        assert sticks is not None and missed(sticks.lines[-1], solution.outputs["tip"]) < 1e-12


def test_an_early_stop_is_reported_and_short_motions_are_drawn() -> None:
    module = motion("pendulum").module
    with pytest.warns(SimulationWarning):
        stopped = module.simulate((0.0, 1.0), max_steps=1)
    assert "stopped early" in plot(stopped).get_suptitle()
    stopped.t, stopped.x = stopped.t[:0], stopped.x[:0]
    for cached in ("energies", "energy", "inputs", "frames"):
        stopped.__dict__.pop(cached, None)
    assert plot(stopped)._repr_png_().startswith(b"\x89PNG") and stopped.energy.shape == (0,)


# -- bodies


@pytest.mark.parametrize("name, options", [*[(name, OPTIONS.get(name, {})) for name in systems.names(constrained=False)],
                                           ("puma560", {"convention": "modified"})])
def test_bodies_are_drawn_rigid_and_joined(name: str, options: dict[str, Any]) -> None:
    solution = motion(name, **options)
    drawing, listed = guessed(solution), Drawing.of(solution)
    assert listed is not None and listed.sticks is None and listed.labels == drawing.labels
    assert drawing.spatial == (name in ("spatial_chain", "three_link_arm", "puma560", "flyball_governor"))
    sticks = drawing.sticks
    assert sticks is not None
    points = [line[:, k] for line in sticks.lines for k in range(line.shape[1])]
    size = max(float(np.ptp(np.array(points), axis=(0, 1)).max()), 1e-3)
    for k, line in enumerate(sticks.lines):
        lengths = np.linalg.norm(np.diff(line, axis=1), axis=2)
        assert np.ptp(lengths, axis=0).max(initial=0.0) < 1e-4 * size
        if k in sticks.sliders:
            continue
        others = [p for j, other in enumerate(sticks.lines) if j != k for p in np.moveaxis(other, 1, 0)]
        others += [np.broadcast_to(pivot, line[:, 0].shape) for pivot in sticks.pivots]
        assert min(np.abs(line[:, 0] - p).max() for p in others) < 1e-4 * size, f"body {k} hangs in the air"


def test_a_double_pendulum_is_two_rods_from_the_pivot() -> None:
    solution = motion("double_pendulum")
    drawing = guessed(solution)
    assert drawing.sticks is not None and list(drawing.labels) == ["x", "y"] and not drawing.sticks.sliders
    assert np.allclose(drawing.sticks.pivots, [[0.0, 0.0]])
    a, b = solution.q[:, 0], solution.q.sum(axis=1)
    hinge = np.column_stack([np.cos(a), np.sin(a)])
    upper, lower = drawing.sticks.lines
    assert np.abs(np.linalg.norm(upper, axis=2).max(axis=1) - 1.0).max() < 1e-9
    assert np.abs(upper - hinge[:, None]).max(axis=2).min(axis=1).max() < 1e-9
    assert np.allclose(lower[:, 0], hinge)
    assert np.allclose(lower[:, -1], hinge + 0.5 * np.column_stack([np.cos(b), np.sin(b)]))


def test_a_cart_is_a_slider_that_carries_its_pole() -> None:
    solution = motion("cart_pole")
    sticks = guessed(solution).sticks
    assert sticks is not None and list(sticks.sliders) == [0] and not len(sticks.pivots)
    assert np.allclose(sticks.lines[1][:, 0], np.column_stack([solution.q[:, 0], np.zeros(len(solution.t))]))


def test_a_joint_away_from_both_origins_is_found() -> None:
    q1, q2 = symdyn.coordinates("q1:3")
    system = symdyn.System("offset", gravity=[0, -9.81])
    for k, q in enumerate((q1, q2)):
        body = system.add_body(f"b{k}", mass=1, inertia=0.1)
        system.add_joint(symdyn.Revolute(f"j{k}", system.ground if k == 0 else "b0", body, q, child_point=[-0.5, 0],
                                         parent_point=[0, 0] if k == 0 else [0.5, 0]))
    solution = system.embedding().compile("numpy").simulate((0.0, 1.0), q=[0.3, 0.4])
    sticks = guessed(solution).sticks
    assert sticks is not None
    hinge = np.column_stack([np.cos(solution.q[:, 0]), np.sin(solution.q[:, 0])])
    assert np.abs(sticks.lines[1][:, 0] - hinge).max() < 1e-6


@pytest.mark.parametrize("joint", [lambda *n, **p: symdyn.Helical(*n, pitch=0.1, **p), symdyn.Cylindrical])
def test_a_nut_slides_on_its_screw_wherever_their_origins_are(joint: Any) -> None:
    system = symdyn.System("screw", gravity=[1, 0, -9.81])
    nut = system.add_body("nut", mass=3, inertia=[2, 3, 4], com=[0.3, 0.1, 0.2])
    system.add_joint(joint("thread", system.ground, nut, child_point=[0.2, 0.3, 0], parent_point=[0.1, 0.2, 0.3]))
    sticks = guessed(system.embedding().compile("numpy").simulate((0.0, 1.0))).sticks
    assert sticks is not None and list(sticks.sliders) == [0]


def test_a_body_that_tumbles_is_on_no_screw() -> None:
    system = symdyn.System("tumbling", gravity=[0, 0, -9.81])
    body = system.add_body("body", mass=3, inertia=[2, 3, 4])
    system.add_joint(symdyn.Free("float", system.ground, body, velocity="body", child_point=[0.2, 0.3, 0]))
    sticks = guessed(system.embedding().compile("numpy").simulate((0.0, 1.0), u=[1, 0, 0, 0.1, 2, 0.2])).sticks
    assert sticks is not None and not sticks.sliders and not len(sticks.pivots)


def test_bodies_at_rest_are_drawn() -> None:
    solution = motion("pendulum").module.simulate((0.0, 1.0), q=[0.0])
    sticks = guessed(solution).sticks
    assert sticks is not None and np.allclose(sticks.pivots, 0.0)
    assert plot(solution)._repr_png_()


# -- closed loops


def loop(name: str, coordinates: str = "relative", t: Any = (0.0, 0.2), **options: Any) -> Solution:
    """A short motion of a mechanism with constraints."""
    key = f"{name} {coordinates} {options}"
    if key not in _modules:
        _modules[key] = systems.get(name, **options).augmented(coordinates).compile("numpy")
    return _modules[key].simulate(t, rtol=1e-6)


def ends_of(solution: Solution, joint: str) -> tuple[tuple[str, np.ndarray], tuple[str, np.ndarray]]:
    """Name of the parent and the joint's point on it, (n_t, 3); the same of the child."""
    metadata = solution.module.metadata
    k = metadata.reactions.index(joint)
    points = solution.rows("joint_points")[:, k]
    parent, child = metadata.reaction_bodies[k]
    return (parent, points[:, :3]), (child, points[:, 3:])


def missed(points: np.ndarray, wanted: np.ndarray) -> float:
    """Distance of the nearest of the points (n_t, n, 2 or 3) from the wanted ones, (n_t, 2 or 3)."""
    return float(np.nanmin(np.abs(points - wanted[:, None]).max(axis=(0, 2))))


@pytest.mark.parametrize("name, coordinates, options", [
    *swept([("four_bar", "relative", {})]), ("four_bar", "absolute", {}), ("spatial_slider_crank", "relative", {}),
    *swept([("double_wishbone", "relative", {}), ("bricard", "relative", {}),
            ("n_four_bar", "relative", {"n": 3}), ("andrews_squeezer", "relative", {}),
            ("spatial_slider_crank", "absolute", {}), ("flyball_governor", "relative", {"links": "rods"})])])
def test_bodies_meet_at_every_joint_of_their_loops(name: str, coordinates: str, options: dict[str, Any]) -> None:
    solution = loop(name, coordinates, (0.0, 0.01 if name == "andrews_squeezer" else 0.1), **options)
    drawing, metadata = Drawing.of(solution), solution.module.metadata
    assert drawing is not None and drawing.sticks is None and drawing.solids is not None and drawing.solids.forms is not None
    size = np.ptp(drawing.limits(), axis=1).max()
    drawn = {form.item.body for form in drawing.solids.forms.forms if form.item.kind == "rod"}
    for joint, kind in zip(metadata.reactions, metadata.reaction_kinds, strict=True):
        ends = ends_of(solution, joint)
        if kind not in ("rod", "prismatic"):
            assert np.abs(ends[0][1] - ends[1][1]).max() < 1e-6 * size, joint
        elif kind == "rod":
            assert np.ptp(np.linalg.norm(ends[0][1] - ends[1][1], axis=1)) < 1e-6 * size
        for body, point in ends:
            if body != "ground" and metadata.bodies.index(body) in drawn:
                assert missed(ends_of_items(solution, body), point) < 1e-5 * size, f"{joint} on {body}"
            assert missed(drawing.points, point[:, drawing.axes]) < 1e-5 * size


@pytest.mark.parametrize("coordinates", ["relative", "absolute"])
def test_the_rocker_of_a_four_bar_linkage_reaches_to_the_ground(coordinates: str) -> None:
    solution = loop("four_bar", coordinates)
    drawing = Drawing.of(solution)
    assert drawing is not None and drawing.solids is not None and drawing.solids.forms is not None
    items = [form.item for form in drawing.solids.forms.forms]
    rods = [item for item in items if item.kind == "rod"]
    posed = [drawing.solids.forms.hung.at(*pose) for pose in zip(drawing.solids.origins, drawing.solids.rotations, strict=True)]
    for rod, wanted in zip(rods, (0.8, 2.0, 1.6), strict=True):
        assert np.allclose([np.linalg.norm(at.at(rod.ends[1]) - at.at(rod.ends[0])) for at in posed], wanted, atol=1e-6)
    stands = [[at.at(item.ends[0]) for at in posed] for item in items if item.kind == "stand"]
    assert np.allclose(np.array(stands)[:, 0], [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]])


def test_a_screw_in_absolute_coordinates_has_no_carrier_in_its_picture() -> None:
    system = symdyn.System("screw", gravity=[0, 0, -9.81])
    arm = system.add_body("arm", mass=1, inertia=[1, 1, 1], com=[0.5, 0, 0])
    nut = system.add_body("nut", mass=3, inertia=[2, 3, 4], com=[0.3, 0.1, 0.2])
    system.add_joint(symdyn.Revolute("pin", system.ground, arm, axis=[0, 1, 0]))
    system.add_joint(symdyn.Helical("thread", arm, nut, pitch=0.1, parent_point=[1, 0, 0], child_point=[0.2, 0.3, 0]))
    solution = system.augmented("absolute").compile("numpy").simulate((0.0, 0.5))
    assert list(solution.module.metadata.bodies) == ["arm", "nut", "thread_carrier"]
    drawing = Drawing.of(solution)
    assert drawing is not None and drawing.centres.shape[1] == 2
    assert drawing.solids is not None and drawing.solids.forms is not None
    assert {form.item.body for form in drawing.solids.forms.forms} <= {0, 1, -1}
    place = solution.frames[:, 1, :3] + solution.frames[:, 1, 3:].reshape(-1, 3, 3) @ [0.2, 0.3, 0]
    assert missed(ends_of_items(solution, "nut"), place) < 1e-6
    assert np.allclose(solution.reaction("thread", "child"), solution.reaction("thread", "nut"))


@pytest.mark.parametrize("flipped", swept([False, True], False))
def test_a_loop_closed_by_a_guide_has_a_slider_on_a_rail(flipped: bool) -> None:
    q = symdyn.coordinates("q1:4")
    system = symdyn.System("crank", gravity=[0, -9.81, 0])
    crank, rod, slider = [system.add_body(name, mass=1, inertia=[0.1, 0.1, 0.1], com=com)
                          for name, com in (("crank", [0.25, 0, 0]), ("rod", [0.5, 0, 0]), ("slider", [0, 0, 0]))]
    system.add_joint(symdyn.Revolute("A", system.ground, crank, q[0]))
    system.add_joint(symdyn.Revolute("B", crank, rod, q[1], parent_point=[0.5, 0, 0]))
    system.add_joint(symdyn.Revolute("C", rod, slider, q[2], parent_point=[1, 0, 0]))
    ends = (slider, system.ground) if flipped else (system.ground, slider)
    system.close_loop(symdyn.Prismatic("guide", *ends, axis=[1, 0, 0]))
    lean = np.arcsin(0.5 * np.sin(0.7))
    system.initial = {q[0]: 0.7, q[1]: -0.7 - lean, q[2]: lean}
    solution = system.augmented().compile("numpy").simulate((0.0, 0.2))
    drawing = Drawing.of(solution)
    assert drawing is not None and drawing.solids is not None and drawing.solids.forms is not None
    kinds = [form.item.kind for form in drawing.solids.forms.forms]
    assert kinds.count("block") == 1 and kinds.count("stand") == 1
    (k,) = [k for k, kind in enumerate(kinds) if kind == "block"]
    middles = np.array([drawing.solids.vertices(i)[k].mean(axis=0) for i in range(len(solution.t))])
    (_, (_, guide)) = ends_of(solution, "guide") if not flipped else ends_of(solution, "guide")[::-1]
    assert np.allclose(middles, guide, atol=1e-6) and np.allclose(middles[:, 1:], 0.0, atol=1e-6)
    assert missed(ends_of_items(solution, "rod"), guide) < 1e-5


def test_what_a_joint_of_the_user_does_is_seen_in_its_motion() -> None:
    for name in ("pendulum_absolute", "skate"):
        sticks = guessed(loop(name)).sticks
        assert sticks is not None and not sticks.sliders and not len(sticks.pivots) and sticks.rails.shape[1] == 1


def test_bodies_without_joints_that_are_listed_are_joined_as_they_move() -> None:
    solution = motion("double_pendulum")
    sticks, points = guessed(solution).sticks, solution.rows("joint_points").reshape(len(solution.t), -1, 6)
    assert sticks is not None and np.allclose(sticks.pivots, points[0, :1, :2])
    for k, line in enumerate(sticks.lines):
        assert np.abs(line[:, 0] - points[:, k, 3:5]).max() < 1e-6


# -- films


@pytest.mark.parametrize("name", [*swept(["double_pendulum"]), "spatial_chain"])
def test_a_film_is_a_gif_with_the_right_speed(name: str, tmp_path: Path) -> None:
    path = tmp_path / "film.gif"
    animate(motion(name), path, fps=4, speed=0.5)
    with image.open(path) as film:
        assert film.n_frames == 9 and film.info["duration"] == 250
        pixels = []
        for k in (0, 8):
            film.seek(k)
            pixels.append(np.asarray(film.convert("RGB"), dtype=int))
        assert (np.abs(pixels[0] - pixels[1]).sum(axis=2) > 50).sum() > 100
        assert (pixels[0] == 255).all(axis=2).mean() > 0.5


def test_a_film_runs_backwards_with_its_motion() -> None:
    solution = motion("pendulum", (1.0, 0.0))
    film = animate(solution, fps=10)
    whole = Drawing.of(solution)
    assert film.count == 11 and whole is not None
    film.place(10)
    there = np.array(film.figure.axes[0].lines[0].get_data())[:, -1]
    assert np.allclose(there, whole.centres[-1, -1], atol=1e-6)


def test_films_that_cannot_be_are_rejected(tmp_path: Path) -> None:
    solution = motion("pendulum")
    with pytest.raises(ArgumentError, match=r"film\.avi: the ending must be \.gif or \.mp4"):
        animate(solution, tmp_path / "film.avi")
    with pytest.raises(ArgumentError, match=r"1e\+04 pictures; raise speed above 0\.333"):
        animate(solution, fps=1000, speed=0.1)
    with pytest.raises(ArgumentError, match="must be positive"):
        animate(solution, speed=0)
    assert not list(tmp_path.iterdir())


def test_without_ffmpeg_the_way_to_a_film_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ArgumentError, match=r"needs the program ffmpeg, which is not on the path; .* take the ending \.gif"):
        animate(motion("pendulum"), tmp_path / "film.mp4")


@pytest.mark.skipif(os.name == "nt", reason="the program is a shell script")
def test_ffmpeg_gets_every_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A program in place of ffmpeg that keeps what it is sent: pictures of even sides, one after the other; or that fails."""
    program, kept, film = tmp_path / "ffmpeg", tmp_path / "kept", tmp_path / "film.mp4"
    program.write_text(f'#!/bin/sh\ncat > {kept}\necho "$@" > {film}\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    animate(motion("pendulum"), film, fps=2)
    asked = film.read_text().split()
    width, height = map(int, asked[asked.index("-s") + 1].split("x"))
    pictures = np.frombuffer(kept.read_bytes(), np.uint8).reshape(-1, height, width, 3)
    assert width % 2 == height % 2 == 0 and len(pictures) == 3 and asked[asked.index("-r") + 1] == "2"
    assert (pictures[0] != pictures[2]).any() and pictures[0, :3, -3:].min() == 255
    program.write_text("#!/bin/sh\necho Unknown encoder libx264 >&2\nexit 1\n")
    with pytest.raises(ArgumentError, match=r"ffmpeg could not write .*film\.mp4: Unknown encoder libx264"):
        animate(motion("pendulum"), film, fps=2)


def test_a_picture_takes_its_path_alone(tmp_path: Path) -> None:
    solution = motion("pendulum")
    assert len(solution.picture(str(tmp_path / "a.png")).axes) == len(solution.picture(path=tmp_path / "b.png").axes) == 2
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_pictures_that_cannot_be_written_are_rejected(tmp_path: Path) -> None:
    solution = motion("pendulum")
    for give, message in (
            (lambda: solution.picture(0.5, tmp_path / "p.xyz"), r"cannot save the picture to p\.xyz: the ending must be \.png, "),
            (lambda: solution.plot(3), "the path of the picture is 3; pass text or a Path, such as 'motion.png'"),
            (lambda: solution.plot(tmp_path / "none" / "p.png"), "the picture cannot be written to .*: No such file"),
            (lambda: solution.animate(3), "the path of the animation is 3; pass text or a Path"),
            (lambda: solution.save(3), "the path where to save the motion is 3; pass text or a Path"),
            (lambda: solution.report(3), "the path where to write the report is 3; pass text or a Path")):
        with pytest.raises(ArgumentError, match=message):
            give()


# -- ellipsoids of inertia


SEMI_AXES, CENTRE, MASS = np.array([0.5, 0.3, 0.2]), np.array([0.1, -0.2, 0.3]), 2.0


@pytest.fixture(scope="module")
def tumbling() -> Solution:
    """A homogeneous ellipsoid that flies and turns, without gravity."""
    system = symdyn.System("ellipsoid")
    squares = SEMI_AXES**2
    body = system.add_body("body", mass=MASS, inertia=(MASS / 5 * (squares.sum() - squares)).tolist(), com=CENTRE.tolist())
    system.add_joint(symdyn.Free("free", system.ground, body))
    return system.compile(backend="numpy").simulate((0, 1), u=[0.3, 0, 0, 1.0, 2.0, 0.5], rtol=1e-8)


def areas(figure: Any, axes: int = 0) -> list[np.ndarray]:
    """Corners of what is pale in a picture: the areas within outlines."""
    figure.canvas.draw()
    (scene,) = [one for one in figure.axes[axes].collections if isinstance(one, Scene)]
    pale = scene.get_facecolor()[:, 3] < 1
    return [path.vertices[:-1] for path, one in zip(scene.get_paths(), pale, strict=True) if one]


def area(corners: np.ndarray) -> float:
    x, y = corners.T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)


def test_an_ellipsoid_is_the_homogeneous_one_of_the_same_inertia(tumbling: Solution) -> None:
    """Its points are at one distance from its centre in units of the semi-axes, and reach as far as these."""
    solids, bare = Solids.of(tumbling, inertia=True), Solids.of(tumbling)
    assert solids is not None and bare is not None and not any(part.glass for part in bare.parts)
    (place,) = [k for k, part in enumerate(solids.parts) if part.glass]
    for index in (0, len(tumbling.t) // 2, -1):
        frame = tumbling.frames.reshape(len(tumbling.t), 12)[index]
        own = (solids.vertices(index)[place] - frame[:3]) @ frame[3:].reshape(3, 3) - CENTRE
        assert np.linalg.norm(own / SEMI_AXES, axis=1) == pytest.approx(1.0, abs=1e-9)
        assert np.abs(own).max(axis=0) == pytest.approx(SEMI_AXES, rel=1e-6)


def test_the_outline_of_an_ellipsoid_is_within_the_picture_of_a_plane() -> None:
    """In a plane, where all that is known is the moment about its normal, a circle: 2/5 m r² of a ball is I."""
    system = symdyn.System("disc", gravity=[0, -9.81])
    q = symdyn.coordinates("q")
    body = system.add_body("body", mass=2.0, inertia=0.18, com=[0.1, 0])
    system.add_joint(symdyn.Revolute("pin", system.ground, body, q))
    solution = system.compile(backend="numpy").simulate((0, 0.5), rtol=1e-8)
    radius = np.sqrt(5 / 2 * 0.18 / 2.0)
    figure = solution.picture([0.0, 0.4], inertia=True)
    for axes, t in enumerate((0.0, 0.4)):
        (corners,) = areas(figure, axes)
        assert area(corners) == pytest.approx(np.pi * radius**2, rel=5e-3)
        angle = solution(t)[0]
        assert corners.mean(axis=0) == pytest.approx(0.1 * np.array([np.cos(angle), np.sin(angle)]), abs=1e-3)
        low, high = np.transpose([figure.axes[axes].get_xlim(), figure.axes[axes].get_ylim()])
        assert (corners > low).all() and (corners < high).all()
    assert not areas(solution.picture(0.4))


def test_the_nearer_of_two_ellipsoids_is_drawn_over_the_other() -> None:
    system = symdyn.System("two")
    for name, x in (("first", -0.5), ("second", 0.5)):
        body = system.add_body(name, mass=1.0, inertia=[0.02] * 3)
        q = symdyn.coordinates(f"q_{name}")
        system.add_joint(symdyn.Prismatic(name, system.ground, body, axis=[1, 0, 0], coordinate=q, parent_point=[x, 0, 0]))
    solution = system.compile(backend="numpy").simulate((0, 0.1), rtol=1e-5)
    # Both are balls of one size, which perspective makes larger where they are nearer; the eye is first ahead, then behind.
    sizes = []
    for azimuth in (0.0, 180.0):
        back, front = map(area, areas(solution.picture(0.0, view=(0, azimuth), inertia=True)))
        sizes.append(front / back)
    assert min(sizes) > 1.05


def test_films_have_ellipsoids_at_every_time(tumbling: Solution, tmp_path: Path) -> None:
    film = animate(tumbling, tmp_path / "film.gif", fps=2, inertia=True)
    outlines = []
    for k in (0, 2):
        film.place(k)
        (corners,) = areas(film.figure)
        outlines.append(corners)
    assert area(outlines[0]) != pytest.approx(area(outlines[1]), rel=1e-3)
    with image.open(tmp_path / "film.gif") as whole, image.open(io.BytesIO(animate(tumbling, fps=2).gif())) as bare:
        assert whole.n_frames == bare.n_frames == 3
        differ = np.asarray(whole.convert("RGB"), dtype=int) != np.asarray(bare.convert("RGB"), dtype=int)
    assert differ.any(axis=2).mean() > 0.01


def test_ellipsoids_that_there_are_not_are_reported(tumbling: Solution) -> None:
    with pytest.raises(ArgumentError, match="pendulum: inertia=True draws ellipsoids of inertia, and there is none: moments of "
                                            "inertia about centres of mass are zero, or too small to be seen; give inertia"):
        motion("pendulum").picture(inertia=True)
    metadata = tumbling.module.metadata
    fewer = dataclasses.replace(metadata, functions=tuple(f for f in metadata.functions if f != "inertial_parameters"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tumbling.module, "metadata", fewer)
        with pytest.raises(ArgumentError, match="its module has no function 'inertial_parameters', which mechanisms of rigid "
                                                "bodies without added mass have, or leave inertia out"):
            animate(tumbling, inertia=True)
    for draw in (tumbling.picture, tumbling.animate):
        with pytest.raises(ArgumentError, match="ellipsoid: inertia is 'all'; pass True or False"):
            draw(inertia="all")


# -- places they are shown in


def test_a_notebook_shows_figure_and_film() -> None:
    solution = motion("pendulum")
    assert plot(solution)._repr_png_().startswith(b"\x89PNG")
    shown = animate(solution, fps=2)._repr_html_()
    data = base64.b64decode(re.search(r"base64,([^\"]+)", shown)[1])  # type: ignore[index]
    with image.open(io.BytesIO(data)) as film:
        assert film.n_frames == 3


PROGRAM = """
import sys, symdyn
solution = symdyn.systems.pendulum().embedding().compile("numpy").simulate((0, 0.1))
sys.modules["matplotlib"] = None
try:
    solution.plot()
except symdyn.errors.MissingExtra as missing:
    print(missing)
del sys.modules["matplotlib"]
solution.plot({folder!r} + "/a.png")
solution.animate({folder!r} + "/a.gif", fps=10)
print("matplotlib.pyplot" in sys.modules)
"""


def test_without_matplotlib_the_way_to_it_is_reported_and_with_it_no_display_and_no_pyplot_are_needed(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM.format(folder=str(tmp_path))], capture_output=True, text=True,
                          env={**os.environ, "PYTHONPATH": ROOT, "DISPLAY": ""})
    missing, shown = done.stdout.splitlines()
    assert missing.startswith("pictures need matplotlib: pip install 'symdyn[plot]'") and shown == "False" and not done.stderr
    assert {path.name for path in tmp_path.iterdir()} >= {"a.png", "a.gif"}
