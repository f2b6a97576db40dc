"""Chapters 6.2 and 6.3: Newton's and Euler's equations of the platform and of all bodies of the turbine."""

from __future__ import annotations

from typing import Any

import sympy as sp

import symdyn as sd
from symdyn.comparison import Case, Erratum, Formula, Slide, proofs
from symdyn.frames.rigid_body import force_equation, moment_equation
from symdyn.lecture.letters import constant, ddot, dot, moving, skew, symmetric

BODIES = ("P", "T", "N", "H", "B1", "B2", "B3")


class Body:
    """One body of the turbine: letters of its equations, and what symdyn derives for its motion."""

    def __init__(self, name: str, principal: bool = False) -> None:
        """principal: the n-frame is parallel to the body's principal axes, which keeps formulas short."""
        self.m = sp.Symbol(f"m_{name}", positive=True)
        self.I = symmetric(f"I_{name}")
        if principal:
            self.I = sp.diag(*[self.I[axis, axis] for axis in range(3)])
        self.r, self.omega = moving(f"r_{name}"), moving(f"omega_{name}")
        self.F, self.tau, self.F_c, self.tau_c = (constant(f"{letter}_{name}") for letter in ("F", "tau", "Fc", "tauc"))

    @property
    def M(self) -> sp.Matrix:
        """As printed: masses and inertia."""
        return sp.diag(self.m * sp.eye(3), self.I)

    @property
    def Q(self) -> sp.Matrix:
        """As printed: the gyroscopic matrix."""
        return sp.diag(sp.zeros(3), skew(self.omega) * self.I)

    @property
    def s_dot(self) -> sp.Matrix:
        return sp.Matrix.vstack(dot(self.r), self.omega)

    @property
    def s_ddot(self) -> sp.Matrix:
        return sp.Matrix.vstack(ddot(self.r), dot(self.omega))

    @property
    def forces(self) -> sp.Matrix:
        """(6, 1) what acts on it, with what its joints exert."""
        return sp.Matrix.vstack(self.F + self.F_c, self.tau + self.tau_c)

    @property
    def needed(self) -> sp.Matrix:
        """(6, 1) force and moment that its motion needs, derived."""
        return sp.Matrix.vstack(sp.Matrix(force_equation(self.m, ddot(self.r))),
                                sp.Matrix(moment_equation(self.I, self.omega, dot(self.omega))))

    @property
    def momentum_rate(self) -> sp.Matrix:
        """(6, 1) rate of linear and angular momentum, where I_dot = [omega x] I - I [omega x]."""
        turning = self.s_dot[3:, :]
        I_dot = skew(turning) * self.I - self.I * skew(turning)
        return sp.Matrix.vstack(self.m * ddot(self.r), I_dot * turning + self.I * dot(self.omega))


def platform() -> list[Formula]:
    P = Body("P")
    w, r, chi = P.omega, constant("r"), moving("chi_P")
    # chi has the integrals of omega, line 11650.
    s_dot = sd.rate(sp.Matrix.vstack(P.r, chi)).xreplace(dict(zip(dot(chi), w, strict=True)))
    matrix = P.needed.jacobian(P.s_ddot)
    rest = P.needed.xreplace(dict.fromkeys(P.s_ddot, sp.S.Zero))
    derived = (P.needed, P.forces)
    return [
        Formula("force equation", (P.m * ddot(P.r), P.F + P.F_c), (P.needed[:3, :], P.forces[:3, :]), line=11638,
                also=(11689, 11928, 11977)),
        Formula("moment equation", (P.I * dot(w) + w.cross(P.I * w), P.tau + P.tau_c), (P.needed[3:, :], P.forces[3:, :]),
                line=11640,
                also=(11691, 11930, 11979)),
        Formula("M_P", P.M, matrix, line=11695, also=(11985,), latex="M_P"),
        Formula("Q_P s_dot", P.Q * P.s_dot, rest, line=11695, also=(11985,), latex=r"Q_P \dot{s}_P"),
        Formula("matrix form", (P.M * P.s_ddot + P.Q * P.s_dot, P.forces), derived, line=11695,
                also=(11697, 11706, 11720, 11985, 11987, 11996, 12010)),
        Formula("omega tilde", skew(w), sd.rotation.skew(w), line=11702, also=(11992,), latex=r"\tilde{\omega}"),
        Formula("omega x r", skew(w) * r, w.cross(r), line=11702, also=(11992,), latex=r"\omega \times r"),
        Formula("s_dot", [*dot(P.r), *w], s_dot, line=11708, also=(11998,), latex=r"\dot{s}_P"),
        Formula("s_ddot", [*ddot(P.r), *dot(w)], sd.rate(P.s_dot), line=11710, also=(12000,), latex=r"\ddot{s}_P"),
    ]


def angular_velocity() -> list[Formula]:
    """omega = G gamma_dot with ZYX Euler angles; chi gathers what integrals of omega would be."""
    gamma = sd.coordinates("psi theta phi")
    omega = sd.Frame("n").frame("b", rotation=sd.rotation.from_euler("ZYX", gamma)).angular_velocity()
    G = sd.rotation.euler_rates("ZYX", gamma, frame="n")
    return [Formula("omega", G * sp.Matrix([angle.dot for angle in gamma]), omega, line=11656,
                    also=(11827, 11946, 12111), latex=r"\omega_{b_{G_P}/n}")]


def turbine() -> list[Formula]:
    """Tower, nacelle, hub and blades, then all bodies at once; the blocks of M and Q stand on the diagonal."""
    bodies = [Body(name, principal=True) for name in BODIES]
    lines = (11724, 11728, 11732, 11736, 11738, 11740)
    single = [Formula(f"body {name}", (b.M * b.s_ddot + b.Q * b.s_dot, b.forces), (b.needed, b.forces), line=line,
                      also=(line + 290,))
              for name, b, line in zip(BODIES[1:], bodies[1:], lines, strict=True)]
    stacked: dict[str, Any] = {name: sp.Matrix.vstack(*[getattr(b, name) for b in bodies])
                               for name in ("s_dot", "s_ddot", "forces", "needed", "momentum_rate")}
    M, Q = sp.diag(*[b.M for b in bodies]), sp.diag(*[b.Q for b in bodies])
    momentum = proofs.other("The forces are the rate of momentum and angular momentum.",
                            stacked["momentum_rate"] - stacked["forces"])
    swapped = Erratum("Velocities and accelerations are interchanged; M belongs to s_ddot and Q to s_dot, as for each body.",
                      momentum)
    return [
        *single,
        Formula("all bodies", (M * stacked["s_dot"] + Q * stacked["s_ddot"], stacked["forces"]),
                (stacked["needed"], stacked["forces"]), line=11749, also=(12039,), errata=[swapped]),
    ]


TITLE = "2.1 Equations of Motion"
CASES = (
    Case("platform-newton-euler", "Newton's and Euler's equations of the platform",
         Slide("6.2", f"{TITLE} - Equations of Motion of Multibody with respect to Center of Mass", 11632), platform),
    Case("platform-angular-velocity", "Angular velocity of the platform by ZYX Euler angles",
         Slide("6.2", f"{TITLE} - Equations of Motion of Multibody with respect to Center of Mass", 11656), angular_velocity),
    Case("turbine-newton-euler", "Newton's and Euler's equations of all bodies of the turbine",
         Slide("6.2", f"{TITLE} - Newton-Euler equation for the Floating Offshore Wind Turbine", 11743), turbine),
)
