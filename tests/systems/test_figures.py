"""Figures that are the same on every machine: operation counts, and errors of long runs."""

import numpy as np
import pytest

import symdyn as sd
from symdyn.lab.peers import arm
from symdyn.lab.peers.models import CASES
from symdyn.runtime.building.compiler import find_compiler
from symdyn.tape.evaluate import evaluate


@pytest.mark.parametrize(("name", "options", "most"), [
    ("spatial_chain", {"n": 7}, 1194), ("spatial_chain", {"n": 4}, 431), ("n_link_pendulum", {"n": 5}, 264),
    ("double_pendulum", {}, 37), ("puma560", {}, 633),
])
def test_operations_of_the_right_hand_side(name, options, most):
    """A change that needs more operations than before must be entered here."""
    tape = sd.systems.get(name, **options).embedding().tape("rhs")
    assert tape.operations <= most


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if case.bound.operations is not None])
def test_leanest_candidate(name):
    """All parameters at run time, after hoisting, no more operations than the bound of `symdyn bench peers`."""
    case = CASES[name]
    assert min(c.operations for c in case.make().equations().candidates) <= case.bound.operations


def test_inverse_dynamics_of_an_arm_against_published_code():
    assert arm.misses() == [] and sum(arm.counts(grouped=True)) < sum(arm.counts(grouped=False))


def test_spatial_chain_is_the_published_benchmark():
    """Seven links: the parameters are those of the benchmark, each symbolic and run-time."""
    system = sd.systems.get("spatial_chain", n=7)
    values = {str(k): v for k, v in system.defaults.items()}
    assert len(values) == 7 * 10 + 6 + 1
    for i in range(7):
        assert values[f"m{i + 1}"] == pytest.approx(1 + 0.1 * i)
    assert sorted({round(v, 12) for v in values.values()}) == pytest.approx(
        [0.001, 0.0015, 0.002, 0.01, 0.02, 0.03, 0.04, 0.05, 0.25, 0.5, 1, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 9.81])


@pytest.mark.every_value
@pytest.mark.parametrize("backend", ["numpy", "c"])
@pytest.mark.parametrize("name", sd.systems.names(constrained=False))
def test_right_hand_side_agrees_with_30_digits(name, backend):
    """Every system of the catalogue as it comes, at random states, relative to the largest entry."""
    if backend == "c" and find_compiler() is None:
        pytest.skip("no C compiler here")
    equations = sd.systems.get(name).embedding()
    module = equations.compile(backend=backend)
    stream = np.random.default_rng(7)
    for _ in range(3):
        x = stream.uniform(0.2, 1.2, module.metadata.sizes.x)
        inputs = stream.uniform(-1, 1, module.metadata.sizes.inputs)
        values = dict(zip([*module.metadata.x, *module.metadata.inputs, *module.metadata.parameters],
                          [*x, *inputs, *module.parameters()], strict=True))
        exact = evaluate(equations.tape("rhs"), {**values, "t": 0.3}, 30)["rhs"]
        difference = np.array([float(a - b) for a, b in zip(module.rhs(0.3, x, None, inputs), exact, strict=True)])
        assert np.abs(difference).max() <= 1e-12 * np.abs(exact.astype(float)).max()


def test_puma_keeps_its_energy():
    module = sd.systems.get("puma560").embedding().compile()
    assert module.simulate((0, 10), rtol=1e-11).energy_error() <= 1e-10
