"""System.diagnose: freedoms by count and by rank, redundant and contradictory constraints, singular states, idle motions."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from tests.helpers import swept


def parallel(axis: tuple = (0, 0, 1), closing: str = "revolute", reach: float = 2.0) -> sd.System:
    """A four-bar linkage in space whose axes are all parallel."""
    q = sd.coordinates("q1:4")
    s = sd.System("parallel", gravity=[0, 0, -9.81])
    parent, at = s.ground, [0, 0, 0]
    for k, length in enumerate((1, 2, 2)):
        bar = s.add_body(f"bar{k}", mass=1, inertia=[1, 1, 1], com=[length / 2, 0, 0])
        s.add_joint(sd.Revolute(f"hinge{k}", parent, bar, q[k], axis=list(axis), parent_point=at))
        parent, at = bar, [length, 0, 0]
    kind = sd.Revolute if closing == "revolute" else sd.Spherical
    axes = {"axis": list(axis)} if closing == "revolute" else {}
    s.close_loop(kind("close", s.ground, parent, parent_point=[reach, 0, 0], child_point=at, **axes))
    s.initial = {q[0]: 1.0, q[1]: -0.3, q[2]: -1.0}
    return s


def two_bars(name: str, second_on_ground: bool = False) -> tuple[sd.System, tuple]:
    q = sd.coordinates("q1:3")
    s = sd.System(name, gravity=[0, -9.81])
    a, b = (s.add_body(n, mass=1, inertia=1, com=[0.5, 0]) for n in "ab")
    s.add_joint(sd.Revolute("A", s.ground, a, q[0]))
    s.add_joint(sd.Revolute("B", s.ground if second_on_ground else a, b, q[1], parent_point=[1, 0]))
    return s, q


def ball_jointed_rod(axial: float = 0.01, second: str = "spherical") -> sd.System:
    """A crank, a rod between two ball joints, a slider."""
    c, d = sd.coordinates("c d")
    s = sd.System("rod_between_balls", gravity=[0, 0, -9.81])
    crank = s.add_body("crank", mass=1, inertia=[1, 1, 1], com=[0, 0.2, 0])
    rod = s.add_body("rod", mass=1, inertia=[axial, 1, 1], com=[1, 0, 0])
    slider = s.add_body("slider", mass=2)
    s.add_joint(sd.Revolute("A", s.ground, crank, c, axis=[0, 0, 1]))
    if second == "spherical":
        s.add_joint(sd.Spherical("B", crank, rod, sd.coordinates("e1:4"), parent_point=[0, 0.5, 0]))
    else:
        s.add_joint(sd.Universal("B", crank, rod, sd.coordinates("e1:3"), axes=([0, 0, 1], [0, 1, 0]), parent_point=[0, 0.5, 0]))
    s.add_joint(sd.Prismatic("G", s.ground, slider, d, axis=[1, 0, 0]))
    s.close_loop(sd.Spherical("S", slider, rod, child_point=[2, 0, 0]))
    s.initial = {c: 0.5, d: 1.5, "e1": -0.7}
    return s


def test_a_sound_linkage_is_healthy() -> None:
    found = sd.systems.get("four_bar").diagnose()
    assert found.healthy and (found.by_count, found.by_rank, found.at_state) == (1, 1, 1)
    assert found.dependencies == found.singular == found.idle == found.massless == found.still == ()
    assert found.parts == (("bar1", "bar2", "bar3"),) and found.smallest > 0.1
    text = str(found)
    assert "3 bodies with 3 freedoms each: 9" in text and "No constraint is redundant." in text
    assert "No singular configuration up to 3.14" in text


def test_bricard_has_one_redundant_row() -> None:
    found = sd.systems.get("bricard").diagnose()
    assert (found.by_count, found.by_rank) == (0, 1)
    (one,) = found.redundant
    assert one.row.startswith("P6_") and len(one.implied_by) == 4 and one.joints == ("P6",) and one.always
    assert any(note.startswith(f"constraints {one.row}: they depend") for note in sd.systems.get("bricard").augmented().notes)
    assert any(one.row in line and "accelerations stay the same" in line for line in found.advice)


@pytest.mark.parametrize("axis", [(0, 0, 1), (0, sp.Rational(3, 5), sp.Rational(4, 5))], ids=["z", "tilted"])
def test_parallel_axes_make_three_rows_redundant(axis: tuple) -> None:
    found = parallel(axis).diagnose()
    assert (found.by_count, found.by_rank, len(found.redundant)) == (-2, 1, 3)
    assert any("sd.Spherical in place of the revolute joint close" in line and "2 rows fewer" in line for line in found.advice)
    assert len(parallel(axis, "spherical").diagnose().redundant) == 1


def test_leaving_out_what_is_advised_keeps_the_accelerations() -> None:
    def tied(left_out: tuple = ()) -> sd.System:
        s, q = two_bars("pair", True)
        rows = {"plain": q[0] - q[1], "sines": sp.sin(q[0]) - sp.sin(q[1]), "twice": 2 * q[0] - 2 * q[1]}
        for name in [n for n in rows if n not in left_out]:
            s.add_constraint(rows[name], name)
        return s

    advised = tuple(d.row for d in tied().diagnose().redundant)
    assert len(advised) == 2
    x = [0.4, 0.4, 0.1, 0.1]
    full, less = (s.augmented().compile(backend="numpy").rhs(0, x) for s in (tied(), tied(advised)))
    assert np.allclose(full, less, atol=1e-12)


def test_windows_lose_rank_where_they_lie_flat() -> None:
    found = sd.systems.get("n_four_bar").diagnose()
    flat = [s for s in found.singular if s.lost]
    assert len(flat) == 2 and all(abs(abs(s.q["theta0"]) - np.pi / 2) < 1e-5 for s in flat)
    assert all(abs(s.distance - np.pi / 2) < 1e-4 and {"B1_x", "B2_x"} == set(s.rows) for s in flat)
    there = sd.systems.get("n_four_bar").diagnose(q=[np.pi / 2] * 3 + [-np.pi / 2] * 2)
    assert (there.by_rank, there.at_state) == (1, 3)
    assert {d.row for d in there.dependencies if not d.always} == {"B1_x", "B2_x"}
    assert there.singular[0].distance == 0 and not there.redundant


def test_a_constraint_whose_gradient_vanishes_at_the_fold() -> None:
    found = sd.systems.get("slider_crank").diagnose()
    (fold,) = found.singular
    assert fold.lost and fold.rows == ("slider",)
    assert abs(fold.q["theta"] - np.pi / 2) < 1e-5 and abs(fold.q["phi"] + np.pi) < 1e-5
    assert sd.systems.get("slider_crank").diagnose(reach=1.0).singular == ()


def test_a_truss_cannot_move() -> None:
    s, q = two_bars("truss", True)
    s.close_loop(sd.Revolute("C", "a", "b", parent_point=[1, 0], child_point=[1, 0]))
    s.close_loop(sd.Rod("D", s.ground, "a", sp.sqrt(3) / 2, parent_point=[0.5, 0], child_point=[1, 0]))
    s.initial = {q[0]: 1.0, q[1]: 2.0}
    found = s.diagnose()
    assert (found.by_count, found.by_rank, found.still) == (-1, 0, ("a", "b"))
    assert found.moved > 0.01 and [d.row for d in found.redundant] == ["D"]
    assert any("nothing can move" in line for line in found.advice)


def test_a_stretched_pair_moves_infinitesimally_only() -> None:
    s, _ = two_bars("stretched")
    s.close_loop(sd.Revolute("C", s.ground, "b", parent_point=[2, 0], child_point=[1, 0]))
    found = s.diagnose()
    assert found.by_rank == 1 and found.by_count == 0
    assert any("infinitesimal" in line for line in found.remarks) and not found.advice


def test_contradictory_constraints_are_reported_by_row() -> None:
    s, q = two_bars("contradictory")
    s.add_constraint(q[0] + q[1], "one")
    s.add_constraint(2 * q[0] + 2 * q[1] - 1, "two")
    found = s.diagnose()
    assert not found.consistent and set(found.residuals) == {"one", "two"} and not found.healthy
    assert any("two contradicts one" in fault for fault in found.faults)
    assert "No state near fulfils" in str(found)


def test_a_linkage_that_cannot_be_assembled() -> None:
    found = parallel(reach=9.0).diagnose()
    assert not found.consistent and not found.faults and "close_x" in found.residuals
    assert abs(found.residuals["close_x"]) > 0.1


def test_what_no_motion_changes_is_reported_not_raised() -> None:
    s, _ = two_bars("offset")
    s.add_body("c", mass=1, inertia=1)
    s.add_joint(sd.Revolute("third", s.ground, "c", sd.coordinates("q3"), parent_point=[0, 1]))
    s.close_loop(sd.Revolute("impossible", s.ground, "c", parent_point=[0, 3]))
    found = s.diagnose()
    assert not found.consistent and "impossible" in found.faults[0]


def test_the_idle_rotation_of_a_rod_between_ball_joints() -> None:
    found = ball_jointed_rod().diagnose()
    assert found.idle == ("rod",) and found.by_rank == 2 and not found.massless
    assert any("sd.Universal in place of the spherical joint B" in line for line in found.advice)
    assert ball_jointed_rod(second="universal").diagnose().idle == ()


@pytest.mark.filterwarnings("ignore::symdyn.ModelWarning")
def test_a_rotation_without_inertia_moves_no_mass() -> None:
    found = ball_jointed_rod(axial=0.0).diagnose()
    assert found.massless and set(found.massless) <= {"e1_dot", "e2_dot", "e3_dot"}
    assert any("mass or inertia" in line for line in found.advice)


@pytest.mark.parametrize("name", ["spatial_slider_crank", *swept(["double_wishbone"]), "rolling_disc"])
def test_nothing_idle_where_there_is_none(name: str) -> None:
    assert sd.systems.get(name).diagnose(reach=0.5).idle == ()


def test_parts_that_move_independently() -> None:
    s = sd.System("pair", gravity=[0, -9.81])
    for name, q in zip("ab", sd.coordinates("qa qb"), strict=True):
        s.add_body(name, mass=1, inertia=1, com=[1, 0])
        s.add_joint(sd.Revolute(f"pin_{name}", s.ground, name, q))
    found = s.diagnose()
    assert found.parts == (("a",), ("b",)) and found.by_rank == 2 and found.rows == 0
    assert "no loops or constraints: 2 degrees of freedom" in str(found)
    assert len(sd.systems.get("double_pendulum").diagnose().parts) == 1


def test_parameters_without_numbers() -> None:
    x, y = sd.coordinates("x y")
    m, l = sd.parameters("m l")
    s = sd.System("bob", gravity=[0, -9.81])
    body = s.add_body("body", mass=m)
    s.add_joint(sd.Custom("free", s.ground, body, [x, y], position=[x, y, 0]))
    s.close_loop(sd.Rod("rod", s.ground, body, l))
    found = s.diagnose()
    assert found.by_rank == 1 and found.remarks[0].startswith("m, l: no numbers")
    given = s.diagnose(q={x: 3}, params={m: 1, "l": 2})
    assert not given.remarks and given.state == pytest.approx({"x": 2.0, "y": 0.0}) and given.moved == pytest.approx(1.0)
    with pytest.raises(sd.SymdynError, match="there are m, l"):
        s.diagnose(params={"k": 1})


@pytest.mark.parametrize(("asked", "message"), [
    ({"t": "x"}, "four_bar: pass a finite number of seconds as t, found 'x'"),
    ({"t": float("inf")}, "seconds as t, found inf"), ({"reach": None}, "from 0 on as reach, .* found None"),
    ({"reach": "x"}, "pass an angle from 0 on as reach, rad .default: 3.142., found 'x'"),
    ({"reach": -1}, "pass an angle from 0 on as reach, rad .default: 3.142., found -1")])
def test_what_is_no_time_or_reach(asked: dict, message: str) -> None:
    with pytest.raises(sd.SymdynError, match=message):
        sd.systems.get("four_bar").diagnose(**asked)


def test_absolute_coordinates() -> None:
    found = sd.systems.get("four_bar").diagnose(coordinates="absolute", reach=0.5)
    assert (found.speeds, found.rows, found.by_rank) == (9, 8, 1) and found.healthy
    with pytest.raises(sd.SymdynError, match="there are 'relative' and 'absolute'"):
        sd.systems.get("four_bar").diagnose(coordinates="other")
