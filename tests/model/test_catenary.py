"""The line at rest: against integration along the line, published equations, differences at high precision; in generated code."""

from __future__ import annotations

import functools
import math
from itertools import pairwise
from typing import Any

import mpmath
import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from symdyn.errors import EvaluationError
from symdyn.exact.prove import zero
from symdyn.model.elements.catenary import Catenary, potential
from symdyn.tape import Recorder, Tape
from symdyn.tape.differentiate import forward
from symdyn.tape.evaluate import evaluate
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.node import INPUT
from symdyn.tape.passes import substitute
from symdyn.tape.tape import reachable
from tests.model.generated_evaluator import evaluator_of

NAMES = ("x", "z", "e", "c")
# x, z, e, C_B. Part of the line lies, with friction or without; none lies; slack; far too short; nearly flat.
OVER_SEABED = {"lying": (0.83, 0.308, 1e-3, 0.0), "rough": (0.83, 0.308, 1e-3, 1.0), "dead end": (0.72, 0.308, 2e-3, 3.0),
               "lifted": (0.75, 0.62, 1e-2, 0.5), "slack": (0.3, 0.308, 1e-3, 1.0), "stretched": (0.83, 0.9, 1e-3, 0.0),
               "flat": (1.01, 1e-3, 1e-3, 0.2), "soft": (0.99, 0.05, 2.0, 0.0)}
FREE = {"sagging": (0.5, 0.2, 1e-2, 0.0), "deep": (0.01, 0.3, 1e-3, 0.0), "anchor above": (0.6, -0.5, 1e-3, 0.0),
        "steep": (0.1, 1.2, 1e-2, 0.0), "level": (0.8, 0.0, 0.1, 0.0)}
ALL = [(1, name, case) for name, case in OVER_SEABED.items()] + [(0, name, case) for name, case in FREE.items()]
every = pytest.mark.parametrize(("seabed", "name", "case"), ALL, ids=[f"{name}" for _, name, _ in ALL])


def solved(seabed: int, case: Any) -> np.ndarray:
    """h, v in floats."""
    return Catenary((seabed,), "no shape").rows(case)


@functools.cache
def taped(seabed: int) -> Tape:
    """h, v, their first and second derivatives by the four values, and the potential with its gradient by x and z."""
    recorder = Recorder()
    leaves = [recorder.leaf(name, INPUT) for name in NAMES]
    results = recorder.call(Catenary((seabed,), "no shape"), leaves)
    first = [forward(recorder, results, {leaf: 1}) for leaf in leaves]
    second = [[forward(recorder, row, {leaf: 1}) for row in first] for leaf in leaves]
    energy = potential(recorder, bool(seabed), results, leaves)
    gradient = [forward(recorder, [energy], {leaf: 1})[0] for leaf in leaves[:2]]
    return Tape.of(recorder, force=np.array(results, dtype=object), first=np.array(first, dtype=object),
                   second=np.array(second, dtype=object), energy=energy, gradient=np.array(gradient, dtype=object))


def precisely(seabed: int, case: Any, digits: int = 40) -> dict[str, np.ndarray]:
    return evaluate(taped(seabed), dict(zip(NAMES, case, strict=True)), digits)


# -- the force

def tension(s: float, seabed: int, h: float, v: float, c: float) -> tuple[float, float]:
    """Horizontal and vertical force in the line at s of its length from the anchor, over its weight."""
    rise = v - (1 - s)
    if seabed and rise < 0:
        return max(h + c * rise, 0.0), 0.0  # rise: minus the weight between here and where it leaves the seabed
    return h, rise


def kinks(seabed: int, h: float, v: float, c: float) -> list[float]:
    """Where the line leaves the seabed, and where friction has used up the tension."""
    touch = 1 - v if seabed else 0.0
    return [s for s in (touch, touch - h / c if c else 0.0) if 0 < s < 1]


def along(seabed: int, case: Any, h: float, v: float) -> tuple[float, float]:
    """Place of the fairlead over the anchor, by integration along the line."""
    _, _, e, c = case

    def slope(s: float, _: np.ndarray) -> list[float]:
        across, up = tension(s, seabed, h, v, c)
        total = math.hypot(across, up)
        if seabed and up == 0:
            return [1 + e * total, 0.0]
        return [(1 / total + e) * across, (1 / total + e) * up]

    ends = sorted({0.0, *kinks(seabed, h, v, c), 1.0})
    place = np.zeros(2)
    for start, end in pairwise(ends):
        inside = np.nextafter(start, 1), np.nextafter(end, 0)
        place = solve_ivp(slope, inside, place, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    return float(place[0]), float(place[1])


@every
def test_the_integrated_line_ends_at_the_fairlead(seabed: int, name: str, case: tuple) -> None:
    h, v = solved(seabed, case)
    if name == "slack":
        assert h == 0 and v < case[1]
        assert v + case[2] * v**2 / 2 == pytest.approx(case[1], rel=1e-14)  # what hangs, stretched by its own weight
        return
    assert along(seabed, case, h, v) == pytest.approx(case[:2], abs=2e-10)


def published(h: np.ndarray, v: np.ndarray, e: np.ndarray, c: np.ndarray, seabed: int) -> tuple[np.ndarray, np.ndarray]:
    """x and z as Jonkman writes them, case by case."""
    rests = seabed * (v < 1)
    a, b = np.arcsinh(v / h), np.arcsinh((v - 1) / h)
    free = h * (a - b) + h * e, h * (np.cosh(a) - np.cosh(b)) + e * (v - 0.5)
    lies = 1 - v
    left = lies - h / c
    contact = (lies + h * a + h * e + c * e / 2 * (-lies**2 + left * np.maximum(left, 0)),
               h * (np.cosh(a) - 1) + e * v**2 / 2)
    return np.where(rests, contact[0], free[0]), np.where(rests, contact[1], free[1])


def places(n: int, seabed: int) -> np.ndarray:
    """Fairleads anywhere in a circle of 1.3 lengths, some of them about as far as the line is long, and any line; (4, n)."""
    rng = np.random.default_rng(5 + seabed)
    r = np.where(rng.random(n) < 0.3, 1 + rng.normal(size=n) * 10 ** rng.uniform(-6, -1, n), rng.uniform(0.02, 1.3, n))
    angle = rng.uniform(0.001 if seabed else -np.pi / 2, np.pi / 2, n)
    return np.array([r * np.cos(angle), r * np.sin(angle), 10 ** rng.uniform(-9, 1, n), 10 ** rng.uniform(-2, 1, n)])


@pytest.mark.parametrize("seabed", [1, 0])
def test_a_force_is_found_wherever_the_ends_are(seabed: int) -> None:
    """2,000 lines; the equations are met, with an allowance for the rounding of large forces of stiff lines."""
    given = places(2000, seabed)
    h, v = solved(seabed, given).T
    assert np.all(np.isfinite(h)) and np.all(np.isfinite(v))
    slack = h == 0
    assert bool(seabed) == bool(slack.any())
    x, z, e, c = given[:, ~slack]
    h, v = h[~slack], v[~slack]
    x_found, z_found = published(h, v, e, c, seabed)
    allowed = 1e-14 * (1 + h + abs(v))
    assert np.all(abs(x_found - x) < 40 * allowed) and np.all(abs(z_found - z) < 40 * allowed)
    if seabed:
        x, z, e, _ = given[:, slack]
        hanging = (np.sqrt(1 + 2 * e * z) - 1) / e
        assert np.all(x <= 1 - hanging + 1e-6)


def test_the_force_comes_in_steadily_where_a_slack_line_begins_to_pull() -> None:
    _, z, e, c = OVER_SEABED["slack"]
    hanging = solved(1, OVER_SEABED["slack"])[1]
    edge = 1 - hanging
    pulls = np.array([solved(1, (edge + d, z, e, c))[0] for d in (-1e-6, 1e-12, 1e-9, 1e-6, 1e-3)])
    assert pulls[0] == 0 and np.all(np.diff(pulls) > 0)
    assert np.all(pulls[1:] < [1e-12, 1e-9, 1e-6, 1e-3])  # the stiffness is less than the weight of the line over its length


# -- derivatives and energy

@every
def test_derivatives_are_those_of_differences(seabed: int, name: str, case: tuple) -> None:
    """First and second ones, by all values, at 40 digits."""
    found, step = precisely(seabed, case), mpmath.mpf(10) ** -14
    with mpmath.workdps(50):
        exact = [mpmath.mpf(value) for value in case]
        for k in range(4):
            if exact[k] == 0 and k == 3:
                continue  # friction is not below zero
            sides = [precisely(seabed, [*exact[:k], exact[k] + sign * step, *exact[k + 1:]]) for sign in (1, -1)]
            for quantity, derivative in (("force", found["first"][k]), ("first", found["second"][k])):
                wanted = (sides[0][quantity] - sides[1][quantity]) / (2 * step)
                scale = 1 + max(abs(value) for value in wanted.ravel())
                assert max(abs(value) for value in (wanted - derivative).ravel()) < mpmath.mpf(10) ** -14 * scale


@every
def test_a_line_without_friction_has_a_potential(seabed: int, name: str, case: tuple) -> None:
    """Its gradient is the force, and the stiffness is symmetric; the energy is what integration along the line gives."""
    x, z, e, _ = case
    found = precisely(seabed, (x, z, e, 0.0))
    assert max(abs(found["gradient"] - found["force"])) < mpmath.mpf(10) ** -30 * (1 + max(abs(found["force"])))
    first = found["first"]
    assert abs(first[0, 1] - first[1, 0]) < mpmath.mpf(10) ** -30 * (1 + abs(first[0, 0]))
    h, v = map(float, found["force"])
    touch = 1 - v if seabed and v < 1 else 0.0

    def height(s: float) -> float:
        """Height of the line over the anchor, by the closed form for the part below."""
        low, rise = max(v - 1, 0.0) if seabed else v - 1, v - (1 - s)
        return math.hypot(h, rise) - math.hypot(h, low) + e * (rise**2 - low**2) / 2 if s > touch else 0.0

    def density(s: float) -> float:
        across, up = tension(s, seabed, h, v, 0.0)
        return height(s) + e * (across**2 + up**2) / 2

    points = sorted({0.0, touch, 1.0})
    energy = sum(quad(density, a, b, epsabs=1e-12, epsrel=1e-11)[0] for a, b in pairwise(points))
    assert float(found["energy"]) == pytest.approx(energy, rel=1e-9, abs=1e-11)


@pytest.mark.parametrize("shape", ["free", "lifted", "lying", "slack"])
def test_the_line_makes_the_potential_stationary(shape: str) -> None:
    """By exact algebra, for any h, v, x, z and e: its derivatives by h and v are what x and z are off the line's shape."""
    r = Recorder()
    h, v, x, z, e = (r.leaf(name, INPUT) for name in "hvxze")
    U = potential(r, shape != "free", (h, v), (x, z, e, 0))
    slopes = r.slopes[U]
    lying, hanging = {"free": (0, v - 1), "lifted": (0, v - 1), "lying": (1 - v, 0), "slack": (1 - v, 0)}[shape]
    entries: tuple = (U, *(slope for slope, _ in slopes))
    entries = substitute(entries, {r.apply("max", 1 - v, 0): lying, r.apply("max", v - 1, 0): hanging}, r)
    taut = r.apply("gt", h, 0)
    entries = substitute(entries, {r.apply("select", taut, h, 1): h}, r)
    branch = {node: node.args[2 if shape == "slack" else 1] for node in reachable(entries) if node.op == "select"}
    entries = substitute(entries, branch, r)
    U, *given = entries
    assert not [node for node in reachable(entries) if node.op in ("select", "max")]
    along = [lying + h * (r.apply("asinh", v / h) - r.apply("asinh", hanging / h)) + e * h,
             r.sqrt(h * h + v * v) - r.sqrt(h * h + hanging * hanging) + e * (v * v - hanging * hanging) / 2]
    if shape == "slack":  # what hangs is straight, and the rest lies anywhere
        along = [x, v + e * v * v / 2]
    off = [forward(r, [U], {force: 1})[0] for force in (h, v)]
    assert zero(r, list(zip(off, [x - along[0], z - along[1]])), 1000, positive=[h])
    by_place = [forward(r, [U], {leaf: 1})[0] for leaf in (x, z, e)]
    if shape == "slack":
        by_place[0], given[0] = 0, 0  # h is zero
    assert zero(r, list(zip(by_place, given)), 1000, positive=[h])


def test_friction_takes_the_potential_away() -> None:
    first = precisely(1, OVER_SEABED["rough"])["first"]
    assert abs(first[0, 1] - first[1, 0]) > 1e-4 * abs(first[0, 1])


# -- generated code

@functools.cache
def unit(backend: str) -> Any:
    """A module of forces, first and second derivatives of a line over a seabed and of one without, in this order."""
    recorder = Recorder()
    names, outputs = [], []
    for seabed in (1, 0):
        leaves = [recorder.leaf(f"{name}{seabed}", INPUT) for name in NAMES]
        names += [leaf.args[1] for leaf in leaves]
        results = recorder.call(Catenary((seabed,), "no shape at rest"), leaves)
        first = [d for leaf in leaves for d in forward(recorder, results, {leaf: 1})]
        outputs += [*results, *first, *(d for leaf in leaves for d in forward(recorder, first, {leaf: 1}))]
    tape = Tape.of(recorder, solve=np.array(outputs, dtype=object))
    return evaluator_of(tape, names, backend)


@pytest.mark.parametrize("backend", ["numpy", "c"])
def test_generated_code_agrees_with_40_digits(backend: str) -> None:
    pairs = [(over, list(FREE.values())[k % len(FREE)]) for k, over in enumerate(OVER_SEABED.values())]
    many = unit(backend).many(np.zeros(1), np.zeros((1, 0)), np.array([[*a, *b] for a, b in pairs]), np.zeros((1, 0)))
    for row, (over, free) in zip(np.asarray(many), pairs, strict=True):
        one = np.array(unit(backend).one(0.0, np.zeros(0), np.array([*over, *free])))
        if backend == "c":  # NumPy's functions of arrays need not round as those of numbers
            np.testing.assert_array_equal(row, one)
        for result in (row, one):
            for part, (seabed, case) in zip(np.split(result, 2), ((1, over), (0, free)), strict=True):
                found = precisely(seabed, case)
                for values, name in zip(np.split(part, [2, 10]), ("force", "first", "second"), strict=True):
                    wanted = found[name].ravel().astype(float)
                    # a stretched line loses digits: its stiffness 1 / e to the one across
                    np.testing.assert_allclose(values, wanted, rtol=0, atol=1e-11 * max(1, abs(wanted).max()))


FAILS = {"straight above": (0, (0.0, 0.5, 1e-3, 0.0)), "on the seabed": (1, (0.9, 0.0, 1e-3, 0.0)),
         "below the seabed": (1, (0.9, -0.1, 1e-3, 0.0)), "negative stiffness": (1, (0.9, 0.3, -1e-3, 0.0)),
         "negative friction": (1, (0.9, 0.3, 1e-3, -1.0)), "not a number": (0, (math.nan, 0.3, 1e-3, 0.0)),
         "too far": (0, (1e101, 0.3, 1e-3, 0.0)), "straight above the seabed": (1, (0.0, 1.5, 1e-3, 0.0))}


@pytest.mark.parametrize("name", FAILS)
def test_what_has_no_shape_is_rejected(name: str) -> None:
    """By NaN where a tape is evaluated, by a code in generated code, while recording for numbers."""
    seabed, case = FAILS[name]
    assert np.all(np.isnan(solved(seabed, case)))
    assert all(mpmath.isnan(value) for value in precisely(seabed, case, 20)["force"])
    values = [*case, *FREE["level"]] if seabed else [*OVER_SEABED["lying"], *case]
    for backend in ("numpy", "c"):
        with pytest.raises(EvaluationError, match="no shape at rest"):
            unit(backend).one(0.0, np.zeros(0), np.array(values))
    if not any(math.isnan(value) for value in case):
        with pytest.raises(ZeroDivisionError, match="no shape"):
            Recorder().call(Catenary((seabed,), "no shape"), case)


def test_numbers_are_folded_while_recording() -> None:
    case = OVER_SEABED["rough"]
    assert [float(value) for value in Recorder().call(Catenary((1,), "no shape"), case)] == list(solved(1, case))


def test_rows_and_points_agree() -> None:
    rows = np.array(list(OVER_SEABED.values())).T
    found = evaluate_rows(taped(1), dict(zip(NAMES, rows, strict=True)), rows.shape[1])["force"]
    np.testing.assert_array_equal(found, [solved(1, case) for case in OVER_SEABED.values()])
