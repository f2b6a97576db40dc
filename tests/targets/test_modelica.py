"""Modelica models: parsed by pymoca's grammar, compiled and simulated by Rumoca, they give what the C module gives."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import symdyn as sd
from symdyn.cli import main
from symdyn.errors import UnsupportedExpression
from symdyn.lab.modelica import compared, computed, simulated
from symdyn.runtime.module import Module
from symdyn.targets.modelica import unit_of
from tests.helpers import swept
from tests.mechanisms import strange


def written(module: Module, folder: Path, **given: object) -> tuple[str, str]:
    """The texts of the model of a mechanism and of its test."""
    model, test = (path.read_text(encoding="utf-8") for path in module.to_modelica(folder, **given))
    return model, test


def ratio(x: float, y: float) -> tuple[float, float]:
    return x / (1 + y * y), x * y


def square(x: float) -> float:
    return x * x


def compiled(system: sd.System) -> Module:
    return (system.augmented() if system.loops or system.constraints else system.embedding()).compile(backend="c")


def ball(**event: object) -> sd.System:
    """A ball above a floor."""
    y = sd.coordinates("y")
    m, g = sd.parameters("m g", positive=True)
    system = sd.System("ball", gravity=[0, -g])
    body = system.add_body("ball", mass=m)
    system.add_joint(sd.Prismatic("fall", system.ground, body, y, axis=[0, 1]))
    system.add_event("floor", y, direction=-1, **event)
    system.defaults, system.initial = {m: 2.0, g: 9.81}, {y: 1.0}
    return system


@pytest.mark.parametrize("name", ["two_link_arm", "slider_crank", "spatial_chain", "rolling_disc"])
def test_equations_agree_with_c(name: str, tmp_path: Path) -> None:
    pytest.importorskip("pymoca")
    module = compiled(sd.systems.get(name))
    errors, apart = compared(module, written(module, tmp_path)[0], 200)
    assert len(errors) == 200 and apart == 0
    assert np.median(errors) < 5e-15 and errors.max() < 5e-14  # 1e-16 times what the state's condition makes of it


@pytest.mark.parametrize("name", swept(["four_bar", "strange"], "four_bar"))
def test_the_written_test_passes(name: str, tmp_path: Path) -> None:
    pytest.importorskip("rumoca")
    model, test = written(compiled(strange() if name == "strange" else sd.systems.get(name)), tmp_path)
    assert test.count("assert(") > 10
    simulated(model + test, f"{name}_test", 1e-6, 1e-6)


def test_the_written_test_finds_a_wrong_result(tmp_path: Path) -> None:
    pytest.importorskip("rumoca")
    model, test = written(compiled(sd.systems.two_link_arm()), tmp_path)
    wrong = re.sub(r"^(  der\(\w+\) = )(.*);$", r"\1\2 + 1e-6;", model, flags=re.MULTILINE)
    assert wrong != model
    with pytest.raises(Exception, match=r"assert failed.*rates1"):
        simulated(wrong + test, "two_link_arm_test", 1e-6, 1e-6)


def test_a_motion_with_constraints_is_that_of_simulate(tmp_path: Path) -> None:
    pytest.importorskip("rumoca")
    module = compiled(sd.systems.four_bar())
    model, _ = written(module, tmp_path)
    found = simulated(model, "four_bar", 1.0, 0.1, 1e-12)
    sol = module.simulate(np.linspace(0, 1, 11), rtol=1e-12)
    x = np.array([found[n] for n in module.metadata.x]).T
    assert np.abs(x - sol.x).max() < 1e-7  # the error of the BDF, which falls with its tolerance
    assert 0 < np.max(found["violation"]) < 1e-9


def test_states_where_constraints_depend_take_the_numeric_algorithm(tmp_path: Path) -> None:
    """A parallelogram that lies flat: the regular equations fail their check, and C falls back, too."""
    pytest.importorskip("rumoca")
    system = sd.systems.four_bar()
    lengths = {"l1": 1.0, "l2": 2.0, "l3": 1.0, "d": 2.0}
    system.defaults = {k: lengths.get(str(k), v) for k, v in system.defaults.items()}
    module = compiled(system)
    start = {"q": [0.0, 0.0, -np.pi], "u": [0.3, -0.3, 0.3]}
    model, _ = written(module, tmp_path, **start)
    rates = "".join(f"  Real rate{k} = der(flat.{n});\n" for k, n in enumerate(module.metadata.x))
    whole = f"{model}\nmodel compared\n  four_bar flat(baumgarte=0);\n{rates}  Real regular = flat.regular;\nend compared;\n"
    found = simulated(whole.replace("\nprotected\n", "\n"), "compared", 1e-9, 1e-9)
    assert found["regular"][0] == 0
    wanted = module.evaluate("rhs", 0.0, [*start["q"], *start["u"]])
    assert np.allclose([found[f"rate{k}"][0] for k in range(6)], wanted, rtol=1e-9, atol=1e-12)


def test_events_reset_and_stop(tmp_path: Path) -> None:
    pytest.importorskip("rumoca")
    y = sd.coordinates("y")
    module = ball(reset={y.dot: -y.dot / 2}).embedding().compile(backend="c")
    model, _ = written(module, tmp_path)
    found = simulated(model, "ball", 0.8, 0.1, 1e-10)
    sol = module.simulate(np.linspace(0, 0.8, 9), rtol=1e-11)
    assert abs(found["y"][-1] - sol.q[-1, 0]) < 1e-6 and found["y_dot"][-1] < sol.u[0, 0] + 9.81 * 0.8
    stopped = ball(stop=True).embedding().compile(backend="c")
    found = simulated(written(stopped, tmp_path)[0], "ball", 0.8, 0.1, 1e-10)
    assert abs(found.time[-1] - np.sqrt(2 / 9.81)) < 1e-6


def test_events_that_reset_the_same_state_are_in_one_clause(tmp_path: Path) -> None:
    y = sd.coordinates("y")
    system = ball(reset={y.dot: -y.dot})
    system.add_event("ceiling", y - 3, direction=1, reset={y.dot: -y.dot})
    system.add_event("seen", y - 1, direction=0, stop=True)
    model, _ = written(system.embedding().compile(backend="numpy"), tmp_path)
    assert model.count("elsewhen event_ceiling > 0 then") == 1 and model.count("  when ") == 2
    assert "when {event_seen > 0, event_seen < 0} then\n    terminate(\"the event seen\");" in model


def test_names_units_inputs_and_outputs(tmp_path: Path) -> None:
    module = compiled(strange())
    model, _ = written(module, tmp_path)
    assert "parameter Real end_ = 3.5" in model and "parameter Real block_ = 1.5" in model and "input Real F(" in model
    assert "output Real values[25]" in model
    arm = written(compiled(sd.systems.two_link_arm()), tmp_path, q={"q1": 0.5}, inputs={"tau1": 2.0}, params={"m1": 3.0})[0]
    assert 'parameter Real m1(unit="kg") = 3.0 "mass of link1";' in arm and "input Real tau1(unit=\"N.m\", start=2.0)" in arm
    assert 'Real q1(unit="rad", start=0.5, fixed=true) "coordinate";' in arm and "output Real tip[2](each unit=\"m\")" in arm
    units = {"kg m^2": "kg.m2", "N m/rad": "N.m/rad", "m/s^2": "m/s2", "1/s": "1/s", "": "", "furlong": ""}
    assert [unit_of(unit) for unit in units] == list(units.values())


def test_unit_quaternions_stay_unit(tmp_path: Path) -> None:
    system = sd.System("thrown", gravity=[0, 0, -9.81])
    body = system.add_body("body", mass=1, inertia=[1, 2, 3])
    system.add_joint(sd.Free("joint", system.ground, body, orientation=sd.EulerParameters()))
    module = system.embedding().compile(backend="numpy")
    model, _ = written(module, tmp_path)
    assert len(module.metadata.unit_groups) == 1 and re.search(r"when abs\(.* - 1\) > 1e-6 then\n    reinit\(", model)


def test_functions_of_the_user(tmp_path: Path) -> None:
    pytest.importorskip("rumoca")
    system, q = sd.systems.pendulum(), sd.coordinates("q1")
    text = """function ratio
  input Real x;
  input Real y;
  output Real r[2];
algorithm
  r[1] := x/(1 + y*y);
  r[2] := x*y;
end ratio;"""
    first, second = sd.External("ratio", ["x", "y"], 2, python=ratio, texts={"modelica": text})(q, q.dot)
    system.add_torque("bob", first + 2 * second)
    model, test = written(system.embedding().compile(backend="numpy"), tmp_path)
    simulated(model + test, "pendulum_test", 1e-6, 1e-6)


@pytest.mark.parametrize(("given", "message"), [
    ({"inputs": {"tau1": lambda t, x: 0.0}}, "a Modelica model asked for with tau1 = .*a function in Python"),
    ({"q": {"nothing": 1.0}}, "nothing"), ({"folder": 3}, "the path of the folder")])
def test_what_a_model_cannot_have_is_rejected(tmp_path: Path, given: dict[str, object], message: str) -> None:
    module = sd.systems.two_link_arm().compile(backend="numpy")
    with pytest.raises(sd.ArgumentError, match=message):
        module.to_modelica(**{"folder": tmp_path, **given})


def test_mechanisms_that_a_model_cannot_have_are_rejected(tmp_path: Path) -> None:
    with pytest.raises(UnsupportedExpression, match=r"floating_crane calls the numeric algorithm symdyn_c.*take an FMU"):
        sd.systems.floating_crane().compile(backend="numpy").to_modelica(tmp_path)
    crank = sd.systems.slider_crank()
    theta = sd.coordinates("theta")
    crank.add_event("turned", theta - 1, reset={theta.dot: 0})
    with pytest.raises(sd.ArgumentError, match=r"hold again after the resets of the event turned.*take an FMU"):
        crank.augmented().compile(backend="numpy").to_modelica(tmp_path)
    system, q = sd.systems.pendulum(), sd.coordinates("q1")
    system.add_torque("bob", sd.External("square", ["x"], python=square)(q))
    with pytest.raises(sd.SymdynError, match=r"square.*modelica"):
        system.embedding().compile(backend="numpy").to_modelica(tmp_path)
    with pytest.raises(sd.ArgumentError, match="violate"):
        sd.systems.slider_crank().compile(backend="numpy").to_modelica(tmp_path, q=[0.3, 2.0])
    with pytest.raises(sd.SymdynError, match=r"a Modelica model is written by module.to_modelica"):
        sd.systems.pendulum().embedding().write(tmp_path, backend="modelica")
    bouncing = ball(stop=True)
    bouncing.add_contact(sd.Contact("below", bouncing.bodies[0], bouncing.ground, restitution=0.8))
    with pytest.raises(sd.ArgumentError, match=r"a Modelica model asked for, but .* rigid contact below"):
        bouncing.embedding().compile(backend="numpy").to_modelica(tmp_path)


def test_violations_of_constraints_of_speeds_are_outputs(tmp_path: Path) -> None:
    skate, _ = written(sd.systems.get("skate").compile(backend="numpy"), tmp_path)
    assert "output Real violation_rate(unit=\"m/s\")" in skate and "output Real violation(" not in skate
    bars, _ = written(sd.systems.four_bar().augmented().compile(backend="numpy"), tmp_path)
    assert bars.count("AssertionLevel.warning") == 2 and "output Real violation(unit=\"m\")" in bars


def test_ranges_of_validity_become_warnings(tmp_path: Path) -> None:
    model, _ = written(sd.systems.get("land_wind_turbine").compile(backend="numpy"), tmp_path)
    assert model.count("AssertionLevel.warning") >= 1 and "inf" not in re.sub(r"\"[^\"]*\"", "", model)


def test_all_operations_are_computed(tmp_path: Path) -> None:
    pytest.importorskip("pymoca")
    module = compiled(strange())
    rows = np.random.default_rng(2).normal(size=(5, 4)) / 2
    found = computed(module, written(module, tmp_path)[0], rows, 0.5, np.ones((5, 1)))
    assert np.allclose(found, module.evaluate("rhs", 0.5, rows, inputs=np.ones((5, 1))), rtol=1e-14)


def test_the_command_writes_a_model(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "pendulum", "--modelica", "--output", str(tmp_path)]) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["pendulum.mo", "pendulum_test.mo"]
    assert main(["export", "pendulum"]) == 2 and "--modelica" in capsys.readouterr().err
