"""`symdyn bench peers`: the programs have the same models, verdicts are right, and what is missing is said."""

from __future__ import annotations

import dataclasses
import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from symdyn import systems
from symdyn.bench import toolchain
from symdyn.cli import main
from symdyn.errors import SymdynError
from symdyn.lab.peers import command, derivatives
from symdyn.lab.peers.benchmark import Row, benchmark, random_state
from symdyn.lab.peers.casadi_peer import CasadiPeer
from symdyn.lab.peers.description import Description, describe
from symdyn.lab.peers.models import CASES, Bound, cases, turbine_tree
from symdyn.lab.peers.program import Program, unsorted, unsorted_derivatives
from symdyn.lab.peers.table import heading, line, record, verdict
from symdyn.lab.peers.timing import agree, timed
from symdyn.model.joints import Spherical
from symdyn.model.orientation import EulerAngles
from symdyn.model.system import System
from symdyn.runtime.building.compiler import find_compiler

needs_c = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


def pinocchio_model(description: Description) -> Any:
    """The model that the Python package of Pinocchio makes of a description."""
    pin = pytest.importorskip("pinocchio")
    model = pin.Model()

    def number(word: str) -> float:
        value = description.values[int(word.lstrip("-p"))] if "p" in word else abs(float(word))
        return -value if word[0] == "-" else value

    frames: dict[int, Any] = {}
    for words in map(str.split, description.text.splitlines()):
        numbers = [number(word) for word in words[1:] if word[0] in "-p0123456789"]
        if words[0] == "gravity":
            model.gravity.linear = np.array(numbers)
        elif words[0] == "joint":
            kind = pin.JointModelSpherical() if words[2] == "S" else getattr(pin, f"JointModel{words[2]}")()
            place = frames.get(int(numbers[0]), pin.SE3.Identity()) * pin.SE3(np.eye(3), np.array(numbers[1:]))
            model.addJoint(int(numbers[0]), kind, place, f"joint{model.njoints}")
        elif words[0] == "turned":
            kind = getattr(pin, f"JointModel{words[2]}")()
            place = pin.SE3(np.reshape(numbers[4:13], (3, 3)), np.array(numbers[13:]))
            place = frames.get(int(numbers[0]), pin.SE3.Identity()) * place
            model.addJoint(int(numbers[0]), kind, place, f"joint{model.njoints}")
        elif words[0] == "frame":
            frames[int(numbers[0])] = pin.SE3(np.reshape(numbers[1:10], (3, 3)), np.array(numbers[10:]))
        else:
            joint, m, x, y, z, xx, xy, xz, yy, yz, zz = numbers
            inertia = pin.Inertia(m, np.array([x, y, z]), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
            model.inertias[int(joint)] = frames.get(int(joint), pin.SE3.Identity()).act(inertia)
    return model


def pinocchio_accelerations(description: Description, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """The accelerations of a description by Pinocchio, in symdyn's order."""
    model = pinocchio_model(description)
    import pinocchio as pin

    result = pin.aba(model, model.createData(), q[list(description.q_order)], u[list(description.u_order)], np.zeros(model.nv))
    return unsorted(np.array(result), description.u_order)


def in_turned_frames() -> Any:
    """The PUMA 560, whose joints are turned on the link before, or turned on their own link."""
    return systems.puma560("modified")


MADE = {**{name: case.make for name, case in CASES.items()}, "puma560": systems.puma560, "in turned frames": in_turned_frames}


@pytest.mark.parametrize("name", ["n_link_pendulum(5)", "spatial_chain(4)", "turbine_tree", "turbine_tree_body_rates", "puma560",
                                  "in turned frames"])
def test_description_is_the_model(name: str) -> None:
    system = MADE[name]()
    equations, description = system.embedding(), describe(system.check())
    state = random_state(equations)
    x_dot = equations.compile(backend="numpy").rhs(0.0, np.concatenate([state.q, state.u]))
    found = pinocchio_accelerations(description, state.q, state.u)
    assert np.linalg.norm(found - x_dot[len(state.q):]) < 1e-11 * np.linalg.norm(found)


def test_every_number_of_the_turbine_is_a_parameter() -> None:
    text = describe(turbine_tree().check()).text
    written_out = {word for line in text.splitlines() for word in line.split()[3 if line.startswith("joint") else 2:]
                   if "p" not in word}
    assert written_out == {"0"}
    assert len(turbine_tree().check().parameters) == 19


def test_what_peers_cannot_describe() -> None:
    with pytest.raises(SymdynError, match="has loads or a moving ground; peers are compared under gravity alone"):
        describe(systems.cart_pole().check())
    with pytest.raises(SymdynError, match=r"joint .* is spherical; the peers take .* free ones in frames that are not turned"):
        system = System("ball", gravity=[0, 0, -9.81])
        ball = system.add_body("ball", mass=1, inertia=[1, 1, 1])
        system.add_joint(Spherical("ball", system.ground, ball, orientation=EulerAngles("ZYX")))
        describe(system.check())
    with pytest.raises(SymdynError, match=r"no number for m1; add them to its defaults"):
        system = systems.n_link_pendulum(n=2)
        del system.defaults[next(p for p in system.defaults if p.name == "m1")]
        describe(system.check())


def row(**changes: Any) -> Row:
    """A row that meets its bounds exactly, with some changes."""
    given = {"operations": 100, "times": {"symdyn": 80.0, "casadi runtime": 100.0, "pinocchio": 480.0},
             "bound": Bound(100, 0.80, 6.0), **changes}
    return Row("mechanism", "embedding", leanest=given["operations"], prologue=10, chain=20,
               casadi_operations={"casadi baked": 120, "casadi runtime": 130}, difference=1e-15, **given)


@pytest.mark.parametrize("changes, wanted", [
    ({}, "MET"),
    ({"operations": 101}, "MISSED: 101 operations > 100"),
    ({"times": {"symdyn": 81.0, "casadi runtime": 100.0, "pinocchio": 486.0}}, "MISSED: symdyn/CasADi 0.81 > 0.80"),
    ({"times": {"symdyn": 80.0, "casadi runtime": 100.0, "pinocchio": 472.0}}, "MISSED: Pinocchio/symdyn 5.9 < 6.0"),
    ({"times": {"symdyn": 80.0}}, "MET, as far as it could be measured"),
    ({"times": {"symdyn": 80.0}, "operations": 101}, "MISSED: 101 operations > 100"),
    ({"bound": Bound()}, ""),
])
def test_verdict(changes: dict[str, Any], wanted: str) -> None:
    measured = row(**changes)
    assert verdict(measured).endswith(wanted) and bool(verdict(measured)) == bool(wanted)
    assert bool(measured.misses()) == ("MISSED" in wanted)
    assert record(measured)["missed"] == measured.misses()


def test_columns_are_aligned() -> None:
    above, titles = heading().splitlines()
    cells = line(row())
    assert above.rstrip().endswith("ratio of times")
    for title, cell in (("chain", "20"), ("Pinocchio/symdyn", "6.0"), ("symdyn/CasADi", "0.80")):
        assert titles[:titles.index(title) + len(title)].rstrip() == titles[:titles.index(title) + len(title)]
        assert cells[:titles.index(title) + len(title)].endswith(cell)


def derivatives_row(**changes: Any) -> derivatives.Row:
    """A row of derivatives that meets its bounds exactly, with some changes."""
    given = {"executed": (90, 80), "casadi_operations": 300, "times": {"symdyn": 25.0, "casadi": 100.0, "pinocchio": 625.0},
             "bound": derivatives.Bound(80, 0.25, 25.0), **changes}
    return derivatives.Row("mechanism", "embedding", 100, difference=1e-15, **given)


@pytest.mark.parametrize("changes, wanted", [
    ({}, "MET"),
    ({"executed": (90, 81)}, "MISSED: 81 operations > 80"),
    ({"times": {"symdyn": 26.0, "casadi": 100.0, "pinocchio": 650.0}}, "MISSED: symdyn/CasADi 0.260 > 0.25"),
    ({"times": {"symdyn": 25.0, "casadi": 100.0, "pinocchio": 615.0}}, "MISSED: Pinocchio/symdyn 24.6 < 25.0"),
    ({"times": {"symdyn": 25.0}}, "MET, as far as it could be measured"),
    ({"bound": derivatives.Bound()}, ""),
])
def test_verdict_on_derivatives(changes: dict[str, Any], wanted: str) -> None:
    measured = derivatives_row(**changes)
    assert derivatives.verdict(measured).endswith(wanted) and bool(derivatives.verdict(measured)) == bool(wanted)
    assert derivatives.line(measured).startswith("mechanism") and derivatives.line(measured).endswith(wanted)
    assert derivatives.record(measured)["missed"] == measured.misses() and bool(measured.misses()) == ("MISSED" in wanted)


def test_names_of_cases_of_derivatives() -> None:
    assert list(derivatives.cases(["spatial_chain", "puma560"])) == ["spatial_chain(7)", "spatial_chain(12)", "puma560"]
    assert derivatives.cases(None) == derivatives.CASES
    with pytest.raises(SymdynError, match=r"no benchmark model four_bar for derivatives; there are n_link_pendulum\(5\)"):
        derivatives.cases(["four_bar"])


def test_operations_that_are_executed() -> None:
    short = systems.get("cart_pole").embedding()
    assert derivatives.executed(short, 70) == (70, 70)  # its columns one by one take less
    assert derivatives.leanest(systems.get("n_link_pendulum", n=5)).formulation == "embedding"
    long = systems.get("n_link_pendulum", n=5).embedding()
    four, eight = derivatives.executed(long, 1094)
    assert eight < four < 1094


def counting(name: str, value: float, calls: list[str]) -> Program:
    """A program that only notes its turns."""
    return Program(name, lambda n: calls.append(name), lambda: np.array([value, 1.0]))


def test_programs_take_turns_and_must_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("symdyn.timing.loops.TIMING_SECONDS", 0.0)
    calls: list[str] = []
    programs = [counting("a", 1.0, calls), counting("b", 1.0 + 1e-9, calls)]
    assert 0 < agree(programs, "mechanism") < 1e-8
    calls.clear()
    assert set(timed(programs, 3)) == {"a", "b"}
    assert calls[-6:] == ["a", "b"] * 3
    with pytest.raises(SymdynError, match="mechanism: c and a do not compute the same accelerations"):
        agree([*programs, counting("c", 1.1, calls)], "mechanism")
    held = [dataclasses.replace(c, multipliers=partial(np.full, 1, 1.0 + k)) for k, c in enumerate(programs)]
    with pytest.raises(SymdynError, match="mechanism: b and a do not compute the same multipliers"):
        agree(held, "mechanism")


def test_names_of_cases() -> None:
    found, loop = cases(["spatial_chain", "turbine_tree"])
    assert list(found) == [*[f"spatial_chain({n})" for n in (4, 6, 7, 12)], "turbine_tree"] and not loop
    assert cases(["four_bar"]) == ({}, True) and cases(None) == (CASES, True)
    with pytest.raises(SymdynError, match=r"no benchmark model crane; there are n_link_pendulum\(5\).*, four_bar"):
        cases(["crane"])


@needs_c
def test_without_peers(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    monkeypatch.setattr("symdyn.bench.toolchain._installed", lambda name: None)
    code = main(["bench", "peers", "--models", "turbine_tree", "--repeats", "1", "--json", str(tmp_path / "rows.json")])
    printed = capsys.readouterr().out
    assert printed.splitlines()[0] == ("the peers are not installed, symdyn is measured alone; "
                                       "run: pip install 'symdyn[peers]'")
    (found,) = json.loads((tmp_path / "rows.json").read_text())["models"]
    assert code == bool(found["missed"]) and found["operations"] > 100
    assert found["times"].keys() == {"symdyn"} and 0 < found["times"]["symdyn"] < 1e5
    assert found["ratios"]["symdyn_over_casadi_runtime"] is None


@needs_c
def test_derivatives_without_peers(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    monkeypatch.setattr("symdyn.bench.toolchain._installed", lambda name: None)
    code = main(["bench", "peers", "--derivatives", "--models", "n_link_pendulum", "--repeats", "1", "--json",
                 str(tmp_path / "rows.json")])
    printed = capsys.readouterr().out
    assert "symdyn is measured alone" in printed and "MET, as far as it could be measured" in printed and code == 0
    (found,) = json.loads((tmp_path / "rows.json").read_text())["derivatives"]
    assert found["executed"][-1] <= 800 and found["times"].keys() == {"symdyn"} and found["casadi_operations"] is None


@needs_c
def test_formulation_is_a_parameter(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []

    def make(system: Any) -> Any:
        asked.append(system.name)
        return system.embedding()

    assert benchmark("turbine_tree", CASES["turbine_tree"], [], 1, make).formulation == "embedding" and asked == ["turbine_tree"]


def test_missing_compiler_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CXX", "no-such-compiler")
    with pytest.raises(SymdynError, match="compiler was found, tried no-such-compiler; install"):
        toolchain.cpp_compiler([])


# The program that generates CasADi's code through Pinocchio is C++ that takes a third of a minute to compile.
@needs_c
@pytest.mark.slow
@pytest.mark.sweep
def test_casadi_compared_with_symdyn() -> None:
    """The same accelerations, and CasADi's operations as they were published with the bounds; building takes a minute."""
    pytest.importorskip("casadi", reason="the peers are not installed; run: pip install 'symdyn[peers]'")
    pytest.importorskip("pinocchio", reason="the peers are not installed; run: pip install 'symdyn[peers]'")
    found = benchmark("n_link_pendulum(5)", CASES["n_link_pendulum(5)"], [CasadiPeer()], 1)
    assert found.casadi_operations == {"casadi baked": 328, "casadi runtime": 363, "casadi hoisted": 363}
    assert found.times.keys() == {"symdyn", *found.casadi_operations} and found.difference < 1e-12


@needs_c
@pytest.mark.slow
@pytest.mark.sweep
@pytest.mark.parametrize("name", ["n_link_pendulum(5)", "puma560"])
def test_derivatives_compared_with_peers(name: str) -> None:
    """The same derivatives by CasADi's C; Pinocchio's C++, which takes minutes to build, takes part in the command alone."""
    pytest.importorskip("casadi", reason="the peers are not installed; run: pip install 'symdyn[peers]'")
    pytest.importorskip("pinocchio", reason="the peers are not installed; run: pip install 'symdyn[peers]'")
    found = derivatives.benchmark(name, derivatives.CASES[name], [CasadiPeer()], 1)
    assert found.times.keys() == {"symdyn", "casadi"} and found.difference < 1e-11


@pytest.mark.parametrize("name", ["n_link_pendulum(5)", "puma560"])
def test_derivatives_are_those_of_pinocchios_algorithm(name: str) -> None:
    pin = pytest.importorskip("pinocchio")
    system = derivatives.CASES[name].make()
    equations, description = system.embedding(), describe(system.check())
    state = random_state(equations)
    model = pinocchio_model(description)
    data = model.createData()  # what is returned are views of its arrays
    by_q, by_u, _ = pin.computeABADerivatives(model, data, state.q[list(description.q_order)],
                                              state.u[list(description.u_order)], np.zeros(model.nv))
    wanted = unsorted_derivatives(np.hstack([by_q, by_u]), description)
    n = len(state.q)
    found = equations.compile(backend="numpy").jacobian(0.0, np.concatenate([state.q, state.u]), wrt=["x"]).x
    assert found is not None
    assert np.linalg.norm(found[n:] - wanted) < 1e-11 * np.linalg.norm(wanted)


def test_one_missing_peer_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent() -> None:
        raise SymdynError("gcc could not build it.\nCommand: c++\nSource kept at: x.c\nOutput:\n1: error: no\n2: error: nor that")

    monkeypatch.setattr(command, "CasadiPeer", absent)
    monkeypatch.setattr(command, "PinocchioPeer", lambda: "Pinocchio's peer")
    assert command.find_peers() == (["Pinocchio's peer"], [
        "CasADi is left out: gcc could not build it. 1: error: no Source kept at: x.c"])
