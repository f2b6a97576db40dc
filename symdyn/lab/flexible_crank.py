"""A slider-crank with a flexible connecting rod, in a closed loop, against a published solution.

Source of system and numbers: B. Simeon, Modelling a flexible slider crank mechanism by a mixed system of DAEs and PDEs,
Mathematical Modelling of Systems 2 (1996) 1-18; problem "crank" of the Test Set for IVP Solvers, release 2.4, whose reference
solution is to 14 digits. There the rod bends in two sines of its chord, linear in its deflection, and stretches, too.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import symdyn as sd
from symdyn.flexible.modal_body import ModalBody
from symdyn.model.system import System

CRANK, ROD = 0.15, 0.30  # lengths, m
SPEED = 150.0  # rad/s
END = 0.1  # s
# Rates of the two sines at the start, m/s, and the turning of the chord, rad/s.
START = (0.444896105, 0.463434311e-2)
TURNING = -74.9957670
# At the end: angle of the chord (rad), slider (m), sines (m).
REFERENCE = {"phi2": -0.3311734988256260, "x3": 0.1697373328427860, "q1": 0.1893192899613509e-3, "q2": 0.2375751249879174e-4}
# Rate at which the sines turn the clamped end away from the chord, rad/m.
_SLOPES = np.array([1, 2]) * np.pi / ROD
_SIDE, _DENSITY, _MODULUS = 0.008, 7870.0, 0.2e12


def rod() -> ModalBody:
    """The sines, seen from the tangent at the clamped end, with the foreshortening of a beam that keeps its length."""
    x = np.linspace(0, ROD, 81)
    shapes = [sd.Shape("y", stations=x, values=np.sin(c * x) - c * x, slopes=c * np.cos(c * x) - c,
                       curvatures=-(c**2) * np.sin(c * x)) for c in _SLOPES]
    return sd.Beam([0, ROD], _DENSITY * _SIDE**2, _MODULUS * _SIDE**4 / 12, shapes, axis="x").modal


def linear_rod() -> ModalBody:
    """The same with the source's kinematics: its points move across the chord only, whose length stays.

    In the axes of the tangent a point of the chord at X is at X (1 - theta^2 / 2) + w theta along e, with the chord's angle
    -theta, theta = slopes . q, and the deflection w from the chord; this takes the place of the foreshortening.
    """
    beam = rod()
    points, weights = np.polynomial.legendre.leggauss(40)
    X, dm = (points + 1) * ROD / 2, weights * ROD / 2 * _DENSITY * _SIDE**2
    mixed = np.einsum("pi,j->pij", np.sin(np.outer(X, _SLOPES)), _SLOPES)
    S = X[:, None, None] * np.outer(_SLOPES, _SLOPES) - mixed - mixed.transpose(0, 2, 1)
    S_m, S_mX = np.einsum("p,pij->ij", dm, S), np.einsum("p,pij->ij", dm * X, S)
    before = beam.Me - beam.I2[:, :, 2, 2] / 2
    across = np.eye(3) - np.outer(beam.e, beam.e)
    return replace(beam, H2=-np.einsum("x,ij->xij", beam.e, S_m),
                   I2=beam.I2 + 2 * np.einsum("ij,xy->ijxy", before - S_mX, across), S_tip=ROD * np.outer(_SLOPES, _SLOPES),
                   S=0 * beam.S)


def slider_crank(beam: ModalBody) -> System:
    """The crank turns at constant speed; the end of the rod closes the loop."""
    system = sd.System("flexible_crank", gravity=[0, 0, 0])
    crank = system.add_body("crank", mass=0.36, inertia=[0.002, 0.002, 0.002727])
    system.add_joint(sd.Revolute("shaft", system.ground, crank, SPEED * sd.t))
    flexible = system.add_flexible_body("rod", beam, sd.coordinates("q1 q2"))
    system.add_joint(sd.Revolute("crank_pin", crank, flexible.root, sd.coordinates("b"), parent_point=[CRANK, 0, 0]))
    slider = system.add_body("slider", mass=0.075552, inertia=[1e-4] * 3)
    system.add_joint(sd.Prismatic("guide", system.ground, slider, sd.coordinates("x3"), axis=[1, 0, 0]))
    system.close_loop(sd.Revolute("pin", flexible.tip, slider))
    return system


def at_the_end(beam: ModalBody, rtol: float = 1e-10) -> dict[str, float]:
    """The quantities of REFERENCE."""
    module = slider_crank(beam).augmented().compile()
    turning = TURNING - SPEED + float(_SLOPES @ START)
    q, u = module.consistent(q={"x3": CRANK + ROD}, u={"q1_dot": START[0], "q2_dot": START[1], "b_dot": turning},
                             keep=["q1", "q2", "q1_dot", "q2_dot"])
    solution = module.simulate(t=(0, END), q=q, u=u, rtol=rtol, atol=1e-12)
    result = {name: float(solution[name][-1]) for name in module.metadata.q}
    angle = result.pop("b") + SPEED * END - float(_SLOPES @ [result["q1"], result["q2"]])
    return {"phi2": float(np.angle(np.exp(1j * angle))), **result}
