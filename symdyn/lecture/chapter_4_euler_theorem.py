"""Chapter 4.4: Euler's theorem. Every rotation is one about an axis a by an angle phi; the principal rotations."""

from __future__ import annotations

from typing import Any

import sympy as sp
from sympy import cos, sin

import symdyn as sd
from symdyn.comparison import Case, Erratum, Formula, Slide, proofs
from symdyn.lecture import chapter_4_three_link as three_link

phi, theta, psi = sp.symbols("phi theta psi")
a_x, a_y, a_z = a = sp.Matrix(sp.symbols("a_x a_y a_z"))
r = sp.Matrix([sp.Symbol(f"r_P/E,{axis}") for axis in "xyz"])
r_x, r_y, r_z = r
# The axis has length 1; a_x / 2 and a_y / 2 instead of a_x and a_y leave a_z real wherever formulas are compared.
UNIT = {a_x: a_x / 2, a_y: a_y / 2, a_z: sp.sqrt(4 - a_x**2 - a_y**2) / 2}

# As printed; S is the matrix of the cross product with a.
S = sp.Matrix([[0, -a_z, a_y], [a_z, 0, -a_x], [-a_y, a_x, 0]])
R = sp.Matrix([
    [(1 - cos(phi)) * a_x**2 + cos(phi), (1 - cos(phi)) * a_x * a_y - a_z * sin(phi),
     (1 - cos(phi)) * a_z * a_x + a_y * sin(phi)],
    [(1 - cos(phi)) * a_x * a_y + a_z * sin(phi), (1 - cos(phi)) * a_y**2 + cos(phi),
     (1 - cos(phi)) * a_y * a_z - a_x * sin(phi)],
    [(1 - cos(phi)) * a_z * a_x - a_y * sin(phi), (1 - cos(phi)) * a_y * a_z + a_x * sin(phi),
     (1 - cos(phi)) * a_z**2 + cos(phi)]])
NO_INDEX = "The superscripts b of the second and third factor have lost their index."
ALL_N = "The superscript of the second and third factor is n, which is that of the first."


def _product_of_rotations() -> list[Formula]:
    R_1, R_12, R_23 = three_link.R_1, three_link.R_12, three_link.R_23
    angles = (three_link.psi, three_link.theta, three_link.phi)
    right = sd.rotation.from_euler("ZYX", angles)
    _, b1, b2, b3 = three_link.arm()
    # The matrices of the product are right; some factors have the superscript of another rotation. Each is taken for what its
    # superscript says: b is b_3.
    turn_y, turn_x = b2.rotation(b1), b3.rotation(b2)
    about_y = proofs.Proof("invariant axis", "The second factor turns by theta about y and leaves the unit vector along y.",
                           lambda R: sp.Matrix(R).col(1) - sp.Matrix([0, 1, 0]))
    whole = proofs.Proof("another formulation", "After R_b1 and b1R_b2 the third factor must make up R of the ZYX angles.",
                         lambda R: R_1 * R_12 * sp.Matrix(R) - right)
    second, third = r"{}^{b_1}R_{b_2}", r"{}^{b_2}R_{b_3}"
    return [
        Formula("second factor, with superscript b", R_23.T, turn_y, line=6597, also=(6611,), latex=second, errata=[Erratum(
            "The index 1 is missing: b, which is b_3, does not follow b_1; the matrix next to it is that of b1R_b2.", about_y,
            slip=NO_INDEX)]),
        Formula("third factor, with superscript b", sp.eye(3), turn_x, line=6597, latex=third, errata=[Erratum(
            "The index 2 is missing: from b_3 to b, which is b_3, nothing turns; the matrix next to it is that of b2R_b3.",
            whole, slip=NO_INDEX)]),
        Formula("second factor, with superscript n", R_1 * R_12, turn_y, line=6631, latex=second, errata=[Erratum(
            "The superscript is b_1, not n: R_b1 would be counted twice; the matrix next to it is that of b1R_b2.", about_y,
            slip=ALL_N)]),
        Formula("third factor, with superscript n", R_1 * R_12 * R_23, turn_x, line=6631, latex=third, errata=[Erratum(
            "The superscript is b_2, not n: nR_b3 is the whole product already; the matrix next to it is that of b2R_b3.",
            whole, slip=ALL_N)]),
        Formula("R of b", R_1 * R_12 * R_23, right, line=6597, also=(6611, 6631, 6653), latex=r"{}^nR_b"),
    ]


def _vector_and_frame() -> list[Formula]:
    n = sd.Frame("n")
    b = n.frame("b", rotation=sd.rotation.about(list(a), phi))
    turned = b.point("P'", list(r))
    in_n, in_b = turned.position(of=n, components=n), turned.position(of=b, components=b)
    third = 1 / sp.sqrt(3)
    third_turn = proofs.limit("A third of a turn about the diagonal (1, 1, 1) carries x to y, y to z and z to x.",
                              at={phi: 2 * sp.pi / 3, a_x: third, a_y: third, a_z: third}, value=[r_z, r_x, r_y])
    rotated = Erratum("The components of P' in b are those of P in n; in n those of P' are R times them.", third_turn)
    return [
        Formula("components of P' in n", b.rotation(n) * in_b, in_n, line=6621, also=(6635, 6842), latex="{}^nr_{P'/E}"),
        Formula("components of P' in n, those of P' in b", in_b, in_n, line=6639, errata=[rotated], latex="{}^nr_{P'/E}"),
        Formula("rotated vector", R * r, in_n, line=6641, where=UNIT, latex="{}^nr_{P'/E}"),
    ]


def _vector_rotation() -> list[Formula]:
    right = sd.rotation.about(list(a), phi, unit=True)
    turned = right * r
    # The part of r along the axis: the mean of r and of r turned by pi.
    along = (r + sd.rotation.about(list(a), sp.pi, unit=True) * r) / 2
    odd = (turned - turned.xreplace({phi: -phi})) / 2
    axr = a.cross(r)
    length = sp.sqrt(axr.dot(axr))
    across = r - along
    form = a * a.dot(r) - a.cross(axr) * cos(phi) + axr * sin(phi)
    outer = a * a.T
    matrices = outer * r - S * (S * r) * cos(phi) + S * r * sin(phi)
    bracket = outer - (outer - sp.eye(3)) * cos(phi) + S * sin(phi)
    unit: dict[str, Any] = {"where": UNIT, "latex": "{}^nr_{P'/E}"}
    one = sp.eye(3)
    return [
        Formula("r_P'/E by way of Q", along + right * (r - along), turned, line=6661, also=(6694, 6791), where=UNIT,
                latex="{}^nr_{P'/E}"),
        Formula("radius of the circle of P", length, sp.sqrt(across.dot(across)), line=6683, also=(6681,), where=UNIT, latex="r"),
        Formula("direction across a and r", axr / length, odd / (sin(phi) * sp.sqrt(across.dot(across))), line=6678, where=UNIT),
        Formula("part across a and r", axr / length * length * sin(phi), odd, line=6685, where=UNIT),
        Formula("part across a and r, product", axr * sin(phi), odd, line=6685, where=UNIT),
        Formula("r_P'/E", form, turned, line=6696, also=(6702, 6726, 6764, 6793), **unit),
        Formula("r_P'/E with a^T", a * (a.T * r)[0] - S * (S * r) * cos(phi) + S * r * sin(phi), turned, line=6704,
                also=(6728, 6766), **unit),
        Formula("r_P'/E with a a^T", matrices, turned, line=6722, also=(6730,), **unit),
        Formula("r_P'/E with a a^T - 1", outer * r - (outer - one) * r * cos(phi) + S * r * sin(phi), turned, line=6750, **unit),
        Formula("r_P'/E in brackets", bracket * r, turned, line=6752, also=(6770,), **unit),
        Formula("r_P'/E, step 1", (outer - cos(phi) * (outer - one) + sin(phi) * S) * r, turned, line=6772, **unit),
        Formula("r_P'/E, step 2", (outer - cos(phi) * outer + cos(phi) * one + sin(phi) * S) * r, turned, line=6774, **unit),
        Formula("r_P'/E, step 3", ((1 - cos(phi)) * outer + cos(phi) * one + sin(phi) * S) * r, turned, line=6776, **unit),
        Formula("r_P'/E, result", (cos(phi) * one + (1 - cos(phi)) * outer + sin(phi) * S) * r, turned, line=6778, also=(6795,),
                **unit),
    ]


def _products() -> list[Formula]:
    skew = sd.rotation.skew
    a_1, a_2, a_3 = u = sp.Matrix(sp.symbols("a_1:4"))
    v = sp.Matrix(sp.symbols("b_1:4"))
    b_1 = v[0]
    S_u = sp.Matrix([[0, -a_3, a_2], [a_3, 0, -a_1], [-a_2, a_1, 0]])
    across = proofs.Proof("orthogonality", "The cross product is at right angles to both vectors.",
                          lambda product: sp.Matrix([u.dot(product), v.dot(product)]))
    index = Erratum("The vector b has the components b_1, b_2, b_3; b_1 is printed three times.", across)
    along = (r + sd.rotation.about(list(a), sp.pi, unit=True) * r) / 2
    twice = skew(list(a)) * skew(list(a)) * r
    squares = sp.Matrix([[a_x**2, a_x * a_y, a_x * a_z], [a_x * a_y, a_y**2, a_y * a_z], [a_x * a_z, a_y * a_z, a_z**2]])
    written_out = sp.Matrix([a_x**2 * r_x + a_x * a_y * r_y + a_x * a_z * r_z, a_x * a_y * r_x + a_y**2 * r_y + a_y * a_z * r_z,
                             a_x * a_z * r_x + a_y * a_z * r_y + a_z**2 * r_z])
    S_2 = sp.Matrix([[-a_y**2 - a_z**2, a_x * a_y, a_x * a_z], [a_x * a_y, -a_x**2 - a_z**2, a_y * a_z],
                     [a_x * a_z, a_y * a_z, -a_x**2 - a_y**2]])
    length = sp.diag(*[a_x**2 + a_y**2 + a_z**2] * 3)
    return [
        Formula("a x b, entries", S_u * sp.Matrix([b_1, b_1, b_1]), skew(list(u)) * v, line=6710, also=(6736, 6758),
                errata=[index], latex=r"a \times b"),
        Formula("a x b", S_u * v, skew(list(u)) * v, line=6712, also=(6738, 6760, 6762), latex=r"a \times b"),
        Formula("a . b", (u.T * v)[0], u.dot(v), line=6708, also=(6734, 6756), latex=r"a \cdot b"),
        Formula("a (a^T r), product", a * (a_x * r_x + a_y * r_y + a_z * r_z), along, line=6716, where=UNIT),
        Formula("a (a^T r), components", written_out, along, line=6718, where=UNIT),
        Formula("a a^T r", squares * r, along, line=6720, where=UNIT),
        Formula("a x (a x r), product", S * S * r, twice, line=6742),
        Formula("a x (a x r), matrix", S_2 * r, twice, line=6744),
        Formula("a x (a x r), difference", (squares - length) * r, twice, line=6746),
        Formula("a x (a x r)", (a * a.T - sp.eye(3)) * r, twice, line=6748, where=UNIT),
    ]


def _matrix() -> list[Formula]:
    about = sd.rotation.about
    right = about(list(a), phi, unit=True)
    still = Erratum("The matrix next to R, the name of the bracket above, is S(a); R is 1 + sin phi S + (1 - cos phi) S^2.",
                    proofs.limit("By the angle 0 nothing turns.", at={phi: 0}, value=sp.eye(3)))
    axes = (dict(zip(a, row)) for row in sp.eye(3).tolist())
    along_x, along_y, along_z = axes
    R_x = sp.Matrix([[1, 0, 0], [0, cos(phi), -sin(phi)], [0, sin(phi), cos(phi)]])
    R_y = sp.Matrix([[cos(theta), 0, sin(theta)], [0, 1, 0], [-sin(theta), 0, cos(theta)]])
    R_z = sp.Matrix([[cos(psi), -sin(psi), 0], [sin(psi), cos(psi), 0], [0, 0, 1]])
    return [
        Formula("R by S", sp.eye(3) + sin(phi) * S + (1 - cos(phi)) * S**2, right, line=6797, also=(6809,), where=UNIT,
                latex=r"R_{a,\phi}"),
        Formula("S", S, sd.rotation.skew(list(a)), line=6809, latex="S(a)"),
        Formula("R as the matrix of S", S, right, line=6801, where=UNIT, errata=[still], latex=r"R_{a,\phi}"),
        Formula("R", R, right, line=6815, also=(6850, 6856, 6868, 6880, 6892, 6904), where=UNIT, latex=r"R_{a,\phi}"),
        Formula("R about x", R_x, about("X", phi), line=6821, latex=r"R_{x,\phi}"),
        Formula("R about y", R_y, about("Y", theta), line=6825, latex=r"R_{y,\theta}"),
        Formula("R about z", R_z, about("Z", psi), line=6829, latex=r"R_{z,\psi}"),
        Formula("R with the axis x", R.xreplace(along_x), about("X", phi), line=6819),
        Formula("R with the axis y", R.xreplace(along_y), about("Y", phi), line=6823),
        Formula("R with the axis z", R.xreplace(along_z), about("Z", phi), line=6827),
    ]


_TITLE = "Euler's Theorem on Rotation"
CASES = (
    Case("euler-theorem-product", "The rotation of Euler angles as a product", Slide("4.4", _TITLE, 6595), _product_of_rotations),
    Case("euler-theorem-vector-and-frame", "Rotating a vector and changing the frame", Slide("4.4", _TITLE, 6609),
         _vector_and_frame),
    Case("euler-theorem-vector", "A vector turned about an axis", Slide("4.4", _TITLE, 6651), _vector_rotation),
    Case("euler-theorem-products", "Products of vectors as matrices", Slide("4.4", _TITLE, 6700), _products),
    Case("euler-theorem-matrix", "Rotation matrix of axis and angle, principal rotations", Slide("4.4", _TITLE, 6784), _matrix),
)
