"""Every pivot of the mass matrix is asked when generated code runs, in whatever way its sum is written."""

from __future__ import annotations

import numpy as np
import pytest

from symdyn import systems
from symdyn.errors import EvaluationError
from symdyn.runtime.building.compiler import find_compiler
from symdyn.tape.recorder import Recorder


@pytest.mark.parametrize("backend", ["numpy", "c"])
def test_no_indefinite_mass_matrix_passes(backend: str) -> None:
    """Accelerations are computed where masses make the matrix positive definite, and rejected everywhere else."""
    if backend == "c" and find_compiler() is None:
        pytest.skip("no C compiler here")
    module = systems.get("n_link_pendulum", n=5).embedding().compile(backend=backend)
    masses = [name for name in module.metadata.parameters if name.startswith("m")]
    assert len(masses) == 5
    stream = np.random.default_rng(5)
    refused = 0
    for _ in range(300):
        values = dict(zip(masses, stream.uniform(-0.3, 1.0, 5), strict=True))
        x = stream.uniform(-3, 3, 10)
        definite = np.linalg.eigvalsh(module.evaluate("mass_matrix", 0.0, x, params=values)).min() > 0
        try:
            module.evaluate("rhs", 0.0, x, params=values)
        except EvaluationError as error:
            assert "not positive definite" in str(error) and not definite
            refused += 1
        else:
            assert definite
    assert 30 < refused < 270


def test_a_check_of_a_value_with_a_sign() -> None:
    """The divisor is the value without its sign; the check stays with it."""
    recorder = Recorder()
    value = recorder.positive(-recorder.leaf("a", 1), "a is not negative")
    assert any(reason == "a is not negative" for reason in recorder.checks.values())
    assert value.args[0] in recorder.checks
