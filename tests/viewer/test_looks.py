"""Look of bodies and joints by rules: sizes against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

import symdyn as sd
from symdyn.pictures.looks import PALETTE, Item, Mechanism, looks_of
from symdyn.viewer.live import mechanism_of


def looks(system: sd.System) -> tuple[list[Item], Mechanism, float]:
    mechanism, _ = mechanism_of(system.check())
    items, length = looks_of(mechanism)
    return [item for item in items if not item.layer], mechanism, length


def free(inertia: list[float]) -> Item:
    system = sd.System("one")
    body = system.add_body("body", mass=2.0, inertia=inertia)
    system.add_joint(sd.Free("free", system.ground, body))
    (item,), _, _ = looks(system)
    return item


def test_a_free_body_has_its_inertia() -> None:
    """Ball 2/5 m r², cylinder m r²/2 and m (r²/4 + l²/12), box m (b² + c²)/12."""
    ball = free([2 / 5 * 2 * 0.3**2] * 3)
    assert ball.kind == "ball" and ball.size == pytest.approx((0.3,))
    across, along = 2 * (0.4**2 / 4 + 0.6**2 / 12), 2 * 0.4**2 / 2
    cylinder = free([across, along, across])
    assert cylinder.kind == "rod" and cylinder.size == pytest.approx((0.4, 0.4))
    ends = np.abs([end[1:] for end in cylinder.ends])
    np.testing.assert_allclose(ends, [[0, 0.3, 0]] * 2, atol=1e-12)
    a, b, c = 0.4, 0.6, 0.9
    box = free([2 / 12 * (b * b + c * c), 2 / 12 * (a * a + c * c), 2 / 12 * (a * a + b * b)])
    sides = np.abs(np.reshape(box.turn, (3, 3))) @ box.size
    assert box.kind == "box"
    np.testing.assert_allclose(2 * sides, [a, b, c], rtol=1e-12)


def test_a_uniform_rod_reaches_to_its_end() -> None:
    """The last link of a pendulum has no joint at its end: its length follows from its inertia, m l²/12."""
    q = sd.coordinates("q")
    system = sd.System("pendulum", gravity=[0, -9.81])
    rod = system.add_body("rod", mass=3, inertia=3 * 1.4**2 / 12, com=[0.7, 0])
    system.add_joint(sd.Revolute("pin", system.ground, rod, coordinate=q))
    items, mechanism, _ = looks(system)
    (drawn,) = [item for item in items if item.name == "rod"]
    np.testing.assert_allclose(mechanism.at(drawn.ends[1]), [1.4, 0, 0], atol=1e-12)
    assert {item.kind for item in items} == {"rod", "pin", "stand"}


def test_a_point_mass_is_a_ball_on_a_rod() -> None:
    items, mechanism, _ = looks(sd.systems.pendulum())
    own = [item for item in items if item.body == 0 and item.name == "bob"]
    assert [item.kind for item in own] == ["rod", "ball"] and all(item.color == PALETTE[0] for item in own)
    np.testing.assert_allclose(mechanism.at(own[1].ends[0]), mechanism.centres[0])


def test_a_wheel_is_a_disc_about_its_axle() -> None:
    q, x = sd.coordinates("q x")
    system = sd.System("wheel")
    cart = system.add_body("cart", mass=1)
    wheel = system.add_body("wheel", mass=2, inertia=[0.5 * 2 * 0.25 / 2, 0.5 * 2 * 0.25, 0.5 * 2 * 0.25 / 2])
    system.add_joint(sd.Prismatic("rail", system.ground, cart, axis=[1, 0, 0], coordinate=x))
    system.add_joint(sd.Revolute("axle", cart, wheel, axis=[0, 1, 0], coordinate=q))
    items, _, length = looks(system)
    (disc,) = [item for item in items if item.kind == "disc"]
    assert disc.size[0] == pytest.approx(min(0.5, 0.5 * length)) and disc.axis == 1
    assert {"block", "pin", "rod"} <= {item.kind for item in items}


def test_a_line_to_another_body_leaves_its_first_as_it_looks() -> None:
    system = sd.systems.pendulum()
    before, _, _ = looks(system)
    system.draw("bob", sd.shapes.Line([[0, -0.5]], to=(system.ground, [1, 0])))
    assert looks(system)[0] == before
    system.draw("bob", sd.shapes.Line([[0, 0], [0, -1]]))
    assert not [item for item in looks(system)[0] if item.name == "bob"]


def test_springs_and_dampers() -> None:
    y = sd.coordinates("y")
    system = sd.System("oscillator", gravity=[0, -9.81])
    block = system.add_body("block", mass=1)
    system.add_joint(sd.Prismatic("guide", system.ground, block, axis=[0, 1], coordinate=y))
    for name, values in (("a", {"stiffness": 5}), ("b", {"damping": 2}), ("c", {"stiffness": 5, "damping": 2})):
        system.add_spring_damper(system.ground, block, [0, 1], **values, name=name)
    system.add_force_between(system.ground, block, 3, [0, 1], name="d")
    items, mechanism, _ = looks(system)
    found = {item.name: item for item in items if item.kind in ("spring", "damper", "both", "thread")}
    assert set(found) == {"a (spring)", "b (damper)", "c (spring and damper)", "d (force)"}
    for item in found.values():
        np.testing.assert_allclose([mechanism.at(end) for end in item.ends], [[0, 1, 0], [0, 0, 0]], atol=1e-12)


@pytest.mark.parametrize(("gravity", "up"), [([0, 0, 9.81], (0, 0, -1)), ([0, 0, -9.81], (0, 0, 1)), ([-1, 0, 0], (1, 0, 0)),
                                             ([1, 1, 0], (0, 0, 1)), (None, (0, 0, 1))])
def test_up_is_against_gravity(gravity: list[float] | None, up: tuple[float, ...]) -> None:
    system = sd.System("one", gravity=gravity)
    body = system.add_body("body", mass=1, com=[0, 0, 1])
    system.add_joint(sd.Revolute("pin", system.ground, body, axis=[1, 0, 0]))
    assert looks(system)[1].up == pytest.approx(up)


def test_joint_axes_and_spring_ends_are_functions() -> None:
    """The axis in the n-frame turns with the parent: that of joint 3 of the PUMA stays parallel to that of joint 2."""
    module = sd.systems.puma560().compile(backend="numpy")
    rng = np.random.default_rng(1)
    for q in rng.uniform(-2, 2, (3, 6)):
        axes = module.evaluate("joint_axes", 0.0, np.concatenate([q, np.zeros(6)]), None, np.zeros(0))
        np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1.0, atol=1e-13)
        np.testing.assert_allclose(axes[0], [0, 0, 1], atol=1e-13)
        np.testing.assert_allclose(axes[2], axes[1], atol=1e-13)
        assert abs(axes[1] @ axes[0]) < 1e-13


def test_bodies_without_mass_that_only_slide_are_no_rails() -> None:
    """A hip that two sliders let move freely in its plane, with a leg: of the carrier between them nothing is seen."""
    x, y, q = sd.coordinates("x y q")
    system = sd.System("hip", gravity=[0, -9.81])
    carrier, hip, leg = system.add_body("carrier"), system.add_body("hip", mass=1), system.add_body("leg", mass=1, com=[0, -1])
    system.add_joint(sd.Prismatic("along", system.ground, carrier, axis=[1, 0], coordinate=x))
    system.add_joint(sd.Prismatic("across", carrier, hip, axis=[0, 1], coordinate=y))
    system.add_joint(sd.Revolute("joint", hip, leg, coordinate=q))
    mechanism, _ = mechanism_of(system.check())
    assert mechanism.carriers == {0}
    items = [item for item in looks_of(mechanism)[0] if not item.layer]
    assert sorted(item.kind for item in items) == ["ball", "ball", "pin", "rod"]


def test_what_touches_is_as_large_as_its_contacts() -> None:
    """A box to its corners, a wheel to its rim, before anything moves."""
    system = sd.System("blocks", gravity=[0, 0, -9.81])
    box = system.add_body("box", mass=2, inertia=[0.1, 0.2, 0.3])
    wheel = system.add_body("wheel", mass=1, inertia=[0.01, 0.02, 0.01])
    system.add_joint(sd.Free("of_box", system.ground, box, orientation=sd.EulerParameters()))
    system.add_joint(sd.Free("of_wheel", system.ground, wheel))
    system.add_contact(sd.Contact("corners", box, system.ground, shape=sd.contacts.Box([0.4, 0.6, 0.2]), friction=0.3))
    system.add_contact(sd.Contact("rim", wheel, system.ground, shape=sd.contacts.Disc(0.35, axis=[0, 1, 0]), friction=0.3))
    items, mechanism, _ = looks(system)
    (block,) = [item for item in items if item.kind == "box"]
    np.testing.assert_allclose(block.size, [0.2, 0.3, 0.1])
    (disc,) = [item for item in items if item.name == "wheel"]
    np.testing.assert_allclose(disc.size, 0.35)
    axle = np.subtract(mechanism.at(disc.ends[1]), mechanism.at(disc.ends[0]))
    np.testing.assert_allclose(np.abs(axle / np.linalg.norm(axle)), [0, 1, 0], atol=1e-12)
