"""Chapter 6.4: recursive inverse and forward dynamics of a three-link arm, and of platform, nacelle and rotor."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import sympy as sp

import symdyn as sd
from symdyn.comparison import Case, Formula, Slide
from symdyn.frames.product import times
from symdyn.lecture.letters import skew
from symdyn.lecture.propagation_letters import typeset

LINKS = (1, 2, 3)
g = sp.Symbol("g", positive=True)
tau = sd.inputs("tau_1 tau_2 tau_3")


class Chain:
    """A chain of three links: what symdyn's recursion gives of link k by name, and the same from the embedding technique."""

    def __init__(self, system: sd.System, sizes: tuple[int, ...] = (1, 1, 1)) -> None:
        self.system = system
        self.recursive = system.recursive()
        self.sizes = sizes
        self.a_0 = sp.Matrix([0, 0, 0, *[-component for component in system.gravity]])

    def of(self, name: str, link: int) -> sp.Matrix:
        """A quantity of a link, not simplified."""
        return sp.Matrix(self.recursive.explicit(f"{name}_{link}", simplify=False))

    @cached_property
    def qdd(self) -> list[sp.Matrix]:
        """Accelerations of the joints, as symbols."""
        return self._split(self.recursive.accelerations)

    @cached_property
    def needed(self) -> list[sp.Matrix]:
        """Forces along the joints, by the mass matrix of the embedding technique."""
        equations = self.system.embedding()
        M, k, F = (sp.Matrix(equations.explicit(name, simplify=False)) for name in ("M_tilde", "k_tilde", "F_tilde"))
        return self._split(M * sp.Matrix.vstack(*self.qdd) + k - F.xreplace(dict.fromkeys(tau, sp.S.Zero)))

    def acceleration(self, link: int) -> sp.Matrix:
        """As printed: X a of the link before, plus S q_ddot + c."""
        before = self.a_0 if link == 1 else self.of("a", link - 1)
        return times(self.of("X", link), before) + times(self.of("S", link), self.qdd[link - 1]) + self.of("c", link)

    def own_force(self, link: int) -> sp.Matrix:
        """I a + p."""
        return times(self.of("I", link), self.of("a", link)) + self.of("p", link)

    def resultant(self, link: int, com: Any) -> sp.Matrix:
        """The force that accelerates a link, from its centre of mass to its origin."""
        at_G = self.of("f_G", link)
        return sp.Matrix.vstack(at_G[:3, :] + times(skew(com), at_G[3:, :]), at_G[3:, :])

    def _split(self, column: Any) -> list[sp.Matrix]:
        entries, parts = list(column), []
        for size in self.sizes:
            parts.append(sp.Matrix(entries[:size]))
            entries = entries[size:]
        return parts


def arm() -> Chain:
    """Three links that turn about z, 1 m long, with their centres of mass in the middle."""
    q = sd.coordinates("q1 q2 q3")
    system = sd.System("arm", gravity=[0, -g, 0])
    before: Any = system.ground
    for link in LINKS:
        body = system.add_body(f"link{link}", mass=sp.Symbol(f"m_{link}", positive=True), com=[sp.Rational(1, 2), 0, 0],
                               inertia=sp.diag(0, *[sp.Symbol(f"I_{link}", positive=True)] * 2))
        joint = sd.Revolute(f"joint{link}", before, body, q[link - 1], axis=[0, 0, 1], parent_point=[0 if link == 1 else 1, 0, 0])
        system.add_joint(joint)
        system.add_joint_force(joint, tau[link - 1])
        before = body
    return Chain(system)


def turbine() -> Chain:
    """Platform with tower, 6-DOF joint; nacelle that yaws; hub with blades."""
    angles, place = sd.coordinates("psi theta phi"), sd.coordinates("x y z")
    yaw, rotor = sd.coordinates("psi_N phi_H")
    system = sd.System("turbine", gravity=[0, 0, -g])
    bodies = [system.add_body(name, mass=sp.Symbol(f"m_{letter}", positive=True), com=com,
                              inertia=sp.diag(*sp.symbols(f"I_{letter}_x I_{letter}_y I_{letter}_z", positive=True)))
              for name, letter, com in (("platform", "P", [0, 0, sp.Symbol("c_P")]), ("nacelle", "N", [0, 0, 0]),
                                        ("rotor", "H", [0, 0, 0]))]
    h, b = sp.symbols("h b", positive=True)
    system.add_joint(sd.Free("sea", system.ground, bodies[0], [*place, *angles], velocity="body"))
    system.add_joint(sd.Revolute("yaw", bodies[0], bodies[1], yaw, axis=[0, 0, 1], parent_point=[0, 0, h]))
    system.add_joint(sd.Revolute("shaft", bodies[1], bodies[2], rotor, axis=[1, 0, 0], parent_point=[b, 0, 0]))
    return Chain(system, (6, 1, 1))


def inverse_dynamics(chain: Chain, lines: dict[int, int], again: dict[int, int] | None = None) -> list[Formula]:
    """Inverse dynamics of three links; lines: of a_k, with f_k^B, f_k and tau_k two lines further each."""
    result = []
    for link in LINKS:
        line, also = lines[link], [(again[link] + 2 * step,) if again else () for step in range(4)]
        own = chain.resultant(link, chain.system.bodies[link - 1].com)
        # Nothing hangs on the last link: f_4 = 0.
        beyond = times(chain.of("X_star", link + 1), chain.of("f", link + 1)) if link < 3 else sp.zeros(6, 1)
        result += [
            Formula(f"a_{link}", chain.acceleration(link), chain.of("a", link), line=line, also=also[0],
                    latex=typeset(_acceleration(link))),
            Formula(f"f_{link}^B", chain.own_force(link), own, line=line + 2, also=also[1],
                    latex=typeset(f"f{link}B = I{link} a{link} + p{link}")),
            Formula(f"f_{link}", own + beyond, chain.of("f", link), line=line + 4, also=also[2],
                    latex=typeset(f"f{link} = f{link}B + {link}X{link + 1}* f{link + 1}")),
            Formula(f"tau_{link}", times(chain.of("S", link).T, chain.of("f", link)), chain.needed[link - 1], line=line + 6,
                    also=also[3], latex=typeset(f"tau_{link} = S{link}^T f{link}")),
        ]
    return result


def of_arm() -> list[Formula]:
    lost = "The name of the function is lost; the slide lists what is known: p and c of theta and its rate, X of theta."
    return [Formula("X of theta", None, None, line=12271, also=(12310, 12361, 12404), latex="X", unreadable=lost),
            *inverse_dynamics(arm(), {1: 12275, 2: 12285, 3: 12295})]


def of_turbine() -> list[Formula]:
    return inverse_dynamics(turbine(), {1: 12366, 2: 12376, 3: 12386}, {1: 12410, 2: 12420, 3: 12430})


def forward_dynamics() -> list[Formula]:
    """Forward dynamics of the arm: articulated inertia and bias force inwards, accelerations outwards.

    The torques are those that any given accelerations need; from them the slide's formulas must find the accelerations.
    """
    chain = arm()
    of = chain.of
    given = {torque: needed[0] for torque, needed in zip(tau, chain.needed, strict=True)}
    result = []
    for link, line in zip(LINKS, (12314, 12326, 12336), strict=True):
        X, S, c, f = (of(name, link) for name in ("X", "S", "c", "f"))
        I_A, p_A = (of(name, link) for name in (("I", "p") if link == 3 else ("I_A", "p_A")))
        before = chain.a_0 if link == 1 else of("a", link - 1)
        inertia, moved = times(S.T, I_A, S)[0], times(X, before)
        I, p = ("I3", "p3") if link == 3 else (f"I{link}A", f"p{link}A")
        result += [
            Formula(f"a_{link}", moved + times(S, chain.qdd[link - 1]) + c, of("a", link), line=line,
                    latex=typeset(_acceleration(link))),
            Formula(f"f_{link}", times(I_A, of("a", link)) + p_A, f, line=line + 2, where=given,
                    latex=typeset(f"f{link} = {I} a{link} + {p}")),
            Formula(f"tau_{link}", times(S.T, f), chain.needed[link - 1], line=line + 4,
                    latex=typeset(f"tau_{link} = S{link}^T f{link}")),
            Formula(f"qdd_{link}", (sp.Symbol(f"tau_{link}") - times(S.T, times(I_A, moved + c) + p_A)[0]) / inertia,
                    chain.qdd[link - 1][0], line=line + 6, where=given,
                    latex=typeset(f"q{link}'' = (S{link}^T {I} S{link})^-1 "
                                  f"(tau_{link} - S{link}^T ({I} ({link}X{link - 1} a{link - 1} + c{link}) + {p}))")),
        ]
    for link in (1, 2):
        last = link == 2
        I_A, p_A = (of(name, link + 1) for name in (("I", "p") if last else ("I_A", "p_A")))
        X, X_star, S, c = (of(name, link + 1) for name in ("X", "X_star", "S", "c"))
        inverse = sp.Matrix([1 / times(S.T, I_A, S)[0]])
        back = times(X_star, I_A, S)
        force = sp.Matrix([sp.Symbol(f"tau_{link + 1}")]) - times(S.T, times(I_A, c) + p_A)
        n, I, p = link + 1, *(("I3", "p3") if last else ("I2A", "p2A"))
        printed = f"{link}X{n}* {I} S{n} (S{n}^T {I} S{n})^-1"
        result += [
            Formula(f"I_{link}^A", of("I", link) + times(X_star, I_A, X) - times(back, inverse, S.T, I_A, X), of("I_A", link),
                    line=12344, latex=typeset(f"I{link}A = I{link} + {link}X{n}* {I} {n}X{link}"
                                              f" - {printed} S{n}^T {I} {n}X{link}")),
            Formula(f"p_{link}^A", of("p", link) + times(X_star, p_A) + times(X_star, I_A, c) + times(back, inverse, force),
                    of("p_A", link), line=12345,
                    latex=typeset(f"p{link}A = p{link} + {link}X{n}* {p} + {link}X{n}* {I} c{n}"
                                  f" + {printed} (tau_{n} - S{n}^T ({I} c{n} + {p}))")),
        ]
    return result


def _acceleration(link: int) -> str:
    return f"a{link} = {link}X{link - 1} a{link - 1} + S{link} q{link}'' + c{link}"


CASES = (
    Case("three-link-inverse-dynamics", "Three-link arm: recursive inverse dynamics",
         Slide("6.4", "Inverse Dynamics of 3-Link Arm", 12257), of_arm),
    Case("three-link-forward-dynamics", "Three-link arm: forward dynamics by articulated bodies",
         Slide("6.4", "Forward Dynamics of 3-Link Arm", 12303), forward_dynamics),
    Case("turbine-inverse-dynamics", "Platform, nacelle and rotor: recursive inverse dynamics",
         Slide("6.4", "Inverse Dynamics of floating wind turbine", 12351), of_turbine),
)
