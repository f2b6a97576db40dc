"""Shapes of bodies: closed, moved with their bodies, drawn in the order in which they hide each other, and what is said to bad
ones."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import symdyn as sd
from symdyn.errors import ArgumentError, ModelError
from symdyn.model.faults import Faults
from symdyn.model.shapes import drawn
from symdyn.runtime.module import Module
from symdyn.runtime.solutions.solution import Solution

pytest.importorskip("matplotlib")
image = pytest.importorskip("PIL.Image")

from matplotlib.figure import Figure  # noqa: E402

from symdyn.pictures.bodies import make_axes  # noqa: E402
from symdyn.pictures.depth_order import Camera, cut, order, planes  # noqa: E402
from symdyn.pictures.drawing import Drawing  # noqa: E402
from symdyn.pictures.meshes import Part, parts_of  # noqa: E402
from symdyn.pictures.scene import Scene  # noqa: E402
from symdyn.pictures.solids import Solids, part_way  # noqa: E402

S = sd.shapes


@pytest.fixture(scope="module", autouse=True)
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SYMDYN_CACHE_DIR", str(tmp_path_factory.mktemp("cache")))
        yield


def buoy() -> sd.System:
    """A body that moves freely, and a smaller one hinged on it at the height h."""
    h = sd.parameters("h")
    system = sd.System("buoy")
    hull = system.add_body("hull", mass=3, inertia=[2, 3, 4])
    mast = system.add_body("mast", mass=1, inertia=[0.2, 0.3, 0.1], com=[0, 0, 1])
    system.add_joint(sd.Free("sea", system.ground, hull, sd.coordinates("x y z psi theta phi"),
                             orientation=sd.EulerAngles("ZYX")))
    system.add_joint(sd.Revolute("hinge", hull, mast, sd.coordinates("a"), axis=[1, 0, 0], parent_point=[0, 0, h]))
    system.set_defaults({h: 0.5})
    return system


def drawn_buoy() -> sd.System:
    system, h = buoy(), sd.parameters("h")
    system.draw("hull", S.Box([4, 3, 2 * h], hole=[1, 1]), color="#cc2222")
    system.draw("mast", S.Cylinder([0, 0, 0], [0, 0, 2], 0.2, 0.1))
    system.draw(system.ground, S.Water([8, 8]), S.Line([[5, 0, -3]], to=("hull", [2, 0, 0])))
    return system


@pytest.fixture(scope="module")
def module() -> Module:
    return drawn_buoy().embedding().compile("numpy")


@pytest.fixture(scope="module")
def solution(module: Module) -> Solution:
    return module.simulate((0.0, 1.0), q={"z": 0.1, "phi": 0.4}, u=[0.3, 0.1, 0.0, 0.5, 0.4, 0.8, 2.0], rtol=1e-6)


def parts(shape: Any) -> list[Part]:
    """The pieces of a shape on body 0."""
    return list(parts_of(drawn(Faults(), "b", [shape], None, False)[0].record, 0, (1.0, 0.0, 0.0)))


def volume(pieces: list[Part]) -> float:
    """Volume that the drawn faces enclose, by the divergence theorem: a third of the sum of p . n A."""
    total = 0.0
    for part in pieces:
        for face in part.faces:
            a = part.vertices[face[0]]
            for b, c in zip(part.vertices[face[1:]], part.vertices[face[2:]]):
                total += a @ np.cross(b, c) / 6
    return total


# -- meshes


def test_faces_close_around_the_volume_of_the_shape() -> None:
    n = 20
    section = n / 2 * np.sin(2 * np.pi / n)  # of a polygon in the unit circle
    assert volume(parts(S.Box([4, 3, 2], [1, 2, 3]))) == pytest.approx(24)
    assert volume(parts(S.Box([40, 40, 10], [1, -2, 3], hole=[10, 8]))) == pytest.approx(10 * (1600 - 80))
    assert volume(parts(S.Cylinder([1, 2, 3], [4, 0, 5], 2.0))) == pytest.approx(section * 4 * np.sqrt(17))
    assert volume(parts(S.Cylinder([0, 0, 0], [0, 0, 6], 2.0, 0.0))) == pytest.approx(section * 4 * 6 / 3)
    flat = 10 / 2 * np.sin(2 * np.pi / 10) / 4 * 0.5  # of a decagon in an ellipse of chord 1 and thickness 0.5
    assert volume(parts(S.Blade([0, 0, 1], [0, 0, 7], [2, 2, 2], thickness=0.5))) == pytest.approx(flat * 4 * 6)


@pytest.mark.parametrize("shape", [S.Box([4, 3, 2], [1, 2, 3]), S.Box([4, 3, 2], hole=[1, 2]),
                                   S.Cylinder([1, 2, 3], [4, 0, 5], 2.0, 1.0)])
def test_pieces_are_convex_and_their_planes_face_outward(shape: Any) -> None:
    for part in parts(shape):
        normals, offsets = planes(part.vertices, np.concatenate([part.corners, part.hidden]))
        gaps = normals @ part.vertices.T - offsets[:, None]
        assert gaps.max() < 1e-12 and gaps.min(axis=1).max() < -0.1


def test_edges_of_a_box_with_a_hole_are_its_own_and_no_seams() -> None:
    """12 edges outside; the opening has 4 at the top, 4 at the bottom, 4 upright: seams would be more."""
    lengths = [np.linalg.norm(part.vertices[b] - part.vertices[a]) for part in parts(S.Box([8, 6, 2], hole=[3, 1]))
               for a, b, *_ in part.edges]
    assert sum(lengths) == pytest.approx(4 * (8 + 6 + 2) + 4 * (3 + 1 + 2))
    assert len(parts(S.Box([8, 6, 2]))[0].edges) == 12


def test_a_blade_lies_along_its_direction() -> None:
    (blade,) = parts(S.Blade([0, 3, 1], [0, 3, 11], [2, 1], direction=[1, 0, 0.3], thickness=0.1))
    sections = blade.vertices[:10], blade.vertices[10:20]
    np.testing.assert_allclose([section.mean(axis=0) for section in sections], [[0, 3, 1], [0, 3, 11]], atol=1e-12)
    assert np.ptp(blade.vertices[:10, 0]) == pytest.approx(2) and np.ptp(blade.vertices[:10, 1]) < 0.2
    assert np.ptp(blade.vertices[10:, 0]) == pytest.approx(1)


# -- motion


def test_shapes_are_plain_data_and_move_with_their_bodies(module: Module, solution: Solution) -> None:
    assert json.loads(json.dumps(module.metadata.drawn)) == list(module.metadata.drawn)
    solids = Solids.of(solution)
    assert solids is not None
    for index in (0, 400, 1000):
        rows = solution.frames.reshape(len(solution.t), -1, 12)[index]
        corner = rows[0, :3] + rows[0, 3:].reshape(3, 3) @ [2.0, 1.5, 0.5]
        places = solids.vertices(index)
        assert min(np.abs(v - corner).max() for p in places[:4] for v in p) < 1e-12
        top = rows[1, :3] + rows[1, 3:].reshape(3, 3) @ [0.0, 0.0, 2.0]
        assert np.abs(places[4][20:].mean(axis=0) - top).max() < 1e-12
        assert np.abs(places[5][0] - [5, 0, -3]).max() == 0
        assert np.abs(places[5][1] - rows[0, :3] - rows[0, 3:].reshape(3, 3) @ [2, 0, 0]).max() < 1e-12


def test_lengths_follow_the_parameters_of_the_run(module: Module) -> None:
    for h in (0.5, 1.25):
        solids = Solids.of(module.simulate((0.0, 0.1), params={"h": h}, rtol=1e-3))
        assert solids is not None
        assert np.ptp(np.concatenate(solids.vertices(0)[:4])[:, 2]) == pytest.approx(2 * h)


def test_between_two_times_bodies_turn_and_do_not_shrink() -> None:
    """A body that spins by 1.6 rad from one time to the next: half-way it has turned by half of that."""
    system = sd.System("spinner")
    body = system.add_body("rotor", mass=1, inertia=[1, 1, 1])
    system.add_joint(sd.Revolute("shaft", system.ground, body, sd.coordinates("a"), axis=[1, 0, 0]))
    system.draw(body, S.Blade([0, 0, 1], [0, 0, 9], [1, 0.5]))
    solution = system.embedding().compile("numpy").simulate(np.linspace(0, 3.2, 5), u=[2.0], rtol=1e-10)
    solids = Solids.of(solution)
    assert solids is not None
    times = np.array([0.0, 0.4, 1.0, 2.9])
    between = solids.at(solution.t, times)
    for k, t in enumerate(times):
        turned = solids.parts[0].vertices @ Rotation.from_rotvec([2 * t, 0, 0]).as_matrix().T
        assert np.abs(between.vertices(k)[0] - turned).max() < 1e-7


def test_part_of_a_turn_is_about_its_axis_by_part_of_its_angle() -> None:
    rng = np.random.default_rng(3)
    angles = np.array([0.0, 1e-9, 1e-3, 1.0, 2.6, 3.0, 3.14159, np.pi - 1e-9])
    axes = rng.normal(size=(200, 1, 3))
    vectors = axes / np.linalg.norm(axes, axis=-1, keepdims=True) * angles[:, None]
    A = Rotation.random(1600, rng=rng).as_matrix().reshape(200, 8, 3, 3)

    def turned(share: float) -> np.ndarray:
        return np.asarray(A @ Rotation.from_rotvec(share * vectors.reshape(-1, 3)).as_matrix().reshape(200, 8, 3, 3))

    for share in (0.0, 0.3, 1.0):
        assert np.abs(part_way(A, turned(1.0), np.full((200, 1, 1), share)) - turned(share)).max() < 2e-8


@pytest.mark.parametrize("shown", [True, False])
def test_flexible_bodies_bend_and_end_at_their_tips(shown: bool) -> None:
    """A beam that sways: its shape, or without one its line, ends where the frame at its free end is."""
    beam = sd.Beam([0, 10], [2, 2], [400, 400], [
        sd.Shape("x", [1], name="bend"), sd.Shape("y", [1], name="side")])
    system = sd.System("swaying", gravity=[0, 0, -9.81])
    mast = system.add_flexible_body("mast", beam)
    head = system.add_body("head", mass=3, inertia=[0.1, 0.1, 0.1])
    system.add_joint(sd.Revolute("foot", system.ground, mast.root, sd.coordinates("a"), axis=[1, 0, 0]))
    system.add_joint(sd.Fixed("top", mast.tip, head))
    system.draw(head, S.Box([0.5, 0.5, 0.5]))
    if shown:
        system.draw(mast.root, S.Cylinder([0, 0, 0], [0, 0, 10], 0.2, 0.1))
    module = system.embedding().compile("numpy")
    eta = [str(q) for q in mast.coordinates]
    solution = module.simulate((0.0, 0.5), q={eta[0]: 2.5, eta[1]: -1.0, "a": 0.3}, rtol=1e-5)
    solids = Solids.of(solution)
    assert solids is not None
    for index in (0, 600):
        (places,) = [p for p, part in zip(solids.vertices(index), solids.own, strict=False) if part.body == 0]
        end = places[-20:].mean(axis=0)
        head_at = solution.frames.reshape(len(solution.t), -1, 12)[index, module.metadata.bodies.index("head"), :3]
        assert np.abs(end - head_at).max() < 1e-9 and np.linalg.norm(end) < 9.9
    drawing = Drawing.of(solution)
    assert drawing is not None and not drawing.bare


# -- what hides what


def hit(part: Part, places: np.ndarray, eye: np.ndarray, way: np.ndarray) -> float:
    """Distance along a ray at which it enters a convex piece; infinite if it misses."""
    normals, offsets = planes(places, np.concatenate([part.corners, part.hidden]))
    speed, ahead = normals @ way, offsets - normals @ eye
    with np.errstate(divide="ignore"):
        reach = ahead / speed
    enters, leaves = reach[speed < 0].max(initial=0.0), reach[speed > 0].min(initial=np.inf)
    return float(enters) if enters < leaves and (ahead[speed == 0] >= 0).all() else np.inf


def parted(a: tuple[Part, np.ndarray], b: tuple[Part, np.ndarray]) -> bool:
    """Whether a face of one piece has the other on its outer side."""
    return any(((n := planes(v, part.corners))[0] @ w.T - n[1][:, None]).min(axis=1).max() > 0.05
               for (part, v), (_, w) in ((a, b), (b, a)))


def test_what_is_drawn_later_is_what_a_ray_from_the_eye_meets_first() -> None:
    """Rays through scenes of plates and cones that do not touch, seen from all sides."""
    rng = np.random.default_rng(5)
    axes: Any = Figure().add_subplot(projection="3d")
    axes.set(xlim=(-9, 9), ylim=(-9, 9), zlim=(-9, 9))
    compared = 0
    for _ in range(8):
        pieces: list[tuple[Part, np.ndarray]] = []
        while len(pieces) < 7:
            x, y, z = rng.uniform(0.3, 1.5), rng.uniform(3, 12), rng.uniform(3, 14)
            shape = S.Box([x, y, z]) if rng.random() < 0.5 else S.Cylinder([0, 0, -z / 8], [0, 0, z / 8], x, x / 2)
            (part,) = parts(shape)
            place = rng.uniform(-5, 5, 3) + part.vertices @ Rotation.from_rotvec(rng.normal(0, 2, 3)).as_matrix().T
            if all(parted((part, place), other) for other in pieces):
                pieces.append((part, place))
        axes.view_init(rng.uniform(-80, 80), rng.uniform(-180, 180))
        camera = Camera.of(axes.get_proj())
        eye = camera.eye[:3]
        rank = {k: r for r, k in enumerate(order([p for p, _ in pieces], [v for _, v in pieces], camera))}
        for _ in range(100):
            way = pieces[rng.integers(7)][1].mean(axis=0) + rng.normal(0, 1.5, 3) - eye
            met = {k: s for k, (part, v) in enumerate(pieces) if np.isfinite(s := hit(part, v, eye, way))}
            if len(met) > 1:
                compared += 1
                assert max(met, key=rank.__getitem__) == min(met, key=met.__getitem__)
    assert compared > 100


@pytest.mark.parametrize("azimuth", [-150, -60, 30, 120])
def test_a_mast_anywhere_on_a_deck_is_drawn_after_it_from_above_and_before_it_from_below(azimuth: float) -> None:
    """On the far side of the deck its middle is farther away than that of the deck, which it hides nevertheless."""
    axes: Any = Figure().add_subplot(projection="3d")
    axes.set(xlim=(-20, 20), ylim=(-20, 20), zlim=(-20, 20))
    (deck,), (mast,) = parts(S.Box([40, 40, 2])), parts(S.Cylinder([0, 0, 1], [0, 0, 4], 1))
    for x in (-18, 18):
        for elevation, first in ((25, 0), (-25, 1)):
            axes.view_init(elevation, azimuth)
            assert order([deck, mast], [deck.vertices, mast.vertices + [x, x / 3, 0]], Camera.of(axes.get_proj()))[0] == first


def test_the_eye_is_where_the_axes_say() -> None:
    axes: Any = Figure().add_subplot(projection="3d")
    axes.view_init(30, -60)
    for projection in ("persp", "ortho"):
        axes.set_proj_type(projection)
        toward = Camera.of(axes.get_proj()).toward(np.array([0.5, 0.5, 0.5])) * [4, 4, 3]  # the axes' box is 4 : 4 : 3
        wanted = [np.cos(np.pi / 6) / 2, -np.cos(np.pi / 6) * np.sqrt(3) / 2, 0.5]
        assert np.abs(toward / np.linalg.norm(toward) - wanted).max() < 1e-12


def test_polygons_are_cut_at_the_water() -> None:
    square = np.array([[0, 0, -1], [2, 0, -1], [2, 0, 3], [0, 0, 3.0]])
    below, above = cut(square, square[:, 2])
    assert below[:, 2].max() == 0 == above[:, 2].min()
    assert np.ptp(below[:, 2]) == 1 and np.ptp(above[:, 2]) == 3 and len(below) == len(above) == 4


def test_water_with_waves_moves_in_stills_and_parts_what_stands_in_it() -> None:
    """Strips follow the elevation a cos(w t - k s) along the heading, and a pole is under water up to where the surface is."""
    amplitude, frequency, length, heading = 0.5, 0.8, 12.0, 0.6
    system = sd.System("pole", gravity=[0, 0, -9.81])
    pole = system.add_body("pole", mass=1, inertia=[1, 1, 1])
    system.add_joint(sd.Prismatic("guide", system.ground, pole, axis=[0, 0, 1]))
    system.draw("pole", S.Box([0.1, 0.1, 8.0]), color="#ff0000")
    system.draw(system.ground, S.Water((20, 10), waves=(amplitude, frequency, length, heading, 0)))
    solution = system.embedding().compile("numpy").simulate((0.0, 0.3))
    drawing = Drawing.of(solution)
    assert drawing is not None and drawing.solids is not None and drawing.solids.water is not None
    axes = make_axes(Figure(), 111, drawing, (20, -60))
    scene = Scene(drawing.solids, [0, 1, 2])
    axes.add_collection(scene, autolim=False)
    camera = Camera.of(axes.get_proj())
    for index in (0, 700, 1000):
        scene.place(index)
        time = solution.t[index]
        strips = [strip for strip, _ in scene._surface(drawing.solids.water, camera)]
        corners = np.concatenate(strips)
        along = corners[:, :2] @ [np.cos(heading), np.sin(heading)]
        wanted = amplitude * np.cos(frequency * time - 2 * np.pi / length * along)
        assert np.allclose(corners[:, 2], wanted, atol=1e-12)
        assert len(strips) >= 24 and np.allclose(np.ptp(corners[:, :2], axis=0), [20, 10])
        areas = [np.cross(strip[1:-1] - strip[0], strip[2:] - strip[0])[:, 2].sum() / 2 for strip in strips]
        assert np.abs(areas).sum() == pytest.approx(200.0)
        scene.do_3d_projection()
        wet = int(scene.get_facecolor()[:, 3].argmin())
        red = [path.vertices for path in scene.get_paths()][:wet]
        surface = camera.project(np.array([[0.0, 0.0, amplitude * np.cos(frequency * time)]]))[0, 1]
        near = camera.project(np.array([[0.05, -0.05, amplitude * np.cos(frequency * time)]]))[0, 1]
        assert max(polygon[:, 1].max() for polygon in red) == pytest.approx(surface, abs=2 * abs(near - surface))


@pytest.mark.parametrize("elevation", [20, -20])
def test_what_is_under_water_is_drawn_before_the_water(solution: Solution, elevation: float) -> None:
    drawing = Drawing.of(solution)
    assert drawing is not None and drawing.solids is not None
    axes = make_axes(Figure(), 111, drawing, (elevation, -60))
    scene = Scene(drawing.solids, [0, 1, 2])
    axes.add_collection(scene, autolim=False)
    scene.place(300)
    scene.do_3d_projection()
    camera = Camera.of(axes.get_proj())
    alphas = scene.get_facecolor()[:, 3]
    water = int(alphas.argmin())
    assert (alphas < 1).sum() == 1 and 10 < water < len(alphas) - 10
    heights = np.concatenate(drawing.solids.vertices(300))
    lowest, highest = heights[heights[:, 2].argmin()], heights[heights[:, 2].argmax()]
    polygons = [path.vertices for path in scene.get_paths()]

    def shows(some: list[np.ndarray], point: np.ndarray) -> bool:
        return min(np.abs(p - camera.project(point[None])).sum(axis=1).min() for p in some) < 1e-9

    before, after = polygons[:water], polygons[water + 1:]
    wet, dry = (before, after) if elevation > 0 else (after, before)
    assert shows(wet, lowest) and shows(dry, highest) and not shows(wet, highest)


def test_a_box_hides_the_one_behind_it(tmp_path: Any) -> None:
    system = sd.System("pair")
    body = system.add_body("b", mass=1, inertia=[1, 1, 1])
    system.add_joint(sd.Revolute("j", system.ground, body, sd.coordinates("q"), axis=[0, 0, 1]))
    system.draw(body, S.Box([1, 1, 1], [0, -2, 0]), color="#ff0000")
    system.draw(body, S.Box([1, 1, 1], [0, 2, 0]), color="#0000ff")
    solution = system.embedding().compile("numpy").simulate((0.0, 0.1))
    reds, blues = [], []
    for k, azimuth in enumerate((-90, 90)):
        solution.picture(0.0, tmp_path / f"{k}.png", view=(0, azimuth))
        pixels = np.asarray(image.open(tmp_path / f"{k}.png").convert("RGB")).astype(int)
        reds.append(((pixels[..., 0] > 100) & (pixels[..., 1:].max(axis=2) < 20)).sum())
        blues.append(((pixels[..., 2] > 100) & (pixels[..., :2].max(axis=2) < 20)).sum())
    assert reds[0] > 2000 and blues[1] > 2000
    assert reds[1] == 0 == blues[0]


# -- pictures


def test_shapes_stand_for_the_lines_of_their_bodies() -> None:
    system = buoy()
    system.draw("hull", S.Box([4, 3, 1]))
    solution = system.embedding().compile("numpy").simulate((0.0, 0.2))
    drawing = Drawing.of(solution)
    assert drawing is not None and drawing.spatial and drawing.sticks is None
    assert drawing.solids is not None and drawing.solids.forms is not None
    assert {part.body for part in drawing.solids.own} == {0}
    assert {form.item.body for form in drawing.solids.forms.forms if form.item.axis < 0} == {1}
    fewer = tuple(f for f in solution.module.functions if f != "joint_points")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(solution.module, "metadata", dataclasses.replace(solution.module.metadata, functions=fewer))
        lines = Drawing.of(solution)
    assert lines is not None and lines.sticks is not None and list(lines.bare) == [1]
    assert np.isnan(lines.sticks.lines[0]).all() and np.isfinite(lines.sticks.lines[1]).all()
    assert (np.ptp(drawing.limits(), axis=1) > [4, 3, 1]).all()


def test_a_plane_mechanism_shows_its_shapes_in_the_plane() -> None:
    system = sd.systems.cart_pole()
    system.draw("cart", S.Box([0.5, 0.25, 0.3]))
    solution = system.embedding().compile("numpy").simulate((0.0, 1.0), inputs={"F": 3.0})
    drawing = Drawing.of(solution)
    assert drawing is not None and list(drawing.labels) == ["x", "y"] and drawing.solids is not None
    scene = Scene(dataclasses.replace(drawing.solids, forms=None), [0, 1])
    scene.place(1000)
    scene.do_3d_projection()
    corners = np.concatenate([path.vertices for path in scene.get_paths()])
    x = solution["q1"][1000]
    assert np.allclose([corners.min(axis=0), corners.max(axis=0)], [[x - 0.25, -0.125], [x + 0.25, 0.125]])


def test_pictures_at_chosen_times_share_their_limits(solution: Solution) -> None:
    figure = solution.picture([0.0, 0.25, 1.0], view=(10, 20))
    assert [axes.get_title() for axes in figure.axes] == ["t = 0 s", "t = 0.25 s", "t = 1 s"]
    assert len({(axes.get_xlim(), axes.get_zlim(), axes.elev, axes.azim) for axes in figure.axes}) == 1
    assert (figure.axes[0].elev, figure.axes[0].azim) == (10, 20)
    assert [(a.elev, a.azim) for a in solution.picture(0.5, view=[(0, -90), (0, 0)]).axes] == [(0, -90), (0, 0)]
    assert len(solution.picture().axes) == 2


def test_axes_that_point_at_the_eye_have_no_labels(solution: Solution) -> None:
    (axes,) = solution.picture(0.0, view=(0, -90)).axes
    assert axes.get_xlabel() == "x [m]" and axes.get_ylabel() == "" and not len(axes.get_yticks())


def test_films_show_shapes(solution: Solution, tmp_path: Any) -> None:
    solution.animate(tmp_path / "film.gif", fps=4, view=(20, -40))
    with image.open(tmp_path / "film.gif") as film:
        assert film.n_frames == 5
        first = np.asarray(film.convert("RGB")).astype(int)
        film.seek(4)
        last = np.asarray(film.convert("RGB")).astype(int)
    assert ((first[..., 0] > 100) & (first[..., 1:].max(axis=2) < 60)).sum() > 300
    assert (np.abs(first - last).sum(axis=2) > 60).sum() > 1000


def test_wrong_pictures_are_rejected(solution: Solution) -> None:
    for arguments, message in (({"t": 3.0}, "goes from t = 0 s to 1 s; t = 3 s is outside"), ({"t": {}}, "t must be a time"),
                               ({"t": []}, "t must be a time or a list of times"),
                               ({"view": (100, 0)}, r"view is \(100, 0\); pass \(elevation, azimuth\)"),
                               ({"view": 5}, "view is 5"),
                               ({"t": [0, 1], "view": [(0, 0)] * 3}, "3 views are given for 2 times")):
        with pytest.raises(ArgumentError, match=message):
            solution.picture(**arguments)
    bare = Module(dataclasses.replace(solution.module.metadata, functions=("rhs",)), solution.module.library, "numpy")
    with pytest.raises(ArgumentError, match="there is nothing to draw"):
        bare.simulate((0.0, 0.1)).picture()


def test_a_colour_that_does_not_exist_is_reported() -> None:
    system = buoy()
    system.draw("hull", S.Box([1, 1, 1]), color="blau")
    with pytest.raises(ArgumentError, match="buoy: a shape has the colour 'blau', which is none; pass '#rrggbb'"):
        system.embedding().compile("numpy").simulate((0.0, 0.1)).picture()


# -- faults


@pytest.mark.parametrize("shape, message", [
    (S.Box([1, 0, 1]), "Box of 'hull': size is 0; pass a positive length, m"),
    (S.Box([1, -2, 1]), "size is -2"), (S.Box([1, 2]), "size has 2 components; pass 3"),
    (S.Box([1, 1, 1], hole=[2, 0.5]), "hole is 2 m long along x, and the box 1 m; make it smaller"),
    (S.Box([1, 1, 1], hole=[0.2]), "hole has 1 components; pass 2"),
    (S.Cylinder([0, 0, 0], [0, 0, 0], 1), r"start and end are the same point \(0, 0, 0\)"),
    (S.Cylinder([0, 0, 0], [0, 0, 1], -1), "radius is -1; pass a length from zero on, m"),
    (S.Blade([0, 0, 0], [0, 0, 1], [1]), "chords has 1 entries; pass at least two"),
    (S.Blade([0, 0, 0], [0, 0, 1], [1, 1], direction=[0, 0, 0]), "direction is zero"),
    (S.Blade([0, 0, 0], [0, 0, 1], [1, 1], thickness=0), "thickness is 0"),
    (S.Line([[0, 0, 0]]), "points has 1 points; pass at least two"), (S.Line([[0, 0, 0], [1, 0, 0]], width=0), "width is 0"),
    (S.Line([[0, 0, 0]], to="hull"), "to is 'hull'; pass a body and a point on it"),
    (S.Line([[0, 0, 0]], to=("keel", [0, 0, 0])), "Line of 'hull' is 'keel', which is no body of the system"),
    (S.Water(), "the water surface stays in place; draw it on system.ground"),
    (S.Box([sd.parameters("w"), 1, 1]), "Box of 'hull' uses w, which the mechanism does not have for a parameter; there are h"),
    (S.Box(["1", 1, 1]), "is the text '1'; text is never evaluated"), ("box", "a shape of 'hull' is 'box'"),
])
def test_faults_of_shapes_are_reported_with_numbers(shape: Any, message: str) -> None:
    system = buoy()
    system.draw("hull", shape)
    with pytest.raises(ModelError, match=message):
        system.check()


def test_other_faults_of_drawing_are_reported() -> None:
    system = buoy()
    system.draw("keel", S.Box([1, 1, 1]), color="#12")
    system.draw("hull")
    system.draw("hull", S.Box([1, 1, 1]), color=(2, 0, 0))
    system.draw(system.ground, S.Water([1, 2, 3], center=[0]), S.Box([1, 1, 1]))
    system.move_ground([sd.t, 0, 0])
    with pytest.raises(ModelError) as caught:
        system.check()
    for told in ("Box of 'keel' is 'keel', which is no body", "the colour of 'keel' is '#12'",
                 "draw was given no shape for 'hull'", "the colour of 'hull' is [2.0, 0.0, 0.0]", "size has 3 components; pass 2",
                 "center has 1 components; pass 2", "Box of 'ground': shapes are not drawn on a ground that moves"):
        assert told in str(caught.value), (told, str(caught.value))
    plane = sd.systems.pendulum()
    plane.draw(plane.ground, S.Water())
    with pytest.raises(ModelError, match="in sight in systems in space only"):
        plane.check()
