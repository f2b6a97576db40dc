"""Formulas as MathML, which browsers typeset without a script or a network."""

from __future__ import annotations

import re
from html import unescape

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator

# The bold letters of Unicode: browsers take no `mathvariant` but "normal" (MathML Core).
_ALPHABETS = (("A", 26, 0x1D400), ("a", 26, 0x1D41A), ("0", 10, 0x1D7CE), ("\u0391", 25, 0x1D6A8), ("\u03b1", 25, 0x1D6C2))
_BOLD = {ord(first) + k: chr(bold + k) for first, count, bold in _ALPHABETS for k in range(count)}
# latex2mathml knows the alignment of lines by this name, and their distance without a number.
_LINES = (r"\begin{aligned}", r"\begin{align*}"), (r"\end{aligned}", r"\end{align*}"), (r"\\[2pt]", r"\\")
# Names of functions, which are set off from factors before them and from arguments without parentheses.
_FUNCTION = re.compile("<mi>((?:arc)?(?:sin|cos|tan)|exp|log|ln|det)</mi>(?=((?:<mrow>)*<mo[^>]*>&#x00028;)?)")
_FIRST = re.compile("(<m[a-z]+>|(?<!&#x00029;)</mo>)$")
_SIGNS = re.compile(r"[,.;:!?)\u2019]+")
_VARIANT = re.compile(r'<(m[in]) mathvariant="bold(?:-italic)?">([^<]*)</')


def mathml(formula: str, display: str = "inline") -> str:
    """A formula of LaTeX as MathML. Raises ValueError for one that is not understood."""
    for written, known in _LINES:
        formula = formula.replace(written, known)
    text = convert(formula, display=display).replace('mathvariant="sans-serif"', 'mathvariant="normal"')
    if "<mi>&</mi>" in text or r"\begin" in text:
        raise ValueError(f"latex2mathml does not take the formula {formula}")
    text = _FUNCTION.sub(_function, text)
    return _VARIANT.sub(lambda m: f"<{m[1]}>{unescape(m[2]).translate(_BOLD)}</", text)


def _function(name: re.Match[str]) -> str:
    left = "0" if _FIRST.search(name.string[max(0, name.start() - 20):name.start()]) else "0.167em"
    return f'<mo lspace="{left}" rspace="{"0" if name[2] else "0.167em"}">{name[1]}</mo>'


def inline(writer: HTML5Translator, node: nodes.math) -> None:
    writer.body.append(mathml(node.astext()))
    raise nodes.SkipNode


def block(writer: HTML5Translator, node: nodes.math_block) -> None:
    writer.body.append(f'<div class="formula">{mathml(node.astext(), "block")}</div>')
    raise nodes.SkipNode


def keep_together(app: Sphinx, document: nodes.document, name: str) -> None:
    """Signs that follow a formula stay on its line, where browsers would break."""
    for formula in list(document.findall(nodes.math)):
        after = formula.next_node(siblings=True, descend=False, ascend=False)
        if isinstance(after, nodes.Text) and (signs := _SIGNS.match(after.astext())):
            formula.parent.replace(after, nodes.Text(after.astext()[signs.end():]))
            formula.replace_self(nodes.inline("", "", formula.deepcopy(), nodes.Text(signs[0]), classes=["short"]))


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    app.connect("doctree-resolved", keep_together)
    app.config.html_math_renderer = "mathml"  # type: ignore[attr-defined]
    return {"parallel_read_safe": True}
