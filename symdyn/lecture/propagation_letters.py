"""The matrix formulas of chapters 5.7, 5.8 and 6.4 as they are printed: typed once, they can be typeset and evaluated.

Letters stand apart, products are written side by side, and a transposed, starred or dotted letter is a letter of its own:
"f1 = I1 a1 + p1 + 1X2* f2", "q2'' = (S2^T I2 S2)^-1 (tau_2 - S2^T p2)"; v x and v x* are the matrices of the products.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import sympy as sp

from symdyn.frames.product import times
from symdyn.spatial.sixvectors import force_cross, motion_cross
from symdyn.spatial.vectors import vector

# Letters of link 2 before the slides shorten them.
_LONG = {
    "X": r"{}^{b_2}X_{b_1}", "X_3*": r"{}^{b_2}X_{b_3}^*", "X_G": r"{}^{b_{G2}}X_{b_2}", "X_G*": r"{}^{b_2}X_{b_{G2}}^*",
    "X_back": r"{}^{b_2}X_{b_{G2}}", "S": "S_{b_2}", "S^T": "S_{b_2}^T",
    "S_ring": r"\overset{\circ}{S}_{b_2}", "S_dot": r"\dot{S}_{b_2}",
    "v_1": r"{}^{b_1}\hat{v}_{b_1}", "v_2": r"{}^{b_2}\hat{v}_{b_2}", "v_G": r"{}^{b_{G2}}\hat{v}_{b_{G2}}",
    "a_1": r"{}^{b_1}\hat{a}_{b_1}", "a_2": r"{}^{b_2}\hat{a}_{b_2}", "a_G": r"{}^{b_{G2}}\hat{a}_{b_{G2}}",
    "I_2": r"{}^{b_2}\hat{I}_{b_2}", "I_G": r"{}^{b_{G2}}\hat{I}_{G_2}", "f_G": r"{}^{b_{G2}}\hat{f}_{G_2}^{B_2}",
    "f_2": r"{}^{b_2}\hat{f}_{O_2}", "f_B": r"{}^{b_2}\hat{f}_{O_2}^{B_2}", "f_3": r"{}^{b_3}\hat{f}_{O_3}",
    "a_i": r"{}^{b_i}\hat{a}_{b_i}",
}
_SIGNS = {"x": r"\times", "x*": r"\times^*", "]": "]", ")^-1": ")^{-1}", **{sign: sign for sign in "+-=()["}}
_SHORT: tuple[tuple[str, Callable[[re.Match[str]], str]], ...] = (
    (r"(\d)X(\d)(\*?)", lambda m: rf"{{}}^{m[1]}X_{m[2]}" + ("^*" if m[3] else "")),
    (r"q(\d)('{1,2})", lambda m: rf"\{'d' * len(m[2])}ot{{q}}_{m[1]}"),
    (r"tau_(\d)", lambda m: rf"\tau_{m[1]}"),
    (r"S(\d)\^T", lambda m: rf"S_{m[1]}^T"),
    (r"([acfpIS])(\d)([AB]?)", lambda m: f"{m[1]}_{m[2]}" + (f"^{m[3]}" if m[3] else "")),
)


def typeset(text: str) -> str:
    """In LaTeX. Raises ValueError for a letter that the slides do not have."""
    return " ".join(_SIGNS.get(token) or _LONG.get(token) or _short(token) for token in _tokens(text))


def evaluated(text: str, letter: Callable[[str], Any]) -> Any:
    """Value of the right side, or of the only one; letter: gives the value of a letter."""
    tokens = _tokens(text.rpartition("=")[2])
    result = _sum(tokens, letter)
    if tokens:
        raise ValueError(f"{text!r} goes on with {' '.join(tokens)!r} after its end; brackets come in pairs")
    return result


def both_sides(text: str, letter: Callable[[str], Any]) -> tuple[Any, Any]:
    """Values of both sides of an equation."""
    left, _, right = text.partition("=")
    return evaluated(left, letter), evaluated(right, letter)


def _tokens(text: str) -> list[str]:
    return re.findall(r"\)\^-1|[()\[\]]|[^\s()\[\]]+", text)


def _short(token: str) -> str:
    for pattern, made in _SHORT:
        if result := re.fullmatch(pattern, token):
            return made(result)
    raise ValueError(f"there is no letter {token!r} in chapters 5.7, 5.8 and 6.4; write it as in 'f1 = I1 a1 + p1 + 1X2* f2'")


def _sum(tokens: list[str], letter: Callable[[str], Any]) -> Any:
    total = _product(tokens, letter)
    while tokens and tokens[0] in ("+", "-"):
        sign = tokens.pop(0)
        term = _product(tokens, letter)
        total = total + term if sign == "+" else total - term
    return total


def _product(tokens: list[str], letter: Callable[[str], Any]) -> Any:
    value = _factor(tokens, letter)
    while tokens and tokens[0] not in ("+", "-", ")", "]", ")^-1"):
        factor = _factor(tokens, letter)
        both = isinstance(value, sp.MatrixBase) and isinstance(factor, sp.MatrixBase)
        value = times(value, factor) if both else value * factor
    return value


def _factor(tokens: list[str], letter: Callable[[str], Any]) -> Any:
    token = _next(tokens)
    if token in ("(", "["):
        value = _sum(tokens, letter)
        if _next(tokens) == ")^-1":
            value = sp.Matrix([1 / value[0]])
    else:
        value = letter(token)
    if tokens and tokens[0] in ("x", "x*"):
        product = motion_cross if tokens.pop(0) == "x" else force_cross
        value = sp.Matrix(product(vector(*value)))
    return value


def _next(tokens: list[str]) -> str:
    if not tokens:
        raise ValueError("a formula ends where a letter or a closing bracket must follow; brackets come in pairs")
    return tokens.pop(0)
