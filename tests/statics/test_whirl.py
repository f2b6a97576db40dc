"""Sense in which modes go round: translation and tilt in one sense, and in opposite ones, against eigenvectors by hand."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.statics.modes import Mode, Modes
from tests.runtime.test_campbell import rotor
from tests.statics.test_frozen_time import free_rotor

MASS, ACROSS, ALONG = 1.0, 0.25, 0.4
STIFFNESS = {"x": 400.0, "y": 900.0, "a": 60.0, "b": 30.0}
# Coupling of x with the tilt b about y, and of y with the tilt a about x.
COUPLING = (-30.0, -50.0)


@functools.cache
def tilting_rotor() -> Any:
    """A rotor that spins with s about the axis z of a carrier without mass, on springs against x, y and small tilts a, b."""
    x, y, a, b, spin = sd.coordinates("x y a b spin")
    s = sd.System("tilting_rotor")
    carriers = [s.add_body(n) for n in ("sideways", "up", "first", "second")]
    body = s.add_body("disc", mass=MASS, inertia=[ACROSS, ACROSS, ALONG])
    s.add_joint(sd.Prismatic("jx", s.ground, carriers[0], x, axis=[1, 0, 0]))
    s.add_joint(sd.Prismatic("jy", carriers[0], carriers[1], y, axis=[0, 1, 0]))
    s.add_joint(sd.Revolute("ja", carriers[1], carriers[2], a, axis=[1, 0, 0]))
    s.add_joint(sd.Revolute("jb", carriers[2], carriers[3], b, axis=[0, 1, 0]))
    s.add_joint(sd.Revolute("js", carriers[3], body, spin, axis=[0, 0, 1]))
    k, (c, d) = STIFFNESS, COUPLING
    s.add_joint_force("jx", -k["x"] * x - c * b)
    s.add_joint_force("jy", -k["y"] * y - d * a)
    s.add_joint_force("ja", -k["a"] * a - d * y)
    s.add_joint_force("jb", -k["b"] * b - c * x)
    return s.embedding().compile(backend="numpy")


def by_hand(W: float) -> list[tuple[float, float, float]]:
    """Frequency, rad/s, and whirl of translation and of tilt of each mode of the linear equations of a spinning disc.

    The four carriers, which do not spin, are what the fixed frame sees: x moves all of them, y three, a two, b one.
    """
    M, G, K = np.diag([MASS, MASS, ACROSS, ACROSS]), np.zeros((4, 4)), np.diag(list(STIFFNESS.values()))
    G[2, 3], G[3, 2] = ALONG * W, -ALONG * W
    K[0, 3] = K[3, 0] = COUPLING[0]
    K[1, 2] = K[2, 1] = COUPLING[1]
    inverse = np.linalg.inv(M)
    values, vectors = np.linalg.eig(np.block([[np.zeros((4, 4)), np.eye(4)], [-inverse @ K, -inverse @ G]]))

    def round_about(p: complex, q: complex, bodies: int) -> float:
        """Modes of so many bodies that both move; one more moves along p alone."""
        return float(-2 * bodies * np.imag(np.conj(p) * q) / ((bodies + 1) * abs(p)**2 + bodies * abs(q)**2))

    return [(float(values[k].imag), round_about(*vectors[:2, k], 3), round_about(*vectors[2:4, k], 1))
            for k in np.argsort(values.imag) if values[k].imag > 0]


def test_translation_and_tilt_in_opposite_senses_are_named_apart() -> None:
    """At 20 rad/s the lowest mode moves forward and tilts backward, the highest the other way round."""
    expected = by_hand(20.0)
    found = tilting_rotor().stability(fixed={"spin_dot": 20.0}).modes
    for mode, (omega, translation, tilt) in zip(found, expected, strict=True):
        assert np.isclose(mode.omega, omega, rtol=1e-9)
        assert np.allclose(mode.whirls, (translation, tilt), atol=1e-6)
    assert [m.sense for m in (found[0], found[3])] == ["forward (translation), backward (tilt)",
                                                       "backward (translation), forward (tilt)"]
    assert found[0].whirl == 0.0 and found[1].sense == "forward (tilt)" and "backward (tilt)" in repr(found[0])
    back = tilting_rotor().stability(fixed={"spin_dot": -20.0}).modes
    assert [m.sense for m in back] == [m.sense for m in found]
    diagram = tilting_rotor().campbell("spin_dot", [19.0, 20.0])
    assert sum("forward (translation), backward (tilt)" in n for n in diagram.names) == 1


def test_tables_of_modes_show_the_whirl() -> None:
    """Forward and backward of a round rotor; no column where nothing goes round."""
    modes = free_rotor("parameters").stability(fixed={"omega_z_free": 60.0}).modes
    assert [m.sense for m in modes] == ["", "backward", "forward", "", "backward", "forward"]
    lines = repr(modes).splitlines()
    assert lines[1].endswith("kind         whirl") and lines[3].endswith("oscillation  backward")
    assert lines[2].endswith("zero") and lines[5].endswith("oscillation")
    assert "whirl" not in repr(Modes("still", [m for m in modes if not m.sense]))


def test_modes_of_named_blades_show_the_sense_of_their_pattern() -> None:
    stiff = rotor().campbell("psi_dot", [9.0], blades=[("b1", "b2", "b3")], params={"k_h": 1e9, "k_b": 400.0}, azimuths=3)
    senses = [m.sense for m in stiff.modes[0] if m.name.startswith("b1")]
    assert senses == ["backward", "", "forward"] and "forward" in repr(stiff.modes[0])


@pytest.mark.parametrize(("whirl", "whirls", "sense"), [
    (0.9, (0.9, 0.8), "forward"), (-0.3, (0.0, -0.3), "backward"), (0.1, (0.1, 0.1), ""),
    (0.0, (0.5, -0.5), "forward (translation), backward (tilt)"), (0.0, (0.1, -0.5), "backward (tilt)"), (0.0, (0.1, -0.1), "")])
def test_senses_in_words(whirl: float, whirls: tuple[float, float], sense: str) -> None:
    mode = Mode(1j, np.ones(1), np.ones(1), "oscillation", "x", ("x",), np.ones(2), np.ones(2), whirl=whirl, whirls=whirls)
    assert mode.sense == sense
