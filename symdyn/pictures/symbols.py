"""Names as they are typeset: theta_1_dot becomes a theta with an index and a dot."""

from __future__ import annotations

import re
from collections.abc import Sequence

_GREEK = frozenset("alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi rho sigma tau phi chi psi omega "
                   "Gamma Delta Theta Lambda Xi Sigma Phi Psi Omega".split())
# A letter, Greek or Latin, with an index or without.
_SYMBOL = re.compile(r"([A-Za-z]+?)(?:_?(\d+)|_([A-Za-z0-9_]+)|)")
_WORD = re.compile(r"\w+", re.ASCII)
# Letters that symbols on an axis have together at most.
_SHORT = 10
# Digits above the line.
_RAISED = str.maketrans("-0123456789", "\N{SUPERSCRIPT MINUS}\N{SUPERSCRIPT ZERO}\N{SUPERSCRIPT ONE}\N{SUPERSCRIPT TWO}"
                        "\N{SUPERSCRIPT THREE}\N{SUPERSCRIPT FOUR}\N{SUPERSCRIPT FIVE}\N{SUPERSCRIPT SIX}"
                        "\N{SUPERSCRIPT SEVEN}\N{SUPERSCRIPT EIGHT}\N{SUPERSCRIPT NINE}")
_ACCENTS = {"_dot": r"\dot", "_ddot": r"\ddot"}


def typeset(name: str) -> str:
    r"""A name in the mathematics of matplotlib: "q1_dot" is $\dot{q}_{1}$; words stay as they are, with a dot above their rates.

    >>> typeset("theta_2_ddot"), typeset("steer"), typeset("steer_dot")
    ('$\\ddot{\\theta}_{2}$', 'steer', '$\\dot{\\mathrm{steer}}$')
    """
    suffix = next((end for end in ("_ddot", "_dot") if name.endswith(end)), "")
    match = _SYMBOL.fullmatch(name.removesuffix(suffix))
    letter = match[1].replace("lamda", "lambda") if match else ""
    if match is None or not (letter in _GREEK or len(letter) == 1):
        word = name.removesuffix(suffix)
        if suffix and _WORD.fullmatch(word):
            escaped = word.replace("_", r"\_")
            return rf"${_ACCENTS[suffix]}{{\mathrm{{{escaped}}}}}$"
        return name.replace("$", r"\$")
    head = rf"\{letter}" if letter in _GREEK else letter
    if suffix:
        head = rf"{_ACCENTS[suffix]}{{{head}}}"
    index = match[2] or (match[3] or "").replace("_", r",\,")
    if index and not index.isdigit():
        index = rf"\mathrm{{{index}}}"
    return f"${head}_{{{index}}}$" if index else f"${head}$"


def axis_label(names: Sequence[str], title: str, unit: str) -> str:
    """Label of an axis: up to three short symbols, else the title of its curves; with the unit.

    >>> axis_label(["q1", "q2"], "coordinates", "rad"), axis_label(["q_hook_1", "q_hook_2"], "coordinates", "rad")
    ('$q_{1}$, $q_{2}$ [rad]', 'coordinates [rad]')
    """
    signs = [typeset(name) for name in names]
    short = all(sign.startswith("$") for sign in signs) and sum(map(_letters, signs)) <= _SHORT
    few = len(names) == 1 or (len(names) <= 3 and short)
    label = ", ".join(signs) if few else title
    return f"{label} [{typeset_unit(unit)}]" if unit else label


def _letters(sign: str) -> int:
    """Number of letters and digits that a typeset name shows."""
    without = re.sub(r"\\(mathrm|d?dot|_)|[${}_]", "", sign)
    return len(re.sub(r"\\[A-Za-z]+", "x", without))


def typeset_unit(unit: str) -> str:
    """A unit with raised powers, as letters that every font has.

    >>> typeset_unit("kg m^2"), typeset_unit("s^-1")
    ('kg m²', 's⁻¹')
    """
    return re.sub(r"\^-?\d+", lambda power: power[0][1:].translate(_RAISED), unit)
