"""Products of rotations and their rates brought to a readable form by exact rules of known cost: no search, no time limit."""

from __future__ import annotations

import sympy as sp

# Longer entries stay as they are: multiplied out they would fill the memory.
LONGEST = 1500


def tidy(vector: sp.MatrixBase) -> sp.Matrix:
    """Each entry multiplied out with sin^2 + cos^2 = 1, where that is shorter; equal to the one given.

    >>> a, b = sp.symbols("a b")
    >>> sd.frames.tidy(sp.Matrix([b * sp.sin(a) ** 2 + b * sp.cos(a) ** 2]))
    Matrix([[b]])
    """
    return sp.Matrix(*vector.shape, [_entry(e) for e in vector])


def _entry(e: sp.Expr) -> sp.Expr:
    if e.is_Atom or sp.count_ops(e) > LONGEST:
        return e
    best, before = sp.expand(e), None
    while best != before:  # each round is shorter than the one before, or the last
        before = best
        for angle in sorted({f.args[0] for f in best.atoms(sp.sin, sp.cos)}, key=str):
            s, c = sp.sin(angle), sp.cos(angle)
            best = min((best, _without(best, s, c), _without(best, c, s)), key=_length)
    return min((best, e), key=_length)


def _without(e: sp.Expr, square: sp.Expr, other: sp.Expr) -> sp.Expr:
    """Even powers of `square` replaced by 1 - other^2."""
    replaced = e.replace(lambda p: p.is_Pow and p.base == square and p.exp.is_Integer and p.exp >= 2,
                         lambda p: (1 - other**2) ** (p.exp // 2) * square ** (p.exp % 2))
    return sp.expand(replaced)


def _length(e: sp.Expr) -> tuple[int, str]:
    return int(sp.count_ops(e)), str(e)
