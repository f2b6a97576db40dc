"""The floating crane: draft, heel and counter-ballast against closed forms of ship statics."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import symdyn as sd
from symdyn.lab.turbine import States, values

HELD = {"x": 0.0, "y": 0.0, "psi": 0.0}  # nothing else holds them


@pytest.fixture(scope="module")
def hook() -> Any:
    return sd.systems.floating_crane().embedding().compile()


def numbers(module: Any, **changed: float) -> dict[str, float]:
    return {**dict(zip(module.metadata.parameters, module.metadata.defaults, strict=True)), **changed}


class Statics:
    """Mass, draft, height of the centre of mass, metacentric height and radius of an upright box; a hanging cargo counts at the
    boom's tip."""

    def __init__(self, p: Mapping[str, float]) -> None:
        cargo = p.get("m_c", 0.0)
        self.mass = p["m_L"] + p["m_b"] + cargo
        self.draft = self.mass / (p["rho"] * p["L"] * p["B"])
        height = (p["m_L"] * p["z_L"] + p["m_b"] * p["z_b"] + cargo * p.get("z_t" if "l_r" in p else "z_d", 0.0)) / self.mass
        self.radius = p["B"] ** 2 / (12 * self.draft)
        self.along = p["L"] ** 2 / (12 * self.draft) + self.draft / 2 - height
        self.GM = self.draft / 2 + self.radius - height

    def heel(self, moment: float) -> float:
        """Heel of a wall-sided hull: mass (GM + BM/2 tan^2 phi) sin phi = moment cos phi, moment in kg m."""
        tangent = brentq(lambda T: self.mass * (self.GM + self.radius / 2 * T**2) * T - moment, 0, 1, xtol=1e-15)
        return float(np.arctan(tangent))


def test_the_lecture_s_numbers() -> None:
    defaults = {p.name: v for p, v in sd.systems.floating_crane().check().defaults.items()}
    assert [defaults[name] for name in ("L", "B", "m_L", "m_c")] == [110, 45, 9.5e6, 2.608e6]
    assert Statics(defaults).draft == pytest.approx(7.5, rel=1e-15)


def test_heel_and_draft_with_the_cargo_on_the_hook(hook: Any) -> None:
    p = numbers(hook)
    found = hook.equilibrium(fixed=HELD, start={"z": -7.0, "theta": 0.02, "phi": 0.1})
    statics = Statics(p)
    heel = statics.heel(-p["m_c"] * p["y_t"])
    assert np.degrees(heel) == pytest.approx(7.3435, abs=1e-4)
    assert found.stable and found["phi"] == pytest.approx(heel, rel=1e-12) and abs(found["theta"]) < 1e-12
    assert found["alpha"] == pytest.approx(-heel, rel=1e-12)  # the rope hangs straight down
    assert hook.outputs(0.0, found.x)["draft"] == pytest.approx(statics.draft, rel=1e-13)  # in the middle, at any heel
    assert [found[name] for name in ("z", "phi", "alpha")] == pytest.approx(
        [hook.metadata.initial[name] for name in ("z", "phi", "alpha")], rel=1e-13)


def test_small_heel_and_trim_are_the_moment_by_displacement_and_metacentric_height(hook: Any) -> None:
    changed = {"y_t": -0.1, "x_t": 0.1}
    statics, moment = Statics(numbers(hook, **changed)), 0.1 * numbers(hook)["m_c"]
    found = hook.equilibrium(fixed=HELD, params=changed)
    assert found["phi"] == pytest.approx(moment / (statics.mass * statics.GM), rel=1e-5)
    assert found["theta"] == pytest.approx(moment / (statics.mass * statics.along), rel=1e-5)


def test_counter_ballast_that_keeps_it_level(hook: Any) -> None:
    p = numbers(hook)
    found = hook.equilibrium(free=["z", "theta", "phi", "alpha", "beta", "m_x"], fixed={**HELD, "phi": 0.0})
    assert found.solved == {"m_x": pytest.approx(-p["m_c"] * p["y_t"] / (2 * p["y_b"]), rel=1e-12)}
    assert found.solved["m_x"] < p["m_b"] / 2 and found.stable
    assert found["z"] == pytest.approx(-7.5, rel=1e-12)


def test_before_lifting_it_floats_level() -> None:
    module = sd.systems.floating_crane("ashore").embedding().compile()
    found = module.equilibrium(fixed=HELD, start={"z": -7.0, "phi": 0.1})
    assert found["z"] == pytest.approx(-Statics(numbers(module)).draft, rel=1e-12)
    assert found["z"] == pytest.approx(module.metadata.initial["z"], rel=1e-13)
    assert found.stable and abs(found["phi"]) < 1e-12 and abs(found["theta"]) < 1e-12


def test_cargo_on_deck_does_not_change_the_draft() -> None:
    equations = sd.systems.floating_crane("deck").embedding()
    start = np.zeros((1, 6))
    start[0, 2] = -7.5
    assert np.abs(values(equations, States(start, np.zeros((1, 6))), "accelerations")["accelerations"]).max() < 1e-12
    assert Statics({p.name: v for p, v in equations.symbols.defaults.items()}).GM > 0


def test_it_keeps_its_energy_while_the_cargo_swings(hook: Any) -> None:
    solution = hook.simulate(t=(0, 60), q={"phi": 0.0, "alpha": 0.0, "beta": 0.05, "z": -7.5}, rtol=1e-10)
    assert solution["phi"].max() > 0.2 and solution.energy_error() < 1e-8


def test_other_cargo_is_rejected() -> None:
    for cargo in ("sunk", ["hook"]):
        with pytest.raises(sd.ModelError, match=f"has no cargo {re.escape(repr(cargo))}; pass 'hook' or 'deck' or 'ashore'"):
            sd.systems.floating_crane(cargo)  # type: ignore[arg-type]
