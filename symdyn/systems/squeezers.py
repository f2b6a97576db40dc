"""Andrews' squeezing mechanism."""

from __future__ import annotations

from symdyn.model.joints import Revolute
from symdyn.model.symbols import coordinates, parameters
from symdyn.model.system import System

_MASSES = (0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498)
_INERTIAS = (2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5)
_NUMBERS = {
    "xa": -0.06934, "ya": -0.00227, "xb": -0.03635, "yb": 0.03273, "xc": 0.014, "yc": 0.072, "c0": 4530.0, "d": 28e-3,
    "da": 115e-4, "e": 2e-2, "ea": 1421e-5, "rr": 7e-3, "ra": 92e-5, "l0": 7785e-5, "ss": 35e-3, "sa": 1874e-5,
    "sb": 1043e-5, "sc": 18e-3, "sd": 2e-2, "ta": 2308e-5, "tb": 916e-5, "u": 4e-2, "ua": 1228e-5, "ub": 449e-5,
    "zf": 2e-2, "zt": 4e-2, "fa": 1421e-5, "mom": 33e-3,
}
_START = (-0.0617138900142764496, 0.0, 0.455279819163070380, 0.222668390165885885, 0.487364979543842550,
          -0.222668390165885885, 1.23054744454982119)


def andrews_squeezer() -> System:
    """Andrews' squeezing mechanism: seven bodies in a plane, three loops, driven by a constant torque; the motion is fast.

    The n-frame has its origin at O, the pivot of the crank. The coordinates (rad), counterclockwise, are those of the
    published equations: beta turns the crank K1 = OF, Theta K2 = FE relative to it (E is at (-d, 0) of K2), gamma the triangle
    K3 = BDE about B, delta K5 = AG and epsilon K7 = AH about A, Phi K4 = GE relative to K5, and Omega K6 = HE relative to K7.
    Planar, no gravity. K2 carries E; the loops are cut where K3, K4 and K6 meet it there, so that the constraints are
    the published ones. A spring (c0, l0) pulls D of K3 towards C, the torque mom drives the crank.

    Parameters, as published: of each body m1 ... m7 mass (kg), i1 ... i7 inertia about z at the centre of mass (kg m^2);
    (xa, ya), (xb, yb), (xc, yc) the points A, B, C (m); c0 (N/m), l0 (m), mom (N m); lengths (m): rr of K1 and ra its centre
    of mass from O, d of K2 and da its from F, ss, sc, sd, sa, sb of K3 (in its axes E is at (0, -ss), D at (sd, -sc), the
    centre of mass at (sb, -sa)), e of K4 and ea its from E, zt of K5 and (ta, tb) its from A, zf of K6 and fa its from E,
    u of K7 (H is at (0, -u)) with its at (ub, -ua). It starts at rest.
    Source: Schiehlen (ed.), Multibody Systems Handbook, 1990; Hairer and Wanner, Solving Ordinary Differential Equations II;
    Mazzia and Magherini, Test Set for Initial Value Problem Solvers, release 2.4.
    """
    q = beta, Theta, gamma, Phi, delta, Omega, epsilon = coordinates("beta Theta gamma Phi delta Omega epsilon")
    m, i = parameters("m1:8"), parameters("i1:8")
    p = {name: parameters(name) for name in _NUMBERS}
    system = System("andrews_squeezer", planar=True)
    ground = system.ground
    A, B = [p["xa"], p["ya"]], [p["xb"], p["yb"]]
    centres = ([p["ra"], 0], [-p["da"], 0], [p["sb"], -p["sa"]], [0, p["ea"] - p["e"]], [p["ta"], p["tb"]],
               [p["zf"] - p["fa"], 0], [p["ub"], -p["ua"]])
    K1, K2, K3, K4, K5, K6, K7 = (system.add_body(f"K{k + 1}", mass=m[k], inertia=i[k], com=centres[k]) for k in range(7))
    crank = system.add_joint(Revolute("O", ground, K1, beta))
    system.add_joint(Revolute("F", K1, K2, Theta, parent_point=[p["rr"], 0]))
    system.add_joint(Revolute("B", ground, K3, gamma, parent_point=B))
    system.add_joint(Revolute("G", K5, K4, Phi, parent_point=[p["zt"], 0]))
    system.add_joint(Revolute("A5", ground, K5, delta, parent_point=A))
    system.add_joint(Revolute("H", K7, K6, Omega, parent_point=[0, -p["u"]]))
    system.add_joint(Revolute("A7", ground, K7, epsilon, parent_point=A))
    for name, body, end in (("E3", K3, [0, -p["ss"]]), ("E4", K4, [0, -p["e"]]), ("E6", K6, [p["zf"], 0])):
        system.close_loop(Revolute(name, body, K2, parent_point=end, child_point=[-p["d"], 0]))
    system.add_joint_force(crank, p["mom"], name="drive")
    system.add_spring_damper(ground, K3, point_a=[p["xc"], p["yc"]], point_b=[p["sd"], -p["sc"]], stiffness=p["c0"],
                             length=p["l0"])
    system.defaults = {**dict(zip((*m, *i), (*_MASSES, *_INERTIAS), strict=True)), **{p[k]: v for k, v in _NUMBERS.items()}}
    system.initial = dict(zip(q, _START, strict=True))
    system.duration = 0.03
    system.units = {p[name]: "m" for name in ("d", "e", "ea", "fa", "ss", "zf")}
    return system
