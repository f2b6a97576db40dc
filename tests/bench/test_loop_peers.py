"""`symdyn bench peers --models four_bar`: the programs agree, verdicts are right, and what is missing is said."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from symdyn.cli import main
from symdyn.lab.peers.benchmark import fastest
from symdyn.lab.peers.four_bar import LoopRow, four_bar_benchmark, moving_state
from symdyn.lab.peers.kane_peer import KanePeer
from symdyn.lab.peers.kkt_peer import KktPeer
from symdyn.lab.peers.loop_table import loop_lines, loop_record, loop_verdict
from symdyn.runtime.building.compiler import find_compiler
from symdyn.systems import get

needs_c = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")
KANE = ["kane lu", "kane cramer"]
SYMDYN = ["symdyn with multipliers", "symdyn"]


@pytest.fixture(autouse=True)
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Times are not looked at."""
    monkeypatch.setattr("symdyn.timing.loops.TIMING_SECONDS", 1e-5)


def test_linkage_is_closed_and_moves() -> None:
    equations = fastest(get("four_bar"))
    state = moving_state(equations)
    assert state.u[0] == 1.0 and np.abs(state.u).min() > 0.1
    for name in ("C", "C_dot"):
        assert np.abs(equations.lambdify(name)(state.q, state.u, {})).max() < 1e-14


@needs_c
def test_generated_code_of_casadi_and_sympy_agrees() -> None:
    pytest.importorskip("casadi", reason="the peers are not installed; run: pip install 'symdyn[peers]'")
    row = four_bar_benchmark([KktPeer(), KanePeer()], 1)
    ways = [f"casadi {way}" for way in ("solve", "qr", "ldl", "ldl hoisted")]
    assert list(row.times) == [*SYMDYN, *ways, *KANE] and row.operations.keys() == row.times.keys()
    assert row.difference < 1e-12
    assert row.operations["symdyn with multipliers"] < min(row.operations[name] for name in (*ways, *KANE))


def test_pinocchio_agrees() -> None:
    """Pinocchio's Python package solves the same as pinocchio_loop.cpp: to build it takes minutes."""
    pin = pytest.importorskip("pinocchio", reason="the peers are not installed; run: pip install 'symdyn[peers]'")
    system = get("four_bar")
    equations = fastest(system)
    state, v = moving_state(equations), {p.name: n for p, n in system.defaults.items()}
    model, before = pin.Model(), 0.0
    model.gravity.linear = np.array([0.0, -v["g"], 0.0])
    for k in "123":
        joint = model.addJoint(model.njoints - 1, pin.JointModelRZ(), pin.SE3(np.eye(3), np.array([before, 0.0, 0.0])), k)
        model.inertias[joint] = pin.Inertia(v[f"m{k}"], np.array([v[f"lc{k}"], 0.0, 0.0]), np.diag([0.0, v[f"I{k}"], v[f"I{k}"]]))
        before = v[f"l{k}"]
    contact = pin.RigidConstraintModel(pin.ContactType.CONTACT_3D, model, 3, pin.SE3(np.eye(3), np.array([v["l3"], 0.0, 0.0])), 0,
                                       pin.SE3(np.eye(3), np.array([v["d"], 0.0, 0.0])), pin.ReferenceFrame.LOCAL)
    contacts, found, data = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData(), model.createData()
    contacts.append(contact)
    found.append(contact.createData())
    pin.initConstraintDynamics(model, data, contacts, found)
    settings = pin.ProximalSettings(1e-10, 1e-12, 10)
    u_dot = pin.constraintDynamics(model, data, state.q, state.u, np.zeros(3), contacts, found, settings)
    force = data.oMi[3].rotation @ found[0].contact_force.linear
    assert np.allclose(equations.lambdify("accelerations")(state.q, state.u, {}).ravel(), u_dot, rtol=1e-9)
    assert np.allclose(equations.lambdify("lam")(state.q, state.u, {}).ravel(), -force[:2], rtol=1e-9)


@needs_c
def test_without_peers(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    monkeypatch.setattr("symdyn.bench.toolchain._installed", lambda name: None)
    code = main(["bench", "peers", "--models", "four_bar", "--repeats", "1", "--json", str(tmp_path / "rows.json")])
    printed = capsys.readouterr().out
    assert "CasADi is left out: the Python package casadi is not installed" in printed
    assert "Pinocchio is left out: the Python package pinocchio is not installed" in printed
    result = json.loads((tmp_path / "rows.json").read_text())
    (found,) = result["loops"]
    assert result["models"] == [] and code == bool(found["missed"])
    assert list(found["times"]) == [*SYMDYN, *KANE] and found["scaled"].keys() == {"kane"}


@pytest.mark.parametrize("ours, verdict", [(81.0, "MET: 0.90"), (82.0, "MISSED: 0.91 > 0.90")])
def test_verdict(ours: float, verdict: str) -> None:
    times = {"symdyn with multipliers": ours, "casadi solve": 200.0, "casadi ldl": 95.0, "kane lu": 90.0, "pinocchio": 2900.0}
    row = LoopRow("four_bar", "augmented", times, {"symdyn with multipliers": 172}, 1e-15)
    assert loop_verdict(row) == verdict and loop_record(row)["missed"] == row.misses()
    assert row.scaled() == pytest.approx({"casadi": ours * 78 / 95, "kane": ours * 67 / 90, "pinocchio": ours / 2})
    lines = loop_lines(row)
    assert lines[2].split() == ["symdyn", "with", "multipliers", "172", f"{ours / 1e3:.4f}", "1.00"]
    assert lines[-3].endswith(verdict) and lines[-2].endswith("less than 0.07 us:")
    assert lines[-1].endswith(f"{ours / 2e3:.3f} us by pinocchio (1.45 us)")
    alone = LoopRow("four_bar", "augmented", {k: v for k, v in times.items() if "casadi" not in k}, {}, 0.0)
    assert loop_verdict(alone).endswith("MET: 0.90, as far as it could be measured" if ours < 82 else verdict)
