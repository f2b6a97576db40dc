"""Pictures and films show bodies, joints and springs as the solids of the page, where the equations say that they are."""

from __future__ import annotations

import dataclasses
import itertools
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.runtime.solutions.solution import Solution
from tests.helpers import swept

pytest.importorskip("matplotlib")

from symdyn.pictures.animation import animate
from symdyn.pictures.bodies import flat, make_axes
from symdyn.pictures.drawing import Drawing
from symdyn.pictures.figure import Picture
from symdyn.pictures.forms import Form
from symdyn.pictures.looks import STEEL
from symdyn.pictures.meshes import parts_of
from symdyn.pictures.scene import Scene
from symdyn.pictures.solids import Solids


@pytest.fixture(scope="module")
def loop() -> Solution:
    return sd.systems.four_bar().augmented().compile("numpy").simulate((0.0, 0.5))


@pytest.fixture(scope="module")
def cart() -> Solution:
    return sd.systems.cart_pole().compile(backend="numpy").simulate((0.0, 1.0), inputs={"F": 6.0})


def placed(solution: Solution, index: int) -> list[tuple[Form, np.ndarray]]:
    solids = Solids.of(solution)
    assert solids is not None and solids.forms is not None
    return list(zip(solids.forms.forms, solids.vertices(index)[len(solids.own):], strict=True))


@pytest.mark.parametrize("index", [0, 250, 500])
def test_pins_are_where_joints_are_and_links_go_between_them(loop: Solution, index: int) -> None:
    joints = loop.rows("joint_points").reshape(len(loop.t), -1, 6)[index, :, 3:]
    found = placed(loop, index)
    pins = np.array([places.mean(axis=0) for form, places in found if form.item.kind == "pin"])
    assert pins.shape == joints.shape and np.abs(pins - joints).max() < 1e-6
    rods = [places for form, places in found if form.item.kind == "rod"]
    assert len(rods) == 3
    for places in rods:
        for end in (places[:16].mean(axis=0), places[16:].mean(axis=0)):
            assert np.linalg.norm(joints - end, axis=1).min() < 1e-5


def test_rails_reach_as_far_as_what_slides_on_them(cart: Solution) -> None:
    (block,) = [places for form, places in placed(cart, 0) if form.item.kind == "block"]
    (rail,) = [places for form, places in placed(cart, 0) if form.item.color == STEEL]
    x, half = cart["q1"], np.ptp(block[:, 0]) / 2
    assert x.max() - x.min() > 1
    assert rail[:, 0].min() < x.min() - half and rail[:, 0].max() > x.max() + half
    assert rail[:, 0].max() < x.max() + 4 * half


def test_bodies_without_extent_are_seen_on_their_way() -> None:
    """A particle that has come 20 m is drawn by how far it comes, a rod of 1 m on a cart that has come as far by itself."""
    x, q = sd.coordinates("x q")
    system = sd.System("cart", gravity=[0, -9.81])
    cart = system.add_body("cart", mass=1)
    system.add_joint(sd.Prismatic("rail", system.ground, cart, axis=[1, 0], coordinate=x))
    far = system.compile(backend="numpy").simulate((0, 2), u=[10.0])
    solids = Solids.of(far)
    assert solids is not None and solids.forms is not None and solids.forms.length == pytest.approx(0.15 * 20)
    rod = system.add_body("rod", mass=1, inertia=1 / 12, com=[0, 0.5])
    system.add_joint(sd.Revolute("hinge", cart, rod, q))
    solids = Solids.of(system.compile(backend="numpy").simulate((0, 2), u=[10.0, 0.0]))
    assert solids is not None and solids.forms is not None and solids.forms.length < 1.5


def test_numbers_and_labels_of_axes_in_space_are_within_the_picture() -> None:
    turbine = sd.systems.land_wind_turbine(rotor="fixed", flexible="tower", wind=False, drives=False)
    solution = turbine.compile(backend="numpy").simulate((0.0, 0.1))
    for figure in (solution.picture(), solution.picture([0.0, 0.02, 0.04, 0.06, 0.1])):
        figure.canvas.draw()
        for axes in figure.axes:
            for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
                box = axis.get_tightbbox(figure.canvas.get_renderer())
                assert box.y0 >= 0 and box.y1 <= figure.bbox.height
            numbers = [text.get_window_extent() for text in axes.zaxis.get_ticklabels() if text.get_text()]
            label = axes.zaxis.label.get_window_extent()
            assert not any(label.overlaps(number) for number in numbers)


def test_numbers_of_a_narrow_picture_are_apart() -> None:
    module = sd.systems.n_link_pendulum(3).compile(backend="numpy")
    figure = module.simulate((0.0, 0.5), q=[-1.6, 0.05, 0.1]).picture()
    figure.canvas.draw()
    for axes in figure.axes:
        numbers = [text.get_window_extent() for text in axes.get_xticklabels() if text.get_text()]
        assert len(numbers) >= 2 and all(a.x1 < b.x0 for a, b in itertools.pairwise(numbers))


def test_springs_follow_their_ends() -> None:
    solution = sd.systems.car_axis().augmented().compile("numpy").simulate((0.0, 0.2))
    ends = solution.rows("spring_points").reshape(len(solution.t), -1, 2, 3)[-1]
    coils = [places for form, places in placed(solution, -1) if form.item.kind in ("spring", "both") and not form.part.faces]
    assert len(coils) == len(ends) == 2
    assert np.allclose([(places[0], places[-1]) for places in coils], ends)


def test_mooring_lines_go_from_the_fairlead_towards_the_anchor() -> None:
    """They do not make the picture as large as the way to their anchors."""
    system = sd.System("float", gravity=[0, 0, -9.81])
    box = system.add_body("box", mass=500, inertia=[100, 100, 100])
    system.add_joint(sd.Prismatic("heave", system.ground, box, axis=[0, 0, 1]))
    fairlead, anchor = np.array([0.5, 0, 0.2]), np.array([60.0, 0, -20])
    system.add_load(sd.MooringLine(box, fairlead, anchor, length=70, weight=100, stiffness=1e6, name="line"))
    solution = system.compile(backend="numpy").simulate((0, 0.1), q=[-0.1])
    assert solution.module.metadata.connections == (("line", "box", "ground", "line"),)
    ends = solution.rows("spring_points").reshape(len(solution.t), 2, 3)
    assert np.allclose(ends[:, 0], fairlead + np.array([0, 0, 1]) * solution.q) and np.allclose(ends[:, 1], anchor)
    (line,) = [places for form, places in placed(solution, -1) if form.item.kind == "mooring"]
    ways, aside = line[1:] - line[0], np.cross(anchor - ends[-1, 0], [0, 0, 1])
    assert np.allclose(line[0], ends[-1, 0]) and np.allclose(ways @ aside, 0, atol=1e-9)
    assert (ways @ (anchor - ends[-1, 0]) > 0).all()
    drawing = Drawing.of(solution)
    assert drawing is not None and np.ptp(drawing.limits(), axis=1).max() < 5


def test_what_moves_in_a_plane_of_space_is_seen_from_the_front() -> None:
    """A pendulum in the x-z plane of a system in space: x to the right and z up, its solids nearer to the eye hide the others."""
    system = sd.System("swing", gravity=[0, 0, -9.81])
    bob = system.add_body("bob", mass=1, com=[0, 0, -1])
    system.add_joint(sd.Revolute("pin", system.ground, bob, sd.coordinates("q"), axis=[0, 1, 0]))
    solution = system.embedding().compile("numpy").simulate((0.0, 0.5), q=[0.5])
    drawing = Drawing.of(solution)
    assert drawing is not None and drawing.labels == ["x", "z"] and drawing.solids is not None
    scene = Scene(drawing.solids, drawing.axes, drawing.up)
    assert scene._flat is not None and np.allclose(scene._flat.eye, [0, -1, 0, 0])
    assert np.allclose(scene._flat.project(np.array([[1.0, 2.0, 3.0]])), [[1.0, 3.0]])


def test_an_axis_that_points_down_is_turned_over_and_nothing_is_mirrored() -> None:
    system = sd.System("sunk", gravity=[0, 0, 9.81])
    body = system.add_body("frame", mass=1, inertia=[0.01, 0.01, 0.02])
    system.add_joint(sd.Free("flight", system.ground, body, sd.coordinates("x y z a b c"), orientation=sd.EulerAngles("ZYX")))
    solution = system.embedding().compile("numpy").simulate((0.0, 0.05))
    drawing = Drawing.of(solution)
    assert drawing is not None and drawing.up == (0.0, 0.0, -1.0)
    axes = make_axes(Picture(), 111, drawing)
    middle = drawing.limits().mean(axis=1)
    step = 0.1 * np.eye(3)
    screen = flat(axes, np.vstack([middle, middle + step]))
    x, _, z = screen[1:] - screen[0]
    assert z[1] < 0 and abs(z[0]) < 0.1 * abs(z[1])
    assert x[0] > 0
    eye = np.linalg.solve(axes.get_proj(), [0.0, 0.0, -1.0, 0.0])
    # To the right, up and to the eye are right-handed.
    assert np.linalg.det(np.array([step[0], -step[2], eye[:3] / eye[3] - middle])) > 0


def test_a_body_at_rest_without_extent_is_there() -> None:
    system = sd.System("hover", gravity=[0, 0, 0])
    body = system.add_body("frame", mass=1, inertia=[0.01, 0.01, 0.02])
    system.add_joint(sd.Free("flight", system.ground, body, sd.coordinates("x y z a b c"), orientation=sd.EulerAngles("ZYX")))
    solution = system.embedding().compile("numpy").simulate((0.0, 0.1))
    drawing = Drawing.of(solution)
    assert drawing is not None and drawing.spatial
    size = np.ptp(drawing.solids.reach(), axis=0) if drawing.solids is not None else np.zeros(3)
    # The cylinder of the same inertia: m r² / 2 about its axis.
    assert size[0] == pytest.approx(2 * np.sqrt(2 * 0.02), rel=0.02)


def test_films_show_the_same_solids(loop: Solution) -> None:
    film: Any = animate(loop, fps=4)
    (scene,) = [artist for artist in film.figure.axes[0].collections if isinstance(artist, Scene)]
    film.place(1)
    scene.do_3d_projection()
    corners = np.concatenate([path.vertices for path in scene.get_paths()])
    wanted = np.concatenate([places for _, places in placed(loop, int(np.argmin(abs(loop.t - 0.25))))])[:, :2]
    assert np.allclose([corners.min(axis=0), corners.max(axis=0)], [wanted.min(axis=0), wanted.max(axis=0)], atol=1e-3)


@pytest.mark.parametrize("left_out", ["joint_axes", *swept(["spring_points"]), "inertial_parameters", *swept(["joint_points"])])
def test_modules_without_some_functions_are_drawn(left_out: str) -> None:
    solution = sd.systems.andrews_squeezer().augmented().compile("numpy").simulate((0.0, 0.002))
    metadata = solution.module.metadata
    fewer = dataclasses.replace(metadata, functions=tuple(name for name in metadata.functions if name != left_out))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(solution.module, "metadata", fewer)
        assert left_out not in solution.module.functions
        assert len(solution.picture(0.0).axes) == 1 and len(solution.view().html) > 10_000


def test_the_ground_holds_springs_and_rods_by_stands_and_hangers() -> None:
    """A stand where the spring is above, a hanger where it is below; none where a joint already has one."""
    system = sd.System("held", gravity=[0, -9.81])
    x, y = sd.coordinates("x y")
    body = system.add_body("body", mass=1.0, inertia=0.1)
    system.add_joint(sd.Planar("free", system.ground, body, [x, y, 0]))
    system.add_spring_damper(body, system.ground, stiffness=10, length=1, point_b=[0, -1], name="below")
    system.add_spring_damper(body, system.ground, stiffness=10, length=1, point_b=[0, 1], name="above")
    lever = system.add_body("lever", mass=1.0, inertia=0.1, com=[0.5, 0])
    system.add_joint(sd.Revolute("pin", system.ground, lever, coordinate=sd.coordinates("phi"), parent_point=[2, 0]))
    system.add_spring_damper(body, system.ground, stiffness=10, length=1, point_b=[2, 0], name="to the pin")
    found = placed(system.compile(backend="numpy").simulate((0, 0.01)), 0)
    cones = {form.item.name: places for form, places in found if form.item.kind == "stand"}
    assert set(cones) == {"pin (revolute), on the ground", "below, on the ground", "above, on the ground"}
    assert cones["below, on the ground"][:, 1].max() == pytest.approx(-1)
    assert cones["above, on the ground"][:, 1].min() == pytest.approx(1)


def test_rails_in_stills_reach_through_the_times_that_are_shown() -> None:
    """A body that goes far after these does not make the picture long."""
    system = sd.System("slide", gravity=[0, -9.81])
    body = system.add_body("body", mass=1.0)
    system.add_joint(sd.Prismatic("rail", system.ground, body, axis=[1, 0], coordinate=sd.coordinates("x")))
    solution = system.compile(backend="numpy").simulate(np.linspace(0, 100, 1001), u=[1.0])
    left, right = solution.picture([0, 1]).axes[0].get_xlim()
    assert left < 0 < 1 < right < 2
    assert solution.picture([0, 100]).axes[0].get_xlim()[1] > 100


def test_discs_of_the_user_are_round() -> None:
    records = [{"kind": "sweep", "values": {"points": [[0, 0, 0], [0, 0, long]], "widths": [[1, 1], [1, 1]]}}
               for long in (0.1, 3.0)]
    wheel, rod = (part for record in records for part in parts_of(record, 0, (0.0, 0.0, 0.0)))
    assert (len(wheel.vertices), len(rod.vertices)) == (2 * 48, 2 * 20)
