"""Factors in a band of the compiled implicit methods: orders of elimination, motions as with dense ones, memory, reports."""

from __future__ import annotations

import ctypes
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.backend.band import Band
from symdyn.backend.packed import NAME, Pattern
from symdyn.backend.right_side import RightSide
from symdyn.errors import ArgumentError
from symdyn.lab.stiff_cables import elastic_cable
from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.integrating import methods
from symdyn.runtime.solutions.tables import facts

needs_c = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")
TIGHT = {"rtol": 1e-12, "atol": 1e-14}


def dense(patch: pytest.MonkeyPatch) -> None:
    """From here on no band pays."""
    patch.setattr(Band, "pays", property(lambda self: False))


def pattern_of(there: np.ndarray, n_q: int) -> Pattern:
    return Pattern(len(there), *np.nonzero(there), n_q)


# -- the order


def solved(given: Pattern, J: np.ndarray, mu: complex, right: np.ndarray) -> np.ndarray:
    """(mu - J) x = right as the band says: coordinates eliminated, a matrix within the diagonals, the rest substituted."""
    band, order = given.band, given.band.sequence
    P, b, r, end = J[np.ix_(order, order)], right[order], band.reduced, band.reduced + band.size
    x = b.astype(complex)
    assert not P[:r, :r].any() and not P[:r, end:].any() and not P[r:end, end:].any() and not np.triu(P[end:, end:]).any()
    x[:r] /= mu
    inner = mu * np.eye(band.size) - P[r:end, r:end] - P[r:end, :r] @ P[:r, r:end] / mu
    row, column = np.nonzero(inner)
    assert (row - column <= band.lower).all() and (column - row <= band.upper).all()
    x[r:end] = np.linalg.solve(inner, b[r:end] + P[r:end, :r] @ x[:r])
    x[:r] += P[:r, r:end] @ x[r:end] / mu
    for k in range(end, given.n):
        x[k] = (b[k] + P[k] @ np.where(np.arange(given.n) < k, x, 0)) / mu
    result = np.empty_like(x)
    result[order] = x
    return result


@pytest.mark.parametrize("seed", range(12))
def test_orders_solve_random_systems(seed: int) -> None:
    """Coordinates whose rates are speeds, or are not; states that nothing depends on, one after another; against LAPACK."""
    rng = np.random.default_rng(seed)
    n_q, n = int(rng.integers(1, 9)), 24
    pattern = rng.random((n, n)) < 0.06
    pattern[:n_q] = False
    for i in range(n_q):
        pattern[i, rng.integers(n_q, n, 1 if rng.random() < 0.7 else 3)] = True
    pattern[:, rng.integers(n_q, n, 3)] = False
    given = pattern_of(pattern, n_q)
    J, right = np.where(pattern, rng.normal(size=(n, n)), 0.0), rng.normal(size=n)
    for mu in (3.0, 2.0 + 5.0j):
        np.testing.assert_allclose(solved(given, J, mu, right), np.linalg.solve(mu * np.eye(n) - J, right), rtol=0, atol=1e-9)
    assert sorted(given.band.sequence.tolist()) == list(range(n))


def test_orders_of_mechanisms() -> None:
    """Two coordinates a knot: diagonals up to the next knot's last speed, whatever the cable's length and the order of names."""
    for n in (10, 20):
        band = elastic_cable(n).embedding().compile(backend="numpy").jacobian_indices().band
        assert (band.reduced, band.size, band.lower, band.upper) == (2 * n - 2, 2 * n - 2, 3, 3) and band.pays
    for name, options in (("double_pendulum", {}), ("n_link_pendulum", {"n": 8}), ("cart_pole", {})):
        assert not sd.systems.get(name, **options).compile(backend="numpy").jacobian_indices().band.pays


def test_work_follows_from_the_others() -> None:
    there = elastic_cable(12).embedding().compile(backend="numpy").jacobian_indices()
    with_work = there.with_work()
    assert with_work.n == there.n + 1 and with_work.band.sequence[-1] == there.n
    assert (with_work.band.size, with_work.band.factors) == (there.band.size, there.band.factors)


# -- motions


def pushed() -> sd.System:
    """A cable of 20 links with a force on the knot in its middle, and an event there."""
    system = elastic_cable(20)
    system.add_joint_force("up10", sd.inputs("F"))
    system.add_event("low", sd.coordinates("y10") + 0.005)
    return system


@pytest.fixture(scope="module")
def cable() -> Any:
    return pushed().embedding().compile(backend="c")


@pytest.fixture(scope="module")
def whole() -> Any:
    """The same with dense factors."""
    with pytest.MonkeyPatch.context() as patch:
        dense(patch)
        module = pushed().embedding().compile(backend="c")
        for right_side in (RightSide(method="radau"), RightSide(method="radau5"), RightSide(method="radau5", work=True)):
            module.library(right_side)
    return module


@needs_c
@pytest.mark.parametrize(("method", "at"), [("radau5", 1e-8), ("radau", 1e-9)])
def test_cables_move_as_with_dense_factors(cable: Any, whole: Any, method: str, at: float) -> None:
    """Both near a motion by explicit steps at 1e-12, with about as many steps; the band is in the code of one alone, and its
    factors are kept where steps keep their length."""
    times = np.linspace(0, 0.05, 11)
    exact = cable.simulate(times, inputs=[0.3], **TIGHT)
    banded, full = (module.simulate(times, inputs=[0.3], method=method, rtol=at, atol=1e-3 * at) for module in (cable, whole))
    errors = [np.abs(found.q - exact.q).max() for found in (banded, full)]
    assert banded.success and 1e-15 < errors[0] <= 2 * errors[1] and errors[1] <= at / 10
    assert banded.n_steps <= 1.3 * full.n_steps and banded.nlu <= 0.8 * full.nlu
    assert [NAME in module.library(RightSide(method=method)).metadata.shapes for module in (cable, whole)] == [True, False]
    assert (banded.factors, exact.factors) == ("banded: 38 of 76 states, 3 diagonals below and 3 above the main one", "")


@needs_c
def test_work_is_integrated(cable: Any, whole: Any) -> None:
    given = {"inputs": lambda t, x: [np.sin(50 * t)], "work": True, "method": "radau5", "rtol": 1e-9, "atol": 1e-12}
    banded, full = (module.simulate([0, 0.04], **given) for module in (cable, whole))
    assert np.abs(banded.work - full.work).max() <= 1e-6 * np.abs(full.work).max() and np.abs(full.work).max() > 1e-6
    assert np.abs(banded.energy_balance["error"]).max() <= 1e-6 * np.abs(full.work).max()


@needs_c
def test_events_states_between_steps_and_motions_backwards(cable: Any) -> None:
    given = {"inputs": [0.0], "method": "radau5", "rtol": 1e-9, "atol": 1e-12}
    exact, found = cable.simulate([0, 0.05], inputs=[0.0], **TIGHT), cable.simulate([0, 0.05], **given)
    assert len(exact.events["low"].t) == 1
    np.testing.assert_allclose(found.events["low"].t, exact.events["low"].t, rtol=0, atol=1e-8)
    between = np.linspace(0.001, 0.049, 17)
    assert np.abs(found(between) - exact(between))[:, :38].max() <= 1e-7
    # Damped motions grow backwards: a short way.
    start = exact.x[-1]
    back = [cable.simulate([0.05, 0.0498], start[:38], start[38:], events=False, **{**given, **more}).q[-1]
            for more in ({"method": "dop853", **TIGHT}, {})]
    assert np.abs(back[0] - back[1]).max() <= 1e-8


@needs_c
def test_sensitivities_take_the_factors_of_the_state(cable: Any) -> None:
    """The derivative by the mass of the knots, against differences of tight explicit motions."""
    found = cable.simulate([0, 0.02], inputs=[0.3], method="radau5", rtol=1e-9, atol=1e-12, sensitivities=["m"], events=False)
    m = float(cable.default_parameters[cable.metadata.parameters.index("m")])
    ends = [cable.simulate([0, 0.02], inputs=[0.3], params={"m": m * (1 + h)}, events=False, **TIGHT).q[-1]
            for h in (-1e-3, 1e-3)]
    wanted = (ends[1] - ends[0]) / (2e-3 * m)
    assert np.abs(found.sensitivity["m"][-1, :38] - wanted).max() <= 1e-4 * np.abs(wanted).max()
    assert found.factors.startswith("banded")


def bodies_on_bushings(n: int) -> sd.System:
    """Free bodies in a row on springs of 1 m between points off their centres: rates of angles are sums of speeds."""
    a, k, d = sd.parameters("a k d")
    system = sd.System(f"bodies_on_bushings_{n}", gravity=[0, 0, -9.81])
    before, at = system.ground, [0, 0, 0]
    for i in range(n):
        body = system.add_body(f"body{i}", mass=1, inertia=[0.01, 0.02, 0.03])
        system.add_joint(sd.Free(f"free{i}", system.ground, body, orientation=sd.EulerAngles("ZYX", speeds="body")))
        for off in ([a, 0, 0], [0, a, 0], [0, 0, a]):
            point = [x + (y if before is not system.ground else 0) for x, y in zip(off, at, strict=True)]
            system.add_spring_damper(before, body, stiffness=k, damping=d, length=1, point_a=point, point_b=off)
        before = body
        system.initial[system.joints[-1].coordinates[0]] = float(i + 1)
    system.defaults = {a: 0.2, k: 2e4, d: 20}
    return system


@needs_c
def test_rates_that_are_sums_of_speeds_stay_in_the_band() -> None:
    module = bodies_on_bushings(8).embedding().compile(backend="c")
    band = module.jacobian_indices().band
    assert band.pays and band.reduced == 24 and band.size == 72 and max(band.lower, band.upper) <= 30
    found, exact = (module.simulate([0, 0.1], **given) for given in ({"method": "radau", "rtol": 1e-9, "atol": 1e-11}, TIGHT))
    assert found.success and np.abs(found.x[-1] - exact.x[-1]).max() <= 1e-6


@needs_c
def test_members_of_ensembles_have_factors_in_bands_here_and_in_other_processes() -> None:
    module = elastic_cable(15).embedding().compile(backend="c")
    damping, names = [40.0, 60.0], module.metadata.q
    alone = [module.simulate((0, 0.01), params={"d": d}, method="radau5").q[-1] for d in damping]
    with ProcessPoolExecutor(1) as executor:
        for way in ({}, {"executor": executor}):
            ends = [f"end {name}" for name in names]
            done = sd.ensemble(module, {"d": damping}, (0, 0.01), ends, method="radau5", chunk=1, **way)
            assert done.n_failed == 0
            np.testing.assert_array_equal(np.column_stack([done[name] for name in ends]), alone)


@needs_c
def test_factors_serve_again_while_derivative_and_length_stay() -> None:
    """Dense ones, too: steps that are all of the longest length."""
    swing = sd.systems.get("double_pendulum").compile(backend="c")
    found, exact = (swing.simulate([0, 0.2], **given) for given in ({"method": "radau5", "rtol": 1e-4, "max_step": 1e-3}, TIGHT))
    assert found.n_steps >= 200 and 0 < found.nlu < found.n_steps and found.factors == "dense: 4 states"
    assert np.abs(found.x[-1] - exact.x[-1]).max() <= 1e-5


# -- memory, reports


@needs_c
def test_memory_grows_with_the_number_of_states() -> None:
    sizes = []
    for n in (10, 20, 40):
        library = elastic_cable(n).embedding().compile(backend="c").library(RightSide(method="radau5"))
        size = library.function("simulation_size")
        size.restype = ctypes.c_long
        sizes.append(size())
    assert (sizes[2] - sizes[1]) == pytest.approx(2 * (sizes[1] - sizes[0]), rel=0.01) and sizes[2] < 8 * 156 * 100


@needs_c
def test_a_long_cable_runs_where_dense_matrices_do_not_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    """The bound counts what is taken: the band's matrices pass, dense ones do not, and smaller bounds reject bands."""
    module = elastic_cable(50).embedding().compile(backend="c")
    band = 8 * (196 // 2 * 10 * 4 + len(module.jacobian_indices().rows))
    monkeypatch.setattr(methods, "LARGEST_MATRICES", band)
    assert module.simulate((0, 0.001), method="radau5").success
    monkeypatch.setattr(methods, "LARGEST_MATRICES", band - 1)
    with pytest.raises(ArgumentError, match=r"its matrices of 196 states take 0\.0 GiB; use method='Radau' of SciPy, whose"):
        module.simulate((0, 0.001), method="radau5")
    dense(monkeypatch)
    with pytest.raises(ArgumentError, match=r"its matrices of 196 states take"):
        module.simulate((0, 0.001), method="radau5")


@needs_c
def test_reports_say_how_matrices_were_factorized(cable: Any) -> None:
    given = {"inputs": [0.0], "events": False}
    found = {method: cable.simulate([0, 0.001], method=method, **given) for method in ("radau5", "dop853")}
    assert ("Factors", found["radau5"].factors) in facts(found["radau5"])
    long = elastic_cable(50).embedding().compile(backend="numpy")
    of_scipy = long.simulate([0, 0.001], method="Radau").factors
    assert of_scipy == f"sparse: 196 states, {len(long.jacobian_indices().rows)} entries of the derivative"
    assert found["dop853"].factors == "" and "Factors" not in dict(facts(found["dop853"]))
    swing = sd.systems.get("double_pendulum").compile(backend="c").simulate((0, 0.1), method="radau")
    assert swing.factors == "dense: 4 states"
