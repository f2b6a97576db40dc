"""Chapter 1.7 and 1.8: a chair on a turning disk, the centripetal and the Coriolis acceleration step by step."""

from __future__ import annotations

import sympy as sp

import symdyn as sd
from symdyn.comparison import Case, Formula, Slide, conventions
from symdyn.comparison.conventions import Convention
from symdyn.lecture.chapter_1_circular import length, limit

r, v, omega, m, step = sp.symbols("r v omega m_P Delta_t", positive=True)
w = sp.Matrix([0, 0, omega])


def _chair() -> list[Formula]:
    n = sd.Frame("n")
    b = n.frame("b", rotation=sd.rotation.about("Z", omega * sd.t))
    turn = b.rotation(n)
    fixed, moving = b.point("P", [r, 0, 0]), b.point("P", [r, v * sd.t, 0])
    r_fixed, r_moving = turn * sp.Matrix([r, 0, 0]), turn * sp.Matrix([r, v * sd.t, 0])
    rd_PO = turn * sp.Matrix([0, v, 0])
    felt = fixed.inertial_forces(m, frame=b, components=n)
    return [
        Formula("force on the fixed chair", m * w.cross(w.cross(r_fixed)), m * fixed.acceleration(seen_from=n), line=1646,
                also=(644, 692)),
        Formula("felt on the fixed chair", -m * w.cross(w.cross(r_fixed)), felt.total, line=1675, also=(648, 696, 1650)),
        Formula("felt on the moving chair", -2 * m * w.cross(rd_PO) - m * w.cross(w.cross(r_moving)),
                moving.inertial_forces(m, frame=b, components=n).total, line=1727),
    ]


def _centripetal() -> list[Formula]:
    n = sd.Frame("n")
    b = n.frame("b", rotation=sd.rotation.about("Z", omega * sd.t))
    A = b.point("A", [r, 0, 0])
    r_AO, velocity = A.position(of=n), A.velocity(seen_from=n)
    acceleration = A.acceleration(seen_from=n)
    change = velocity.subs(sd.t, step) - velocity.subs(sd.t, 0)
    mean = limit(change, step)
    by_angle = length(mean) / omega
    parts = A.acceleration_parts(through=b, seen_from=n)
    inertial = A.inertial_forces(m, frame=b, components=n)
    return [
        Formula("a_n as a limit", mean, acceleration.subs(sd.t, 0), line=1773),
        Formula("a_n", w.cross(w.cross(r_AO)), parts.centripetal, line=1776),
        Formula("v_t", w.cross(r_AO), velocity, line=1780),
        Formula("size of v_t", omega * r, length(velocity), line=1782, latex="|v_t|"),
        Formula("change of v by Delta theta", omega * r, by_angle, line=1784, latex=r"|\Delta v| / \Delta\theta"),
        Formula("size of a_n", omega**2 * r, length(acceleration), line=1786, latex="|a_n|"),
        Formula("seen in the b-frame", sp.zeros(3, 1), A.acceleration(seen_from=b), line=1799),
        Formula("forces in the b-frame", (m * acceleration - m * w.cross(w.cross(r_AO)), sp.zeros(3, 1)),
                (m * acceleration + inertial.total, sp.zeros(3, 1)), line=1799),
    ]


def _coriolis() -> list[Formula]:
    """A moves along a slot with v; where a step in time is taken, components are those of the b-frame."""
    x_B, y_B = sp.symbols("x_BO y_BO")
    n = sd.Frame("n")
    b = n.frame("b", rotation=sd.rotation.about("Z", omega * sd.t))
    A = b.point("A", [r + v * sd.t, 0, 0])
    turn = b.rotation(n)
    v_n = A.velocity(seen_from=b, components=n)
    a_t1 = limit(v_n.subs(sd.t, step) - v_n.subs(sd.t, 0), step)
    in_slot = sp.Matrix([v, 0, 0])

    def v_t(at: sp.Expr) -> sp.Matrix:
        return (A.velocity(seen_from=n, components=b) - A.velocity(seen_from=b)).subs(sd.t, at)

    r_AO = A.position(of=n, components=b).subs(sd.t, 0)
    change = v_t(step) - v_t(sp.S.Zero)
    B = b.point("B", [x_B, y_B, 0])
    about_B = v_t(sp.S.Zero) - B.velocity(seen_from=n, components=b)
    centre = conventions.other_point(about_B,
                                     "The slide calls the centre of the disk B here, as 1.9 does, and O in the lines below.")
    size = Convention("size of a vector",
                      "v_n without bars stands for its size; these slides set omega and v_n bold or not alike.",
                      lambda change: length(change) * v_n / length(v_n))
    parts = A.acceleration_parts(through=b, seen_from=n)
    acceleration = A.acceleration(seen_from=n)
    inertial = A.inertial_forces(m, frame=b, components=n)
    return [
        Formula("a_t1", w.cross(v_n.subs(sd.t, 0)), a_t1, line=1837, also=(1839,)),
        Formula("change of v_n by Delta theta", length(v_n), length(a_t1) / omega, line=1849, latex=r"|\Delta v| / \Delta\theta"),
        Formula("change of v_n, in parentheses", v_n, a_t1 / omega, line=1849, conventions=[size],
                latex=r"|\Delta v| / \Delta\theta"),
        Formula("size of a_t1", length(v_n) * omega, length(a_t1), line=1851, latex="|a_{t1}|"),
        Formula("v_t after the step", w.cross(r_AO + step * in_slot), v_t(step), line=1859, latex=r"v_t^{t + \Delta t}"),
        Formula("v_t", w.cross(r_AO - sp.Matrix([x_B, y_B, 0])), v_t(sp.S.Zero), line=1863, conventions=[centre], latex="v_t^t"),
        Formula("change of v_t", w.cross(r_AO + step * in_slot) - w.cross(r_AO), change, line=1867, also=(1865,),
                latex=r"\Delta v"),
        Formula("change of v_t, in one product", w.cross(r_AO + step * in_slot - r_AO), change, line=1869, latex=r"\Delta v"),
        Formula("change of v_t, summed", w.cross(step * in_slot), change, line=1871, latex=r"\Delta v"),
        Formula("a_t2", w.cross(in_slot), limit(change, step), line=1873, also=(1861,)),
        Formula("both halves", turn * (w.cross(in_slot) + w.cross(in_slot)), parts.coriolis, line=1873, latex="a_{t1} + a_{t2}"),
        Formula("seen in the b-frame", sp.zeros(3, 1), A.acceleration(seen_from=b), line=1915),
        Formula("forces in the b-frame",
                (m * acceleration - m * w.cross(w.cross(A.position(of=n))) - 2 * m * w.cross(v_n), sp.zeros(3, 1)),
                (m * acceleration + inertial.total, sp.zeros(3, 1)), line=1915),
    ]


CASES = (
    Case("chair-on-disk", "A chair fixed on and moving on a turning disk",
         Slide("1.7", "Examples of rotating reference frame", 1633), _chair),
    Case("disk-centripetal", "Centripetal acceleration on a turning disk",
         Slide("1.8", "Rotating Disk - Centripetal Acceleration", 1767),
         _centripetal),
    Case("disk-coriolis", "Coriolis acceleration in a slot of a turning disk",
         Slide("1.8", "Rotating Disk - Coriolis Acceleration", 1804),
         _coriolis),
)
