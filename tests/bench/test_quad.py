"""Tapes in C with numbers of 113 binary digits, compared with mpmath."""

from __future__ import annotations

import json
import random
from fractions import Fraction
from functools import partial

import mpmath
import numpy as np
import pytest
from mpmath import libmp

import symdyn as sd
from symdyn.bench import kept
from symdyn.bench.work import store
from symdyn.bench.work.cases import named_case
from symdyn.bench.work.converged import converged, distance
from symdyn.cli import main
from symdyn.errors import ArgumentError, EvaluationError
from symdyn.precision import program as precise
from symdyn.precision import quad
from symdyn.precision.extrapolation import midpoint
from symdyn.precision.motion import Precise, agreement, motion, record
from symdyn.tape.node import COORDINATE, PARAMETER
from symdyn.tape.ops import OPERATIONS
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import Tape

needs_quad = pytest.mark.skipif(quad.compiler() is None, reason="no gcc with libquadmath here")
ROUNDING = 2.0**-112


@pytest.fixture
def context():
    made = mpmath.mp.clone()
    made.prec = quad.BITS
    return made


def relative(a, b):
    return float(max(abs(e - f) for e, f in zip(a, b, strict=True)) / max(abs(f) for f in b))


def test_numbers_there_and_back(context):
    chance = random.Random(3)
    values = [chance.choice((-1, 1)) * context.mpf(chance.getrandbits(113)) * context.mpf(2)**chance.randint(-9000, 9000)
              for _ in range(200)]
    numbers = [v._mpf_ for v in (*values, context.mpf(0), context.mpf(1), context.mpf(-0.1))]
    assert quad.from_bytes(quad.to_bytes(numbers)) == numbers
    longer = libmp.from_int((1 << 150) + 1)
    assert quad.from_bytes(quad.to_bytes([longer])) == [libmp.from_int(1 << 150)]
    assert quad.from_bytes(quad.to_bytes([libmp.from_man_exp(1, -16500)])) == [libmp.fzero]  # too small
    for value in (libmp.finf, libmp.fnan, libmp.from_man_exp(1, 16384)):
        with pytest.raises(EvaluationError, match="is no finite number of 128 bits"):
            quad.to_bytes([value])
    with pytest.raises(EvaluationError, match="give what is no finite number"):
        quad.from_bytes(((2**15 - 1) << 112).to_bytes(16, "little"))
    with pytest.raises(EvaluationError, match="is no finite number"):
        quad.literal(libmp.fnan)


@needs_quad
def test_every_operation(context):
    r = Recorder()
    x, y, a = r.leaf("x", COORDINATE), r.leaf("y", COORDINATE), r.leaf("a", PARAMETER)
    unary = ("sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "asinh", "atanh", "exp", "log", "abs",
             "sign", "floor", "ceil", "erf")
    binary = ("add", "sub", "mul", "div", "pow", "atan2", "min", "max")
    compared = [r.apply(op, x, y) for op in ("lt", "le", "gt", "ge", "eq", "ne")]
    truths = [*compared, r.apply("and", *compared[:2]), r.apply("or", *compared[1:3]), r.apply("not", compared[0])]
    entries = [*[r.apply(op, x) for op in unary], r.apply("acosh", x + 1), *[r.apply(op, x, y) for op in binary], -x, r.pi() * x,
               *[r.apply("select", t, x, a) for t in truths], x * Fraction(1, 3), a * Fraction(7, 10), r.apply("guard", x, y)]
    tape = Tape.of(r, out=entries)
    assert {n.op for n in tape.steps} >= set(OPERATIONS) - {"call", "item"}
    fixed = {"a": context.mpf("0.3")}
    ours, theirs = (module.program(tape, context, fixed, ["x", "y"]) for module in (quad, precise))
    for state in ((context.mpf("0.7"), context.mpf("0.2")), (context.mpf("0.1"), context.mpf("0.9"))):
        for found, expected in zip(ours(state), theirs(state), strict=True):
            assert abs(found - expected) <= 4 * ROUNDING * abs(expected)
    with pytest.raises(precise.Lost):
        ours((context.mpf(1), context.mpf(0)))
    with pytest.raises(KeyError, match="no value for a"):
        quad.program(tape, context, {}, ["x", "y"])


@needs_quad
def test_turbine_as_with_mpmath():
    """Water and mooring are numeric algorithms, in several of their cases."""
    equations = sd.systems.floating_wind_turbine().embedding()
    ours, theirs = Precise(equations, 0, compiled=True), Precise(equations, quad.DIGITS)
    for shift in ((0,) * 8, (3, -2, 0.5, 0.1, 0.25, 0.2, 0.1, 0.4), (-4, 1, -4.5, 0, -0.6, 0.1, 0, 0)):
        x = [ours.context.mpf(v) for v in (*shift, *[0.1 * (k + 1) for k in range(8)])]
        assert relative(ours("rhs", ours.context.mpf(0), x), theirs("rhs", ours.context.mpf(0), x)) < 1e-29


@needs_quad
def test_midpoint_rule_is_that_of_the_field():
    precise = Precise(sd.systems.double_pendulum().embedding(), 0, compiled=True)
    number = precise.context.mpf
    t, h, x = number(0), number("0.1"), [number(v) for v in ("0.3", "-0.2", "1.5", "0.7")]
    begin = precise("rhs", t, x)
    expected = midpoint(lambda t, x: precise("rhs", t, x), t, x, begin, h, 6)
    assert relative(precise.rule()(t, x, begin, h, 6), expected) <= 8 * ROUNDING


@needs_quad
def test_midpoint_rule_has_the_bits_of_that_in_python(context):
    """x_dot = v, v_dot = t v - x/(x + 1) where x + 1 > 0, at 2,000 states, some of which it leaves."""
    r = Recorder()
    t, x, v = (r.leaf(name, COORDINATE) for name in "txv")
    apart = x + 1
    tape = Tape.of(r, rhs=np.array([v, t * v - r.apply("guard", x / apart, apart)], dtype=object))
    ours, theirs = (module.program(tape, context, {}, ["t", "x", "v"]) for module in (quad, precise))
    stream, lost = np.random.default_rng(5), 0
    for k, row in enumerate((stream.normal(size=(2_000, 4)) * [1, 2, 1, 0.3]).tolist()):
        t0, h, state = context.mpf(row[0]) / 3, context.mpf(row[3]) / 7, [context.mpf(v) / 3 for v in row[1:3]]
        if k % 50 == 0:
            state[0] = context.mpf(-1)
        field = partial(_field, theirs)
        arguments = t0, state, [context.mpf(v) / 7 for v in row[1:3]], h, 1 + k % 4
        try:
            expected = midpoint(field, *arguments)
        except (precise.Lost, ZeroDivisionError):
            lost += 1
            with pytest.raises((precise.Lost, EvaluationError)):
                ours.midpoint(*arguments)
            continue
        assert ours.midpoint(*arguments) == expected
    assert 20 < lost < 1000


def _field(rhs, t, x):
    return rhs([t, *x])


@needs_quad
def test_motions_are_those_of_mpmath():
    equations = sd.systems.andrews_squeezer().equations()
    compiled, usual = (motion(equations, 0.001, 18, how) for how in (True, False))
    assert agreement(compiled, usual) < 1e-16 and compiled.n_steps == usual.n_steps
    assert "in C with numbers of 113 binary digits" in record(equations, 0.001, 12)["source"]


@needs_quad
def test_references_are_those_of_mpmath(monkeypatch):
    first = named_case("double_pendulum").first()
    reference, compiled = converged(first, [0.4, 0.8], 18)
    monkeypatch.setattr(quad, "suits", lambda digits: False)
    _, usual = converged(first, [0.4, 0.8], 18)
    numbers = [[[mpmath.mpf(v) for v in row] for row in text] for text in (compiled, usual)]
    assert "in C with" in reference.how and reference.digits > 16 and distance(*numbers, 2, 2) < 1e-16


@needs_quad
def test_what_there_is_no_c_of_and_what_needs_more_digits_is_left_to_mpmath():
    """Windows that lie flat need a numeric algorithm; near there the usual equations have lost their digits."""
    equations = sd.systems.n_four_bar().equations()
    ours, theirs = Precise(equations, 0, compiled=True), Precise(equations, quad.DIGITS)
    angle = ours.context.pi / 2
    x = [*[angle] * 3, *[-angle] * 2, *[ours.context.mpf(1)] * 3, *[ours.context.mpf(-1)] * 2]
    assert relative(ours("rhs", ours.context.mpf(0), x), theirs("rhs", ours.context.mpf(0), x)) < 1e-12
    with pytest.raises(quad.NotInQuad, match="symdyn_saddle has no text"):
        quad.program(equations.singular_fallback.tape("rhs"), ours.context, ours.fixed, ours.leaves)

    def run(digits, compiled):
        if compiled:
            raise quad.TooRough("too rough")
        return digits

    assert quad.twice(run, 20, 4) == (20, 24, False)
    with pytest.raises(ZeroDivisionError):
        quad.twice(lambda digits, compiled: digits / 0, 20, 4)
    assert quad.twice(lambda digits, compiled: digits, 20, 4) == (20, 24, True)
    assert quad.twice(lambda digits, compiled: digits, 26, 4) == (26, 30, False)


def test_without_gcc(monkeypatch, context):
    monkeypatch.setenv("SYMDYN_CC", "none")
    assert quad.compiler() is None and not quad.suits(1)
    r = Recorder()
    with pytest.raises(quad.NotInQuad, match="no gcc with libquadmath"):
        quad.program(Tape.of(r, out=[r.leaf("x", COORDINATE)]), context, {}, ["x"])


def test_stored_motion_of_the_turbine():
    """It is that of the mechanism as it is, with the digits shown, and a tight run is near, also in the yaw of 1e-10 rad."""
    about = named_case("floating_wind_turbine")
    first = about.first()
    data = store.stored()[about.name]
    found = store.find(about.name, first, data["times"])
    assert found is not None and found.digits >= 15 and found.times[-1] == about.end and "differ by" in found.how
    x = first.module.simulate(np.r_[0.0, found.times], rtol=1e-13, atol=1e-17).x[1:]
    assert distance(x.tolist(), found.x, 8, 8) < 1e-13


def test_files_are_written_whole_or_not_at_all(tmp_path, monkeypatch):
    path = tmp_path / "deep" / "references.json"
    kept.put(path, "b", {"x": [1, 2]})
    kept.put(path, "a", {"x": [[1, 2], [3, 4]]})
    before = path.read_text()
    assert list(json.loads(before)) == ["a", "b"] and "[3, 4]" in before

    def full(*given):
        raise OSError(28, "no space left")

    monkeypatch.setattr("symdyn.runtime.building.stored.os.replace", full)
    with pytest.raises(OSError, match="no space left"):
        kept.put(path, "c", {})
    assert path.read_text() == before and [p.name for p in path.parent.iterdir()] == ["references.json"]


def test_files_that_cannot_be_written_are_reported_before_anything_runs(tmp_path):
    other = tmp_path / "other.json"
    other.write_text("[1]")
    with pytest.raises(ArgumentError, match=r"other.json holds something else, .* --store FILE"):
        kept.writable(other, tmp_path / "own.json")
    with pytest.raises(ArgumentError, match=r"cannot be written: it is a folder; pass another with --store FILE"):
        kept.writable(tmp_path, tmp_path / "own.json")
    with pytest.raises(ArgumentError, match=r"the package's file of references .* cannot be written: .*--store FILE"):
        kept.writable(None, other / "own.json")
    assert kept.writable(None, tmp_path / "own.json") == tmp_path / "own.json"


@pytest.mark.parametrize("arguments", [["references", "pendulum", "--digits", "6"],
                                       ["extended", "pendulum_absolute", "--t", "0.1", "--digits", "10"]])
def test_commands_store_into_the_file_requested(arguments, tmp_path, capsys):
    own = (store.STORE.read_bytes(), kept.read(store.STORE))
    path = tmp_path / "mine.json"
    kept.put(path, "another", {"x": [1]})
    assert main(["bench", *arguments, "--store", str(path)]) == 0
    assert set(kept.read(path)) == {"another", arguments[1]} and store.STORE.read_bytes() == own[0]
    path.write_text("nothing of the kind")
    assert main(["bench", *arguments, "--store", str(path)]) != 0
    assert "holds something else" in capsys.readouterr().err and path.read_text() == "nothing of the kind"
