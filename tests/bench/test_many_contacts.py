"""symdyn bench balls: what it looks at, on a few balls, and what it rejects."""

from __future__ import annotations

import numpy as np
import pytest

from symdyn.errors import ArgumentError
from symdyn.lab import many_contacts
from symdyn.runtime.building.compiler import find_compiler
from tests.helpers import swept


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
def test_balls_fall_into_a_box_and_keep_the_laws_of_contact() -> None:
    system, start = many_contacts.box(8)
    solution = system.compile().simulate((0, 0.3), q=start, method="moreau", step=many_contacts.STEP)
    stepped = solution.stepped
    assert stepped is not None and len(stepped.touched.a) > 100
    assert many_contacts.missed(solution).max() < 1e-9
    assert many_contacts.deepest(solution, 8) < 1e-9
    values = stepped.touched.values.copy()
    values[np.argmax(values[:, 4]), 1] += 1e-3  # a contact that opens and yet pushes is seen
    stepped.touched.values[:] = values
    assert many_contacts.missed(solution).max() > 1e-4


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
@pytest.mark.parametrize("n", swept([20, 40], 20))
def test_laws_hold_along_the_normals_at_the_end_of_a_step(n: int) -> None:
    """More balls than are solved to rounding, by sweeps alone: the residual that is reported is that of the laws."""
    system, start = many_contacts.box(n)
    solution = system.compile().simulate((0, 0.3), q=start, method="moreau", step=many_contacts.STEP)
    stepped = solution.stepped
    assert stepped is not None and len(stepped.touched.a) > 100
    assert many_contacts.missed(solution).max() < 1e-6 and stepped.residual < 1e-6
    assert many_contacts.deepest(solution, n) < 1e-6


def test_numbers_of_balls_are_checked() -> None:
    for numbers in ("0", "3,x", ""):
        with pytest.raises(ArgumentError, match="pass numbers such as '30,60'"):
            many_contacts.run(numbers)
