"""Chapter 2.2: the equations of motion of a body in the plane, equivalent forces, moment of inertia of many particles."""

from __future__ import annotations

import sympy as sp

import symdyn as sd
from symdyn.comparison import Case, Formula, Slide
from symdyn.comparison.conventions import Convention
from symdyn.frames.rigid_body import equivalent_force_system, moment_equation, point_inertia
from symdyn.lecture.letters import constant, ddot, dot, moving, stands_for, symmetric

m, I_G, theta_dot, theta_ddot = sp.symbols("m I_G theta_dot theta_ddot")
rG = moving("r_GE")
omega, F, M = moving("omega"), constant("F_P"), constant("M_G")
# The accelerations in the force equation are those seen from the n-frame, in components of the b-frame.
FLAT = sp.diag(1, 1, 0)


def equations_of_motion() -> list[Formula]:
    """A body in the plane with a force at a point P, by the embedding technique."""
    x, y, theta = q = sd.coordinates("x y theta")
    P = sp.Matrix([*sp.symbols("r_PG_x r_PG_y"), 0])
    system = sd.System("body", gravity=[0, 0])
    body = system.add_body("b", mass=m, inertia=I_G)
    system.add_joint(sd.Planar("free", system.ground, body, list(q)))
    system.add_force(body, [F[0], F[1]], point=[P[0], P[1]], frame=body)
    equations = system.embedding()
    b = sd.Frame("n").frame("b", rotation=sd.rotation.about("Z", theta), origin=[x, y, 0])
    R = b.rotation(b.root)
    needs = equations.explicit("M_tilde", simplify=False) * sp.Matrix([c.ddot for c in q]) + equations.explicit("k_tilde", False)
    has = equations.explicit("F_tilde", simplify=False)
    b_needs, b_has = (R.T * sp.Matrix([*side[:2], 0]) for side in (needs, has))
    acceleration = stands_for(ddot(rG), R.T * sp.Matrix([x.ddot, y.ddot, 0]))
    at_G = equivalent_force_system(FLAT * F, P)
    w = b.angular_velocity(components=b)
    third = sp.Matrix([0, 0, theta.ddot])
    # A frame that turns as the body does, with its origin at E: what the dots over components in the b-frame say in 1.7.
    about_E = b.root.frame("e", rotation=R)
    from_E = about_E.point("G", list(R.T * sp.Matrix([x, y, 0])))
    parts = from_E.acceleration_parts(through=about_E, seen_from=b.root, components=about_E)
    seen_from_n = Convention("rate of a vector",
                             "The dots are rates seen from the n-frame, taken in the b-frame; in 1.7 those of the components.",
                             lambda a: a - parts.euler - parts.centripetal - parts.coriolis)
    second_rate = stands_for(rG, R.T * sp.Matrix([x, y, 0]), dots=2)
    return [
        Formula("acceleration in the force equation", ddot(rG), b.acceleration(seen_from=b.root, components=b), line=2658,
                conventions=[seen_from_n], renamed=second_rate, latex=r"{}^b\ddot{r}_{G/E}"),
        Formula("force equation", (m * FLAT * ddot(rG), FLAT * F), (b_needs, b_has), line=2658, renamed=acceleration),
        Formula("force at G", FLAT * F, at_G.force, line=2662, also=(2697,), latex=r"{}^bF_G"),
        Formula("moment equation", (I_G * third, P.cross(FLAT * F)), (sp.Matrix([0, 0, needs[2]]), sp.Matrix([0, 0, has[2]])),
                line=2666, also=(2685, 2713, 2737, 2760)),
        Formula("moment about G", P.cross(FLAT * F), at_G.moment, line=2671, also=(2701,), latex=r"{}^bM_G"),
        Formula("angular velocity", theta_dot * sp.Matrix([0, 0, 1]), w, line=2781, latex=r"{}^b\omega_{b/n}"),
    ]


def in_space() -> list[Formula]:
    """A body in space with a moment, in its own components."""
    inertia = symmetric("I")
    system = sd.System("body", gravity=[0, 0, 0])
    body = system.add_body("b", mass=m, inertia=inertia)
    speeds = sd.speeds("omega_x omega_y omega_z")
    system.add_joint(sd.Spherical("ball", system.ground, body, sd.coordinates("phi theta psi"), speeds=speeds,
                                  orientation=sd.EulerAngles("XYZ", speeds="body")))
    system.add_torque(body, list(M), frame=body)
    equations = system.embedding()
    needs = equations.M_tilde * sp.Matrix([u.dot for u in speeds]) + equations.k_tilde
    printed = inertia * dot(omega) + omega.cross(inertia * omega)
    return [Formula("moment equation in space", (M, printed), (equations.F_tilde, needs), line=2675),
            Formula("moment by I_G", printed, moment_equation(inertia, omega, dot(omega)), line=2675, latex=r"{}^bM_G")]


def mass_moment_of_inertia() -> list[Formula]:
    """Mass moment of inertia of three particles, in the plane and in space."""
    masses = sp.symbols("m_1:4", positive=True)
    r = [constant(f"r_{k}G") for k in (1, 2, 3)]
    flat = point_inertia(masses, [FLAT * place for place in r])[2, 2]
    particles = list(zip(masses, r, strict=True))

    def total(term: str) -> sp.Expr:
        i, j = ("xyz".index(letter) for letter in term)
        return sum((mass * place[i] * place[j] for mass, place in particles), sp.S.Zero)

    def squares(first: int, second: int) -> sp.Expr:
        return sum((mass * (place[first]**2 + place[second]**2) for mass, place in particles), sp.S.Zero)

    printed = sp.Matrix([[squares(1, 2), -total("xy"), -total("xz")],
                         [-total("xy"), squares(0, 2), -total("yz")],
                         [-total("xz"), -total("yz"), squares(0, 1)]])
    return [
        Formula("in the plane", sum((mass * (FLAT * place).dot(FLAT * place) for mass, place in particles), sp.S.Zero), flat,
                line=2725, latex="{}^bI_G"),
        Formula("in space", printed, point_inertia(masses, r), line=2729, latex="{}^bI_G"),
    ]


CASES = (
    Case("planar-rigid-body", "A body in the plane", Slide("2.2", "Equations of 2 dimensional rigid body motion", 2641),
         equations_of_motion),
    Case("spatial-moment-equation", "The moment equation in space, body components",
         Slide("2.2", "Equations of 2 dimensional rigid body motion", 2673), in_space),
    Case("mass-moment-of-inertia", "Mass moment of inertia of a body", Slide("2.2", "Mass Moment of Inertia", 2715),
         mass_moment_of_inertia),
)
