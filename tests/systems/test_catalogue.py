"""Accelerations of every tree of the catalogue against Kane's method, derived independently."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
import pytest

import symdyn as sd
from tests.oracles import kane

TOLERANCE = 1e-12
STATES = 5


class Case(NamedTuple):
    name: str
    options: dict[str, Any]
    oracle: Callable[..., kane.Accelerations]
    arguments: tuple = ()

    def __repr__(self) -> str:
        return "-".join([self.name, *map(str, self.options.values())])


@functools.cache
def standard_puma560() -> kane.Accelerations:
    """With all parameters, for the arm that has them and for the one that leaves out those that are zero."""
    every = [str(p) for p in sd.systems.get("puma560", convention="standard", general=True).defaults]
    accelerations = kane.kane_puma560("standard", every)
    return lambda q, u, params: accelerations(q, u, {**dict.fromkeys(every, 0.0), **params})


def modified_puma560() -> kane.Accelerations:
    return kane.kane_puma560("modified", [str(p) for p in sd.systems.get("puma560", convention="modified").defaults])


CASES = [
    Case("pendulum", {}, kane.kane_pendulum),
    Case("double_pendulum", {}, kane.kane_double_pendulum),
    Case("n_link_pendulum", {"n": 1}, kane.kane_n_link_pendulum, (1,)),
    Case("n_link_pendulum", {"n": 5}, kane.kane_n_link_pendulum, (5,)),
    Case("cart_pole", {}, kane.kane_cart_pole),
    Case("vehicle_on_track", {}, kane.kane_vehicle_on_track),
    Case("vehicle_on_rotating_track", {"track_inertia": True}, kane.kane_vehicle_on_rotating_track, (True,)),
    Case("vehicle_on_rotating_track", {"track_inertia": False}, kane.kane_vehicle_on_rotating_track, (False,)),
    Case("prismatic_chain", {"n": 2}, kane.kane_prismatic_chain, (2,)),
    Case("prismatic_chain", {"n": 3}, kane.kane_prismatic_chain, (3,)),
    Case("spatial_chain", {"n": 3}, kane.kane_spatial_chain, (3,)),
    Case("spatial_chain", {"n": 4}, kane.kane_spatial_chain, (4,)),  # past one turn of the axes z, y, x
    Case("two_link_arm", {}, kane.kane_two_link_arm),
    Case("three_link_arm", {}, kane.kane_three_link_arm),
    Case("flyball_governor", {}, kane.kane_flyball_governor),
    Case("puma560", {"convention": "standard"}, standard_puma560),
    Case("puma560", {"convention": "modified"}, modified_puma560),
    Case("puma560", {"convention": "standard", "general": True}, standard_puma560),
]


class Pair(NamedTuple):
    """A compiled system with its oracle."""

    system: Any
    module: Any
    oracle: kane.Accelerations


# Both conventions are those of test_puma560.py, too.
REPEATED = ({"n": 1}, {"n": 2}, {"n": 4}, {"track_inertia": False}, {"convention": "standard"}, {"convention": "modified"},
            {"convention": "standard", "general": True})


@pytest.fixture(scope="module", ids=repr, params=[
    pytest.param(case, marks=pytest.mark.sweep) if case.options in REPEATED else case for case in CASES])
def pair(request: pytest.FixtureRequest) -> Iterator[Pair]:
    case: Case = request.param
    system = sd.systems.get(case.name, **case.options)
    yield Pair(system, system.embedding().compile(backend="numpy"), case.oracle(*case.arguments))


def test_every_system_is_compared() -> None:
    assert {case.name for case in CASES} == set(sd.systems.names(constrained=False))


def test_default_numbers(pair: Pair) -> None:
    model = pair.system.check()
    numbers = {str(p): value for p, value in model.defaults.items()}
    rng = np.random.default_rng(11)
    _compare(pair, rng, numbers, None)


def test_other_numbers(pair: Pair) -> None:
    model = pair.system.check()
    rng = np.random.default_rng(12)
    numbers = {str(p): _vary(str(p), value, rng) for p, value in model.defaults.items()}
    _compare(pair, rng, numbers, numbers)


def _compare(pair: Pair, rng: np.random.Generator, numbers: dict[str, float], params: dict[str, float] | None) -> None:
    model = pair.system.check()
    n = len(model.coordinates)
    for _ in range(STATES):
        q, u, inputs = rng.uniform(-2, 2, n), rng.uniform(-2, 2, n), rng.uniform(-3, 3, len(model.inputs))
        given = {str(a): value for a, value in zip(model.inputs, inputs, strict=True)}
        rates = np.asarray(pair.module.rhs(0.0, np.concatenate([q, u]), params, inputs))
        expected = pair.oracle(q, u, {**numbers, **given})
        np.testing.assert_array_equal(rates[:n], u)
        assert np.linalg.norm(rates[n:] - expected) <= TOLERANCE * np.linalg.norm(expected)


def _vary(name: str, value: float, rng: np.random.Generator) -> float:
    """Another number of the same order; where the catalogue has zero, one that keeps the mass matrix regular."""
    if value != 0:
        return value * rng.uniform(0.7, 1.3)
    return rng.uniform(1, 2) * {"m": 1.0, "c": 0.02, "I": 2e-5}[name[0]]
