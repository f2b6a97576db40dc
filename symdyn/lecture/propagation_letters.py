"""How the matrix formulas of chapters 5.7 and 5.8 are typeset: what is compared are their values, which nobody recognizes."""

from __future__ import annotations

import re

# Letters of link 2 as the slides write them before they are shortened.
_LONG = {
    "X": r"{}^{b_2}X_{b_1}", "X_3*": r"{}^{b_2}X_{b_3}^*", "X_G": r"{}^{b_{G2}}X_{b_2}", "X_G*": r"{}^{b_2}X_{b_{G2}}^*",
    "X_back": r"{}^{b_2}X_{b_{G2}}", "S": "S_{b_2}", "S^T": "S_{b_2}^T", "S_ring": r"\overset{\circ}{S}_{b_2}", "S_dot": r"\dot{S}_{b_2}",
    "v_1": r"{}^{b_1}\hat{v}_{b_1}", "v_2": r"{}^{b_2}\hat{v}_{b_2}", "v_G": r"{}^{b_{G2}}\hat{v}_{b_{G2}}",
    "a_1": r"{}^{b_1}\hat{a}_{b_1}", "a_2": r"{}^{b_2}\hat{a}_{b_2}", "a_G": r"{}^{b_{G2}}\hat{a}_{b_{G2}}",
    "I_2": r"{}^{b_2}\hat{I}_{b_2}", "I_G": r"{}^{b_{G2}}\hat{I}_{G_2}", "f_G": r"{}^{b_{G2}}\hat{f}_{G_2}^{B_2}",
    "f_2": r"{}^{b_2}\hat{f}_{O_2}", "f_B": r"{}^{b_2}\hat{f}_{O_2}^{B_2}", "f_3": r"{}^{b_3}\hat{f}_{O_3}",
    "a_i": r"{}^{b_i}\hat{a}_{b_i}",
}
_BOTH = {"x": r"\times", "x*": r"\times^*", "+": "+", "-": "-", "=": "=", "1": "1"}
_SHORT = (
    (r"(\d)X(\d)(\*?)", lambda m: rf"{{}}^{m[1]}X_{m[2]}" + ("^*" if m[3] else "")),
    (r"q(\d)('{1,2})", lambda m: rf"\{'d' * len(m[2])}ot{{q}}_{m[1]}"),
    (r"tau_(\d)", lambda m: rf"\tau_{m[1]}"),
    (r"S(\d)\^T", lambda m: rf"S_{m[1]}^T"),
    (r"([acfpIS])(\d)([AB]?)", lambda m: f"{m[1]}_{m[2]}" + (f"^{m[3]}" if m[3] else "")),
)


def typeset(text: str) -> str:
    """A formula in LaTeX. Letters stand apart, and brackets at letters: "f1 = I1 a1 + p1 + 1X2* f2", "(S2^T I2 S2)^-1".

    Raises ValueError for a letter that the slides do not have.
    """
    return " ".join(_token(token) for token in text.split())


def _token(token: str) -> str:
    opening, letter, closing = re.fullmatch(r"([(\[]*)(.*?)((?:[)\]](?:\^-1)?)*)", token).groups()  # type: ignore[union-attr]
    return opening + _letter(letter) + closing.replace("^-1", "^{-1}")


def _letter(letter: str) -> str:
    if letter in _BOTH or letter in _LONG:
        return _BOTH.get(letter) or _LONG[letter]
    for pattern, made in _SHORT:
        if found := re.fullmatch(pattern, letter):
            return made(found)
    raise ValueError(f"there is no letter {letter!r} in chapters 5.7 and 5.8; write it as in 'f1 = I1 a1 + p1 + 1X2* f2'")
