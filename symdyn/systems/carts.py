"""A cart that carries a pole."""

from __future__ import annotations

from symdyn.model.joints import Prismatic, Revolute
from symdyn.model.symbols import coordinates, inputs, parameters
from symdyn.model.system import System


def cart_pole() -> System:
    """A cart on a straight horizontal rail, with a pole hinged on it (the inverted pendulum).

    The n-frame has x along the rail and y upward. The coordinate q1 (m) moves the cart along x; q2 (rad) turns the pole
    about z, counted from the upward vertical, positive counterclockwise: at q2 = 0 the pole stands, its centre of mass
    is at (q1 - l sin q2, l cos q2). Planar. It starts at rest, leaning by 0.1 rad.

    Parameters: g (m/s^2, along -y), m_c mass of the cart (kg), m_p mass of the pole (kg), I_p inertia of the pole about
    z at its centre of mass (kg m^2), l distance from the hinge to it (m). The pole is a uniform rod of 1 m.
    Input: F (N), the force on the cart along x.
    """
    q1, q2 = coordinates("q1:3")
    g, m_c, m_p, I_p, length = parameters("g m_c m_p I_p l")
    F = inputs("F")
    system = System("cart_pole", gravity=[0, -g])
    cart = system.add_body("cart", mass=m_c)
    pole = system.add_body("pole", mass=m_p, inertia=I_p, com=[0, length])
    rail = system.add_joint(Prismatic("rail", system.ground, cart, q1, axis=[1, 0]))
    system.add_joint(Revolute("hinge", cart, pole, q2))
    system.add_joint_force(rail, F, name="drive")
    system.defaults = {g: 9.81, m_c: 1.0, m_p: 0.1, I_p: 0.1 / 12, length: 0.5}
    system.initial = {q2: 0.1}
    return system
