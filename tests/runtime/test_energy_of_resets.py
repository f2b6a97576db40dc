"""The energy balance of motions with resets, against closed forms of impacts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.cli.summary import summarize
from symdyn.runtime.solutions import tables as run_tables
from symdyn.runtime.solutions.report import write_report

G = 9.81


@pytest.fixture(scope="module")
def modules() -> Any:
    """A ball that bounces with e = 1/2, and is kicked upwards by 2 m/s at t = 0.6 s; a drag can be switched on."""
    y, n = sd.coordinates("y n")
    c = sd.parameters("c")
    s = sd.System("ball", gravity=[0, -G])
    ball = s.add_body("ball", mass=2)
    joint = s.add_joint(sd.Prismatic("fall", s.ground, ball, y, axis=[0, 1]))
    s.add_joint_force(joint, -c * y.dot, name="drag")
    s.add_state(n, 0)
    s.add_event("bounce", y, direction=-1, reset={y.dot: -y.dot / 2})
    s.add_event("kick", sd.t - 0.6, reset={y.dot: y.dot + 2, n: n + 1})
    s.add_event("count", y - 0.2, reset={n: n + 1})
    s.initial, s.defaults = {y: 1}, {c: 0}
    equations = s.embedding()
    return {backend: equations.compile(backend=backend) for backend in ("c", "numpy")}


METHODS = [("c", "dop853"), ("c", "bs54"), ("c", "taylor"), ("c", "radau"), ("c", "radau5"), ("c", "gauss"), ("c", "RK45"),
           ("numpy", "DOP853"), ("numpy", "LSODA")]


@pytest.mark.parametrize("steps", [True, False])
@pytest.mark.parametrize(("backend", "method"), METHODS)
def test_impacts_are_losses_by_name(modules: Any, backend: str, method: str, steps: bool) -> None:
    """Falling 1 m and bouncing with e = 1/2 loses 3/4 of m g h; the kick adds m (v w + w^2/2)."""
    sol = modules[backend].simulate((0, 0.7), method=method, work=True, rtol=1e-10, steps=steps)
    fall = np.sqrt(2 / G)
    v = G * fall / 2 - G * (0.6 - fall)  # at t = 0.6 s
    assert len(sol.events["bounce"].t) == 1 and len(sol.events["count"].t) >= 1
    balance = sol.energy_balance
    assert list(balance) == ["change", "work", "reset of count", "reset of bounce", "reset of kick", "error"]
    assert balance["reset of bounce"][-1] == pytest.approx(-0.75 * 2 * G, rel=1e-7)
    assert balance["reset of kick"][-1] == pytest.approx(2 * (2 * v + 2), rel=1e-7)
    assert np.abs(balance["reset of count"]).max() == 0
    assert sol.energy_error() < 1e-8
    assert (sol.reset_energy["bounce"][sol.t < fall - 1e-9] == 0).all()


def test_rows_at_the_time_of_a_reset_count_before_and_after_it(modules: Any) -> None:
    sol = modules["c"].simulate((0, 0.7), work=True, rtol=1e-10, steps=True)
    k = int(np.flatnonzero(sol.t == sol.events["bounce"].t[0])[0])
    lost = sol.reset_energy["bounce"]
    assert lost[k] == 0 and lost[k + 1] == pytest.approx(-0.75 * 2 * G, rel=1e-7)


def test_with_drag_the_work_and_the_resets_make_the_change(modules: Any) -> None:
    sol = modules["c"].simulate((0, 0.7), params={"c": 0.7}, work=True, rtol=1e-10)
    assert sol.work[-1] < -1 and sol.reset_energy["bounce"][-1] < -1 and sol.energy_error() < 1e-8


def test_resets_at_one_time_share_their_energy() -> None:
    """A speed of 1 m/s that is set to 3 m/s where two events happen: (9 - 1)/2 J for 1 kg."""
    y, n = sd.coordinates("y n")
    s = sd.System("twice")
    s.add_joint(sd.Prismatic("along", s.ground, s.add_body("block", mass=1), y, axis=[1, 0]))
    s.add_state(n, 0)
    s.add_event("a", y - 1, direction=1, reset={n: 1})
    s.add_event("b", y - 1, direction=1, reset={y.dot: 3})
    s.initial = {y.dot: 1}
    for backend in ("c", "numpy"):
        sol = s.embedding().compile(backend=backend).simulate((0, 2))
        assert list(sol.reset_energy) == ["a + b"] and sol.reset_energy["a + b"][-1] == pytest.approx(4.0)
        assert sol.energy_error() < 1e-12


def test_a_reset_on_constraints_counts_with_its_projection() -> None:
    """A particle on a circle of which one speed is reset, which the other one follows."""
    x, y = sd.coordinates("x y")
    s = sd.System("circling", gravity=[0, -G])
    rail, particle = s.add_body("rail"), s.add_body("particle", mass=1)
    s.add_joint(sd.Prismatic("along", s.ground, rail, x, axis=[1, 0]))
    s.add_joint(sd.Prismatic("up", rail, particle, y, axis=[0, 1]))
    s.add_constraint(x**2 + y**2 - 1, "circle")
    s.initial = {x: 1}
    s.add_event("low", y + 0.8, direction=-1, reset={x.dot: -x.dot / 2})
    module = s.augmented().compile(backend="c")
    for method in ("dop853", "RK45"):
        sol = module.simulate((0, 0.8), method=method, rtol=1e-10)
        assert sol.reset_energy["low"][-1] == pytest.approx(-0.75 * 0.8 * G, rel=1e-8) and sol.energy_error() < 1e-8


def test_reports_and_summaries_name_the_resets(modules: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str],
                                               monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    from symdyn.pictures import embedded

    for name in ("mechanism", "curves", "balance"):  # text alone, which takes less time
        monkeypatch.setattr(embedded, name, lambda *arguments: [])
    sol = modules["c"].simulate((0, 0.7), work=True, rtol=1e-10)
    balance = run_tables.energy(sol)
    assert balance is not None and not balance.doubtful and balance.resets["bounce"] == pytest.approx(-0.75 * 2 * G, rel=1e-7)
    assert "resets of bounce \N{MINUS SIGN}14.715 J" in write_report(sol, tmp_path / "run.html").read_text(encoding="utf-8")
    summarize(sol)
    assert "but for -14.715 J by resets of bounce" in capsys.readouterr().out
