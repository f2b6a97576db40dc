"""The PUMA 560 robot in both Denavit-Hartenberg conventions."""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from symdyn.errors import ModelError
from symdyn.model.joints import Joint, Revolute
from symdyn.model.symbols import coordinates, inputs, parameters
from symdyn.model.system import System

_QUARTER = sp.pi / 2  # exact, so that cosines of the twists are exact zeros
_ENTRIES = ("m{}", "c{}_x", "c{}_y", "c{}_z", "I{}_xx", "I{}_xy", "I{}_xz", "I{}_yy", "I{}_yz", "I{}_zz")


@dataclass(frozen=True)
class _Link:
    """One row: twist (rad), length a and offset d as (symbol, m), mass (kg), centre of mass (m) in the link frame, and
    principal inertia about it (kg m^2); the published products of inertia about the centre of mass are zero."""

    alpha: sp.Expr
    a: tuple[str, float]
    d: tuple[str, float]
    mass: float
    com: tuple[float, float, float]
    inertia: tuple[float, float, float]


_STANDARD = (
    _Link(_QUARTER, ("a1", 0), ("d1", 0), 0, (0, 0, 0), (0, 0.35, 0)),
    _Link(sp.S.Zero, ("a2", 0.4318), ("d2", 0), 17.4, (-0.3638, 0.006, 0.2275), (0.13, 0.524, 0.539)),
    _Link(-_QUARTER, ("a3", 0.0203), ("d3", 0.15005), 4.8, (-0.0203, -0.0141, 0.07), (0.066, 0.086, 0.0125)),
    _Link(_QUARTER, ("a4", 0), ("d4", 0.4318), 0.82, (0, 0.019, 0), (0.0018, 0.0013, 0.0018)),
    _Link(-_QUARTER, ("a5", 0), ("d5", 0), 0.34, (0, 0, 0), (0.0003, 0.0004, 0.0003)),
    _Link(sp.S.Zero, ("a6", 0), ("d6", 0), 0.09, (0, 0, 0.032), (0.00015, 0.00015, 0.00004)),
)
# Published about the origins of the link frames; here about the centres of mass, I = L - m (r.r 1 - r r^T).
_MODIFIED = (
    _Link(sp.S.Zero, ("a0", 0), ("d1", 0), 0, (0, 0, 0), (0, 0, 0.35)),
    _Link(-_QUARTER, ("a1", 0), ("d2", 0.2435), 17.4, (0.068, 0.006, -0.016), (0.13, 0.524, 0.539)),
    _Link(sp.S.Zero, ("a2", 0.4318), ("d3", -0.0934), 4.8, (0, -0.07, 0.014), (0.066, 0.0125, 0.066)),
    _Link(_QUARTER, ("a3", -0.0203), ("d4", 0.4331), 0.82, (0, 0, -0.019), (0.0018, 0.0018, 0.0013)),
    _Link(-_QUARTER, ("a4", 0), ("d5", 0), 0.34, (0, 0, 0), (0.0003, 0.0003, 0.0004)),
    _Link(_QUARTER, ("a5", 0), ("d6", 0), 0.09, (0, 0, 0.032), (0.00015, 0.00015, 0.00004)),
)
_CONVENTIONS = {"standard": _STANDARD, "modified": _MODIFIED}

# Data of each motor: inertia Jm (kg m^2), gear ratio G, viscous friction B (N m s/rad) and Coulomb friction (N m) for
# positive and for negative speed, all on the motor's side of the gear.
_MOTORS = (
    (0.0002, -62.6111, 0.00148, 0.395, -0.435),
    (0.0002, 107.815, 0.000817, 0.126, -0.071),
    (0.0002, -53.7063, 0.00138, 0.132, -0.105),
    (0.000033, 76.0364, 0.0000712, 0.0112, -0.0169),
    (0.000033, 71.923, 0.0000826, 0.00926, -0.0145),
    (0.000033, 76.686, 0.0000367, 0.00396, -0.0105),
)


def puma560(convention: str = "standard", general: bool = False, motors: bool = False, torques: bool = False) -> System:
    """The PUMA 560, six revolute joints.

    The n-frame has its origin at the shoulder on the axis of joint 1, z upward along it. Body i is link i with its
    Denavit-Hartenberg frame: T = R_z(qi) T_z(di) T_x(ai) R_x(alphai), at the far end of the link, in the standard
    convention; T = R_x(alpha(i-1)) T_x(a(i-1)) R_z(qi) T_z(di), at the near end, in the modified one. The two sets of
    numbers are published ones of slightly different geometry; they are not two descriptions of one robot.

    convention   "standard" or "modified"
    general      True: all ten inertial parameters of every link are symbols; False: those published as zero are zero
    motors       True: with rotors and friction, standard or modified. The rotors turn on the ground at Gi qi, which
                 adds Gi^2 Jmi to the diagonal of M_tilde and leaves out their gyroscopic torques, as published
    torques      True: inputs tau1 ... tau6 (N m) in the joints

    Parameters: g (m/s^2, along -z); lengths ai, di (m) that are not zero; of each link mi mass (kg), ci_x, ci_y, ci_z
    centre of mass (m), Ii_xx ... Ii_zz inertia about it (kg m^2; matrix entries), all in link axes. With motors: Jmi
    (kg m^2), Gi (1), Bi (N m s/rad), Tpi and Tni Coulomb friction for positive and negative speed (N m).
    Source: P. Corke, Robotics Toolbox (inertial data after B. Armstrong, O. Khatib, J. Burdick, 1986); modified
    convention: test data of C. D. Sousa's SymPyBotics, computed with the same toolbox.
    """
    if not isinstance(convention, str) or convention not in _CONVENTIONS:
        raise ModelError([f"puma560 has no convention {convention!r}; pass {' or '.join(map(repr, _CONVENTIONS))}"])
    q = coordinates("q1:7")
    g = parameters("g")
    chosen = [word for word, on in (("general", general), ("motors", motors), ("torques", torques)) if on]
    system = System("_".join(["puma560", convention, *chosen]), gravity=[0, 0, -g])
    system.defaults = {g: 9.81}
    parent, joints = system.ground, []
    for i, link in enumerate(_CONVENTIONS[convention], start=1):
        m, x, y, z, xx, xy, xz, yy, yz, zz = _inertial(system, i, link, general)
        body = system.add_body(f"link{i}", mass=m, com=[x, y, z],
                               inertia=sp.Matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
        a, d = (_symbol(system, name, value) for name, value in (link.a, link.d))
        R = sp.rot_ccw_axis1(link.alpha)
        if convention == "standard":
            joint: Joint = Revolute(f"joint{i}", parent, body, q[i - 1], child_point=-R.T * sp.Matrix([a, 0, d]),
                             child_rotation=R.T)
        else:
            joint = Revolute(f"joint{i}", parent, body, q[i - 1], parent_point=sp.Matrix([a, 0, 0]) + d * R[:, 2],
                             parent_rotation=R)
        joints.append(system.add_joint(joint))
        parent = body
    if motors:
        _add_motors(system, joints, q)
    if torques:
        for joint, tau in zip(joints, inputs("tau1:7"), strict=True):
            system.add_joint_force(joint, tau, name=f"torque_{joint.name}")
    system.initial = {q[1]: 0.8, q[2]: 2.5, q[4]: 0.8, q[0].dot: 1.0, q[3].dot: -0.5}
    system.duration = 5.0
    return system


def _symbol(system: System, name: str, value: float, general: bool = False) -> sp.Expr:
    """A parameter with its number, or zero where the number is zero."""
    if value == 0 and not general:
        return sp.S.Zero
    symbol = parameters(name)
    system.defaults[symbol] = value
    return symbol


def _inertial(system: System, i: int, link: _Link, general: bool) -> list[sp.Expr]:
    xx, yy, zz = link.inertia
    values = (link.mass, *link.com, xx, 0.0, 0.0, yy, 0.0, zz)
    return [_symbol(system, name.format(i), value, general) for name, value in zip(_ENTRIES, values, strict=True)]


def _add_motors(system: System, joints: list[Joint], q: tuple[sp.Symbol, ...]) -> None:
    for i, (joint, values) in enumerate(zip(joints, _MOTORS, strict=True), start=1):
        Jm, G, B, Tp, Tn = symbols = parameters(f"Jm{i} G{i} B{i} Tp{i} Tn{i}")
        system.defaults |= dict(zip(symbols, values, strict=True))
        system.units |= {G: "1", B: "N m s/rad", Tp: "N m", Tn: "N m"}
        rotor = system.add_body(f"rotor{i}", inertia=[0, 0, Jm])
        system.add_joint(Revolute(f"gear{i}", system.ground, rotor, G * q[i - 1]))
        speed = q[i - 1].dot
        coulomb = sp.Piecewise((Tp, speed > 0), (Tn, speed < 0), (0, True))
        system.add_joint_force(joint, -B * G**2 * speed - sp.Abs(G) * coulomb, name=f"friction{i}")
