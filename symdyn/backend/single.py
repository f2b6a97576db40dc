"""C in single precision: the text of double precision with numbers of the other type."""

from __future__ import annotations

import re

# Comments and texts stay; then the word, and numbers with a point or an exponent, but no parts of names and no hexadecimal ones.
_TOKENS = re.compile(r"""(?P<kept>//[^\n]*|"(?:[^"\\\n]|\\.)*"|typedef\ double\ symdyn_time;)|\b(?P<word>double)\b|"""
                     r"""(?<![\w.])(?P<number>(?:\d+\.\d*|\.\d+)(?:[eE][+-]?\d+)?|\d+[eE][+-]?\d+)(?![\w.])""")


def in_single(text: str) -> str:
    """The text with floats in place of doubles, but for what is declared as symdyn_time.

    >>> from symdyn.backend.single import in_single
    >>> in_single("const double a = 0.5*b + 1e-3*c[12];  // 0.5 of it")
    'const float a = 0.5f*b + 1e-3f*c[12];  // 0.5 of it'
    """
    return _TOKENS.sub(lambda token: token[0] if token["kept"] else "float" if token["word"] else f"{token['number']}f", text)
