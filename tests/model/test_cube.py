"""Part that water cuts off from the unit cube, against a closed formula at 80 digits, and against laws that any such cut
obeys."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import mpmath
import numpy as np
import pytest

from symdyn.errors import EvaluationError, UnsupportedExpression
from symdyn.model.elements.cube import Cube
from symdyn.tape import Recorder, Tape
from symdyn.tape.differentiate import forward, reverse
from symdyn.tape.evaluate import evaluate
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.node import INPUT
from tests.model.generated_evaluator import evaluator_of

NAMES = ["e0", "e1", "e2", "e3"]
ORDERS = (0, 1, 2)
REASON = "the depth is the same everywhere"
SPLIT = np.cumsum([Cube((order,), "").n_out for order in ORDERS])[:-1]


def taped() -> Tape:
    """All orders, one after the other."""
    recorder = Recorder()
    leaves = [recorder.leaf(name, INPUT) for name in NAMES]
    results = [r for order in ORDERS for r in recorder.call(Cube((order,), REASON), leaves)]
    return Tape.of(recorder, cube=np.array(results, dtype=object))


def random_depths(n: int, seed: int) -> np.ndarray:
    """Cuts through cubes in any attitude, components of e1, e2, e3 perhaps far apart; (n, 4)."""
    rng = np.random.default_rng(seed)
    e = rng.normal(size=(n, 4)) * 10 ** rng.uniform(-3, 1, (n, 4))
    e[:, 0] = rng.uniform(-0.5, 0.5, n) * np.abs(e[:, 1:]).sum(axis=1)
    return e


def corners() -> np.ndarray:
    """Cuts through corners, edges and faces, and cuts parallel to axes or all but; (n, 4)."""
    parts = (0.0, 1.0, -2.0, 1e-17, -1e-9, 1e-200)
    slopes = [s for s in itertools.product(parts, repeat=3) if max(map(abs, s)) >= 1]
    return np.array([[level, *slope] for slope in slopes for level in sorted(
        {np.dot(slope, r) / 2 for r in itertools.product((-1, 0, 1), repeat=3)} | {0.1})])


def rows(e: np.ndarray) -> list[np.ndarray]:
    """Symmetric arrays (n, 4), (n, 4, 4), (n, 4, 4, 4) of the three orders."""
    return full(evaluate_rows(taped(), dict(zip(NAMES, np.asarray(e, float).T, strict=True)), len(e))["cube"])


def full(packed: np.ndarray) -> list[np.ndarray]:
    result = []
    for order, part in zip(ORDERS, np.split(packed, SPLIT, axis=-1), strict=True):
        place = {index: k for k, index in enumerate(Cube((order,), "").indices)}
        where = [place[tuple(sorted(index))] for index in itertools.product(range(4), repeat=order + 1)]
        result.append(part[:, where].reshape(-1, *(4,) * (order + 1)))
    return result


def integral(context: Any, e: Sequence[Any]) -> Any:
    """Integral of max(depth, 0) over the cube: the sum over its corners, for e1 e2 e3 != 0."""
    total = context.mpf(0)
    for signs in itertools.product((-1, 1), repeat=3):
        depth = e[0] + sum(s * v for s, v in zip(signs, e[1:], strict=True)) / 2
        if depth > 0:
            total += signs[0] * signs[1] * signs[2] * depth**4
    return total / (24 * e[1] * e[2] * e[3])


def difference(context: Any, e: Sequence[Any], index: tuple[int, ...], h: Any) -> Any:
    """The derivative of the integral by e_i, e_j, ... by central differences."""
    if not index:
        return integral(context, e)
    ahead, back = list(e), list(e)
    ahead[index[0]] += h
    back[index[0]] -= h
    return (difference(context, ahead, index[1:], h) - difference(context, back, index[1:], h)) / (2 * h)


@pytest.mark.parametrize("order", ORDERS)
def test_against_the_sum_over_corners(order: int) -> None:
    context = mpmath.mp.clone()
    context.dps = 80
    intrinsic = Cube((order,), "")
    for e in random_depths((40, 30, 12)[order], order):
        exact = list(map(context.mpf, e.tolist()))
        wanted = [difference(context, exact, index, context.mpf(10) ** -16) for index in intrinsic.indices]
        precise = intrinsic.precise(context, exact)
        size = max(map(abs, wanted)) or 1
        assert max(abs(a - b) for a, b in zip(precise, wanted, strict=True)) < 1e-20 * size
        found = intrinsic.rows(e.tolist())
        wanted_floats = np.array(list(map(float, wanted)))
        scale = (1.0, 1 / np.abs(e[1:]).max(), np.abs(wanted_floats).max())[order]
        assert np.abs(found - wanted_floats).max() < (2e-15, 1e-14, 1e-12)[order] * scale


def test_dry_and_sunk() -> None:
    n = 50
    e = random_depths(n, 7)
    reach = np.abs(e[:, 1:]).sum(axis=1) / 2
    for side, volume in ((-1, 0.0), (1, 1.0)):
        e[:, 0] = side * reach * (1 + np.geomspace(1e-12, 10, n))
        first, second, third = rows(e)
        assert (first == [volume, 0, 0, 0]).all() and not second.any() and not third.any()


@pytest.mark.parametrize("e", [random_depths(500, 1), corners()], ids=["random", "degenerate"])
def test_identities(e: np.ndarray) -> None:
    """The integral of max(depth, 0) grows with the size of e, changes its sides with its sign, and knows no axis."""
    first, second, third = rows(e)
    assert np.isfinite(first).all() and np.isfinite(second).all() and np.isfinite(third).all()
    C = np.abs(e[:, 1:]).max(axis=1)
    rounding = 2e-15 * (1 / C + np.abs(third).max(axis=(1, 2, 3)) * np.abs(e).max(axis=1))
    # Euler: of degree 0, and -1, in e
    assert np.abs(np.einsum("nij,nj->ni", second, e)).max() < 1e-15
    assert (np.abs(np.einsum("nijk,nk->nij", third, e) + second).max(axis=(1, 2)) < rounding).all()
    # wet and dry part are the whole
    others = rows(-e)
    assert np.abs(first + others[0] - [1, 0, 0, 0]).max() < 4e-16
    smooth = np.abs(np.abs(e[:, 0]) / C - 0.5) > 1e-8  # elsewhere the cut may be a face
    assert (np.abs(second - others[1]).max(axis=(1, 2)) < rounding)[smooth].all()
    for axes in ([0, 2, 3, 1], [0, 2, 1, 3]):
        turned = rows(e[:, axes])
        assert np.abs(turned[0] - first[:, axes]).max() < 4e-16
        assert (np.abs(turned[1] - second[:, axes][:, :, axes]).max(axis=(1, 2)) < 1e-15 / C).all()
    for flip in np.array([[1, -1, 1, 1], [1, 1, 1, -1]]):
        turned = rows(e * flip)
        assert np.abs(turned[0] - first * flip).max() < 4e-16
        assert (np.abs(turned[1] - second * np.outer(flip, flip)).max(axis=(1, 2)) < 1e-15 / C).all()
    # a body in its bounds: wet volume and its centroid
    assert (first[:, 0] >= -1e-16).all() and (first[:, 0] <= 1 + 4e-16).all()
    assert (np.abs(first[:, 1:]) <= first[:, :1] / 2 + 1e-16).all()


def test_results_that_follow_from_others() -> None:
    e = random_depths(100, 3)
    results = Cube((1,), REASON).rows(list(e.T))
    following = {k: rule for k in range(results.shape[1]) if (rule := Cube((1,), REASON).by_others(k))}
    assert list(following) == [0, 1, 2, 3]
    for k, (divisor, pairs) in following.items():
        total = results[:, k] * e[:, divisor] + sum(e[:, i] * results[:, j] for i, j in pairs)
        assert np.abs(total).max() < 1e-14 * np.abs(results * np.abs(e).max(axis=1, keepdims=True)).max()
    assert not any(Cube((order,), REASON).by_others(k) for order in (0, 2) for k in range(4))


def test_values_where_the_cut_meets_faces_edges_and_corners() -> None:
    half_prism, third = [1 / 2, -1 / 12, -1 / 12, 0], 1 / 3
    for e, wanted in (
            ([0, 0, 0, -1], [0.5, 0, 0, -0.125]),  # upright, half in the water
            ([0.5, 0, 0, -1], [1, 0, 0, 0]),  # the top is the cut
            ([-0.5, 0, 0, -1], [0, 0, 0, 0]),  # the bottom is
            ([0, -1, -1, 0], half_prism),  # through two opposite edges
            ([0, -1, -1, -1e-17], half_prism),
            ([-1.5, 1, 1, 1], [0, 0, 0, 0]),  # one corner touches
            ([1.5, 1, 1, 1], [1, 0, 0, 0]),
            ([-0.5, 1, 1, 1], [1 / 6, 1 / 24, 1 / 24, 1 / 24]),  # through three corners: a tetrahedron, centroid at 1/4
            ([-0.5, 1, 0, 1], [1 / 8, third / 8, 0, third / 8])):  # a prism of 1/2 x 1/2
        assert np.abs(rows(np.array([e]))[0] - wanted).max() < 1e-16, e


def test_derivatives_where_the_cut_is_a_face() -> None:
    """They are those of the water plane, on either end."""
    first = Cube((1,), "").indices
    for level, height in ((0.5, 0.5), (-0.5, -0.5)):
        found = dict(zip(first, Cube((1,), "").rows([level, 0.0, 0.0, -1.0]), strict=True))
        assert found[0, 0] == 1 and found[0, 3] == height and found[3, 3] == 0.25
        assert found[1, 1] == found[2, 2] == 1 / 12 and found[0, 1] == found[1, 2] == found[1, 3] == 0
    assert np.isfinite(Cube((2,), "").rows([0.5, 0.0, 0.0, -1.0])).all()


# -- the same in generated code


@pytest.fixture(scope="module", params=["numpy", "c"])
def evaluator(request: pytest.FixtureRequest) -> Any:
    return evaluator_of(taped(), NAMES, request.param)


def test_generated_code(evaluator: Any) -> None:
    e = np.concatenate([random_depths(300, 3), corners(), random_depths(20, 4) * [5, 1, 1, 1]])
    n = len(e)
    many = full(np.array(evaluator.many(np.zeros(n), np.zeros((n, 0)), e, np.zeros((n, 0)))))
    wanted = rows(e)
    C = np.abs(e[:, 1:]).max(axis=1)
    assert np.abs(many[0] - wanted[0]).max() < 4e-16
    assert (np.abs(many[1] - wanted[1]).max(axis=(1, 2)) < 1e-15 / C).all()
    size = np.abs(wanted[2]).max(axis=(1, 2, 3)) + 1 / C**2
    assert (np.abs(many[2] - wanted[2]).max(axis=(1, 2, 3)) < 1e-14 * size).all()
    for k in range(0, n, 17):
        one = full(np.array(evaluator.one(0.0, np.zeros(0), e[k]))[None])
        assert all(np.abs(a[0] - b[k]).max() <= 1e-15 * np.abs(b[k]).max() for a, b in zip(one, many, strict=True))


@pytest.mark.parametrize("e", [[0.1, 0.0, 0.0, 0.0], [np.nan, 0.0, 0.0, 1.0], [0.1, np.nan, 0.0, 1.0], [0.1, 1.0, 0.0, np.nan]])
def test_no_depth_is_reported(evaluator: Any, e: list[float]) -> None:
    with pytest.raises(EvaluationError, match=REASON):
        evaluator.one(0.0, np.zeros(0), np.array(e))
    with pytest.raises(EvaluationError, match=REASON):
        evaluator.many(np.zeros(2), np.zeros((2, 0)), np.array([[0.1, 1.0, 2.0, 3.0], e]), np.zeros((2, 0)))
    for order in ORDERS:
        assert np.isnan(Cube((order,), "").rows(e)).all()
    precise = evaluate(taped(), dict(zip(NAMES, map(mpmath.mpf, e), strict=True)), 30)["cube"]
    assert len(precise) == 34 and all(map(mpmath.isnan, precise))


# -- derivatives on the tape


def test_derivatives_along_a_motion() -> None:
    """The first and second by t of all results of order 0 where e depends on t, against differences with 60 digits."""
    recorder = Recorder()
    t = recorder.leaf("t", INPUT)
    sine, cosine = recorder.sin(t), recorder.cos(t)
    e = [sine / 5, cosine * sine - 1, cosine / 3, t / 7]
    values = recorder.call(Cube((0,), ""), e)
    first = forward(recorder, values, {t: 1})
    second = forward(recorder, first, {t: 1})
    tape = Tape.of(recorder, value=np.array(values, object), first=np.array(first, object), second=np.array(second, object))
    h = mpmath.mpf(10) ** -20
    for at in (0.2, 1.0, 2.5, 4.0, 5.5):
        with mpmath.workdps(60):
            back, here, ahead = (evaluate(tape, {"t": mpmath.mpf(at) + k * h}, 60) for k in (-1, 0, 1))
            assert any(here["second"])
            for low, high in (("value", "first"), ("first", "second")):
                rates = (ahead[low] - back[low]) / (2 * h)
                assert max(abs(rates - here[high])) < 1e-25
        found = evaluate_rows(tape, {"t": at}, 1)
        assert np.abs(found["second"][0] - here["second"].astype(float)).max() < 1e-13
    with pytest.raises(UnsupportedExpression, match="third derivative of the buoyancy of a box"):
        forward(recorder, second, {t: 1})


def test_what_does_not_change_the_depth_has_no_derivative() -> None:
    recorder = Recorder()
    a, b = recorder.leaf("a", INPUT), recorder.leaf("b", INPUT)
    values = recorder.call(Cube((0,), ""), [a, 0, 0, -1])
    assert forward(recorder, values, {b: 1}) == [0, 0, 0, 0]


def test_derivatives_backwards_are_those_forwards() -> None:
    """A product of several results of two calls, one value given twice."""
    recorder = Recorder()
    e = [recorder.leaf(f"e{k}", INPUT) for k in range(4)]
    first, second = (recorder.call(Cube((0,), "a cube"), values) for values in (e, [e[0], e[1] * e[2], e[2], e[2]]))
    value = first[0] * second[3] + first[1] * first[2]
    tape = Tape.of(recorder, backwards=np.array(reverse(recorder, value, e), dtype=object),
                   forwards=np.array([forward(recorder, [value], {leaf: 1})[0] for leaf in e], dtype=object))
    found = evaluate(tape, {"e0": 0.1, "e1": 0.3, "e2": -0.4, "e3": 0.7})
    assert all(abs(v) > 1e-4 for v in found["forwards"])
    assert np.abs(found["backwards"] - found["forwards"]).max() < 1e-28
