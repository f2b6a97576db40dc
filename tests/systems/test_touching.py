"""Mechanisms of the catalogue that touch, against published digits and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

import symdyn as sd
from symdyn.bench.work.cases import named_case, taken
from symdyn.errors import SymdynError
from symdyn.runtime.building.compiler import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


def test_the_walker_has_the_published_gait() -> None:
    """With feet of 1e-4 and 5e-5 of the hip's mass, taken to none; per step the way is 2 sin(theta_0)."""
    module = sd.systems.simplest_walker().compile()
    middle = module.simulate((0, 1), rtol=1e-10).x[-1]
    periods = [module.periodic(3.1, middle[:4], middle[4:], params={"m": m}, cyclic=["x"], exchange=[("left", "right")],
                               rtol=1e-12).period for m in (1e-4, 5e-5)]
    assert 2 * periods[1] - periods[0] == pytest.approx(3.0961058680777, abs=2e-7)
    walk = module.simulate((0, 4), rtol=1e-11)
    (strike,) = walk.contacts["right_foot"].impacts.t
    at = module.simulate((0, strike), rtol=1e-11)["x"][-1]
    assert at - walk["x"][0] == pytest.approx(2 * np.sin(0.19393737), abs=2e-4)


def test_the_block_rocks_as_housner_says() -> None:
    """Its first quarter period by the energy integral, and the rate that an impact leaves, 1 - 3/2 sin^2 alpha of that before."""
    module = sd.systems.rocking_block().compile()
    solution = module.simulate(rtol=1e-12)
    alpha, reach, g = np.arctan2(0.25, 1.0), np.hypot(0.25, 1.0), 9.81

    def slowness(root: float) -> float:
        """dt/droot for theta = start - root^2, from rest, with I = 4/3 m R^2 about the corner."""
        gained = np.cos(alpha - 0.8 * alpha) - np.cos(alpha - 0.8 * alpha + root**2)
        return float(2 * root / np.sqrt(3 / 2 * g / reach * gained)) if root else float(
            2 / np.sqrt(3 / 2 * g / reach * np.sin(0.2 * alpha)))

    quarter = quad(slowness, 0, np.sqrt(0.8 * alpha), epsabs=1e-12, epsrel=1e-12)[0]
    right = solution.contacts["right"]
    assert right.impacts.t[0] == pytest.approx(quarter, abs=1e-9)
    before, after = (module.simulate([0, right.impacts.t[0] + side], rtol=1e-12).u[-1, 2] for side in (-1e-9, 1e-9))
    assert after / before == pytest.approx(1 - 1.5 * np.sin(alpha) ** 2, abs=1e-6)


@pytest.mark.sweep
def test_the_woodpecker_comes_to_its_period() -> None:
    """Leine, van Campen and Glocker find a motion of period one; tests/runtime/test_woodpecker.py has its digits."""
    pecks = sd.systems.woodpecker_toy().compile().simulate((0, 3), rtol=1e-9).contacts["beak"].impacts.t
    laps = np.diff(pecks)
    assert laps[-1] == pytest.approx(0.14597, abs=3e-5)
    assert np.abs(np.diff(laps[-4:])).max() < np.abs(np.diff(laps[:4])).max() / 3


def test_the_woodpecker_touches_its_pole_where_it_is_drawn() -> None:
    """The edges of the sleeve at its height on the side of the pole, the beak where the outline of the bird has it."""
    solution = sd.systems.woodpecker_toy().compile().simulate((0, 0.5))
    at, forces = np.moveaxis(solution.rows("contact_points").reshape(len(solution.t), 3, 2, 3), 2, 0)
    touching = np.linalg.norm(forces, axis=2) > 0
    np.testing.assert_allclose(at[touching][:, 0], 0.0025, atol=1e-9)
    for k, height in ((1, -0.0058), (2, 0.0058)):
        np.testing.assert_allclose(at[:, k, 1] - solution["y"], height + 0.0031 * solution["sleeve"], atol=1e-12)
    frames = solution.rows("frames").reshape(len(solution.t), -1, 12)[:, solution.module.metadata.bodies.index("bird_body")]
    np.testing.assert_allclose(at[:, 0, 1], frames[:, 1] + 0.02 - 0.0201 * solution["bird"], atol=1e-12)


@pytest.mark.parametrize("name", ["simplest_walker", "rocking_block", "woodpecker_toy"])
def test_benches_of_smooth_motions_leave_them_out(name: str) -> None:
    with pytest.raises(SymdynError, match="its motion switches at rigid contacts, and references are of smooth equations"):
        named_case(name).first()
    with pytest.raises(SymdynError, match="its motion switches at rigid contacts"):
        taken(sd.systems.get(name).embedding()).first()
