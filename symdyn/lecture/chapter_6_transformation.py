"""Chapters 6.2 and 6.3: from the velocities of the centre of mass G to those of a point O of the platform."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import sympy as sp
from sympy.physics.vector import ReferenceFrame

import symdyn as sd
from symdyn.comparison import Case, Erratum, Formula, Slide, conventions, proofs
from symdyn.lecture.letters import constant, dot, moving, skew, stands_for

TITLE = "2.1 Equations of Motion - Coordinates Transformation"
x, y, z, psi, theta, phi = q = sp.Matrix(sd.coordinates("x y z psi theta phi"))
m = sp.Symbol("m", positive=True)
c = sp.Matrix([0, 0, sp.Symbol("c")])
F, tau = constant("F"), constant("tau")


class Platform:
    """The platform, described by its point O and ZYX Euler angles; its G is at `com` (body axes)."""

    def __init__(self, com: sp.Matrix = c) -> None:
        self.com = com
        self.inertia = sp.diag(*sp.symbols("I_x I_y I_z", positive=True))
        self.system = sd.System("platform", gravity=[0, 0, 0])
        self.body = self.system.add_body("P", mass=m, inertia=self.inertia, com=list(com))
        self.system.add_joint(sd.Free("sea", self.system.ground, self.body, list(q), orientation=sd.EulerAngles("ZYX")))
        self.system.add_force(self.body, list(F), point=list(com))
        self.system.add_torque(self.body, list(tau))
        self.R = sd.rotation.from_euler("ZYX", [psi, theta, phi])
        self.G = sd.rotation.euler_rates("ZYX", [psi, theta, phi], frame="n")
        self.frame = sd.Frame("n").frame("b", rotation=self.R, origin=[x, y, z])

    @cached_property
    def equations(self) -> Any:
        return self.system.embedding()

    def derived(self, name: str) -> sp.Matrix:
        """A quantity of the embedded equations, not simplified."""
        return sp.Matrix(self.equations.explicit(name, simplify=False))

    @property
    def qd(self) -> sp.Matrix:
        return dot(q)

    @cached_property
    def J(self) -> sp.Matrix:
        """(6, 6) as the slides print it, with the arm from O to G."""
        arm = skew(self.R * self.com)
        return sp.Matrix(sp.BlockMatrix([[sp.eye(3), -arm * self.G], [sp.zeros(3), self.G]]))

    @cached_property
    def M(self) -> sp.Matrix:
        """(6, 6) as the slides print it, about G in the n-frame."""
        return sp.diag(m * sp.eye(3), self.R * self.inertia * self.R.T)

    @cached_property
    def Q(self) -> sp.Matrix:
        return sp.diag(sp.zeros(3), skew(self.G * self.qd[3:, :]) * self.R * self.inertia * self.R.T)

    @cached_property
    def by_positions(self) -> sp.Matrix:
        """(6, 6) J by differentiating the position of G and the rotation."""
        position = sp.Matrix([x, y, z]) + self.R * self.com
        spin = sd.rate(self.R) * self.R.T
        omega = sp.Matrix([spin[2, 1], spin[0, 2], spin[1, 0]])
        return sp.Matrix.vstack(position.jacobian(q), omega.jacobian(self.qd))


def turned_arm() -> sp.Matrix:
    """c in the n-frame, turned by the frames of SymPy."""
    n = ReferenceFrame("n")
    b = n.orientnew("b", "Body", (psi, theta, phi), "ZYX")
    return sp.Matrix((c[0] * b.x + c[1] * b.y + c[2] * b.z).to_matrix(n))


def to_G() -> list[Formula]:
    """Chapter 6.2; r_O/G is O seen from G, as everywhere in the lecture."""
    p = Platform()
    rO, r_OG = sp.Matrix([x, y, z]), constant("r_OG")
    gd = p.qd[3:, :]
    point = p.frame.point("G", list(c))
    position, velocity = point.position(), point.velocity()
    arm = p.R * r_OG
    J = sp.Matrix(sp.BlockMatrix([[sp.eye(3), -skew(arm) * p.G], [sp.zeros(3), p.G]]))
    letters = stands_for(r_OG, -c)
    J_derived = sp.Matrix.vstack(velocity, p.frame.angular_velocity()).jacobian(p.qd)
    why = "The arm from O to G is r_G/O; r_O/G points the other way."
    turned = proofs.other("G is where the frames of SymPy carry c from O.", rO + turned_arm())
    moved = proofs.numeric_derivative("It is the rate of the position of G.", of=rO + p.R * c)
    J_right = proofs.other("Derivatives of the position of G and of the rotation by the coordinates.", p.by_positions)
    return [
        Formula("r_G", rO + arm, position, line=11811, errata=[Erratum(why, turned)], latex="r_{G_P/E}", renamed=letters),
        Formula("velocity of G", dot(rO) + (p.G * gd).cross(arm), velocity, line=11817, also=(11819,),
                errata=[Erratum(why, moved)],
                latex=r"\dot{r}_{G_P/E}", renamed=letters),
        Formula("velocity of G, exchanged", dot(rO) - skew(arm) * p.G * gd, velocity, line=11821, also=(11825,),
                errata=[Erratum(why, moved)], latex=r"\dot{r}_{G_P/E}", renamed=letters),
        Formula("omega", p.G * gd, p.frame.angular_velocity(), line=11827, latex=r"\omega_{b_{G_P}/n}"),
        Formula("J", J, J_derived, line=11831, errata=[Erratum(why, J_right)], latex="J", renamed=letters),
        Formula("s_dot", p.derived("J") * p.qd, sp.Matrix.vstack(velocity, p.frame.angular_velocity()), line=11833, also=(11841,),
                latex=r"\dot{s}"),
    ]


def from_G() -> list[Formula]:
    """Chapter 6.3; the slide's coordinates are those of G, its s_dot is the velocity of O."""
    p = Platform()
    rG, r_GO = moving("r_GE"), constant("r_GO")
    frame = sd.Frame("n").frame("b", rotation=p.R, origin=list(rG))
    point = frame.point("O", list(-c))
    gd = p.qd[3:, :]
    arm = p.R * r_GO
    J = sp.Matrix(sp.BlockMatrix([[sp.eye(3), -skew(arm) * p.G], [sp.zeros(3), p.G]]))
    letters = stands_for(r_GO, c)
    why = "G and O are interchanged: r_G = r_O + R r_G/O, and s_dot holds the velocity of G, q_dot that of O."
    turned = proofs.other("O is where the frames of SymPy carry -c from G.", rG - turned_arm())
    moved = proofs.numeric_derivative("It is the rate of the position of O.", of=rG - p.R * c)
    velocity, omega = point.velocity(), frame.angular_velocity()
    speeds = sp.Matrix.vstack(dot(rG), gd)
    both = proofs.other("Rate of the position of O.", sp.Matrix.vstack(sd.rate(rG - p.R * c), omega))
    return [
        Formula("r_O", rG + arm, point.position(), line=12095, errata=[Erratum(why, turned)], latex="r_{O_P/E}",
                renamed=letters),
        Formula("velocity of O", dot(rG) + (p.G * gd).cross(arm), velocity, line=12101, also=(12103,),
                errata=[Erratum(why, moved)],
                latex=r"\dot{r}_{O_P/E}", renamed=letters),
        Formula("velocity of O, exchanged", dot(rG) - skew(arm) * p.G * gd, velocity, line=12105, also=(12109,),
                errata=[Erratum(why, moved)], latex=r"\dot{r}_{O_P/E}", renamed=letters),
        Formula("omega", p.G * gd, omega, line=12111, latex=r"\omega_{b_G/n}"),
        Formula("velocities in matrix form", J * speeds, sp.Matrix.vstack(velocity, omega), line=12113,
                errata=[Erratum(why, both, [(0,), (1,), (2,)])], renamed=letters),
        Formula("J", J, p.derived("J"), line=12113, latex="J", renamed=letters),
    ]


def coordinates_of_turbine() -> list[Formula]:
    """The independent coordinates: platform, yaw of the nacelle, rotor."""
    yaw, rotor = sd.coordinates("psi_N phi_H")
    system = sd.System("turbine")
    base = system.add_body("platform_and_tower", mass=1, inertia=sp.eye(3))
    nacelle = system.add_body("nacelle", mass=1, inertia=sp.eye(3))
    hub = system.add_body("hub_and_blades", mass=1, inertia=sp.eye(3))
    system.add_joint(sd.Free("sea", system.ground, base, list(q), orientation=sd.EulerAngles("ZYX")))
    system.add_joint(sd.Revolute("yaw", base, nacelle, yaw, axis=[0, 0, 1], parent_point=[0, 0, 80]))
    system.add_joint(sd.Revolute("main_shaft", nacelle, hub, rotor, axis=[1, 0, 0], parent_point=[5, 0, 2]))
    order = conventions.reordered(rows=[0, 1, 2, 5, 4, 3, 6, 7], sentence="The slide lists roll, pitch, yaw; symdyn "
                                  "the angles in the order of the sequence.")
    return [Formula("q", [x, y, z, phi, theta, psi, yaw, rotor], sp.Matrix(system.recursive().symbols.coordinates), line=11855,
                    conventions=[order], latex="q")]


CASES = (
    Case("platform-transformation", "Velocities of the platform's G and O, embedding", Slide("6.2", TITLE, 11805), to_G),
    Case("turbine-coordinates", "The independent coordinates of the turbine", Slide("6.2", TITLE, 11845), coordinates_of_turbine),
    Case("platform-transformation-augmented", "Velocities of the platform's G and O, augmented", Slide("6.3", TITLE, 12091),
         from_G),
)
