"""Functions of the user in descriptions: as expressions, and every message about faulty ones."""

from __future__ import annotations

import re
import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ModelError, UnsupportedExpression
from symdyn.model.symbols import as_expression
from symdyn.tape.differentiate import jacobian
from symdyn.tape.evaluate import evaluate
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.node import COORDINATE
from symdyn.tape.recorder import Recorder
from symdyn.tape.sympy_bridge import expand, record_expression
from symdyn.tape.tape import Output, Tape
from tests.user_functions import BOUNDED, HEIGHT, PAIR, height, pair

X, K, S = sp.symbols("x k s", real=True)
ROOT = Path(__file__).parents[2]
C = "static int f(const double *in, double *out)\n{\n    out[0] = in[0];\n    return 0;\n}"
TABLE = [1.0, 2.0]


def identity(v):
    return v


def squares(a, b):
    return a**2, b**2


def recorded(*expressions: sp.Expr) -> tuple[Recorder, list[Any], list[Any]]:
    recorder = Recorder()
    leaves = {s: recorder.leaf(s.name, COORDINATE) for s in (X, K, S)}
    return recorder, list(leaves.values()), [record_expression(recorder, e, leaves) for e in expressions]


# -- as an expression


def test_one_result_is_an_expression_several_are_a_tuple() -> None:
    one, two = PAIR(X, K)
    assert one.free_symbols == two.free_symbols == {X, K} and one != two
    assert isinstance(HEIGHT(S), sp.Expr) and HEIGHT(S).is_real
    assert as_expression(3 * HEIGHT(S) ** 2, "a force") == 3 * HEIGHT(S) ** 2
    assert HEIGHT(S).subs(S, 2 * X) == HEIGHT(2 * X) and HEIGHT(S).xreplace({S: X}) == HEIGHT(X)
    assert repr(PAIR) == "External(pair(x, k), 2 results)" and repr(HEIGHT) == "External(height(s), 1 result)"


def test_it_prints_as_an_applied_function() -> None:
    assert str(HEIGHT(X + S)) == "height(s + x)" and [str(r) for r in PAIR(X, K)] == ["pair_1(x, k)", "pair_2(x, k)"]
    assert sp.latex(HEIGHT(S)) == r"\operatorname{height}{\left(s \right)}"
    assert sp.latex(PAIR(X, K)[1] ** 2) == r"\operatorname{pair}_{2}^{2}{\left(x, k \right)}"
    assert "height(s)" in sp.pretty(HEIGHT(S), use_unicode=False)


def test_a_name_that_mpmath_or_sympy_know_is_the_users_own() -> None:
    f = sd.External("zeta", ["v"], c=C.replace("f(", "zeta("))
    assert str(f(2.5)) == "zeta(2.5)" and f(2.5).evalf() == f(2.5)
    assert sp.latex(f(S)) == r"\zeta{\left(s \right)}" or "zeta" in sp.latex(f(S))


def test_it_differentiates_in_sympy() -> None:
    """By the derivative that is given, through what is inside; two derivatives deep."""
    found = sp.diff(HEIGHT(X * K), X, K)
    at = {X: sp.Rational(3, 10), K: sp.Rational(7, 10)}
    assert abs(found.subs(at).evalf(25) - sp.diff(height(X * K), X, K).subs(at).evalf(25)) < 1e-24
    for mine, plain in zip(PAIR(X**2, K), pair(X**2, K), strict=True):
        for by in (X, K):
            assert abs(float(sp.diff(mine, by).subs(at)) - float(sp.diff(plain, by).subs(at))) < 1e-15


def test_numbers_at_any_precision() -> None:
    value = HEIGHT(sp.Rational(1, 3))
    assert abs(value.evalf(40) - height(sp.Rational(1, 3)).evalf(40)) < sp.Float(10) ** -39
    assert abs(float(PAIR(2, 3)[0]) + 30) < 1e-15
    assert BOUNDED(2).evalf() == BOUNDED(2)  # it fails there


# -- on the tape


def test_several_results_are_one_call() -> None:
    one, two = PAIR(X, K)
    recorder, _, entries = recorded(one + two, two * S, one)
    tape = Tape.of(recorder, all=np.array(entries, dtype=object))
    assert [n.op for n in tape.steps].count("call") == 1
    assert tape.count()["intrinsic"] == 8


def test_calls_with_numbers_are_folded() -> None:
    _, _, entries = recorded(PAIR(2, 3)[0] + HEIGHT(sp.pi) * 0, HEIGHT(0))
    assert entries == [-30, 0]
    with pytest.raises(ZeroDivisionError, match=r"the table of bounded ends at 0\.5"):
        recorded(BOUNDED(1))


def test_rows_of_states_broadcast() -> None:
    recorder, _, entries = recorded(*PAIR(X, K), HEIGHT(S))
    tape = Tape.of(recorder, f=np.array(entries, dtype=object))
    xs = np.linspace(-1, 1, 7)
    found = evaluate_rows(tape, {"x": xs, "k": 2.0, "s": xs}, 7)["f"]
    for n, x in enumerate(xs):
        np.testing.assert_allclose(found[n], [*[float(v) for v in pair(x, 2.0)], float(height(x))], rtol=1e-15)


def test_derivatives_on_the_tape_are_those_of_the_expressions() -> None:
    """First and second, forward and reverse, at 30 digits where the functions have them, else to rounding."""
    values = {"x": 0.7, "k": 1.3, "s": 0.4}
    both = []
    for f, g in ((PAIR(X * S, K)[1], HEIGHT(X * S)), (pair(X * S, K)[1], height(X * S))):
        recorder, leaves, entries = recorded(f * X, g)
        first = [jacobian(recorder, entries, leaves, mode) for mode in ("forward", "reverse")]
        second = jacobian(recorder, first[0].ravel().tolist(), leaves)
        both.append(evaluate(Tape.of(recorder, forward=first[0], reverse=first[1], second=second), values))
    for name in ("forward", "reverse", "second"):
        assert np.abs(both[0][name] - both[1][name]).max() < 1e-14
        precise = slice(1, None) if name != "second" else slice(3, None)
        assert np.abs(both[0][name][precise] - both[1][name][precise]).max() < 1e-29


def test_expanding_a_tape_gives_the_applied_function_back() -> None:
    one, two = PAIR(X * S, K)
    _, leaves, entries = recorded(one * two - S, HEIGHT(K))
    symbols = dict(zip(leaves, (X, K, S), strict=True))
    assert expand(Output.of("f", np.array(entries, dtype=object)), symbols) == sp.Matrix([one * two - S, HEIGHT(K)])


def test_no_derivative_is_reported() -> None:
    message = (r"a derivative of bounded\(v\) is needed and not given; pass derivative= to sd.External, another sd.External of "
               "the same arguments that gives one result")
    recorder, leaves, entries = recorded(BOUNDED(X))
    with pytest.raises(UnsupportedExpression, match=message):
        jacobian(recorder, entries, leaves)
    with pytest.raises(UnsupportedExpression, match=message):
        sp.diff(BOUNDED(X), X)
    assert jacobian(recorder, entries, [leaves[1]]).tolist() == [[0]]


def test_no_python_function_is_reported() -> None:
    f = sd.External("f", ["v"], c=C)
    with pytest.raises(UnsupportedExpression, match=r"f\(v\) must be evaluated in Python, and has no Python function; pass "):
        recorded(f(2))


@pytest.mark.parametrize(("function", "results", "message"), [
    (squares, 1, r"must return real arrays of the shape of its arguments, here \(1,\)"),
    (squares, 3, r"must return 3 arrays, as a tuple; its Python function returned 2")])
def test_what_a_function_returns_is_looked_at(function: Any, results: int, message: str) -> None:
    f = sd.External("f", ["a", "b"], results, python=function)
    expression = f(2, 3)
    with pytest.raises(UnsupportedExpression, match=message):
        recorded(expression if results == 1 else expression[0])


def test_numbers_of_mpmath_are_counted() -> None:
    f = sd.External("f", ["v"], 2, python=lambda_free, precise=lambda mp, v: v)
    recorder, _, entries = recorded(f(X)[0])
    with pytest.raises(UnsupportedExpression, match="must return 2 results; its function `precise` returned 1"):
        evaluate(Tape.of(recorder, f=np.array(entries, dtype=object)), {"x": 1})


def lambda_free(v):
    return v, v


# -- faults


def faulty(**changes: Any) -> tuple[str, ...]:
    """Faults of an External that would be sound without the changes."""
    name = changes.pop("name", "f")
    arguments = changes.pop("arguments", ["v"])
    with pytest.raises(ModelError) as caught:
        sd.External(name, arguments, **{"c": C, "python": identity, **changes})
    return caught.value.faults


@pytest.mark.parametrize(("changes", "message"), [
    ({"name": "2f"}, r"the name of a function is '2f'; pass letters, digits and underscores"),
    ({"name": 3}, "the name of a function is 3; pass letters"),
    ({"name": "double"}, "a function is called 'double', a name that generated code or C has already"),
    ({"name": "sin"}, "a function is called 'sin', a name"), ({"name": "hypotf"}, "'hypotf', a name"),
    ({"name": "symdyn_f"}, "'symdyn_f', a name"),
    ({"arguments": "v"}, r"f: arguments is 'v'; pass a list of different names, such as \['v', 'omega'\]"),
    ({"arguments": []}, r"f: arguments is \[\]"), ({"arguments": ["v", "v"]}, "pass a list of different names"),
    ({"arguments": [sp.Symbol("v")]}, "pass a list of different names"),
    ({"results": 0}, "f: results is 0; pass a whole number from 1 on"), ({"results": 1.0}, "f: results is 1.0"),
    ({"operations": True}, "f: operations is True; pass a whole number"),
    ({"precise": 3}, "f: precise is 3; pass a function of an mpmath context and of the arguments"),
    ({"reason": 'it "fails"'}, "f: reason is .* pass one line without quotation marks"),
    ({"reason": "one\ntwo"}, "pass one line"), ({"reason": "what??/"}, "pass one line"),
    ({"c": ""}, "f: its text for the backend 'c' is ''; pass the text of a function"),
    ({"c": 3}, "f: its text for the backend 'c' is 3"), ({"texts": {"julia": None}}, "its text for the backend 'julia' is None"),
    ({"texts": ["c"]}, r"f: texts is \['c'\]; pass a dictionary of backends and texts"),
    ({"texts": {"numpy": "def f(v): return v"}}, r"f: texts has numpy; pass python="),
    ({"c": C.replace("f(", "g(")}, r"f: its text in C does not define it; it must hold static int f\(const double \*in, double "),
    ({"c": C.replace("int", "double", 1)}, "f: its text in C does not define it"),
    ({"c": "#include <math.h>\n" + C}, "f: its text in C includes a file; leave that out"),
    ({"c": None, "python": None}, "f has no text; pass c=, python= or both"),
    ({"python": None, "python_source": "def f(v): return v"}, "f: python_source is given without python"),
    ({"python": np.sin}, "f: the Python function is <ufunc 'sin'> of type ufunc; pass a function that is written with def"),
    ({"python": lambda v: v}, "f: the Python function is a lambda; pass a function that is written with def"),
    ({"python": partial(identity)}, "of type partial; pass a function that is written with def"),
    ({"python": squares}, r"the Python function squares takes \(a, b\); it must take 1 argument, without defaults"),
    ({"python_source": "def identity(v): return v"}, None),
    ({"python_source": "def identity(v) return v"}, "is no Python of its own"),
    ({"python_source": "def other(v): return v"}, r"does not define it; it must hold def identity\(...\)"),
    ({"python_source": "def identity(v, n=2): return v"}, r"takes \(v, n=2\); it must take 1 argument, without defaults"),
    ({"python_source": "def identity(*v): return v"}, r"takes \(\*v\); it must take 1 argument"),
    ({"python_source": "def identity(v): return scipy.sin(v) + M"}, "uses M, scipy, which generated modules do not have"),
    ({"python_source": "def identity(v):\n    global M\n    M = 1\n    return v"}, "uses global M, which"),
    ({"python_source": "def identity(v: Wind) -> float: return v"}, "uses Wind, which"),
    ({"python_source": "@fast\ndef identity(v): return v"}, "uses fast, which"),
    ({"derivative": 3}, "f: derivative is 3; pass another sd.External, or None"),
    ({"derivative": PAIR}, r"f takes 1 argument, its derivative pair\(x, k\) 2; both take the same"),
    ({"derivative": HEIGHT, "results": 2},
     r"f: its derivative height\(s\) gives 1 result; it must give 2: of each of 2 the derivatives by v"),
])
def test_faults(changes: dict[str, Any], message: str | None) -> None:
    if message is None:
        assert sd.External("f", ["v"], python=identity, **changes)
    else:
        assert re.search(message, "\n".join(faulty(**changes)))


def test_all_faults_are_reported_at_once() -> None:
    assert len(faulty(name="2f", results=0, reason="\n", c="x", python=None)) == 4


def test_what_a_function_takes_from_outside_is_reported() -> None:
    captured = 3

    def closed(v):
        return captured * v

    def from_module(v):
        return np.interp(v, TABLE, TABLE) + sum(w for w in v) + len(v)

    def sound(v):
        import math

        return np.array([helped(w) for w in v]) * math.pi if len(v) else v

    def helped(v):
        return v

    assert re.search("closed uses captured, which generated modules do not have", faulty(python=closed)[0])
    assert re.search("from_module uses TABLE, which", faulty(python=from_module)[0])
    assert re.search("sound uses helped, which", faulty(python=sound)[0])


def test_another_np_is_reported() -> None:
    scope = {"np": sp, "__name__": "elsewhere"}
    elsewhere = type(sines)(sines.__code__, scope, "sines")
    assert re.search("sines uses np, which is <module 'sympy'.*> there, and NumPy in generated modules",
                     faulty(python=elsewhere)[0])


def sines(v):
    return np.sin(v)


def test_calls_are_looked_at() -> None:
    for call, message in (
            (lambda: HEIGHT(), r"height\(s\) was called with 0 arguments"),
            (lambda: PAIR(X), r"pair\(x, k\) was called with 1 argument$"),
            (lambda: HEIGHT("q"), "height: argument s is the text 'q'"), (lambda: HEIGHT(np.nan), "height: argument s is nan"),
            (lambda: PAIR(sp.I, [1]), "pair: argument x is I, a complex number")):
        with pytest.raises(ModelError, match=message):
            call()
    with pytest.raises(ModelError, match=r"uses g\(x\), which has no value; .* or a function of your own, sd.External"):
        as_expression(sp.Function("g")(X), "a force")


def run(code: str, folder: Path) -> str:
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_function_without_a_file_needs_its_text() -> None:
    nowhere = type(identity)(identity.__code__.replace(co_filename="<stdin>"), {"__name__": "__main__"}, "identity")
    assert faulty(python=nowhere) == (
        "f: the Python function identity: its text cannot be read, as it is in no file; pass it as python_source=",)
    text = "def identity(v):\n    return 1 * v\n"
    assert sd.External("f", ["v"], python=nowhere, python_source=text).function.text("numpy") == text.strip()
