"""Chapter 1.5 and 1.6: components of one vector in two frames, and how they are taken from one to the other."""

from __future__ import annotations

import sympy as sp

import symdyn as sd
from symdyn.comparison import Case, Formula, Slide, conventions

x, y, z = sp.symbols("x y z")


def _components() -> list[Formula]:
    theta, x_O, y_O = sp.symbols("theta x_OE y_OE")
    i, j, k = (sp.eye(3).col(axis) for axis in range(3))
    n = sd.Frame("n")
    b = n.frame("b", rotation=sd.rotation.about("Z", theta))
    P = n.point("P", [x, y, z])
    shifted = n.frame("b", rotation=sd.rotation.about("Z", theta), origin=[x_O, y_O, 0])
    in_n, in_b = P.position(of=n), P.position(of=n, components=b)
    from_O = P.position(of=b, components=b)[:2, 0]
    common = conventions.other_point(from_O, "The arrow is the same only if E and O are one point.")
    r_x, r_y = sp.symbols("r_bx r_by")
    i_b, j_b = b.rotation(n).col(0), b.rotation(n).col(1)
    own = {"r_bx": in_b[0], "r_by": in_b[1]}
    return [
        Formula("r_PE", x * i + y * j + z * k, in_n, line=1142, latex="{}^n r_{P/E}"),
        Formula("r_PE in the plane", sp.Matrix([x, y]), in_n[:2, 0], line=1163, latex="{}^n r_{P/E}"),
        Formula("arrow from components in the b-frame", (r_x * i_b + r_y * j_b)[:2, 0], in_n[:2, 0], line=1166, renamed=own),
        Formula("r_PO next to r_PE", sp.Matrix([r_x, r_y]), P.position(of=shifted)[:2, 0], line=1166, renamed=own,
                conventions=[common], latex="{}^b r_{P/O}"),
    ]


def _ship() -> list[Formula]:
    """A ship on a straight course: axes b along it, n fixed; forces in kN, masses in Mg, so that the quotient is in m/s^2."""
    n = sd.Frame("n")
    course = sp.atan2(9, 12)
    b = n.frame("b", rotation=sd.rotation.about("Z", course))
    to_b, to_n = n.rotation(b)[:2, :2], b.rotation(n)[:2, :2]
    mass, duration = 350000, 10

    def exact(*numbers: str) -> sp.Matrix:
        return sp.Matrix([sp.Rational(number) for number in numbers])

    v_n, F_n, start_n = exact("12", "9"), exact("14000", "10500"), exact("5.76", "4.32")
    v_b, F_b, start_b = exact("15", "0"), exact("17500", "0"), exact("7.2", "0")
    at = list(sd.coordinates("x y"))
    in_n = sd.embedding(at, at, [mass, mass], force=list(F_n))
    rates = [q.ddot for q in at]
    a_n = in_n.M_tilde.LUsolve(in_n.F_tilde)
    end_n = start_n + duration * a_n
    return [
        Formula("v_OE in the n-frame", v_n, to_n * v_b, line=1185, latex="{}^n v_{O/E}"),
        Formula("v_OE in the b-frame", v_b, to_b * v_n, line=1189, latex="{}^b v_{O/E}"),
        Formula("force in the n-frame", F_n, to_n * F_b, line=1212, also=(1265,), latex="{}^n F_O"),
        Formula("force in the b-frame", F_b, to_b * F_n, line=1241, also=(1265,), latex="{}^b F_O"),
        Formula("velocity at the start, n-frame", start_n, to_n * start_b, line=1212, also=(1267,), latex="{}^n v_{O/n}(0)"),
        Formula("velocity at the start, b-frame", start_b, to_b * start_n, line=1241, also=(1267,), latex="{}^b v_{O/n}(0)"),
        Formula("force equation, n-frame", (F_n, mass * sp.Matrix(rates)), (in_n.F_tilde, in_n.M_tilde * sp.Matrix(rates)),
                line=1207, also=(1202, 1230, 1259)),
        Formula("force equation, b-frame", (F_b, mass * to_b * sp.Matrix(rates)),
                (to_b * in_n.F_tilde, to_b * in_n.M_tilde * sp.Matrix(rates)),
                line=1235),
        Formula("acceleration, n-frame", exact("0.04", "0.03"), a_n, line=1218, latex="{}^n a_{O/n}"),
        Formula("acceleration, b-frame", exact("0.05", "0"), to_b * a_n, line=1247, latex="{}^b a_{O/n}"),
        Formula("velocity after 10 s, n-frame", exact("6.16", "4.62"), end_n, line=1220, also=(1269,), latex="{}^n v_{O/n}(10)"),
        Formula("velocity after 10 s, b-frame", exact("7.7", "0"), to_b * end_n, line=1249, also=(1269,),
                latex="{}^b v_{O/n}(10)"),
    ]


def _transformation() -> list[Formula]:
    """Rotation about x: the axes y, z of the n-frame and y', z' of the body."""
    phi, y_b, z_b, y_O, z_O = sp.symbols("phi y'_P z'_P y_OE z_OE")
    cos, sin = sp.cos(phi), sp.sin(phi)
    n = sd.Frame("n")
    b = n.frame("b", rotation=sd.rotation.about("X", phi))
    P = b.point("P", [0, y_b, z_b])
    in_n, turn = P.position(of=n)[1:, 0], b.rotation(n)[1:, 1:]
    shifted = n.frame("b", rotation=sd.rotation.about("X", phi), origin=[0, y_O, z_O]).point("P", [0, y_b, z_b])
    one_origin = conventions.other_point(in_n, "The frames have one origin here; 1.7 adds r_O/E.")
    fixed = n.point("P", sp.Matrix([0, y, z]))
    nR_b = sp.Matrix([[cos, -sin], [sin, cos]])
    return [
        Formula("y_P", y_b * cos - z_b * sin, in_n[0], line=1314, also=(1336,)),
        Formula("z_P", y_b * sin + z_b * cos, in_n[1], line=1338),
        Formula("R", nR_b, turn, line=1342, latex="{}^n R_b"),
        Formula("r_P", nR_b * sp.Matrix([y_b, z_b]), in_n, line=1344, latex="{}^n r_P"),
        Formula("forward problem", nR_b * sp.Matrix([y_b, z_b]), shifted.position(of=n)[1:, 0], line=1356,
                conventions=[one_origin], latex="{}^n r_{P/E}"),
        Formula("inverse problem", (sp.Matrix([y, z]), nR_b * sp.Matrix(sp.symbols("y_b z_b"))),
                (fixed.position(of=n)[1:, 0], turn * fixed.position(of=n, components=b)[1:, 0]), line=1367,
                where=dict(zip(sp.symbols("y_b z_b"), fixed.position(of=n, components=b)[1:, 0])), latex="{}^n r_{P/E}"),
    ]


CASES = (
    Case("vector-components", "One vector in two frames", Slide("1.5", "Vector Decomposition", 1131), _components),
    Case("ship-velocity", "Velocity and force of a ship in two frames",
         Slide("1.5", "Example: Velocity vector decomposition", 1173), _ship),
    Case("coordinate-transformation", "Transformation of coordinates",
         Slide("1.6", "Coordinate Transformation of a Position Vector", 1304), _transformation),
)
