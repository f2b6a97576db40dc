"""Directions without stiffness, and directions whose stiffness is lost in the digits of larger terms."""

from __future__ import annotations

from typing import Any

import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import EquilibriumNotUnique

A, B, C, Z = sd.coordinates("a b c z")
STIFF, SOFT = sd.parameters("K k")
F = sd.inputs("F")


def rails(*forces: Any, constraint: Any = None, rate: Any = None) -> Any:
    """Masses of 1 kg on parallel rails with coordinates a, b, c under these forces; K = 1e12 N/m and k = 1e-6 N/m."""
    s = sd.System("rails", planar=True)
    for k, (q, force) in enumerate(zip((A, B, C), forces, strict=False)):
        s.add_joint(sd.Prismatic(f"rail {k}", s.ground, s.add_body(f"mass {k}", mass=1), q, axis=[1, 0]))
        s.add_joint_force(f"rail {k}", force)
    if rate is not None:
        s.add_state(Z, rate)
    if constraint is not None:
        s.add_constraint(constraint)
    used = {symbol for each in (*forces, rate or 0) for symbol in sp.sympify(each).free_symbols}
    s.defaults = {p: v for p, v in ((STIFF, 1e12), (SOFT, 1e-6)) if p in used}
    return (s.embedding() if constraint is None else s.augmented()).compile(backend="numpy")


SIZES = r"loads make a stiffness of 1e-06 N/m in sums of terms of \de\+12 N/m, known to 0.0\d+ N/m only; fix it"
UNDECIDED = "rails: whether the equilibrium is unique is not decided by the digits: along "


def test_a_stiffness_that_is_lost_in_rounding_is_not_called_none() -> None:
    """Two masses K apart, one of them on k: the sum of both forces is -k b, which K + k in doubles no longer holds."""
    coupled = -STIFF * (A - B)
    with pytest.raises(EquilibriumNotUnique, match=UNDECIDED + r"b \(0.50\), a \(0.50\) " + SIZES):
        rails(coupled, -coupled - SOFT * B).equilibrium()
    with pytest.raises(EquilibriumNotUnique, match=r"is not unique: there is no stiffness along b \(0.50\), a \(0.50\)"):
        rails(coupled, -coupled).equilibrium()
    assert rails(coupled, -coupled - SOFT * B).equilibrium(params={SOFT: 100.0}).verdict == "neutral"
    assert rails(-STIFF * A, -SOFT * B).equilibrium().verdict == "neutral"  # uncoupled, every digit of k counts


def test_loads_that_cancel_are_not_called_none() -> None:
    """0.1 + 0.2 - 0.3 next to k b, and a third mass that nothing holds."""
    p = sd.parameters("p1:4")
    s = sd.System("balanced", planar=True)
    s.add_joint(sd.Prismatic("rail", s.ground, s.add_body("mass", mass=1), A, axis=[1, 0]))
    s.add_joint_force("rail", -(p[0] + p[1] - p[2]) * A)
    s.defaults = dict(zip(p, (0.1, 0.2, 0.3), strict=True))
    with pytest.raises(EquilibriumNotUnique, match=r"a \(1.00\) loads make a stiffness of .*e-17 N/m in sums of .* 0.3"):
        s.embedding().compile(backend="numpy").equilibrium()
    coupled = -STIFF * (A - B)
    with pytest.raises(EquilibriumNotUnique, match=r"not decided by the digits: .*; there is no stiffness along c \(1.00\); "
                                                   r"fix it, as by fixed=\{.*\}, or add a load that holds it, or bring the"):
        rails(coupled, -coupled - SOFT * B, 0 * C).equilibrium()


def test_stiffness_of_a_coordinate_without_a_unit_is_a_moment() -> None:
    """Speeds in 1/s count as turning, as everywhere: what acts along them is a moment."""
    p = sd.parameters("p1:4")
    s = sd.System("balanced")
    s.add_joint(sd.Custom("wire", s.ground, s.add_body("bead", mass=1), [A], None, [A, 0, 0]))
    s.add_joint_force("wire", -(p[0] + p[1] - p[2]) * A)
    s.defaults = dict(zip(p, (0.1, 0.2, 0.3), strict=True))
    with pytest.raises(EquilibriumNotUnique, match=r"a \(1.00\) loads make a stiffness of .*e-17 N m in sums of terms of 0.3"):
        s.embedding().compile(backend="numpy").equilibrium()


def test_stiffness_under_constraints_and_with_extra_states() -> None:
    """A constraint in place of the spring K leaves nothing to cancel; an integrator that acts with k is one of the loads."""
    assert rails(-SOFT * A, 0 * B, constraint=A - B).equilibrium().verdict == "neutral"
    coupled = -STIFF * (A - B)
    with pytest.raises(EquilibriumNotUnique, match=UNDECIDED + r"b \(0.50\), a \(0.50\) " + SIZES):
        rails(coupled, -coupled - SOFT * Z, rate=B - Z).equilibrium()
    with pytest.raises(EquilibriumNotUnique, match=UNDECIDED + r"b \(0.50\), a \(0.50\) " + SIZES):
        rails(coupled, -coupled - SOFT * B, -C, constraint=C - sp.Rational(1, 2) * (A - B)).equilibrium()


def test_a_soft_spring_in_a_trim_is_not_called_none() -> None:
    """The scaled derivative with an input among the unknowns resolves 1e-9 of the largest stiffness."""
    with pytest.raises(EquilibriumNotUnique, match=UNDECIDED + r"b \(1.00\) loads make a stiffness of 1e-06 N/m in sums of "
                                                               r"terms of 1e\+12 N/m, known to 1e\+03 N/m only"):
        rails(-STIFF * A, -SOFT * B, F - 3).equilibrium(fixed={"c": 0}, unknown_params=["F"])
    with pytest.raises(EquilibriumNotUnique, match=r"there is no stiffness along b \(1.00\)"):
        rails(-STIFF * A, 0 * B, F - 3).equilibrium(fixed={"c": 0}, unknown_params=["F"])
