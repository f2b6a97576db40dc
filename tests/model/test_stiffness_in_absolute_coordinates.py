"""A linear stiffness with angles="auto" means the same in relative and in absolute coordinates."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import symdyn as sd

T = np.linspace(0.0, 0.6, 7)
# Yaw, pitch, roll: tilted by 5 degrees at a heading of 90.
ANGLES = np.radians([90.0, 5.0, -5.0])
KINDS = {"angles": sd.EulerAngles("ZYX"), "parameters": sd.EulerParameters()}


def moored(kind: str) -> sd.System:
    """A hull that floats freely, with a deck welded to it; the stiffness acts on the deck."""
    system = sd.System("moored")
    hull, deck = (system.add_body(name, mass=2, inertia=[1, 1.5, 2]) for name in ("hull", "deck"))
    turn = "psi theta phi" if kind == "angles" else "p0 p1 p2 p3"
    q = sd.coordinates(f"x y z {turn}")
    system.add_joint(sd.Free("sea", parent=system.ground, child=hull, orientation=KINDS[kind], coordinates=q))
    system.add_joint(sd.Fixed("weld", parent=hull, child=deck, parent_point=[0.1, 0, 0.3]))
    system.add_load(sd.LinearStiffness(deck, [2, 3, 40, 6, 9, 2], force=[0, 0, 1, 0.2, 0, 0], name="mooring"))
    vector = Rotation.from_euler("ZYX", ANGLES).as_quat()
    start = ANGLES if kind == "angles" else np.roll(vector, 1)
    system.initial = dict(zip(q[3:], start.tolist(), strict=True))
    system.add_output("mast", sd.position(deck, [0.5, 0.2, 1.0]))
    return system


@pytest.mark.parametrize(("kind", "absolute"), [("angles", "parameters"), ("parameters", "angles")])
def test_the_motion_is_the_same_in_absolute_coordinates(kind: str, absolute: str) -> None:
    """Angular accelerations at the start were three times as large where the angles were taken to be others."""
    system = moored(kind)
    one, two = (equations.compile(backend="numpy").simulate(T, rtol=1e-10, atol=1e-12) for equations in (
        system.embedding(), system.augmented(coordinates="absolute", orientation=KINDS[absolute])))
    assert np.ptp(one.outputs["mast"], axis=0).max() > 0.05
    np.testing.assert_allclose(two.outputs["mast"], one.outputs["mast"], rtol=0, atol=1e-8)
    np.testing.assert_allclose(two.energy, one.energy, rtol=0, atol=1e-8)
