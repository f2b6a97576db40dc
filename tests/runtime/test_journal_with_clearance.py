"""A pin in a bore, and a slider-crank whose piston has a journal with clearance."""

from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.errors import SimulationWarning
from symdyn.lab.contact_cases import slider_crank_with_clearance
from symdyn.lab.extended import known

G, C = 9.81, sd.contacts


@pytest.mark.parametrize("space", [False, True])
def test_pin_rests_in_its_bore(space: bool) -> None:
    """At the clearance and the depth (m g/k)^(2/3) below the middle; rigid, it carries its weight."""
    down = [0, 0, -G] if space else [0, -G]
    for law in ("compliant", "rigid"):
        system = sd.System("pin", gravity=down)
        body = system.add_body("pin", mass=2.0)
        axis = [0, 0, 1] if space else [0, 1]
        system.add_joint(sd.Prismatic("height", system.ground, body, axis=axis, coordinate=sd.coordinates("h")))
        yielding: Any = {"law": law, "compliance": C.Compliance(1e8)} if law == "compliant" else {}
        system.add_contact(sd.Contact("bore", body, system.ground, shape=(C.Sphere(0.009), C.Bore(0.01)), **yielding))
        module = system.compile(backend="numpy")
        if law == "rigid":
            assert module.rest({"h": -0.001}).contacts["bore"].force == pytest.approx([2 * G], rel=1e-9)
            continue
        depth = (2 * G / 1e8) ** (2 / 3)
        assert module.equilibrium(start={"h": -0.0011})["h"] == pytest.approx(-0.001 - depth, rel=1e-10)


def test_a_motion_over_impacts_agrees_with_one_of_20_digits() -> None:
    """Over 0.05 s, in which the pin crosses its clearance twelve times, by relative errors of every coordinate and speed. The
    reference: symdyn bench extended slider_crank_with_clearance --digits 24."""
    system, reference = slider_crank_with_clearance(), known("slider_crank_with_clearance")
    assert reference is not None and reference["t"] == system.duration
    assert reference["digits"] >= 20 and reference["runs_differ_by"] < 1e-20
    end, module = np.array([*reference["q"], *reference["q_dot"]], dtype=float), system.compile()
    with pytest.warns(SimulationWarning, match="zeros of events may be missed: journal_releases"):
        runs = [module.simulate((0, system.duration), rtol=rtol, work=True) for rtol in (1e-11, 1e-12)]
    for run, bound in zip(runs, (1e-8, 1e-9), strict=True):
        assert np.abs(run.x[-1] / end - 1).max() < bound
        assert np.abs(run.energy_balance["error"]).max() < 1e-10 * run.energy_scale[0]
        assert len(run.events["journal_touches"].t) == 24
        assert 0 < -run.contacts["journal"].gap.min() < 1e-4
