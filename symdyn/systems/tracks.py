"""A vehicle on a straight track, fixed or hinged."""

from __future__ import annotations

import sympy as sp

from symdyn.model import shapes
from symdyn.model.joints import Prismatic, Revolute
from symdyn.model.symbols import coordinates, parameters
from symdyn.model.system import System


def vehicle_on_track() -> System:
    """A vehicle (a particle) that slides without friction down a fixed inclined track.

    The n-frame has y upward and its origin at O_0, a point of the track. The track falls towards +x at the angle theta
    below the horizontal; the coordinate q1 (m) is the distance travelled down it: the vehicle is at
    q1 (cos theta, -sin theta). Planar.

    Parameters: g (m/s^2, along -y), m mass of the vehicle (kg), theta inclination (rad).
    Source: lecture, chapters 3.1 and 3.2; the equation of motion is m q1_ddot = m g sin theta.
    """
    (q1,) = coordinates("q1:2")
    m, g, theta = parameters("m g theta")
    system = System("vehicle_on_track", gravity=[0, -g])
    vehicle = system.add_body("vehicle", mass=m)
    system.add_joint(Prismatic("track", system.ground, vehicle, q1, axis=[sp.cos(theta), -sp.sin(theta)]))
    system.defaults = {m: 1.0, g: 9.81, theta: 0.5}
    system.initial = {q1.dot: 0.5}
    system.duration = 2.0
    system.units = {theta: "rad"}
    return system


def vehicle_on_rotating_track(track_inertia: bool = True) -> System:
    """A vehicle (a particle) that slides without friction along a track, which turns freely about a hinge O_0.

    The n-frame has y upward and its origin at the hinge. q = [q1, q2]: q1 (m) is the distance of the vehicle from the
    hinge, q2 (rad) the inclination of the track. Planar.

    track_inertia
        True    the track has a mass, centred at the hinge, and an inertia. q2 counts counterclockwise, and the vehicle
                is at -q1 (cos q2, sin q2), as the lecture has it for this case.
        False   the track is massless; only the vehicle moves. q2 counts clockwise, and the vehicle is at
                q1 (cos q2, -sin q2). M_tilde = diag(m, m q1^2) is singular where the vehicle passes the hinge.

    Parameters: g (m/s^2, along -y); with inertia m_v mass of the vehicle (kg), m_t mass of the track (kg), I_t inertia
    of the track about z at the hinge (kg m^2); without, m mass of the vehicle (kg).
    Source: lecture, chapters 3.2 and 3.3.
    """
    q1, q2 = coordinates("q1:3")
    g, m, m_v, m_t, I_t = parameters("g m m_v m_t I_t")
    name = "vehicle_on_rotating_track" if track_inertia else "vehicle_on_massless_track"
    system = System(name, gravity=[0, -g])
    vehicle = system.add_body("vehicle", mass=m_v if track_inertia else m)
    track = system.add_body("track", mass=m_t, inertia=I_t) if track_inertia else system.add_body("track")
    turn, slide = (1, [-1, 0]) if track_inertia else (-1, [1, 0])
    # The joint of the vehicle comes first so that q = [q1, q2], the lecture's order.
    system.add_joint(Prismatic("slider", track, vehicle, q1, axis=slide))
    system.add_joint(Revolute("hinge", system.ground, track, q2, axis=[0, 0, turn]))
    system.draw(track, shapes.Line([(-1.5, 0), (1.5, 0)], 3.0))
    system.defaults = {g: 9.81, m_v: 1.0, m_t: 2.0, I_t: 0.5} if track_inertia else {g: 9.81, m: 1.0}
    system.initial = {q1: 1.0, q2: 0.3, q2.dot: 0.5}
    return system
