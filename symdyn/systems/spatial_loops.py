"""Closed loops in space."""

from __future__ import annotations

import math

from symdyn.model.joints import Prismatic, Revolute, Spherical, Universal
from symdyn.model.points import position
from symdyn.model.symbols import coordinates, parameters
from symdyn.model.system import System

X, Y, Z = [1, 0, 0], [0, 1, 0], [0, 0, 1]
# Data of each rod of the Bricard mechanism: the axis of its first joint, its direction at the start, the number of that principal
# axis.
_RODS = ((Y, (1, 0, 0), 0), (Z, (0, -1, 0), 1), (X, (0, 0, 1), 2), (Y, (-1, 0, 0), 0), (Z, (0, 1, 0), 1))


def bricard() -> System:
    """The rectangular Bricard mechanism: five rods and six revolute joints in a loop that moves although it should not.

    The n-frame has y upward. At q = 0 the joints P1 ... P6 are at (0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1) and
    (0, 0, 1) times l, their axes along y, z, x, y, z, x; P1 and P6 sit on the ground. Rod i has its origin at Pi, its axes
    parallel to the n-frame at q = 0, and reaches to P(i+1); the coordinate qi (rad) turns it relative to the rod before.
    The loop is cut at P6: five constraints on five coordinates, one of which depends on the others, so that one degree
    of freedom is left. It starts at rest at q = 0. Output: P3 (m).

    Parameters: g (m/s^2, along -y); of every rod m mass (kg), l length (m), I_a inertia about its axis and I_t across it, at its
    centre of mass (kg m^2): uniform rods of square section, 0.1 m wide.
    Source: problem A04 of the IFToMM library of computational benchmark problems.
    """
    q = coordinates("q1:6")
    g, m, length, I_a, I_t = parameters("g m l I_a I_t")
    system = System("bricard", gravity=[0, -g, 0])
    parent, at = system.ground, [0, 0, 0]
    for i, (axis, direction, along) in enumerate(_RODS):
        inertia = [I_a if k == along else I_t for k in range(3)]
        reach = [e * length for e in direction]
        rod = system.add_body(f"rod{i + 1}", mass=m, inertia=inertia, com=[e / 2 for e in reach])
        system.add_joint(Revolute(f"P{i + 1}", parent, rod, q[i], axis=axis, parent_point=at))
        if i == 1:
            system.add_output("P3", position(rod, tuple(reach)))
        parent, at = rod, reach
    system.close_loop(Revolute("P6", system.ground, parent, axis=X, parent_point=[0, 0, length], child_point=at))
    system.defaults = {g: 9.81, m: 1.0, length: 1.0, I_a: 1 / 600, I_t: 101 / 1200}
    system.initial = dict.fromkeys(q, 0.0)
    system.duration = 10.0
    return system


def spatial_slider_crank() -> System:
    """A slider-crank in space: a crank, a rod between a ball joint and a universal joint, and a slider.

    The n-frame has z upward. The crank turns about x at A = (0, y_A, z_A); theta (rad) counts from where it points along z: its
    end B is at (0, y_A - r sin theta, z_A + r cos theta). The slider C is at (x, 0, 0) (m) and does not turn. The rod has
    its origin at C and B at (-l, 0, 0): its x axis runs from B to C. The universal joint at C turns it by alpha about the
    slider's x axis, then by beta about its own y axis (rad). The loop is cut at the ball joint B, three constraints on four
    coordinates.

    It starts at theta = 0 with 6 rad/s. Output: B (m).
    Parameters: g (m/s^2, along -z), y_A, z_A, r length of the crank and l of the rod (m); m_c, m_r, m_s mass of crank, rod and
    slider (kg); Ic_xx, Ic_yy, Ic_zz of the crank (z along it) and Ir_xx, Ir_yy, Ir_zz of the rod (x along it), inertia about
    axes through their middle (kg m^2).
    Source: spatial rigid slider-crank mechanism, IFToMM library of computational benchmark problems; Masoudi et al.
    """
    theta, x, alpha, beta = coordinates("theta x alpha beta")
    g, y_A, z_A, r, length, m_c, m_r, m_s = parameters("g y_A z_A r l m_c m_r m_s")
    I_c, I_r = (parameters(f"{name}_xx {name}_yy {name}_zz") for name in ("Ic", "Ir"))
    system = System("spatial_slider_crank", gravity=[0, 0, -g])
    crank = system.add_body("crank", mass=m_c, inertia=I_c, com=[0, 0, r / 2])
    slider = system.add_body("slider", mass=m_s)
    rod = system.add_body("rod", mass=m_r, inertia=I_r, com=[-length / 2, 0, 0])
    system.add_joint(Revolute("A", system.ground, crank, theta, axis=X, parent_point=[0, y_A, z_A]))
    system.add_joint(Prismatic("guide", system.ground, slider, x, axis=X))
    system.add_joint(Universal("C", slider, rod, [alpha, beta], axes=(X, Y)))
    system.close_loop(Spherical("B", crank, rod, parent_point=[0, 0, r], child_point=[-length, 0, 0]))
    system.add_output("B", position(crank, (0, 0, r)))
    system.defaults = {g: 9.81, y_A: 0.1, z_A: 0.12, r: 0.08, length: 0.3, m_c: 0.12, m_r: 0.5, m_s: 2.0,
                       **dict(zip((*I_c, *I_r), (1e-4, 1e-4, 1e-5, 4e-4, 4e-3, 4e-3), strict=True))}
    # From B to C it is (2, -1, -2)/3 of the rod's length.
    system.initial = {x: 0.2, alpha: -math.atan(0.5), beta: math.acos(2 / 3), theta.dot: 6.0, x.dot: 0.24, alpha.dot: 1.92,
                      beta.dot: -0.48 * math.sqrt(5)}
    system.duration = 5.0
    system.units = {length: "m"}
    return system
