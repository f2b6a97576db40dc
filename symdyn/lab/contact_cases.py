"""Mechanisms with contacts whose motions are known with more digits than floats have, see symdyn.lab.extended."""

from __future__ import annotations

import numpy as np

import symdyn as sd


def slider_crank_with_clearance() -> sd.System:
    """A slider-crank whose piston has a journal with clearance, compliant and with friction.

    The motion of 0.05 s has 12 impacts, each of which magnifies errors. Source: Flores, Ambrosio, Claro and Lankarani, Kinematics
    and Dynamics of Multibody Systems with Imperfect Joints, 2008 (the kind of mechanism; the numbers are of its size).
    """
    system, shapes = sd.System("slider_crank_with_clearance", gravity=[0, -9.81]), sd.contacts
    theta, phi, x = sd.coordinates("theta phi x")
    crank = system.add_body("crank", mass=0.3, inertia=1e-4, com=[0.025, 0])
    rod = system.add_body("rod", mass=0.21, inertia=2.5e-4, com=[0.06, 0])
    slider = system.add_body("slider", mass=0.14)
    system.add_joint(sd.Revolute("A", system.ground, crank, theta))
    system.add_joint(sd.Revolute("B", crank, rod, phi, parent_point=[0.05, 0]))
    system.add_joint(sd.Prismatic("guide", system.ground, slider, axis=[1, 0], coordinate=x))
    steel = shapes.Compliance(6.6e10, dissipation=0.05, slip_speed=1e-2, located=True)
    system.add_contact(sd.Contact("journal", rod, slider, shape=(shapes.Sphere(0.0095, [0.12, 0]), shapes.Bore(0.01)),
                                  friction=0.03, law="compliant", compliance=steel))
    rate = 2 * np.pi * 8
    system.initial.update({x: 0.17, theta.dot: rate, phi.dot: -rate * (1 + 0.05 / 0.12)})
    system.duration = 0.05
    return system


CASES = {"slider_crank_with_clearance": slider_crank_with_clearance}
