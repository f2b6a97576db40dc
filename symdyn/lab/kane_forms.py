"""Operations of SymPy's KanesMethod for a tree of the catalogue, simplified by SymPy: one quantity and method a process.

    python -m symdyn.lab.kane_forms NAME QUANTITY METHOD

QUANTITY is M_tilde or k_tilde, METHOD trigsimp, simplify or fu. Frames, points, masses and inertias are those of symdyn's links,
as a user of sympy.physics.mechanics gives them; constraints are left out, as M_tilde and k_tilde are of the tree.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from typing import Any

import sympy as sp
from sympy.physics import mechanics as me
from sympy.simplify.fu import fu

from symdyn.errors import SymdynError
from symdyn.formulation.equations import Equations
from symdyn.formulation.trees.tree import GROUND
from symdyn.systems import get, names
from symdyn.tape.sympy_bridge import expand
from symdyn.tape.tape import Output

METHODS = {"trigsimp": sp.trigsimp, "simplify": sp.simplify, "fu": fu}
QUANTITIES = ("M_tilde", "k_tilde")
# Seconds for a method, and for what comes before it.
LIMIT, START = 60.0, 15.0


def by_kane(equations: Equations) -> dict[str, sp.Matrix]:
    """M_tilde and k_tilde by KanesMethod, in plain symbols.

    The equations have their links' own frames (frames="body"). Raises SymdynError for trees with speeds that are not the rates
    of the coordinates, added mass or elastic bodies.
    """
    tree, s = equations.provenance.of.tree, equations.symbols
    rates = [f"{q.name}_dot" for q in s.coordinates]
    if not tree.rigid or not tree.plain or [u.name for u in s.speeds] != rates:
        raise SymdynError(f"{equations.name}: KanesMethod is set up for rigid bodies whose speeds are the rates of the "
                          "coordinates")
    q = me.dynamicsymbols([f"q_{k}" for k in range(len(s.coordinates))])
    u = me.dynamicsymbols([f"u_{k}" for k in range(len(s.speeds))])
    moving = dict(zip((*s.coordinates, *s.speeds), (*q, *u), strict=True))

    def taken(value: Any) -> list[sp.Expr]:
        matrix = expand(Output.of("part", value), equations.printed_leaves())
        return [e.xreplace(moving) for e in matrix]

    ground, origin = me.ReferenceFrame("N"), me.Point("O")
    origin.set_vel(ground, 0)
    frames: list[me.ReferenceFrame] = []
    points: list[me.Point] = []
    bodies: list[me.RigidBody] = []
    for k, link in enumerate(tree.links):
        before, base = (ground, origin) if link.parent == GROUND else (frames[link.parent], points[link.parent])
        frame = me.ReferenceFrame(f"A{k}")
        frame.orient_explicit(before, sp.Matrix(3, 3, taken(link.R)))
        moved = taken(link.S @ tree.w[list(link.speeds)])
        frame.set_ang_vel(before, _vector(frame, moved[:3]))
        point = base.locatenew(f"P{k}", _vector(before, taken(link.r)))
        carried = base.vel(ground) + before.ang_vel_in(ground).cross(point.pos_from(base))
        point.set_vel(ground, carried + _vector(frame, moved[3:]))
        mass = taken([link.inertia.m])[0]
        if mass != 0:
            center = point.locatenew(f"G{k}", _vector(frame, [h / mass for h in taken(link.inertia.h)]))
            center.v2pt_theory(point, ground, frame)
            I = sp.Matrix(3, 3, taken(link.inertia.I))
            about = me.inertia(frame, I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[1, 2], I[0, 2])
            bodies.append(me.RigidBody(f"B{k}", center, frame, mass, (about, point)))
        frames.append(frame)
        points.append(point)
    method = me.KanesMethod(ground, q, u, [a - b.diff(me.dynamicsymbols._t) for a, b in zip(u, q, strict=True)])
    method.kanes_equations(bodies, [])
    plain = {symbol: sp.Symbol(symbol.func.__name__) for symbol in (*q, *u)}
    return {"M_tilde": method.mass_matrix.xreplace(plain), "k_tilde": (-method.forcing).xreplace(plain)}


def _vector(frame: me.ReferenceFrame, parts: Sequence[sp.Expr]) -> Any:
    return sum((e * axis for e, axis in zip(parts, (frame.x, frame.y, frame.z), strict=True)), me.Vector(0))


def operations(name: str, quantity: str, method: str, limit: float = LIMIT) -> int | None:
    """Operations of the quantity of a mechanism of the catalogue, by a process of its own; None if it does not end in time or
    does not apply."""
    command = [sys.executable, "-m", "symdyn.lab.kane_forms", name, quantity, method]
    try:
        run = subprocess.run(command, capture_output=True, text=True, check=False, timeout=limit + START)
    except subprocess.TimeoutExpired:
        return None
    return int(run.stdout) if run.returncode == 0 else None


def main(name: str, quantity: str, method: str) -> None:
    """Print the operations of a quantity."""
    system = get(name)
    equations = system.augmented(frames="body") if name in names(constrained=True) else system.embedding()
    value = by_kane(equations)[quantity]
    print(sum(int(sp.count_ops(METHODS[method](e))) for e in value))


if __name__ == "__main__":
    main(*sys.argv[1:])
