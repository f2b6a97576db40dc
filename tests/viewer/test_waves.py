"""The surface of water with waves, as pages show it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.errors import ModelError
from tests.viewer.test_views import Opened

pytest.importorskip("matplotlib")

AMPLITUDE, FREQUENCY, LENGTH, HEADING, RAMP = 0.4, 0.9, 30.0, 0.5, 8.0
# The surface that the page would draw now: (n, 6), places and normals.
SURFACE = """() => { const s = symdyn.stage, scene = symdyn.scenes[0], change = s.renderer.change; let found;
    s.renderer.change = (mesh, vertices) => {
        if (mesh === scene.water) found = Array.from(vertices);
        change.call(s.renderer, mesh, vertices);
    };
    s.draw(false); s.renderer.change = change; return found; }"""


def floating() -> sd.System:
    """A box that heaves under a force in phase with the elevation at the origin."""
    omega, ramp = sd.parameters("omega ramp")
    system = sd.System("float", gravity=[0, 0, -9.81])
    box = system.add_body("box", mass=500, inertia=[100, 100, 100])
    system.add_joint(sd.Prismatic("heave", system.ground, box, axis=[0, 0, 1], coordinate=sd.coordinates("z")))
    system.add_load(sd.LinearStiffness(box, [0, 0, 2e4, 0, 0, 0], name="water"))
    system.add_load(sd.WaveExcitation(box, [0, 0, 1e3, 0, 0, 0], [0] * 6, frequency=omega, ramp=ramp, name="waves"))
    system.draw(system.ground, sd.shapes.Water((20, 16), waves=(AMPLITUDE, omega, LENGTH, HEADING, ramp)))
    system.set_defaults({omega: FREQUENCY, ramp: RAMP})
    return system


def test_the_surface_moves_with_the_force_of_the_waves(chromium: Any, tmp_path: Path) -> None:
    module = floating().compile(backend="numpy")
    module.simulate((0, 20)).view(tmp_path / "view.html", forces=True)
    row = module.metadata.acting.index(("waves", "box", "force"))
    with Opened(chromium, tmp_path / "view.html") as page:
        for t in (2.5, 11.3):
            page.page.evaluate("t => symdyn.scenes[0].source.seek(t)", t)
            found = np.array(page.page.evaluate(SURFACE)).reshape(-1, 6)
            x, y, z = found[:, :3].T
            assert np.ptp(x) == pytest.approx(20) and np.ptp(y) == pytest.approx(16)
            force = module.evaluate("applied_loads", t, np.zeros(2)).reshape(-1, 6)[row, 5]
            middle = np.abs(x) + np.abs(y) < 1e-6
            np.testing.assert_allclose(z[middle], AMPLITUDE * force / 1e3, atol=1e-6)
            # A crest that is at the origin now has been before it, against the heading, by a fixed speed.
            grown = (1 - np.cos(np.pi * min(t / RAMP, 1))) / 2
            along = np.cos(HEADING) * x + np.sin(HEADING) * y
            np.testing.assert_allclose(z, AMPLITUDE * grown * np.cos(FREQUENCY * (t - along * 2 * np.pi / LENGTH / FREQUENCY)),
                                       atol=1e-5)
            # Normals are across the slopes that the places have.
            n = int(np.sqrt(len(x)))
            slope = np.diff(z.reshape(n, n), axis=0) / np.diff(x.reshape(n, n), axis=0)
            normal = -found[:, 3].reshape(n, n)
            np.testing.assert_allclose(slope, (normal[1:] + normal[:-1]) / 2, atol=1e-4)


def test_waves_come_with_data_files_and_the_slider_of_time(chromium: Any, tmp_path: Path) -> None:
    floating().to_toml(tmp_path / "float.toml")
    system = sd.read_system(tmp_path / "float.toml")
    system.show(tmp_path / "show.html")
    with Opened(chromium, tmp_path / "show.html") as page:
        before = np.array(page.page.evaluate(SURFACE))
        (slider,) = [s for s in page.page.evaluate("symdyn.scenes[0].data.sliders") if s["group"] == "t"]
        page.page.evaluate("s => { symdyn.scenes[0].source.set(s, 12) }", slider)
        after = np.array(page.page.evaluate(SURFACE))
        assert slider["moves"] and not before[2::6].any() and np.abs(after[2::6]).max() > 0.2


def test_the_turbine_with_waves_shows_them() -> None:
    (water,) = [r for r in sd.systems.floating_wind_turbine(waves=True).embedding().drawn if r["kind"] == "water"]
    assert len(water["values"]["waves"][0]) == 5
    (still,) = [r for r in sd.systems.floating_wind_turbine().embedding().drawn if r["kind"] == "water"]
    assert "waves" not in still["values"]


@pytest.mark.parametrize("waves, message", [((1, 2), r"waves has 2 entries; pass \(amplitude, frequency, length\)"),
                                            ((1, 2, 0), "length of waves is 0; pass a positive length, m"),
                                            (("1", 2, 3), "is the text '1'; text is never evaluated")])
def test_faults_of_waves_are_reported(waves: tuple[object, ...], message: str) -> None:
    system = floating()
    system.draw(system.ground, sd.shapes.Water(waves=waves))
    with pytest.raises(ModelError, match=message):
        system.check()
