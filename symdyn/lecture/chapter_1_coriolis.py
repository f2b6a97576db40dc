"""Chapter 1.4: a projectile along a meridian, the inertial forces on the earth."""

from __future__ import annotations

import sympy as sp

import symdyn as sd
from symdyn.comparison import Case, Erratum, Formula, Slide, proofs

i, j, k = (sp.eye(3).col(axis) for axis in range(3))
R, gamma, omega, m = sp.symbols("R gamma omega m", positive=True)
# The pictures of the turning earth print v = omega x r again and again.
OF_PICTURES = (837, 844, 851, 858, 871, 884, 897, 910, 934, 947, 960, 973, 986)


def _projectile() -> list[Formula]:
    t = sd.t
    n = sd.Frame("n")
    earth = n.frame("earth", rotation=sd.rotation.about("Z", omega * t))
    P = earth.point("P", [R * sp.cos(gamma * t), 0, R * sp.sin(gamma * t)])
    meridian = earth.point("M", [1, 0, 0])
    position, velocity, acceleration = (P.position(of=n), P.velocity(seen_from=n),
                                        P.acceleration(seen_from=n))
    parts = P.acceleration_parts(through=earth, seen_from=n)
    cos, sin = sp.cos(gamma * t), sp.sin(gamma * t)
    b = sp.cos(omega * t) * i + sp.sin(omega * t) * j
    b1 = -omega * sp.sin(omega * t) * i + omega * sp.cos(omega * t) * j
    b2 = -omega**2 * sp.cos(omega * t) * i - omega**2 * sp.sin(omega * t) * j
    r = R * cos * b + R * sin * k
    circle = n.frame("disk", rotation=sd.rotation.about("Z", t)).point("C", [R, 0, 0])
    b_rate = meridian.velocity(seen_from=n)
    b_position, b_acceleration = meridian.position(of=n), meridian.acceleration(seen_from=n)
    return [
        Formula("circle", R * sp.cos(t) * i + R * sp.sin(t) * j, circle.position(of=n), line=1008),
        Formula("r", r, position, line=1012, also=(1033,)),
        Formula("b", b, b_position, line=1014, also=(1029, 1045)),
        Formula("rate of b", b1, b_rate, line=1016, latex="b'"),
        Formula("b times its rate", 0, b_position.dot(b_rate), line=1018, also=(1020, 1031, 1047), latex=r"b \cdot b'"),
        Formula("second rate of b", b2, b_acceleration, line=1022, latex="b''"),
        Formula("second rate of b from b", -omega**2 * b, b_acceleration, line=1022, also=(1031, 1047), latex="b''"),
        Formula("v", -gamma * R * sin * b + R * cos * b1 + gamma * R * cos * k, velocity, line=1037),
        Formula("a, differentiated", -(gamma**2 * R * cos * b + gamma * R * sin * b1)
                + (-gamma * R * sin * b1 + R * cos * b2) - gamma**2 * R * sin * k, acceleration, line=1041),
        Formula("a, summed", R * cos * b2 - 2 * gamma * R * sin * b1 - gamma**2 * R * cos * b - gamma**2 * R * sin * k,
                acceleration, line=1041),
        Formula("a, regrouped", R * cos * b2 - 2 * gamma * R * sin * b1 - gamma**2 * (R * cos * b + R * sin * k), acceleration,
                line=1041),
        Formula("a", R * cos * b2 - 2 * gamma * R * sin * b1 - gamma**2 * r, acceleration, line=1041, also=(1049,)),
        Formula("centripetal, of the earth", R * cos * b2, parts.centripetal, line=1051),
        Formula("centripetal, of the projectile", -gamma**2 * r, parts.relative, line=1054),
        Formula("Coriolis", -2 * gamma * R * sin * b1, parts.coriolis, line=1056),
    ]


def _earth() -> list[Formula]:
    """An object A seen from a frame with its origin B that moves and turns in any way."""
    X, Y, Z, x, y, z, yaw, pitch, roll = sd.coordinates("X Y Z x y z psi theta phi")
    n = sd.Frame("n")
    b = n.frame("b", rotation=sd.rotation.from_euler("ZYX", [yaw, pitch, roll]), origin=[X, Y, Z])
    A = b.point("A", [x, y, z])
    turn, w = b.rotation(n), b.angular_velocity(n)
    alpha = b.angular_acceleration(n)
    v_B, a_B = sp.Matrix([X.dot, Y.dot, Z.dot]), sp.Matrix([X.ddot, Y.ddot, Z.ddot])
    r, v_rel, a_rel = (turn * sp.Matrix(u) for u in ([x, y, z], [x.dot, y.dot, z.dot], [x.ddot, y.ddot, z.ddot]))
    F = sp.Matrix(sp.symbols("F_x F_y F_z"))
    a_A = A.acceleration(seen_from=n)
    inertial = A.inertial_forces(m, frame=b, components=n)
    relative = A.acceleration_parts(through=b, seen_from=n).relative
    turning = w.cross(w.cross(r))
    position = sp.Matrix([X, Y, Z]) + r
    return [
        Formula("Newton's law in the n-frame", (F, m * sd.rate(sd.rate(position))), (F, m * a_A), line=1070, also=(1091, 1113)),
        Formula("velocity of A", v_B + v_rel + w.cross(r), A.velocity(seen_from=n), line=1081, also=(1103,), latex="v_A"),
        Formula("acceleration of A", a_B + a_rel + 2 * w.cross(v_rel) + alpha.cross(r) + turning, a_A, line=1083, also=(1105,),
                latex="a_A"),
        Formula("acceleration of A from B", a_rel + 2 * w.cross(v_rel) + alpha.cross(r) + turning,
                a_A - b.acceleration(seen_from=n), line=1083, also=(1105,), latex="a_{A/B}"),
        Formula("Newton's law", (F, m * (a_B + a_rel + 2 * w.cross(v_rel) + alpha.cross(r) + turning)), (F, m * a_A), line=1095),
        Formula("Newton's law in the b-frame", (F - m * (a_B + 2 * w.cross(v_rel) + alpha.cross(r) + turning), m * a_rel),
                (F + inertial.total, m * relative), line=1097),
        Formula("force of the origin", -m * a_B, inertial.origin, line=1119, latex="-m a_B"),
        Formula("Coriolis force", -2 * m * w.cross(v_rel), inertial.coriolis, line=1121),
        Formula("centrifugal force", -m * turning, inertial.centrifugal, line=1123),
    ]


def _constant_spin() -> list[Formula]:
    """The earth turns with constant omega; A on the equator, or sent along a meridian from the latitude of 45 degrees."""
    X, Y, Z, x, y, z, latitude = sd.coordinates("X Y Z x y z lambda")
    north = sp.Symbol("beta")
    r, speed = sp.symbols("r_AB u", positive=True)
    n = sd.Frame("n")
    earth = n.frame("earth", rotation=sd.rotation.about("Z", omega * sd.t), origin=[X, Y, Z])
    A, on_equator = earth.point("A", [x, y, z]), earth.point("A", [r, 0, 0])
    turn, w = earth.rotation(n), omega * k
    v_rel, a_rel = turn * sp.Matrix([x.dot, y.dot, z.dot]), turn * sp.Matrix([x.ddot, y.ddot, z.ddot])
    r_AB, a_B = turn * sp.Matrix([x, y, z]), sp.Matrix([X.ddot, Y.ddot, Z.ddot])
    F = sp.Matrix(sp.symbols("F_x F_y F_z"))
    forces = A.inertial_forces(m, frame=earth, components=n).total
    relative = A.acceleration_parts(through=earth, seen_from=n).relative
    outwards = on_equator.inertial_forces(m, frame=earth, components=earth).centrifugal[0]
    energy = m * (omega * r)**2 / 2
    lagrange = proofs.other("Lagrange: the energy m omega^2 r^2 / 2 of the turning body drives r with its derivative.",
                            energy.diff(r))
    sign = Erratum("omega x (omega x r) = -omega^2 r points inwards, so that with the minus in front the force points outwards.",
                   lagrange)

    def held_on_meridian(speed: sp.Expr) -> sp.Expr:
        """Sign of the acceleration to the east of a body that keeps to the meridian, 45 degrees north of the equator."""
        body = earth.point("P", [R * sp.cos(latitude), 0, R * sp.sin(latitude)])
        east = body.acceleration_parts(through=earth, seen_from=n, components=earth).coriolis[1]
        east = east.xreplace({latitude: sp.pi / 4, latitude.dot: speed / R})
        return east / sp.Abs(east)

    place = earth.point("Q", [R * sp.cos(north), 0, R * sp.sin(north)])
    r_of_place = turn * sp.Matrix([R * sp.cos(north), 0, R * sp.sin(north)])
    return [
        Formula("velocity of a place on the earth", w.cross(r_of_place),
                place.velocity(seen_from=n) - earth.velocity(seen_from=n),
                line=830, also=OF_PICTURES, latex="v"),
        Formula("Newton's law in the b-frame", (F - m * (a_B + 2 * w.cross(v_rel) + w.cross(w.cross(r_AB))), m * a_rel),
                (F + forces, m * relative), line=1117),
        Formula("centrifugal force, outwards", -m * (r * omega**2), outwards, line=1123, errata=[sign]),
        Formula("southwards, in words: sign of the acceleration to the east", 1, held_on_meridian(-speed), line=928),
        Formula("northwards, in words: sign of the acceleration to the east", -1, held_on_meridian(speed), line=1002),
        Formula("northwards, in words: sign of the Coriolis force to the east", 1, -held_on_meridian(speed), line=1121),
    ]


CASES = (
    Case("projectile-on-meridian", "A projectile along a meridian of the turning earth",
         Slide("1.4", "Superposition of Rotation. Coriolis Acceleration", 1006), _projectile),
    Case("earth-frame", "Newton's law seen from a moving frame",
         Slide("1.4", "Example-The earth rotates with the constant angular velocity", 1079), _earth),
    Case("earth-constant-spin", "Inertial forces on an earth that turns uniformly",
         Slide("1.4", "Example-The earth rotates with the constant angular velocity", 1101), _constant_spin),
)
