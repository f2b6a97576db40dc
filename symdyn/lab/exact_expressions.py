"""Random expressions through exact algebra: the value is kept to 50 digits, and what is printed reads back as the same.

    python -m symdyn.lab.exact_expressions [--count N] [--seed K]

Expressions hold fractions, roots, powers, sines, cosines and tangents of sums, halves and multiples of angles, and numbers of all
kinds. Each is brought to its shortest form. Checked are the value at a random point, with 50 digits (decimal numbers are printed
in sixteen), and that the printed text, read again, has the same normal form as what was given. Exit code 1: an expression that
fails, each with its seed.
"""

from __future__ import annotations

import argparse
import random
import sys

import mpmath
import sympy as sp

from symdyn.exact.prove import prove
from symdyn.exact.shortest import shortest
from symdyn.model.symbols import coordinates, symbols_of, time

DIGITS = 50
# Relative difference of values: with decimal numbers, printed in sixteen digits; without.
DECIMAL, EXACT = 1e-13, 1e-40

a, b, c = sp.symbols("a b c", positive=True)
q1, q2, q3 = coordinates("q1 q2 q3")


def expression(draw: random.Random, depth: int) -> sp.Expr:
    """A random expression with fractions, roots, sums of angles and numbers of all kinds."""
    if depth == 0:
        return draw.choice([a, b, c, q1, q1.dot, q2.dot, sp.Integer(draw.randint(-3, 3)), sp.Rational(1, 3), sp.Float(0.1)])
    parts = [expression(draw, depth - 1) for _ in range(2)]
    kind = draw.randrange(9)
    if kind < 3:
        return sp.Add(*parts)
    if kind < 6:
        return sp.Mul(*parts)
    if kind == 6:
        angle = draw.choice([q1, q2, q1 + q2, q1 - q2, q1 + q2 + q3, 2 * q1, q2 / 2, q1 + sp.pi / 2, a * time])
        return parts[0] * draw.choice([sp.sin, sp.cos, sp.tan])(angle)
    if kind == 7:
        return parts[0] / draw.choice([a, a + b, b * sp.cos(q1) + c, sp.sqrt(a**2 + q1**2)])
    return sp.sqrt(a**2 + parts[0]**2) if draw.random() < 0.3 else parts[0] ** 2


def failure(seed: int) -> str:
    """Fault of the shortest form of the random expression of this seed; "" if nothing is."""
    draw = random.Random(seed)
    given = expression(draw, draw.randint(2, 5))
    short = shortest(given)
    symbols = sorted(symbols_of(given) | symbols_of(short), key=str)
    with mpmath.workdps(DIGITS):
        point = [mpmath.mpf(draw.randint(20, 190)) / 97 for _ in symbols]
        wanted, result = (sp.lambdify(symbols, e, "mpmath")(*point) for e in (given, short))
        bound = (DECIMAL if given.has(sp.Float) else EXACT) * (1 + abs(wanted) + abs(result))
        if not abs(wanted - result) <= bound:
            return f"{given} has the value {mpmath.nstr(wanted, 15)}, its shortest form {short} {mpmath.nstr(result, 15)}"
    if given.has(sp.Float):
        return ""
    read = sp.sympify(str(short), locals={s.name: s for s in symbols})
    verdict = prove(read, given)
    return "" if verdict else f"{given} is printed as {short}, which reads as something else: {verdict}"


def main() -> int:
    """Check random expressions; print those that fail."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--count", type=int, default=10_000, help="how many expressions (default: 10000)")
    parser.add_argument("--seed", type=int, default=0, help="of the first; the others have the numbers after it (default: 0)")
    arguments = parser.parse_args()
    failed = 0
    for seed in range(arguments.seed, arguments.seed + arguments.count):
        wrong = failure(seed)
        if wrong:
            failed += 1
            print(f"{seed}: {wrong}", flush=True)
    print(f"{arguments.count} expressions, {failed} fail")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
