"""Motions at more digits: the program of a tape, the method, what is stored."""

from __future__ import annotations

import json

import mpmath
import numpy as np
import pytest

import symdyn as sd
from symdyn.bench.work.converged import distance
from symdyn.cli import main
from symdyn.lab import extended
from symdyn.lab.extended import known
from symdyn.lab.loop_cases import REFERENCE
from symdyn.precision.extrapolation import NotFinite, integrate
from symdyn.precision.motion import Precise, agreement, motion
from symdyn.runtime.building.compiler import find_compiler
from symdyn.tape.evaluate import evaluate


@pytest.fixture
def context():
    made = mpmath.mp.clone()
    made.dps = 40
    return made


def relative(a, b):
    return max(abs(e - f) for e, f in zip(a, b, strict=True)) / max(abs(f) for f in b)


@pytest.mark.parametrize("name", ["andrews_squeezer", "bricard", "double_wishbone"])
def test_a_program_gives_what_the_tape_gives(name):
    equations = sd.systems.get(name).equations()
    precise = Precise(equations, 30)
    values = {**precise.fixed, **dict(zip(precise.leaves, [precise.context.mpf(0), *precise.start], strict=True))}
    for quantity in ("rhs", "lam", "M_tilde"):
        expected = evaluate(equations.tape(quantity), values, 30)[quantity].ravel()
        assert relative(precise(quantity, precise.context.mpf(0), precise.start),
                        expected) <= 1e-26


def test_the_method_reaches_its_tolerance(context):
    """An oscillator over several periods."""
    for digits in (15, 28):
        run = integrate(lambda t, x: [x[1], -x[0]], (context.mpf(0), context.mpf(20)), [context.mpf(0), context.mpf(1)],
                        context.mpf(10)**-digits, [slice(0, 1), slice(1, 2)], context)
        assert relative(run.x, [context.sin(20), context.cos(20)]) <= 100 * context.mpf(10)**-digits
        assert run.n_evaluations < 6000


def test_kinks_are_located_to_all_digits(context):
    """A ball falls from 1 m onto a spring, k = 900 1/s^2, and leaves it as fast as it came: twice, in closed form."""
    g, w = context.mpf(10), context.mpf(30)
    fall, speed = context.sqrt(2 / g), context.sqrt(2 * g)
    below = 2 * (context.pi / 2 + context.atan(g / (w * speed))) / w
    end = 3 * fall + below + below / 3
    run = integrate(lambda t, x: [x[1], -g - w**2 * min(x[0], 0)], (context.mpf(0), end), [context.mpf(1), context.mpf(0)],
                    context.mpf(10)**-28, [slice(0, 1), slice(1, 2)], context, sides=lambda t, x: [x[0] > 0])
    phase = w * below / 3
    assert relative(run.kinks, [fall, fall + below, 3 * fall + below]) <= 1e-25
    expected = [-g / w**2 * (1 - context.cos(phase)) - speed / w * context.sin(phase),
                -g / w * context.sin(phase) - speed * context.cos(phase)]
    assert relative(run.x, expected) <= 1e-25
    with pytest.raises(ArithmeticError, match="step size vanishes"):  # it is driven back onto the kink from both sides
        integrate(lambda t, x: [-1 if x[0] > 0 else 1], (context.mpf(0), context.mpf(1)), [context.mpf(1) / 3],
                  context.mpf(10)**-12, [slice(0, 1)], context, sides=lambda t, x: [x[0] > 0])


def test_steps_at_whose_end_nothing_is_finite_are_made_smaller(context):
    """A stiff spring, over which a long step of the midpoint rule has no finite number; in closed form cos."""
    def field(t, x):
        if abs(x[0]) > 10:
            raise NotFinite("too large")
        return [x[1], -10**12 * x[0]]

    run = integrate(field, (context.mpf(0), context.mpf("1e-4")), [context.mpf(1), context.mpf(0)], context.mpf(10)**-14,
                    [slice(0, 1), slice(1, 2)], context)
    assert abs(run.x[0] - context.cos(100)) <= 1e-10 and run.n_rejected > 0


def test_what_is_not_a_number_is_no_agreement(context):
    """Two results that are not finite do not differ by zero."""
    with pytest.raises(ArithmeticError, match=r"x_dot is not finite at t = 0\.5"):
        integrate(lambda t, x: [1 if x[0] < 0.5 else context.nan], (context.mpf(0), context.mpf(1)), [context.mpf(0)],
                  context.mpf(10)**-12, [slice(0, 1)], context)
    assert distance([[context.nan]], [[context.nan]], 1, 0) == float("inf")
    assert distance([[context.mpf(3)]], [[context.mpf(2)]], 1, 0) == 0.5


def test_the_method_reports_where_it_cannot_go_on(context):
    with pytest.raises(ArithmeticError, match="step size vanishes"):
        integrate(lambda t, x: [x[0]**2], (context.mpf(0), context.mpf(2)), [context.mpf(1)], context.mpf(10)**-12,
                  [slice(0, 1)], context)


def test_pendulum_to_25_digits(context):
    """In x and y, held by a constraint: sin(phi / 2) = -k cd(w t), k^2 = 1/2."""
    found = motion(sd.systems.pendulum_absolute().equations(), 0.7, 26)
    angle = context.sqrt(context.mpf("9.81")) * context.mpf("0.7")
    half = -context.sqrt(0.5) * context.ellipfun("cn", angle, m=0.5) / context.ellipfun("dn", angle, m=0.5)
    x, y = 2 * half * context.sqrt(1 - half**2), 2 * half**2 - 1
    assert relative(found.q, [x, y]) <= 1e-25
    assert abs(found.q[0]**2 + found.q[1]**2 - 1) <= 1e-34
    # The rod's force is 2 l lam = m (v^2 / l - g y / l).
    assert abs(2 * found.lam[0] - (found.u[0]**2 + found.u[1]**2 - context.mpf("9.81") * y)) <= 1e-24


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")
def test_andrews_as_the_compiled_module():
    equations = sd.systems.andrews_squeezer().equations()
    coarse, fine = (motion(equations, 0.001, digits) for digits in (12, 14))
    assert agreement(coarse, fine) <= 1e-10
    sol = equations.compile().simulate((0, 0.001), rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(sol.q[-1], np.array(fine.q, dtype=float), rtol=0, atol=1e-12)
    np.testing.assert_allclose(sol.u[-1], np.array(fine.u, dtype=float), rtol=0, atol=1e-9)


def test_positions_of_lost_rank_are_left_to_the_other_equations():
    """Windows that lie flat: pivots and whole rows vanish there, accelerations stay as large as nearby."""
    precise = Precise(sd.systems.n_four_bar().equations(), 30)
    context = precise.context
    expected = context.mpf("9.81") * 3.5 / 3  # theta_ddot of the parallelograms with n = 2, times sin(theta)
    for away, allowed in (("0.01", 1e-20), ("0", 1.0)):  # where rank is lost, two constraints hold what four did
        angle = context.pi / 2 + context.mpf(away)
        rates = precise("rhs", context.mpf(0), [*[angle] * 3, *[-angle] * 2, *[context.mpf(1)] * 3, *[context.mpf(-1)] * 2])
        assert all(abs(rate - expected * context.sin(angle)) <= allowed for rate in rates[5:8])


@pytest.mark.parametrize("name", ["andrews_squeezer", "car_axis"])
def test_stored_motions(name):
    """At least 20 digits in which two runs agree; the published ones are near."""
    stored, published = known(name), REFERENCE[name]
    assert stored["digits"] >= 20 and stored["runs_differ_by"] <= 10.0**-stored["digits"]
    assert stored["t"] == published["t"]
    np.testing.assert_allclose(np.array(stored["q"], dtype=float), published["q"], rtol=1e-9)
    np.testing.assert_allclose(np.array(stored["q_dot"], dtype=float), published["q_dot"], rtol=1e-7)
    assert all(len(text.lstrip("-0.").replace(".", "").partition("e")[0]) >= stored["digits"] for text in stored["q"])


def test_the_command_stores_what_it_makes(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(extended, "STORE", tmp_path / "extended.json")
    assert main(["bench", "extended", "pendulum_absolute", "--t", "0.2", "--digits", "15"]) == 0
    made = json.loads(extended.STORE.read_text())["pendulum_absolute"]
    assert made["t"] == 0.2 and made["tolerances"] == ["1e-15", "1e-19"] and 12 <= made["digits"] <= 15
    assert made["runs_differ_by"] <= 10.0**-made["digits"]
    assert f"{made['digits']} digits" in capsys.readouterr().out
    assert main(["bench", "extended", "skate", "--t", "0.1", "--digits", "12", "--print"]) == 0
    assert list(extended.stored()) == ["pendulum_absolute"]
