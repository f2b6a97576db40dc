"""Helpers of several tests: numbers for the inputs of a tape, closeness at 30 digits, a pendulum in closed
form, a browser, records in records."""

from __future__ import annotations

import base64
import dataclasses
import random
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp

from symdyn.formulation.equations import Equations
from symdyn.model.symbols import symbols_of
from symdyn.tape import Node, Tape
from symdyn.tape.evaluate import evaluate

DIGITS = 30
TOLERANCE = mpmath.mpf(10) ** -25
# For derivatives by central differences: the error is about STEP^2, and HIGH - 20 digits are left.
HIGH = 80
STEP = mpmath.mpf(10) ** -20
GRAVITY = 9.81
# In a page: text with less contrast to what is behind it than WCAG 2.2 AA asks for, 4.5, of large letters 3. Colours that let
# others through are mixed with what is behind.
CONTRAST = """() => {
    const channel = v => (v /= 255) <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
    const parse = text => { const [r, g, b, a = 1] = (text.match(/[\\d.]+/g) || [0, 0, 0, 1]).map(Number);
        return text.startsWith("color(srgb") ? [255 * r, 255 * g, 255 * b, a] : [r, g, b, a]; };
    const light = c => 0.2126 * channel(c[0]) + 0.7152 * channel(c[1]) + 0.0722 * channel(c[2]);
    const over = (front, back) => [0, 1, 2].map(k => front[3] * front[k] + (1 - front[3]) * back[k]);
    const behind = e => { if (!e) return [255, 255, 255]; const c = parse(getComputedStyle(e).backgroundColor);
        return c[3] > 0.99 ? c : over(c, behind(e.parentElement)); };
    return [...document.querySelectorAll("body *")].filter(e => e.checkVisibility() && [...e.childNodes].some(
        n => n.nodeType === 3 && n.textContent.trim()) && !["SCRIPT", "STYLE", "OPTION"].includes(e.tagName)).flatMap(e => {
        const style = getComputedStyle(e), back = behind(e), a = light(over(parse(style.color), back)), b = light(back);
        const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), size = parseFloat(style.fontSize);
        const large = size >= 24 || (size >= 18.66 && style.fontWeight >= 700);
        return ratio < (large ? 3 : 4.5) ? [e.tagName + " " + e.textContent.slice(0, 20) + " " + ratio.toFixed(2)] : [];
    });
}"""


def swept(cases: Iterable[Any], *few: Any) -> list[Any]:
    """Cases of a parametrized test, of which all but a few are left to `pytest -m sweep`."""
    listed = list(cases)
    assert all(one in listed for one in few), f"{few} are not all among {listed}"
    return [one if one in few else pytest.param(*one if type(one) is tuple else (one,), marks=pytest.mark.sweep)
            for one in listed]


def without_constants_of_modules() -> None:
    """Have hypothesis leave out the numbers of the package's text, which it reads for seconds, and which change from run to
    run with what is loaded; and look for no garbage where it takes a generator of random numbers, which takes as long."""
    from hypothesis.internal import entropy
    from hypothesis.internal.conjecture import providers

    if hasattr(providers, "_get_local_constants"):
        providers._get_local_constants = lambda: providers._local_constants
    if hasattr(entropy, "gc"):
        entropy.gc = SimpleNamespace(collect=lambda: 0, get_referrers=lambda taken: [taken])


def numbers(names: Sequence[str], seed: int, low: float = 0.2, high: float = 1.2) -> dict[str, Fraction]:
    """A number for each name, the same for the same seed, exact in any arithmetic."""
    rng = random.Random(seed)
    return {name: Fraction(round(rng.uniform(low, high) * 2**20), 2**20) for name in names}


def state(equations: Equations, seed: int = 0, **given: Any) -> dict[str, Any]:
    """Numbers for every symbol of the equations (derivatives of speeds zero), some given; Euler parameters of unit norm."""
    s = equations.symbols
    names = [a.name for a in (*s.coordinates, *s.speeds, *s.states, *s.inputs, *s.parameters)]
    values: dict[str, Any] = {**numbers(names, seed), "t": Fraction(3, 10), **{f"{u.name}_dot": 0 for u in s.speeds}, **given}
    with mpmath.workdps(2 * DIGITS):
        for first in [n for n in values if n.startswith("e0")]:
            group = [n for n in values if n[:1] == "e" and n[2:] == first[2:]]
            norm = mpmath.sqrt(sum(mpmath.mpf(values[n].numerator) ** 2 / values[n].denominator**2 for n in group))
            values.update({n: mpmath.mpf(values[n].numerator) / values[n].denominator / norm for n in group})
    return values


def at(tape: Tape, values: Mapping[str, Any], digits: int = DIGITS) -> dict[str, np.ndarray]:
    """All outputs of a tape; fractions among the values are taken exactly."""
    with mpmath.workdps(digits + 10):
        plain = {k: mpmath.mpf(v.numerator) / v.denominator if isinstance(v, Fraction) else v for k, v in values.items()}
    return evaluate(tape, plain, digits)


def quantities(equations: Equations, values: Mapping[str, Any], *names: str, digits: int = DIGITS) -> list[np.ndarray]:
    """Quantities of the equations in numbers, in the order of the names."""
    result = at(equations.tape(*names), values, digits)
    return [result[name] for name in names]


def largest(*arrays: Any) -> Any:
    """The largest absolute value in some arrays."""
    return max((abs(v) for a in arrays for v in np.asarray(a, dtype=object).ravel()), default=mpmath.mpf(0))


def close(a: Any, b: Any, tolerance: Any = TOLERANCE) -> bool:
    """Whether two arrays agree, relative to the largest entry (at least 1)."""
    a, b = np.asarray(a, dtype=object), np.asarray(b, dtype=object)
    assert a.shape == b.shape, f"shapes {a.shape} and {b.shape}"
    with mpmath.workdps(2 * DIGITS):
        return bool(largest(a - b) <= tolerance * max(1, largest(a), largest(b)))


def exact(tape: Tape, name: str, values: Mapping[str, Fraction]) -> Fraction:
    """An output that uses + - * / only, in exact arithmetic."""
    rules = {"add": lambda a, b: a + b, "sub": lambda a, b: a - b, "mul": lambda a, b: a * b, "div": lambda a, b: a / b,
             "neg": lambda a: -a}
    done: dict[Node, Fraction] = {}
    for node in tape.steps:
        done[node] = values[node.args[1]] if node.op == "leaf" else Fraction(rules[node.op](
            *[done[a] if isinstance(a, Node) else Fraction(a) for a in node.args]))
    entry = tape.outputs[name].entries[0]
    return done[entry] if isinstance(entry, Node) else Fraction(entry)


def in_sympy(expression: sp.Expr, values: Mapping[str, Fraction], digits: int = 40) -> Any:
    """A SymPy expression in numbers, as mpmath's."""
    at = {s: sp.Rational(values[s.name].numerator, values[s.name].denominator) for s in symbols_of(expression)}
    value = sp.N(expression.doit().xreplace(at), digits, maxn=200)
    with mpmath.workdps(digits):
        return mpmath.mpf(str(value)) if value.is_real else complex(value)


def number(value: Any) -> Any:
    """A value for the inputs of a tape as mpmath's number."""
    return mpmath.mpf(value.numerator) / value.denominator if isinstance(value, Fraction) else mpmath.mpf(value)


def shifted(equations: Equations, values: Mapping[str, Any], step: Any) -> dict[str, Any]:
    """The state a moment later, at constant speeds."""
    (rates,) = quantities(equations, values, "rates", digits=HIGH)
    with mpmath.workdps(HIGH):
        moved = {q.name: number(values[q.name]) + step * rate
                 for q, rate in zip(equations.symbols.coordinates, rates, strict=True)}
        return {**values, **moved, "t": number(values["t"]) + step}


def by_time(equations: Equations, values: Mapping[str, Any], name: str) -> np.ndarray:
    """Derivative of a quantity by time at constant speeds, by a central difference."""
    later, earlier = (quantities(equations, shifted(equations, values, h), name, digits=HIGH)[0] for h in (STEP, -STEP))
    with mpmath.workdps(HIGH):
        return (later - earlier) / (2 * STEP)


def twists(equations: Equations, values: Mapping[str, Any]) -> np.ndarray:
    """[v_G; omega] of every body, n-frame, (n_b, 6), by differentiating positions and rotations."""
    v, frames_dot = by_time(equations, values, "positions"), by_time(equations, values, "frames")
    (frames,) = quantities(equations, values, "frames", digits=HIGH)
    with mpmath.workdps(HIGH):
        rows = []
        for k in range(len(v)):
            W = frames_dot[k, 3:].reshape(3, 3) @ frames[k, 3:].reshape(3, 3).T
            rows.append([*v[k], W[2, 1], W[0, 2], W[1, 0]])
        return np.array(rows, dtype=object).reshape(-1, 6)


def swing(t: float, release: float) -> float:
    """Angle of a pendulum of 1 m, released at rest."""
    with mpmath.workdps(30):
        k, w = mpmath.sin(mpmath.mpf(release) / 2), mpmath.sqrt(mpmath.mpf(GRAVITY))
        quarter = mpmath.ellipk(k**2)
        phase = mpmath.fmod(w * mpmath.mpf(t), 4 * quarter)
        return float(2 * mpmath.asin(k * mpmath.ellipfun("sn", quarter - phase, k**2)))


def values_of(page: Any, script: str, argument: Any = None) -> np.ndarray:
    """Bytes that a script in a page returns, of an argument. They come as a text: an array of numbers takes seconds."""
    return np.frombuffer(base64.b64decode(page.evaluate(f"""given => {{ const bytes = ({script})(given); let text = "";
        for (let k = 0; k < bytes.length; k += 4096) text += String.fromCharCode(...bytes.subarray(k, k + 4096));
        return btoa(text); }}""", argument)), np.uint8)


@contextmanager
def browser() -> Iterator[Any]:
    """Chromium through Playwright; the test is skipped without them."""
    playwright = pytest.importorskip("playwright.sync_api")
    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if chromium is None:
        pytest.skip("no Chromium on this machine")
    with playwright.sync_playwright() as p:
        opened = p.chromium.launch(executable_path=chromium, args=["--no-sandbox", "--use-angle=swiftshader",
                                                                                 "--enable-unsafe-swiftshader"])
        yield opened
        opened.close()


def records_in(value: Any) -> Iterator[Any]:
    """Records, and what they hold that may be changed."""
    if dataclasses.is_dataclass(value):
        yield value
        for field in dataclasses.fields(value):
            yield from records_in(getattr(value, field.name))
    elif isinstance(value, tuple):
        for entry in value:
            yield from records_in(entry)
    elif isinstance(value, (list, dict, set)):
        yield value
