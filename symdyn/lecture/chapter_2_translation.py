"""Chapter 2.1: two particles; inner forces cancel, and the resultant force moves the centre of mass."""

from __future__ import annotations

import sympy as sp

import symdyn as sd
from symdyn.comparison import Case, Formula, Slide
from symdyn.frames.rigid_body import center_of_mass
from symdyn.lecture.letters import constant, ddot, moving, stands_for

m1, m2, m_system = sp.symbols("m_1 m_2 m_system", positive=True)
r1, r2, rG = moving("r_1E"), moving("r_2E"), moving("r_GE")
F1, F2, f12, f21 = (constant(name) for name in ("F_1", "F_2", "f_12", "f_21"))
THIRD_LAW = dict(zip(f21, -f12, strict=True))


def newton() -> list[Formula]:
    n = sd.Frame("n")
    a1, a2 = (n.point(name, r).acceleration(seen_from=n, components=n) for name, r in (("1", r1), ("2", r2)))
    forces, inertia = F1 + f12 + F2 + f21, m1 * a1 + m2 * a2
    inner = f12 + f21
    G = center_of_mass([m1, m2], [r1, r2])
    of_G = {m_system: m1 + m2, **stands_for(rG, G, dots=2)}
    momentum_rate = sd.rate(sd.rate(m1 * r1 + m2 * r2))
    total = (forces - inner, inertia)
    return [
        Formula("first particle", (F1 + f12, m1 * ddot(r1)), (F1 + f12, m1 * a1), line=2263, also=(2373,)),
        Formula("second particle", (F2 + f21, m2 * ddot(r2)), (F2 + f21, m2 * a2), line=2263, also=(2373,)),
        Formula("sum of both", (F1 + f12 + F2 + f21, m1 * ddot(r1) + m2 * ddot(r2)), (forces, inertia), line=2267),
        Formula("without inner forces", (F1 + F2, m1 * ddot(r1) + m2 * ddot(r2)), (forces, inertia), line=2272, where=THIRD_LAW),
        Formula("(1)", (F1 + F2, momentum_rate), total, line=2286, also=(2278, 2310)),
        Formula("r_G", (m1 * r1 + m2 * r2) / m_system, G, line=2292, renamed={m_system: m1 + m2}, latex=r"r_{G/E}"),
        Formula("(2)", m1 * r1 + m2 * r2, (m1 + m2) * G, line=2294, latex=r"m_{system} r_{G/E}"),
        Formula("(2) in (1)", (F1 + F2, sd.rate(sd.rate(m_system * rG))), total, line=2300, also=(2318,), renamed=of_G),
        Formula("resultant", (F1 + F2, m_system * ddot(rG)), total, line=2304, also=(2322, 2330), renamed=of_G,
                latex=r"\Sigma F"),
    ]


CASES = (
    Case("two-particles-force", "Two particles: the resultant force moves the centre of mass",
         Slide("2.1", "Translation of the rigid body in spatial(3D) motion", 2257), newton),
)
