"""Groups of bodies that touch one another: closed forms of two and three of them, piles, momentum, all pairs, errors."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

import symdyn as sd
from symdyn.errors import ArgumentError, ModelError, SimulationWarning
from symdyn.runtime.building.compiler import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
G, R = 9.81, 0.05
Sphere, Plane = sd.contacts.Sphere, sd.contacts.Plane


def grains(n: int, gravity: float = G, **options: object) -> sd.Module:
    """Spheres in space."""
    system = sd.System("grains", gravity=[0, 0, -gravity])
    bodies = [system.add_body(f"ball_{k}", mass=1.0, inertia=[0.4 * R**2] * 3) for k in range(n)]
    for k, body in enumerate(bodies):
        system.add_joint(sd.Free(f"joint_{k}", system.ground, body, orientation=sd.EulerParameters()))
    system.add_contact(sd.ContactGroup("grains", bodies, Sphere(R), **options))  # type: ignore[arg-type]
    return system.compile()


def state(positions: np.ndarray) -> np.ndarray:
    """Coordinates of spheres at positions (n, 3)."""
    return np.hstack([positions, np.tile([1.0, 0, 0, 0], (len(positions), 1))]).ravel()


def moving(velocities: np.ndarray) -> np.ndarray:
    """Speeds of spheres that do not spin."""
    return np.hstack([velocities, np.zeros_like(velocities)]).ravel()


@pytest.mark.parametrize("restitution", [1.0, 0.5])
def test_two_spheres_that_meet_askew(restitution: float) -> None:
    """Without friction the components along the line of centres are exchanged, as far as restitution says."""
    module = grains(2, 0.0, restitution=restitution)
    offset = 0.06
    solution = module.simulate((0, 0.2), q=state(np.array([[0, 0, 0], [0.2, offset, 0]])),
                               u=moving(np.array([[1.0, 0, 0], [0, 0, 0]])), method="moreau", step=1e-4)
    normal = np.array([np.sqrt((2 * R) ** 2 - offset**2), offset, 0]) / (2 * R)
    passed = (1 + restitution) / 2 * normal[0] * normal
    u = solution.u[-1].reshape(2, 6)
    np.testing.assert_allclose(u[:, :3], [[1, 0, 0] - passed, passed], atol=5e-3)
    np.testing.assert_allclose(u[:, :3].sum(axis=0), [1, 0, 0], atol=1e-14)  # momentum
    found = solution.contact_groups["grains"]
    assert set(found.a) == {1} and set(found.b) == {0}
    lost = -solution.energy_balance["contact grains"][-1]
    assert lost == pytest.approx((1 - restitution**2) / 4 * normal[0] ** 2, abs=5e-3)


def test_rough_spheres_begin_to_spin_and_keep_their_angular_momentum() -> None:
    module = grains(2, 0.0, friction=0.4, restitution=0.3)
    positions, velocities = np.array([[0, 0, 0], [0.2, 0.05, 0.02]]), np.array([[1.0, 0, 0], [-0.5, 0.1, 0]])
    solution = module.simulate((0, 0.3), q=state(positions), u=moving(velocities), method="moreau", step=1e-4)
    q, u = solution.q.reshape(-1, 2, 7), solution.u.reshape(-1, 2, 6)
    spin = u[-1, :, 3:]
    assert np.abs(spin).max() > 1
    np.testing.assert_allclose(u[-1, :, :3].sum(axis=0), velocities.sum(axis=0), atol=1e-14)
    orbital = np.cross(q[:, :, :3], u[:, :, :3]).sum(axis=1)
    hit = solution.contact_groups["grains"]
    assert (hit.friction <= 0.4 * hit.normal + 1e-9).all()
    sliding = (hit.mode == "sliding") & (hit.normal > 0)
    np.testing.assert_allclose(hit.friction[sliding], 0.4 * hit.normal[sliding], rtol=1e-6)
    change = orbital[-1] - orbital[0]
    assert np.linalg.norm(change + 0.4 * R**2 * spin.sum(axis=0)) < 2e-3 * np.linalg.norm(change) + 1e-6


def test_a_pile_of_three_rests_on_the_floor() -> None:
    module = grains(3, planes=[Plane()], friction=0.5)
    tower = np.array([[0, 0, R], [0, 0, 3 * R], [0, 0, 5 * R]])
    solution = module.simulate((0, 0.2), q=state(tower), method="auto", step=1e-2)
    assert solution.method == "moreau" and solution.why == "contacts of a group are found in steps of one length"
    np.testing.assert_allclose(solution.q[-1], state(tower), atol=1e-7)
    last = solution.contact_groups["grains"]
    at_end = last.row == len(solution.t) - 1
    forces = dict(zip(zip(last.a[at_end], last.b[at_end], strict=True), last.normal[at_end], strict=True))
    assert set(forces) == {(0, 3), (1, 0), (2, 1)}
    np.testing.assert_allclose([forces[0, 3], forces[1, 0], forces[2, 1]], [3 * G, 2 * G, G], rtol=1e-5)
    with pytest.raises(ArgumentError, match="rhs depends on the forces in the contact groups"):
        solution.rows("rhs")


def test_the_grid_finds_what_all_pairs_find() -> None:
    """Spheres thrown at each other: no two overlap at any time, and momentum stays."""
    generator, n = np.random.default_rng(5), 12
    places = [[x, y, z] for x in (0, 0.13, 0.26) for y in (0, 0.12) for z in (0.06, 0.2)]
    positions = generator.permutation(np.array(places))
    velocities = -3 * (positions - positions.mean(axis=0)) + generator.normal(0, 0.2, (n, 3))
    solution = grains(n, 0.0, restitution=0.4, friction=0.3).simulate(
        (0, 0.3), q=state(positions), u=moving(velocities), method="moreau", step=2e-3)
    q = solution.q.reshape(-1, n, 7)[:, :, :3]
    gaps = [np.linalg.norm(q[:, i] - q[:, j], axis=1).min() - 2 * R for i, j in combinations(range(n), 2)]
    assert min(gaps) > -1e-6
    assert sum(gap < 1e-3 for gap in gaps) > 10  # they did meet
    total = solution.u.reshape(-1, n, 6)[:, :, :3].sum(axis=1)
    np.testing.assert_allclose(total, np.tile(velocities.sum(axis=0), (len(total), 1)), atol=1e-12)
    assert solution.stepped is not None and solution.stepped.residual < 1e-6


def test_discs_in_a_plane_agree_with_contacts_that_are_named_one_by_one() -> None:
    def scene(grouped: bool) -> sd.Module:
        system = sd.System("discs", gravity=[0, -G])
        bodies = [system.add_body(f"disc_{k}", mass=1.0 + k, inertia=0.002) for k in range(2)]
        for k, body in enumerate(bodies):
            system.add_joint(sd.Planar(f"joint_{k}", system.ground, body))
        if grouped:
            system.add_contact(sd.ContactGroup("all", bodies, [Sphere(0.1), Sphere(0.05)], planes=[Plane()], friction=0.3))
        else:
            system.add_contact(sd.Contact("one", bodies[0], system.ground, shape=Sphere(0.1), friction=0.3))
            system.add_contact(sd.Contact("two", bodies[1], system.ground, shape=Sphere(0.05), friction=0.3))
            system.add_contact(sd.Contact("both", bodies[1], bodies[0], shape=(Sphere(0.05), Sphere(0.1)), friction=0.3))
        return system.compile()

    start = {"q": [0, 0.1, 0, 0.03, 0.27, 0], "u": [0.4, 0, 0, 0, 0, 0]}
    one, other = (scene(grouped).simulate((0, 0.4), method="moreau", step=1e-3, **start) for grouped in (True, False))
    np.testing.assert_allclose(one.q, other.q, atol=1e-8)


def test_what_does_not_fit_is_rejected() -> None:
    module = grains(2, planes=[Plane()])
    apart = state(np.array([[0, 0, 1.0], [0.2, 0, 1.0]]))
    with pytest.raises(ArgumentError, match="contacts of the group grains are found in steps; pass method='moreau'"):
        module.simulate((0, 1), q=apart)
    with pytest.raises(ArgumentError, match=r"2 of its pairs overlap at the start, the deepest ball_1 and a plane by 0\.04 m"):
        module.simulate((0, 1), q=state(np.array([[0, 0, 0.05], [0.09, 0, 0.01]])), method="moreau", step=1e-2)
    system = sd.System("chain", gravity=[0, 0, -G])
    one, two = system.add_body("one", mass=1), system.add_body("two", mass=1)
    system.add_joint(sd.Free("free", system.ground, one))
    system.add_joint(sd.Prismatic("on_it", one, two, axis=[0, 0, 1]))
    system.add_contact(sd.ContactGroup("links", [one, two], Sphere(0.1)))
    with pytest.raises(ModelError, match="body 'one' is not free; each of its bodies hangs on a Free joint"):
        system.check()
    for options, message in (({"restitution": 1.5}, "restitution is 1.5, which would gain energy"),
                             ({"friction": -0.1}, "static friction is -0.1; pass a number that is not negative"),
                             ({"friction": (0.1, 0.2)}, "kinetic friction 0.2 is above static friction 0.1"),
                             ({"friction": (0.1, 0.2, 0.3)}, "pass a coefficient, or a pair"),
                             ({"planes": [1]}, "planes are .*; pass a list of sd.contacts.Plane"),
                             ({"planes": [Plane([0, 0, 0])]}, "the normal of a plane is zero")):
        with pytest.raises(ModelError, match=message):
            grains(2, **options)
    for bodies, shape, message in (([], Sphere(1), "pass a list of bodies"), (["a"], 3, "pass one sd.contacts.Sphere"),
                                   (["a", "a"], Sphere(1), "a is in it twice"), (["a"], Sphere(-1), "a radius is not positive"),
                                   (["b"], Sphere(1), "body 'b' is not free")):
        system = sd.System("few", gravity=[0, 0, -G])
        system.add_joint(sd.Free("free", system.ground, system.add_body("a", mass=1, inertia=[1, 1, 1])))
        system.add_contact(sd.ContactGroup("group", bodies, shape))
        with pytest.raises(ModelError, match=message):
            system.check()


def test_more_contacts_than_there_is_room_for_end_the_run() -> None:
    """A large sphere among very small ones has more of them around it than equal spheres can have."""
    system = sd.System("crowd", gravity=[0, 0, 0])
    radii = [1.0] + [0.01] * 2
    bodies = [system.add_body(f"ball_{k}", mass=1.0, inertia=[1, 1, 1]) for k in range(len(radii))]
    for k, body in enumerate(bodies):
        system.add_joint(sd.Free(f"joint_{k}", system.ground, body, orientation=sd.EulerParameters()))
    planes = [Plane([0, 0, 1], [0, 0, -1 - 1e-3 * k]) for k in range(60)]
    system.add_contact(sd.ContactGroup("crowd", bodies, [Sphere(r) for r in radii], planes=planes))
    positions = np.array([[0, 0, 0.06], [3, 0, 0], [5, 0, 0]])
    with pytest.warns(SimulationWarning, match="more than .* contacts at once"):
        assert not system.compile().simulate((0, 1), q=state(positions), u=moving(np.array([[0, 0, -10.0], [0] * 3, [0] * 3])),
                                             method="moreau", step=0.1).success
