"""Chapter 5.5: the arm of two links by Newton and Euler, link by link; the slides write no weight."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import sympy as sp

import symdyn as sd
from symdyn.comparison.case import Case, Erratum, Formula, Remark, Slide
from symdyn.comparison.proofs import Proof, numeric_derivative, other
from symdyn.lecture.arm_in_space import cross
from symdyn.report.simplify import simplified
from symdyn.spatial.sixvectors import force_transform
from symdyn.spatial.vectors import identity

APPLICATION = "Application of Recursive Newton-Euler Equation"
FORCES = "Force and moment exerted on a rigid body"


class PlanarArm:
    """The arm of two links with all vectors of the slides in n-components."""

    def __init__(self) -> None:
        self.q1, self.q2 = sd.coordinates("q1 q2")
        self.m1, self.m2, self.I1, self.I2, self.lc1, self.l1, self.lc2 = sd.parameters("m1 m2 I1 I2 lc1 l1 lc2")
        self.n = sd.Frame("n")
        self.b1 = self.n.frame("b1", rotation=sd.rotation.about("Z", self.q1))
        self.b2 = self.b1.frame("b2", rotation=sd.rotation.about("Z", self.q2), origin=[self.l1, 0, 0])
        self.G1, self.G2 = self.b1.point("G1", [self.lc1, 0, 0]), self.b2.point("G2", [self.lc2, 0, 0])
        self.O1, self.O2 = self.b1.point("O1"), self.b2.point("O2")
        self.r_G1, self.r_O2 = self.G1.position(self.n), self.O2.position(self.n)
        self.r_G2 = self.G2.position(self.n) - self.r_O2  # from O_2, as r_G2/O2; the others start from O_1 = E
        self.omega_1, self.omega_2 = self.b1.angular_velocity(self.n), self.b2.angular_velocity(self.n)
        self.omega_21 = self.b2.angular_velocity(self.b1, components=self.n)

    @cached_property
    def equations(self) -> Any:
        return sd.systems.two_link_arm().recursive()

    def force(self, link: int, name: str) -> tuple[sp.Matrix, sp.Matrix]:
        """Moment and force "f" through the joint or "f_G" resultant at the centre of mass, n-components, without weight."""
        R = (self.b1, self.b2)[link - 1].rotation(self.n)
        wrench = self.equations.explicit(f"{name}_{link}", simplify=False).subs(sp.Symbol("g"), 0)
        # Those that are printed where the slide is wrong are short when simplified; the moment in joint 1 is not.
        moment = wrench[2] if (link, name) == (1, "f") else simplified(wrench[2], 1.0)
        return R * sp.Matrix([*wrench[:2], moment]), R * wrench[3:, :]

    @cached_property
    def kinetic_energy(self) -> sp.Expr:
        """From squares of velocities, for Lagrange's equations."""
        v_1, v_2 = self.G1.velocity(self.n), self.G2.velocity(self.n)
        w_1, w_2 = self.q1.dot, self.q1.dot + self.q2.dot
        return (self.m1 * v_1.dot(v_1) + self.m2 * v_2.dot(v_2) + self.I1 * w_1**2 + self.I2 * w_2**2) / 2

    def lagrange(self, q: Any) -> sp.Expr:
        """d/dt dT/dq_dot - dT/dq, the torque along a coordinate."""
        T = self.kinetic_energy
        return sd.rate(T.diff(q.dot)) - T.diff(q)


def along_z(value: Any) -> sp.Matrix:
    return sp.Matrix([0, 0, value])


def dot_left_out(value: sp.Expr, line: str) -> Erratum:
    return Erratum("An angular velocity is the rate of the angle, and the slide prints the angle itself: the dot is left out.",
                   numeric_derivative(f"the angular velocity must be the derivative of the angle, as line {line} has it",
                                      of=along_z(value)))


def accelerations() -> list[Formula]:
    """Step 1, outwards."""
    a = PlanarArm()
    w_1, w_2, w_21 = a.omega_1, a.omega_2, a.omega_21
    alpha_1, alpha_21 = sd.rate(w_1), sd.rate(w_21)
    a_O1, a_O2 = a.O1.acceleration(a.n), a.O2.acceleration(a.n)
    a_G2 = a.G2.acceleration(a.n)
    relative = Erratum(
        "Link 2 turns with omega_b2/n, and the slide lets it turn with omega_b2/b1, so that the turning of link 1 is missing.",
        numeric_derivative("it must be the second derivative of the position of G_2", of=a.G2.position(a.n), order=2))
    # Second derivatives of omega have no symbols; of angles c t^3 they are 6 c.
    third_1, third_2 = sp.symbols("q1_dddot q2_dddot")
    c_1, c_2 = sp.symbols("c1 c2")
    cubic_1 = a.n.frame("cubic_1", rotation=sd.rotation.about("Z", c_1 * sd.t**3))
    cubic_2 = cubic_1.frame("cubic_2", rotation=sd.rotation.about("Z", c_2 * sd.t**3))
    return [
        Formula("acceleration of G1", a_O1 + cross(alpha_1, a.r_G1) + w_1.cross(w_1.cross(a.r_G1)), a.G1.acceleration(a.n),
                line=7701, also=(8044,), latex=r"\ddot{\mathbf r}_{G_1/E}"),
        Formula("acceleration of O2", a_O1 + cross(alpha_1, a.r_O2) + w_1.cross(w_1.cross(a.r_O2)), a_O2, line=7706, also=(8048,),
                latex=r"\ddot{\mathbf r}_{O_2/E}"),
        Formula("acceleration of G2", a_O2 + cross(alpha_21, a.r_G2) + w_21.cross(w_21.cross(a.r_G2)), a_G2, line=7711,
                also=(8052,), latex=r"\ddot{\mathbf r}_{G_2/E}", errata=[relative]),
        Formula("omega of b1", along_z(a.q1.dot), w_1, line=7704, also=(7709,), latex=r"\boldsymbol\omega_{b_1/n}"),
        Formula("omega of b2 against b1", along_z(a.q2.dot), w_21, line=7714, latex=r"\boldsymbol\omega_{b_2/b_1}"),
        Formula("second rate of omega of b2", along_z(third_1) + along_z(third_2),
                sd.rate(sd.rate(cubic_2.angular_velocity(a.n))), line=7716, also=(8056,),
                latex=r"\ddot{\boldsymbol\omega}_{b_2/n}", renamed={third_1: 6 * c_1, third_2: 6 * c_2}),
        Formula("omega of b1, summary", along_z(a.q1), w_1, line=8046, also=(8050, 8061), latex=r"\boldsymbol\omega_{b_1/n}",
                errata=[dot_left_out(a.q1, "7704")]),
        Formula("omega of b2 against b1, summary", along_z(a.q2), w_21, line=8054, latex=r"\boldsymbol\omega_{b_2/b_1}",
                errata=[dot_left_out(a.q2, "7714")]),
        Formula("omega of b2, summary", along_z(a.q1 + a.q2), w_2, line=8063, latex=r"\boldsymbol\omega_{b_2/n}",
                errata=[dot_left_out(a.q1 + a.q2, "7714")]),
    ]


def resultants() -> list[Formula]:
    """Step 2: Newton and Euler at the centres of mass."""
    a = PlanarArm()
    (M_1, F_1), (M_2, F_2) = a.force(1, "f_G"), a.force(2, "f_G")
    alpha_1, alpha_2 = a.b1.angular_acceleration(a.n), a.b2.angular_acceleration(a.n)
    # The letter omega of these two lines is the angle along z, whose second derivative they take.
    angle_1, angle_2 = along_z(a.q1), along_z(a.q1 + a.q2)
    newton = r"\mathbf F_{{G_{0}}}", r"\mathbf M_{{G_{0}}}"
    given = sp.Matrix([a.equations.symbols.coordinates[1]])
    turned = Erratum(
        "The given angle is theta_b2/b1, of link 2 against link 1; with the indices exchanged it has the other sign.",
        Proof("rotation", "turning about z by it must take b2- to b1-components",
              lambda angle: sd.rotation.about("Z", sp.Matrix(angle)[0]) - a.b2.rotation(a.b1)))
    return [
        # theta_b1/b2, of link 1 against link 2
        Formula("angle of link 2 that is given", -given, given, line=7756, also=(7815, 8022), latex=r"\theta_{b_2/b_1}",
                errata=[turned]),
        Formula("F_G1", a.m1 * a.G1.acceleration(a.n), F_1, line=7772, also=(8061,), latex=newton[0].format(1)),
        Formula("F_G2", a.m2 * a.G2.acceleration(a.n), F_2, line=7774, also=(8063,), latex=newton[0].format(2)),
        Formula("M_G1", a.I1 * sd.rate(sd.rate(angle_1)), M_1, line=7772, latex=newton[1].format(1)),
        Formula("M_G2", a.I2 * sd.rate(sd.rate(angle_2)), M_2, line=7774, latex=newton[1].format(2)),
        Formula("M_G1, summary", a.I1 * alpha_1, M_1, line=8061, latex=newton[1].format(1)),
        Formula("M_G2, summary", a.I2 * alpha_2, M_2, line=8063, latex=newton[1].format(2)),
    ]


def equivalent_forces() -> list[Formula]:
    """A force, and a force with a couple, at a point P of a body, moved to its centre of mass G."""
    r, F, M_P, M_O = (sp.Matrix(sp.symbols(f"{name}_x {name}_y {name}_z")) for name in ("r_PG", "F_P", "M_P", "M_O"))
    omega, v_G = (sp.Matrix(sp.symbols(f"{name}_x {name}_y {name}_z")) for name in ("omega", "v_G"))
    to_G = sp.Matrix(force_transform(identity(), list(r)))
    with_couple = to_G * sp.Matrix.vstack(M_P, F)
    alone = to_G * sp.Matrix.vstack(sp.zeros(3, 1), F)

    def power(M_G: Any) -> Any:
        at_P = M_P.dot(omega) + F.dot(v_G + omega.cross(r))
        return sp.Matrix(M_G).dot(omega) + F.dot(v_G) - at_P

    couple_at_P = Erratum("The couple acts at P and is M_P everywhere else on the slide; there is no O.",
                          Proof("power", "both force systems must have the same power in every motion of the body", power))
    I_zz, alpha = sp.symbols("I_zz alpha")
    wheel = sd.System("wheel", planar=True)
    turn = sd.coordinates("q1")
    wheel.add_joint(sd.Revolute("axle", wheel.ground, wheel.add_body("wheel", mass=1, inertia=sp.Symbol("I_zz")), turn))
    moment = wheel.recursive().link(1).f_G[:3, :]
    return [
        Formula("M_G of a planar body", along_z(I_zz * alpha), moment, line=7841, renamed={alpha: turn.ddot}),
        Formula("F_G", F, alone[3:, :], line=7853, also=(7883,), latex=r"{}^b\mathbf F_G"),
        Formula("M_G of a force", r.cross(F), alone[:3, :], line=7857, latex=r"{}^b\mathbf M_G"),
        Formula("M_G of a force and a couple", M_O + r.cross(F), with_couple[:3, :], line=7887, latex=r"{}^b\mathbf M_G",
                errata=[couple_at_P]),
        Formula("M_G in words", M_P + r.cross(F), with_couple[:3, :], line=7889, latex=r"{}^b\mathbf M_G"),
    ]


def torques() -> list[Formula]:
    """Step 3, inwards: what the joints must exert."""
    a = PlanarArm()
    (M_G1, F_G1), (M_G2, F_G2) = a.force(1, "f_G"), a.force(2, "f_G")
    (tau_1, F_O1), (tau_2, F_O2) = a.force(1, "f"), a.force(2, "f")
    r_G1, r_O2, r_G2 = a.r_G1, a.r_O2, a.r_G2
    lever = Erratum(
        "The moment about O_2 has r_G2/O2 x F_G2 besides M_G2, as line 7921 has it; the summary leaves it out.",
        other("Lagrange's equation of q2 must give the same torque", lambda: along_z(a.lagrange(a.q2))))
    return [
        Formula("F_O2", F_G2, F_O2, line=7917, also=(8065,), latex=r"\mathbf F_{O_2}"),
        Formula("M_O2", M_G2 + r_G2.cross(F_G2), tau_2, line=7921, also=(7923,), latex=r"\mathbf M_{O_2}"),
        Formula("forces on link 1", -F_O2 + F_O1, F_G1, line=7968),
        Formula("F_O1", F_G1 + F_O2, F_O1, line=7970, also=(8067,), latex=r"\mathbf F_{O_1}"),
        Formula("moments on link 1", -tau_2 + r_O2.cross(-F_O2) + tau_1, M_G1 + r_G1.cross(F_G1), line=7978),
        Formula("tau_1", M_G1 + r_G1.cross(F_G1) + tau_2 + r_O2.cross(F_O2), tau_1, line=7980, also=(8071,), latex=r"\tau_1"),
        Formula("tau_2", M_G2, tau_2, line=8069, latex=r"\tau_2", errata=[lever]),
    ]


CASES = (
    Case("two-link-arm-accelerations", "Accelerations of the centres of mass of two links", Slide("5.5", APPLICATION, 7667),
         accelerations, remarks=[
             Remark("The components next to the acceleration of O_2 are those of r_O2/E; r_G1/E is printed.", 7708, (8048,)),
             Remark("The equation holds, but the next step needs angular accelerations: one dot on every omega, not two.", 7716,
                    (8056,))]),
    Case("two-link-arm-resultants", "Resultant force and moment at the centre of mass of each link",
         Slide("5.5", APPLICATION, 7718), resultants, remarks=[Remark(
             "omega is the name of an angle here, [0 0 theta], with two dots in the moment; everywhere else it is the angular "
             "velocity. Two dots on the angle are one on that, and the moment is right.", 7772, (7774,))]),
    Case("force-moved-to-the-center-of-mass", "A force and a couple at P, moved to G", Slide("5.5", FORCES, 7839),
         equivalent_forces),
    Case("two-link-arm-torques", "The torques in the joints, link by link", Slide("5.5", FORCES, 7899), torques, remarks=[
        Remark("The forces and moments of the slide act on link 1; its title says link 3, and the arm has two.", 7938)]),
)
