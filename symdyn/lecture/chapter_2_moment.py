"""Chapter 2.1: two particles on a turning body; the moment about a point O of the body."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import sympy as sp

import symdyn as sd
from symdyn.comparison import Case, Erratum, Formula, Slide, proofs
from symdyn.frames.rigid_body import angular_momentum, center_of_mass, equivalent_force_system, moment_equation, point_inertia
from symdyn.lecture.letters import constant, ddot, dot, moving, stands_for

TITLE = "Rotation of the rigid body in spatial(3D) motion"
m1, m2, m_system = sp.symbols("m_1 m_2 m_system", positive=True)
r1, r2, rO, r1E, r2E, rG = (moving(name) for name in ("r_1O", "r_2O", "r_OE", "r_1E", "r_2E", "r_GO"))
omega = moving("omega")
F1, F2, f12, f21 = (constant(name) for name in ("F_1", "F_2", "f_12", "f_21"))


def inertia_of(m: sp.Expr, r: sp.Matrix) -> sp.Matrix:
    """(3, 3) of a particle, as the slides print it."""
    x, y, z = r
    return sp.Matrix([[m * (y**2 + z**2), -m * x * y, -m * x * z],
                      [-m * x * y, m * (x**2 + z**2), -m * y * z],
                      [-m * x * z, -m * y * z, m * (x**2 + y**2)]])


def turning_frame(n: sd.Frame, origin: Sequence[Any] = (0, 0, 0)) -> sd.Frame:
    """A frame that turns about z and about its own x: its angular velocity can have any direction."""
    psi, phi = sd.coordinates("psi phi")
    return n.frame("b", rotation=sd.rotation.about("Z", psi) * sd.rotation.about("X", phi), origin=list(origin))


class Body:
    """A turning body with two particles, and what symdyn derives of it."""

    def __init__(self) -> None:
        self.n = sd.Frame("n")
        self.b = turning_frame(self.n, rO)
        self.points = [self.b.point(name, constant(f"b_r_{name}")) for name in "12"]

    @cached_property
    def r(self) -> list[sp.Matrix]:
        """Positions from O."""
        return [p.position(of=self.b, components=self.n) for p in self.points]

    @cached_property
    def a(self) -> list[sp.Matrix]:
        """Accelerations seen from the n-frame."""
        return [p.acceleration(seen_from=self.n, components=self.n) for p in self.points]

    @cached_property
    def omega(self) -> sp.Matrix:
        return self.b.angular_velocity(seen_from=self.n, components=self.n)

    @cached_property
    def alpha(self) -> sp.Matrix:
        return self.b.angular_acceleration(seen_from=self.n, components=self.n)

    def moment(self, *masses: sp.Expr) -> sp.Matrix:
        """About O, of what accelerates the particles (zero or both masses)."""
        inertia, G = point_inertia(masses, self.r), center_of_mass(masses, self.r)
        return sp.Matrix(moment_equation(inertia, self.omega, self.alpha, sum(masses), G, ddot(rO)))

    @cached_property
    def letters(self) -> dict[Any, Any]:
        """Meaning of the letters of the slides."""
        angular = stands_for(omega, self.omega) | stands_for(dot(omega), self.alpha)
        positions = stands_for(r1, self.r[0], 2) | stands_for(r2, self.r[1], 2)
        accelerations = stands_for(ddot(r1E), self.a[0]) | stands_for(ddot(r2E), self.a[1])
        G = center_of_mass([m1, m2], self.r)
        return {**angular, **positions, **accelerations, **stands_for(rG, G), m_system: m1 + m2}


def forces() -> list[Formula]:
    """Inner forces act along the line that joins the particles, and have no moment."""
    pull = sp.Symbol("s", positive=True)
    inner = pull * (r2 - r1)
    along = stands_for(f12, inner) | stands_for(f21, -inner)
    acting = [equivalent_force_system(F, r).moment for F, r in ((F1, r1), (inner, r1), (F2, r2), (-inner, r2))]
    total = sum(acting, sp.zeros(3, 1))
    size_f, size_r, theta = sp.symbols("f r theta", positive=True)
    # A force at the angle theta to the position (r, 0, 0); from O its line is at the distance r sin(theta).
    turned = sd.rotation.about("Z", theta) * sp.Matrix([size_f, 0, 0])
    size = equivalent_force_system(turned, [size_r, 0, 0]).moment[2]
    letters = along
    # Along the force and across it: the distance of O from the line of the force is the component across.
    arm = -(sd.rotation.about("Z", theta).T * sp.Matrix([size_r, 0, 0]))[1]
    return [
        Formula("moment of all forces", r1.cross(F1 + f12) + r2.cross(F2 + f21), total, line=2367, also=(2435,),
                latex=r"\Sigma M_O", renamed=letters),
        Formula("moment of f_12", -r2.cross(f21), acting[1], line=2393, also=(2417, 2439), renamed=letters),
        *[Formula(f"size of the moment of {f}", sp.Symbol(f) * sp.Symbol(r) * sp.sin(sp.Symbol(angle)), size, line=line,
                  renamed={f: size_f, r: size_r, angle: theta})
          for f, r, angle, line in (("f_12", "r_1O", "theta_1", 2408), ("f_21", "r_2O", "theta_2", 2415))],
        *[Formula(f"size of the moment of {f} by the arm", sp.Symbol(f) * sp.Symbol("l"), size, line=line,
                  renamed={f: size_f, "l": arm}) for f, line in (("f_12", 2408), ("f_21", 2415))],
        Formula("multiplied out", r1.cross(F1) + r1.cross(f12) + r2.cross(F2) + r2.cross(f21), total, line=2437, renamed=letters),
        Formula("f_12 replaced", r1.cross(F1) - r2.cross(f21) + r2.cross(F2) + r2.cross(f21), total, line=2441, renamed=letters),
        Formula("moment of the outer forces", r1.cross(F1) + r2.cross(F2), total, line=2443, also=(2427,), latex=r"\Sigma M_O"),
    ]


def of_first_particle() -> list[Formula]:
    """r_1/O x m_1 r_1/E_ddot, step by step."""
    body = Body()
    I_O1, I_O2 = inertia_of(m1, r1), inertia_of(m2, r2)
    derived = body.moment(m1, m2).xreplace({m2: sp.S.Zero})
    turning = derived.xreplace(dict.fromkeys(ddot(rO), sp.S.Zero))
    letters = body.letters
    of_O = m1 * r1.cross(ddot(rO))
    massless = proofs.limit("Without the first mass there is no such moment.", at={m1: 0}, value=sp.zeros(3, 1))
    whole_body = Erratum("The rate of the first particle's angular momentum takes its own inertia I_O,1, not that of the body.",
                         massless)
    # In letters: r_1 and r_2 turn with omega.
    carried = stands_for(dot(r1), omega.cross(r1)) | stands_for(dot(r2), omega.cross(r2))
    in_letters = moment_equation(point_inertia([m1], [r1]), omega, dot(omega), m1, r1, ddot(rO))
    return [
        Formula("two parts", r1.cross(m1 * (ddot(rO) + ddot(r1))), derived, line=2453, renamed=letters),
        Formula("multiplied out", of_O + m1 * r1.cross(ddot(r1)), derived, line=2455, also=(2457,), renamed=letters),
        Formula("with a rate", of_O + sd.rate(m1 * r1.cross(dot(r1))), derived, line=2459, renamed=letters),
        Formula("with omega", of_O + sd.rate(m1 * r1.cross(omega.cross(r1))), derived, line=2461, also=(2477,), renamed=letters),
        Formula("velocity", omega.cross(r1), body.points[0].velocity(seen_from=body.n, components=body.n) - dot(rO), line=2465,
                latex=r"\dot{r}_{1/O}", renamed=letters),
        Formula("rate of the product", m1 * dot(r1).cross(dot(r1)) + m1 * r1.cross(ddot(r1)), turning, line=2467,
                renamed=letters),
        Formula("rate of the product, shorter", m1 * r1.cross(ddot(r1)), turning, line=2467, renamed=letters),
        Formula("with I_O,1", of_O + sd.rate(I_O1 * omega), derived, line=2493, also=(2499, 2529), renamed=letters),
        Formula("with I_O", of_O + sd.rate((I_O1 + I_O2) * omega), in_letters, slide=Slide("2.1", f"{TITLE} - Moment equation"),
                line=2523, errata=[whole_body], renamed=carried),
    ]


def inertia() -> list[Formula]:
    """The inertia of a particle, from its angular momentum."""
    w = sp.Matrix(list(omega))
    derived = point_inertia([m1], [r1])
    momentum = angular_momentum(derived, w)
    return [
        Formula("I_O,1", inertia_of(m1, r1), derived, line=2483, latex="I_{O,1}"),
        Formula("angular momentum", m1 * r1.cross(w.cross(r1)), momentum, line=2481),
        Formula("angular momentum with I_O,1", inertia_of(m1, r1) * w, momentum, line=2483, latex=r"I_{O,1} \omega"),
    ]


def about_O() -> list[Formula]:
    """Both particles."""
    body = Body()
    I_O1, I_O2 = inertia_of(m1, r1), inertia_of(m2, r2)
    I_O = I_O1 + I_O2
    derived = body.moment(m1, m2)
    letters = body.letters
    rates = sd.rate(I_O1 * omega) + sd.rate(I_O2 * omega)
    of_O = (m1 * r1 + m2 * r2).cross(ddot(rO))
    of_G = m_system * rG.cross(ddot(rO))
    return [
        Formula("by accelerations", r1.cross(m1 * ddot(r1E)) + r2.cross(m2 * ddot(r2E)), derived, line=2369,
                also=(2379, 2423, 2449, 2473, 2491, 2495, 2519, 2525, 2582, 2604), latex=r"\Sigma M_O", renamed=letters),
        Formula("both by parts",
                m1 * r1.cross(ddot(rO)) + sd.rate(I_O1 * omega) + m2 * r2.cross(ddot(rO)) + sd.rate(I_O2 * omega),
                derived, line=2493, also=(2499, 2529), renamed=letters),
        Formula("sorted", m1 * r1.cross(ddot(rO)) + m2 * r2.cross(ddot(rO)) + rates, derived, line=2501, renamed=letters),
        Formula("put together", of_O + sd.rate(I_O * omega), derived, line=2505, renamed=letters),
        Formula("r_G", (m1 * r1 + m2 * r2) / m_system, center_of_mass([m1, m2], [r1, r2]), line=2509, also=(2533,),
                renamed={m_system: m1 + m2}, latex="r_{G/O}"),
        Formula("m_system r_G", m1 * r1 + m2 * r2, (m1 + m2) * center_of_mass([m1, m2], [r1, r2]), line=2509, also=(2533,),
                latex="m_{system} r_{G/O}"),
        Formula("with r_G", of_G + sd.rate(I_O * omega), derived, line=2511, also=(2535, 2584, 2604), renamed=letters),
        Formula("moment equation", of_G + omega.cross(I_O * omega) + I_O * dot(omega), derived, line=2612, also=(2619,),
                latex=r"\Sigma M_O", renamed=letters),
    ]


CASES = (
    Case("two-particles-moment", "Two particles: inner forces have no moment", Slide("2.1", TITLE, 2344), forces),
    Case("particle-moment", "The moment that one particle needs about O", Slide("2.1", TITLE, 2445), of_first_particle),
    Case("particle-inertia", "The mass moment of inertia of a particle", Slide("2.1", TITLE, 2469), inertia),
    Case("moment-about-O", "The moment equation about a point O of the body", Slide("2.1", TITLE, 2487), about_O),
)
