"""Chapter 1.1 and 1.2: Newton's law in translating frames; box and strap in a bus, a person in an elevator."""

from __future__ import annotations

from functools import cache
from typing import Any

import sympy as sp

import symdyn as sd
from symdyn.comparison import Case, Erratum, Formula, Slide, proofs

i, j, k = (sp.eye(3).col(axis) for axis in range(3))
m, g, a, N = sp.symbols("m_P g a N", positive=True)
WEIGHT = -m * g * k


@cache
def falling_body() -> Any:
    """Equations of motion of a body with the coordinates x, y, z on which gravity alone acts."""
    q = list(sd.coordinates("x y z"))
    system = sd.System("falling", gravity=[0, 0, -g])
    body = system.add_body("body", mass=m)
    system.add_joint(sd.Custom("free", system.ground, body, q, position=q))
    return system.embedding()


def gravity() -> sp.Matrix:
    """The weight of the body, (3, 1), N."""
    return falling_body().explicit("F_tilde", simplify=False)


def _newtons_law() -> list[Formula]:
    x, y, z = sd.coordinates("x y z")
    V, F = sp.Matrix(sp.symbols("V_x V_y V_z")), sp.Matrix(sp.symbols("F_x F_y F_z"))
    rdd = sp.Matrix([x.ddot, y.ddot, z.ddot])
    particle = sd.embedding([x, y, z], [x, y, z], [m, m, m], force=list(F))
    n = sd.Frame("n")
    steady = n.frame("b", origin=list(V * sd.t))
    P = n.point("P", [x, y, z])
    return [
        Formula("Newton's law", (m * rdd, F), (particle.M_tilde * rdd + particle.k_tilde, particle.F_tilde), line=112,
                also=(167, 175, 187, 195)),
        Formula("acceleration in a frame of constant velocity", rdd, P.acceleration(seen_from=steady), line=152),
    ]


def _relative_motion() -> list[Formula]:
    X, Y, Z, x, y, z = sd.coordinates("X Y Z x y z")
    n = sd.Frame("n")
    b = n.frame("b", rotation=sp.eye(3), origin=[X, Y, Z])
    P = b.point("P", [x, y, z])
    F = sp.Matrix(sp.symbols("F_x F_y F_z"))
    rdd_PO = sp.Matrix([x.ddot, y.ddot, z.ddot])
    rdd_OE = sp.Matrix([X.ddot, Y.ddot, Z.ddot])
    rdd_PE = P.acceleration(seen_from=n)
    relative = P.acceleration(seen_from=b)
    return [
        Formula("acceleration of P", rdd_PO + rdd_OE, rdd_PE, line=197, latex=r"\ddot{r}_{P/E}"),
        Formula("Newton's law", (m * (rdd_PO + rdd_OE), F), (m * rdd_PE, F), line=199),
        Formula("Newton's law, expanded", (m * rdd_PO + m * rdd_OE, F), (m * rdd_PE, F), line=201),
        Formula("Newton's law in the b-frame", (m * rdd_PO, F - m * rdd_OE),
                (m * relative, F + P.inertial_forces(m, frame=b).total), line=203, also=(267, 322, 378, 432, 506, 533)),
    ]


def _bus() -> list[Formula]:
    s, y = sd.coordinates("s y")
    n = sd.Frame("n")
    b = n.frame("b", rotation=sp.eye(3), origin=[0, s, 0])
    fixed, sliding, parked = b.point("P", [0, 2, 1]), b.point("P", [0, y, 1]), n.point("P", [0, 2, 1])
    of_bus = {"a": s.ddot}
    force = m * fixed.acceleration(seen_from=n)
    inertial = fixed.inertial_forces(m, frame=b).total
    N_of_floor = sp.Matrix(sp.symbols("N_x N_y N_z"))
    free = sliding.acceleration(seen_from=n)
    y_ddot = sp.solve(free[1], y.ddot)[0]
    seen = m * sliding.acceleration(seen_from=b).xreplace({y.ddot: y_ddot})
    at_rest = m * parked.acceleration(seen_from=n)
    weight = gravity()
    r = sd.coordinates("r_x r_y r_z")
    any_box = n.point("P", list(r))
    rdd_PE = sp.Matrix([c.ddot for c in r])
    return [
        Formula("Newton's law, box", (m * rdd_PE, WEIGHT + N_of_floor),
                (m * any_box.acceleration(seen_from=n), weight + N_of_floor), line=228, also=(226,)),
        Formula("Newton's law, bus at rest", (0 * k, WEIGHT + N_of_floor), (at_rest, weight + N_of_floor), line=234),
        Formula("N, bus at rest", -WEIGHT, at_rest - weight, line=236),
        Formula("acceleration, bus at rest", 0 * k, parked.acceleration(seen_from=n), line=232, latex=r"\ddot{r}_{P/E}"),
        Formula("F on the fixed box", m * a * j, force, line=255, renamed=of_bus),
        Formula("size of F on the fixed box", m * a, force[1], line=259, renamed=of_bus),
        Formula("acceleration of O", a * j, b.acceleration(seen_from=n), line=282,
                also=(340,), renamed=of_bus, latex=r"\ddot{r}_{O/E}"),
        Formula("forces on the fixed box, seen in the bus", m * a * j - m * a * j, force + inertial, line=282, renamed=of_bus),
        Formula("fixed box, seen in the bus", 0 * j, m * fixed.acceleration(seen_from=b), line=282),
        Formula("F on the free box", 0 * j, m * free.xreplace({y.ddot: y_ddot}), line=312),
        Formula("forces on the free box, seen in the bus", 0 * j - m * a * j,
                sliding.inertial_forces(m, frame=b).total, line=340, renamed=of_bus),
        Formula("free box, seen in the bus", -m * a * j, seen, line=341, renamed=of_bus),
    ]


def _strap() -> list[Formula]:
    s = sd.coordinates("s")
    n = sd.Frame("n")
    b = n.frame("b", rotation=sp.eye(3), origin=[0, s, 0])
    P = b.point("P", [0, 2, 1])
    of_bus = {"a": s.ddot}
    rdd_PE = rdd_OE = a * j
    T = m * rdd_PE + m * g * k
    T_of_strap = sp.Matrix(sp.symbols("T_x T_y T_z"))
    weight = gravity()
    tension = m * P.acceleration(seen_from=n) - weight
    inertial = P.inertial_forces(m, frame=b).total
    relative = m * P.acceleration(seen_from=b)
    r = sd.coordinates("x y z")
    swinging = b.point("P", list(r))
    rdd_PO = sp.Matrix([c.ddot for c in r])
    carries = proofs.limit("In a bus that does not accelerate, the strap carries the weight.", at={s.ddot: 0},
                           value=[0, 0, m * g])
    cancel = Erratum("Tension and inertial force leave m g k, which carries the weight; the three forces cancel together.",
                     carries)
    return [
        Formula("Newton's law", (m * rdd_PE, T_of_strap - m * g * k), (m * P.acceleration(seen_from=n), T_of_strap + weight),
                line=366, also=(360, 365), renamed=of_bus),
        Formula("T", T, tension, line=367, renamed=of_bus),
        Formula("Newton's law, seen in the bus", (m * rdd_PO, T_of_strap - m * g * k - m * rdd_OE),
                (m * swinging.acceleration(seen_from=b), T_of_strap + weight + swinging.inertial_forces(m, frame=b).total),
                line=390, renamed=of_bus),
        Formula("forces, T put in", m * rdd_PE - m * rdd_PE, tension + weight + inertial, line=392),
        Formula("handle, seen in the bus", 0 * j, relative, line=394),
        Formula("tension and inertial force, in words", sp.zeros(3, 1), tension + inertial, line=398, errata=[cancel],
                latex=r"T - m_P \ddot{r}_{O/E}"),
    ]


def _elevator() -> list[Formula]:
    z = sd.coordinates("z")
    n = sd.Frame("n")
    b = n.frame("b", rotation=sp.eye(3), origin=[0, 0, z])
    rdd_OE = b.acceleration(seen_from=n)
    P = b.point("P", [0, 0, 1])
    inertial = P.inertial_forces(m, frame=b).total
    rdd_PE = P.acceleration(seen_from=n)
    weight = gravity()
    scale = (m * rdd_PE - weight)[2]
    fall = falling_body()
    g_down = {z.ddot: fall.explicit("M_tilde", simplify=False).LUsolve(weight)[2]}
    upwards = proofs.numeric_derivative("The elevator rises: its position is z k.", of=sp.Matrix([0, 0, z]), order=2)
    rises = Erratum("The elevator accelerates upwards, along k; j is the direction of the bus.", upwards)
    rest = {z.ddot: 0}
    rising = {"a": z.ddot}
    slide_N = m * (g + a)
    return [
        Formula("Newton's law, falling", (m * z.ddot * k, -m * g * k), (m * rdd_PE, weight), line=419, also=(417,)),
        Formula("acceleration, falling", -g * k, rdd_PE.xreplace(g_down), line=421, latex=r"\ddot{r}_{P/E}"),
        Formula("acceleration of O, falling", -g * k, rdd_OE.xreplace(g_down), line=442, latex=r"\ddot{r}_{O/E}"),
        Formula("forces, falling", -m * g * k + m * g * k, weight + sp.Matrix(inertial).xreplace(g_down), line=444),
        Formula("weight felt, falling", 0 * k, m * P.acceleration(seen_from=b), line=446),
        Formula("Newton's law on the scale", (m * z.ddot * k, -m * g * k + N * k), (m * rdd_PE, weight + N * k), line=466,
                also=(492,)),
        Formula("Newton's law, at rest", (0 * k, -m * g * k + N * k), (m * rdd_PE.xreplace(rest), weight + N * k), line=470),
        Formula("scale, at rest", m * g, scale.xreplace(rest), line=472, also=(474,)),
        Formula("Newton's law, rising", (m * a * k, -m * g * k + N * k), (m * rdd_PE, weight + N * k), line=492, renamed=rising),
        Formula("scale, rising", m * (g + a), scale, line=494, also=(496, 522, 549), renamed=rising, latex="N"),
        Formula("resultant, rising", m * a * k, scale * k + weight, line=498, renamed=rising),
        Formula("acceleration of O, rising", a * j, rdd_OE, line=521, also=(548,), renamed=rising, errata=[rises],
                latex=r"\ddot{r}_{O/E}"),
        Formula("forces, rising", -m * g * k + N * k - m * a * k, weight + N * k + inertial, line=521, also=(548,),
                renamed=rising),
        Formula("forces with N, rising", (-m * g * k + slide_N * k - m * a * k), weight + scale * k + inertial, line=522,
                also=(549,), renamed=rising),
        Formula("person, seen in the elevator", 0 * k, m * P.acceleration(seen_from=b), line=522, also=(549,)),
        Formula("additional force, rising", -m * a * k, inertial, line=554, renamed=rising),
    ]


CASES = (
    Case("newtons-law", "Newton's law and where it holds", Slide("1.1", "Force Vector and Newton's Laws", 100), _newtons_law),
    Case("translating-frame", "Newton's law in a translating frame", Slide("1.2", "Relative Motion", 183), _relative_motion),
    Case("bus-box", "A box in a bus", Slide("1.2", "Examples of a Bus", 213), _bus),
    Case("bus-strap", "A strap in an accelerating bus", Slide("1.2", "Examples of a Bus", 350), _strap),
    Case("elevator-scale", "Reading of a scale in an elevator", Slide("1.2", "Examples of an elevator", 404), _elevator),
)
