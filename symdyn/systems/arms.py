"""Arms of two and three links with revolute joints."""

from __future__ import annotations

from typing import Any

from symdyn.model.bodies import Body
from symdyn.model.joints import Revolute
from symdyn.model.points import position
from symdyn.model.symbols import coordinates, inputs, parameters
from symdyn.model.system import System

_LINK = ("m{}", "I{}_xx", "I{}_yy", "I{}_zz", "lc{}", "l{}")


def two_link_arm() -> System:
    """An arm of two links that moves in the vertical plane.

    The n-frame has its origin at O_1, the first joint, y upward. The frames b_1 and b_2 of the links have their origins
    at the joints O_1 and O_2 and x along the link. The coordinates q1 = theta_b1/n and q2 = theta_b2/b1 (rad) turn
    about z; at q = 0 the arm is stretched out along +x. Planar.

    Parameters: g (m/s^2, along -y); of each link mi mass (kg), Ii inertia about z at the centre of mass G_i (kg m^2),
    lci distance of G_i from O_i (m), li length (m). The links are uniform rods.
    Inputs: tau1, tau2 (N m), the torques in the joints. Output: tip, the position of the end effector O_3 (m).
    Source: lecture, chapters 4.1 and 5.5 to 5.7 (which write no gravity: g = 0 there).
    """
    q1, q2 = coordinates("q1:3")
    g, m1, I1, lc1, l1, m2, I2, lc2, l2 = parameters("g m1 I1 lc1 l1 m2 I2 lc2 l2")
    tau1, tau2 = inputs("tau1:3")
    system = System("two_link_arm", gravity=[0, -g])
    link1 = system.add_body("link1", mass=m1, inertia=I1, com=[lc1, 0])
    link2 = system.add_body("link2", mass=m2, inertia=I2, com=[lc2, 0])
    shoulder = system.add_joint(Revolute("shoulder", system.ground, link1, q1))
    elbow = system.add_joint(Revolute("elbow", link1, link2, q2, parent_point=[l1, 0]))
    system.add_joint_force(shoulder, tau1, name="motor1")
    system.add_joint_force(elbow, tau2, name="motor2")
    system.add_output("tip", position(link2, (l2, 0, 0)))
    system.defaults = {g: 9.81, m1: 2.0, I1: 2.0 * 0.5**2 / 12, lc1: 0.25, l1: 0.5,
                       m2: 1.0, I2: 1.0 * 0.4**2 / 12, lc2: 0.2, l2: 0.4}
    system.initial = {q1: 0.3, q2: 0.6}
    return system


def three_link_arm() -> System:
    """An arm of three links in space, whose joints turn about z, y and x: the angles are ZYX Euler angles.

    The n-frame has its origin at O_1, z upward. The frames b_i of the links have their origins at the joints O_i and x
    along the link, so that at q = 0 the arm is stretched out along +x. The coordinates (rad) are q1 = psi_b1/n about z,
    q2 = theta_b2/b1 about y (positive lowers the arm), q3 = phi_b3/b2 about x: nR_b3 = R_z(q1) R_y(q2) R_x(q3). At
    q2 = pi/2 the first and the last axis coincide (gimbal lock of the angles; the motion of the arm stays regular).

    Parameters: g (m/s^2, along -z); of each link mi mass (kg), Ii_xx, Ii_yy, Ii_zz inertia about the centre of mass G_i
    in link axes (kg m^2), lci distance of G_i from O_i (m), li length (m).
    Inputs: tau1, tau2, tau3 (N m), the torques in the joints. Output: tip, the position of the end effector O_4 (m).
    Source: lecture, chapters 4.2, 4.3 and 5.8.
    """
    q = coordinates("q1:4")
    tau = inputs("tau1:4")
    g = parameters("g")
    system = System("three_link_arm", gravity=[0, 0, -g])
    system.defaults = {g: 9.81}
    parent: Body = system.ground
    reach: Any = 0
    for i, (axis, mass, size) in enumerate((([0, 0, 1], 2.0, 0.4), ([0, 1, 0], 1.5, 0.4), ([1, 0, 0], 1.0, 0.3))):
        m, xx, yy, zz, lc, length = parameters(" ".join(name.format(i + 1) for name in _LINK))
        link = system.add_body(f"link{i + 1}", mass=m, inertia=[xx, yy, zz], com=[lc, 0, 0])
        joint = system.add_joint(Revolute(f"joint{i + 1}", parent, link, q[i], axis=axis, parent_point=[reach, 0, 0]))
        system.add_joint_force(joint, tau[i], name=f"motor{i + 1}")
        rod = mass * size**2 / 12
        system.defaults |= {m: mass, xx: 0.1 * rod, yy: rod, zz: rod, lc: size / 2, length: size}
        parent, reach = link, length
    system.add_output("tip", position(parent, (reach, 0, 0)))
    system.initial = {q[0]: 0.2, q[1]: -0.5, q[2]: 0.4, q[0].dot: 1.0, q[2].dot: 2.0}
    return system
