"""Chapter 1.9: a ball in a slot of a turning disk, and a ball thrown over it, seen by B on the disk and by E on the ground."""

from __future__ import annotations

from typing import Any

import sympy as sp

import symdyn as sd
from symdyn.comparison import Case, Erratum, Formula, Slide
from symdyn.comparison.proofs import Proof

v, omega = sp.symbols("v omega", positive=True)
w = sp.Matrix([0, 0, omega])
# One line for each of the eight slides, which draw the ball at later and later times.
OF_B, OF_E = range(1974, 2073, 14), range(1978, 2077, 14)
BOTH = "The descriptions of B and E are exchanged."


def _straight(path: Any) -> Any:
    return path.diff(sd.t, 2)


def _speed(path: Any) -> Any:
    rate = path.diff(sd.t)
    return rate.dot(rate) - (v**2 + (omega * v * sd.t)**2)


def _slot() -> list[Formula]:
    n = sd.Frame("n")
    b = n.frame("b", rotation=sd.rotation.about("Z", omega * sd.t))
    A, B = b.point("A", [v * sd.t, 0, 0]), b.point("B", [0, 0, 0])
    r_AB, v_rel = A.position(of=B, components=n), b.rotation(n) * sp.Matrix([v, 0, 0])
    v_B = B.velocity(seen_from=n)
    cos, sin = sp.cos(omega * sd.t), sp.sin(omega * sd.t)
    in_n, in_b = sp.Matrix([v * sd.t * cos, v * sd.t * sin, 0]), sp.Matrix([v * sd.t, 0, 0])
    uniform = Proof("another formulation", "B turns with the slot, in which the ball moves uniformly on a straight line.",
                    _straight)
    composed = Proof("another formulation", "Seen from the ground, v along the slot and omega v t across it make up the speed.",
                     _speed)
    of_B = Erratum("B stands on the disk and describes the ball in the b-frame; these are components in the n-frame.", uniform,
                   slip=BOTH)
    of_E = Erratum("E stands on the ground and describes the ball in the n-frame; these are components in the b-frame.", composed,
                   slip=BOTH)
    return [
        Formula("v_A", v_B + v_rel + w.cross(r_AB), A.velocity(seen_from=n), line=1942, also=(1961,)),
        Formula("position of A described by B, in words", in_n, A.position(of=B, components=b), line=OF_B[0], also=OF_B[1:],
                errata=[of_B]),
        Formula("position of A described by E, in words", in_b, A.position(of=B, components=n), line=OF_E[0], also=OF_E[1:],
                errata=[of_E]),
    ]


def _thrown() -> list[Formula]:
    n = sd.Frame("n")
    b = n.frame("b", rotation=sd.rotation.about("Z", omega * sd.t))
    A, B = n.point("A", [v * sd.t, 0, 0]), b.point("B", [0, 0, 0])
    r_AB, v_B = A.position(of=B, components=n), B.velocity(seen_from=n)
    v_rel = A.velocity(seen_from=b, components=n)
    v_A = A.velocity(seen_from=n)
    return [
        Formula("v_A", v_B + v_rel + w.cross(r_AB), v_A, line=2103, also=(2117,)),
        Formula("v_A, constant", sp.Matrix([v, 0, 0]), v_A, line=2101, also=(2115,)),
    ]


CASES = (
    Case("ball-in-slot", "A ball in a slot of a turning disk, seen from two frames",
         Slide("1.9", "Velocity vector of the point with respect to rotating reference frame", 1936), _slot),
    Case("ball-thrown", "A ball thrown over a turning disk, seen from two frames",
         Slide("1.9", "Velocity vector of the point with respect to rotating reference frame", 2097), _thrown),
)
