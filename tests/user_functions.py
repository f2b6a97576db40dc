"""Functions of the user for tests, each with the expression that it is."""

from __future__ import annotations

import numpy as np
import sympy as sp

import symdyn as sd


def pair_numpy(x, k):
    """Two results: a hardening spring, and its energy."""
    square = x**2
    return -k * x * (1 + square), k * square * (1 + square / 2) / 2


def slopes_numpy(x, k):
    return -k * (1 + 3 * x**2), -x * (1 + x**2), k * x * (1 + x**2), x**2 * (1 + x**2 / 2) / 2


def curves_numpy(x, k):
    one, two = 1 + 3 * x**2, x * (1 + x**2)
    return -6 * k * x, -one, -one, 0 * x, k * one, two, two, 0 * x


def c_text(name: str, *results: str) -> str:
    """C99 that stores expressions in x and k."""
    lines = "\n".join(f"    out[{n}] = {r};" for n, r in enumerate(results))
    return (f"static int {name}(const double *in, double *out)\n{{\n    const double x = in[0], k = in[1];\n"
            f"    (void)k;\n{lines}\n    return 0;\n}}\n")


# Functions with second, first and no derivatives; the last two stand in one text.
CURVES = sd.External("curves", ["x", "k"], 8, python=curves_numpy, c=c_text(
    "curves", "-6*k*x", "-(1 + 3*x*x)", "-(1 + 3*x*x)", "0*x", "k*(1 + 3*x*x)", "x*(1 + x*x)", "x*(1 + x*x)", "0*x"))
SHARED = c_text("slopes", "-k*(1 + 3*x*x)", "-x*(1 + x*x)", "k*x*(1 + x*x)", "x*x*(1 + x*x/2)/2") + "\n" + c_text(
    "pair", "-k*x*(1 + x*x)", "k*x*x*(1 + x*x/2)/2")
SLOPES = sd.External("slopes", ["x", "k"], 4, python=slopes_numpy, c=SHARED, derivative=CURVES)
PAIR = sd.External("pair", ["x", "k"], 2, python=pair_numpy, c=SHARED, derivative=SLOPES, operations=8)


def pair(x: sp.Expr, k: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """The same as expressions."""
    return -k * x * (1 + x**2), k * x**2 * (1 + x**2 / 2) / 2


def height_numpy(s):
    return np.sin(s) + s**2 / 2


def height_1_numpy(s):
    return np.cos(s) + s


def height_2_numpy(s):
    return 1 - np.sin(s)


def _height(name: str, function: object, value: str, precise: object, derivative: sd.External | None) -> sd.External:
    text = f"static int {name}(const double *in, double *out)\n{{\n    out[0] = {value};\n    return 0;\n}}"
    return sd.External(name, ["s"], python=function, c=text, precise=precise, derivative=derivative)


HEIGHT_2 = _height("height_2", height_2_numpy, "1 - sin(in[0])", lambda mp, s: 1 - mp.sin(s), None)
HEIGHT_1 = _height("height_1", height_1_numpy, "cos(in[0]) + in[0]", lambda mp, s: mp.cos(s) + s, HEIGHT_2)
HEIGHT = _height("height", height_numpy, "sin(in[0]) + in[0]*in[0]/2", lambda mp, s: mp.sin(s) + s * s / 2, HEIGHT_1)


def height(s: sp.Expr) -> sp.Expr:
    """The same as an expression."""
    return sp.sin(s) + s**2 / 2


def bounded_numpy(v):
    return np.where(v < 0.5, 1 + v, np.nan)


BOUNDED = sd.External("bounded", ["v"], python=bounded_numpy, reason="the table of bounded ends at 0.5", c="""
static int bounded(const double *in, double *out)
{
    out[0] = 1 + in[0];
    return in[0] >= 0.5;
}""")
