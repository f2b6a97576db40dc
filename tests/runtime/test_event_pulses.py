"""Pulses far narrower than steps are found, whatever their form, or warned of; ordinary events are proved without a warning."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn import panels
from symdyn.errors import ArgumentError, SimulationWarning
from symdyn.lab.events import count, draw, measure, system
from tests.helpers import swept

T = sd.t
ROOT = np.sqrt(np.log(2))
# Value of the height y with its zeros; y = t.
PULSES: dict[str, tuple[Callable[[Any], Any], list[float]]] = {
    "bell over time": (lambda y: sp.exp(-((T - 33.3) / 0.2) ** 2) - 0.5, [33.3 - 0.2 * ROOT, 33.3 + 0.2 * ROOT]),
    "narrow bell over time": (lambda y: sp.exp(-((T - 33.3) / 0.02) ** 2) - 0.5, [33.3 - 0.02 * ROOT, 33.3 + 0.02 * ROOT]),
    "bell": (lambda y: sp.exp(-((y - 33.3) / 0.2) ** 2) - 0.5, [33.3 - 0.2 * ROOT, 33.3 + 0.2 * ROOT]),
    "peak": (lambda y: 1 / (1 + ((y - 33.3) / 0.05) ** 2) - 0.5, [33.25, 33.35]),
    "window": (lambda y: sp.tanh(50 * (y - 33.3)) - sp.tanh(50 * (y - 33.4)) - 1, [33.30000182, 33.39999818]),
    "roof": (lambda y: sp.Max(0.05 - sp.Abs(y - 33.3), -0.01), [33.25, 33.35]),
    "box": (lambda y: sp.Piecewise((1, (y > 33.3) & (y < 33.4)), (-1, True)), [33.3, 33.4]),
}
METHODS = [("c", "dop853"), ("c", "radau"), ("c", "taylor"), ("c", "gauss"), ("c", "RK45"), ("numpy", "DOP853"),
           ("numpy", "Radau")]


def particle(value: Callable[[Any], Any], **options: Any) -> sd.System:
    """A free particle at 1 m/s with one event."""
    y = sd.coordinates("y")
    s = sd.System("particle", gravity=[0, 0])
    s.add_joint(sd.Prismatic("along", s.ground, s.add_body("mass", mass=1), y, axis=[0, 1]))
    s.add_event("pulse", value(y), **options)
    s.initial = {y.dot: 1}
    return s


@pytest.fixture(scope="module")
def compiled() -> Any:
    known: dict[Any, Any] = {}

    def of(name: str, backend: str) -> Any:
        if (name, backend) not in known:
            known[name, backend] = particle(PULSES[name][0]).embedding().compile(backend=backend)
        return known[name, backend]

    return of


@pytest.mark.every_value
@pytest.mark.filterwarnings("error::symdyn.errors.SimulationWarning")
@pytest.mark.parametrize(("backend", "method"), METHODS)
@pytest.mark.parametrize("name", PULSES)
def test_a_narrow_pulse_within_a_long_step_is_found(compiled: Any, name: str, backend: str, method: str) -> None:
    run = compiled(name, backend).simulate((0, 100), method=method)
    np.testing.assert_allclose(run.events["pulse"].t, PULSES[name][1], rtol=0, atol=1e-7)


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_a_narrow_pulse_ends_the_motion_in_the_run_itself(backend: str) -> None:
    """Also backward in time, where the other zero comes first."""
    module = particle(PULSES["bell"][0], stop=True).embedding().compile(backend=backend)
    forward, backward = module.simulate((0, 100)), module.simulate((100, 0), q=[100])
    assert forward.t[-1] == pytest.approx(33.3 - 0.2 * ROOT, abs=1e-9)
    assert backward.t[-1] == pytest.approx(33.3 + 0.2 * ROOT, abs=1e-9)


@functools.cache
def driven(backend: str) -> Any:
    F = sd.inputs("F")
    return particle(lambda y: F - sp.Rational(1, 2)).embedding().compile(backend=backend)


def pulse(t: float, x: np.ndarray) -> float:
    return float(np.exp(-((t - 33.3) / 0.02) ** 2))


@pytest.mark.every_value
@pytest.mark.parametrize("backend", ["c", "numpy"])
@pytest.mark.parametrize("given", [{"F": pulse}, pulse])
def test_a_pulse_of_an_input_function_is_warned_of_or_found_with_a_spacing(backend: str, given: Any) -> None:
    module = driven(backend)
    match = ("particle: zeros of events may be missed: pulse depends on the input F, and a pulse of a function between two "
             "samples is not seen; give event_spacing, the time between samples, as short as the shortest pulse that matters")
    with pytest.warns(SimulationWarning, match=match):
        assert module.simulate((0, 100), inputs=given).doubts
    spaced = module.simulate((0, 100), inputs=given, event_spacing=0.02)
    np.testing.assert_allclose(spaced.events["pulse"].t, [33.3 - 0.02 * ROOT, 33.3 + 0.02 * ROOT], rtol=0, atol=1e-9)
    assert spaced.doubts == ()


@pytest.mark.filterwarnings("error::symdyn.errors.SimulationWarning")
@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_inputs_that_are_known_throughout_need_no_spacing(backend: str) -> None:
    module = driven(backend)
    table = (np.array([0, 33.3, 33.32, 33.34, 100]), np.array([0, 0, 1, 0, 0.0]))
    np.testing.assert_allclose(module.simulate((0, 100), inputs={"F": table}).events["pulse"].t, [33.31, 33.33], atol=1e-9)
    assert not len(module.simulate((0, 100), inputs={"F": 0.3}).events["pulse"].t)
    assert module.simulate((0, 100), inputs={"F": pulse}, events=False).doubts == ()


def test_a_pulse_of_a_motion_is_warned_of() -> None:
    z = sd.motions("z")
    module = particle(lambda y: z - sp.Rational(1, 2)).embedding().compile(backend="numpy")

    def followed(t: float) -> tuple[float, float, float]:
        v, w = np.exp(-((t - 33.3) / 0.2) ** 2), 1 / 0.2**2
        return v, -2 * (t - 33.3) * w * v, (-2 * w + 4 * ((t - 33.3) * w) ** 2) * v

    with pytest.warns(SimulationWarning, match="pulse depends on the input z, and"):
        module.simulate((0, 100), inputs={"z": followed})
    assert len(module.simulate((0, 100), inputs={"z": followed}, event_spacing=0.2).events["pulse"].t) == 2


def test_a_function_of_the_user_is_warned_of_or_sampled() -> None:
    text = "static int bell(const double *in, double *out) { out[0] = exp(-(in[0] - 33.3)*(in[0] - 33.3)/0.04); return 0; }"
    bell = sd.External("bell", ["s"], c=text)
    module = particle(lambda y: bell(y) - sp.Rational(1, 2)).embedding().compile(backend="c")
    with pytest.warns(SimulationWarning, match=r"pulse depends on the function bell\(s\), and a pulse"):
        module.simulate((0, 100))
    spaced = module.simulate((0, 100), event_spacing=0.2)
    np.testing.assert_allclose(spaced.events["pulse"].t, PULSES["bell"][1], rtol=0, atol=1e-9)
    assert spaced.doubts == ()


def hinged(value: Callable[[Any], Any], backend: str = "numpy") -> Any:
    """A double pendulum with an event of the force on its hinge, whose speeds equations are solved for."""
    q = sd.coordinates("q1 q2")
    s = sd.System("pendulum", gravity=[0, -1])
    upper, lower = (s.add_body(name, mass=1) for name in ("upper", "lower"))
    s.add_joint(sd.Revolute("hinge", s.ground, upper, q[0], child_point=[0, 1]))
    s.add_joint(sd.Revolute("knee", upper, lower, q[1], child_point=[0, 1]))
    s.add_event("pull", value(sd.reaction("hinge")[1]))
    s.initial = {q[0]: 1}
    return s.embedding().compile(backend=backend)


@pytest.mark.parametrize("backend", swept(["c", "numpy"], "c"))
def test_a_narrow_pulse_of_a_reaction_is_warned_of_or_found_with_a_spacing(backend: str) -> None:
    level = hinged(lambda N: N - 2, backend).simulate((0, 3), rtol=1e-10)
    module = hinged(lambda N: sp.exp(-((N - 2) / 0.001) ** 2) - sp.Rational(1, 2), backend)
    match = "pendulum: zeros of events may be missed: pull depends on exp of what is only sampled, and a pulse"
    with pytest.warns(SimulationWarning, match=match):
        module.simulate((0, 3))
    spaced = module.simulate((0, 3), event_spacing=2e-4, rtol=1e-10)
    assert level.doubts == spaced.doubts == () and len(level.events["pull"].t) > 0
    np.testing.assert_allclose(spaced.events["pull"].t.reshape(-1, 2).mean(axis=1), level.events["pull"].t, atol=1e-4)


def test_many_motions_warn_of_a_narrow_pulse_of_a_reaction() -> None:
    module = hinged(lambda N: sp.exp(-((N - 2) / 0.001) ** 2) - sp.Rational(1, 2), "c")
    match = "of 2 motions 0: pendulum: zeros of events may be missed: pull depends on exp of what is only sampled, .*; 1: pend"
    with pytest.warns(SimulationWarning, match=match):
        many = module.simulate_batch({"q1": [1, 1.1]}, t=(0, 1))
    assert many.success.all()


def test_a_pulse_in_a_long_value_is_warned_of() -> None:
    """A sum of two hundred sines, which bounds say little of."""
    s = particle(lambda y: sp.exp(-sum(sp.sin(k * y + k) for k in range(1, 201)) ** 2) - sp.Rational(1, 2))
    module = s.embedding().compile(backend="numpy")
    with pytest.warns(SimulationWarning, match="pulse depends on exp of what is only sampled, and a pulse of a function"):
        module.simulate((0, 0.01))


@pytest.mark.parametrize("backend", swept(["c", "numpy"], "c"))
def test_what_cannot_be_proved_is_warned_of(backend: str) -> None:
    """The value is 1e-6 all the time; bounds of its parts, which cancel, do not show it before a hundred thousandth of a step."""
    s = particle(lambda y: sp.sin(1000 * T) ** 2 + sp.cos(1000 * T) ** 2 - 1 + sp.Rational(1, 10**6))
    module = s.embedding().compile(backend=backend)
    match = ("particle: zeros of events may be missed: pulse .from t = [0-9.]* s on. may pass zero and back between two samples, "
             f"which {panels.MOST_PROOFS} divisions of a step do not rule out; give event_spacing, the time between samples, as "
             "short as the shortest pulse that matters")
    with pytest.warns(SimulationWarning, match=match):
        assert not len(module.simulate((0, 100)).events["pulse"].t)
    assert module.simulate((0, 100), event_spacing=1).doubts == ()


def test_a_spacing_is_a_time_that_samples_can_be_taken_at() -> None:
    module = particle(PULSES["bell"][0]).embedding().compile(backend="numpy")
    with pytest.raises(ArgumentError, match="event_spacing must be a positive number of seconds, or 0, found -1"):
        module.simulate((0, 100), event_spacing=-1)
    with pytest.raises(ArgumentError, match=r"particle: event_spacing = 1e-09 s makes over 1e\+08 samples of a run of 100 s"):
        module.simulate((0, 100), event_spacing=1e-9)
    with pytest.raises(ArgumentError, match=r"event_spacing = 1e-09 s makes over 1e\+08 samples"):
        module.simulate_batch(t=(0, 100), u=np.ones((2, 1)), event_spacing=1e-9)
    assert module.simulate_batch(t=(0, 100), u=np.ones((2, 1)), event_spacing=1).success.all()


@pytest.mark.filterwarnings("error::symdyn.errors.SimulationWarning")
@pytest.mark.parametrize("name", ["pendulum", *swept(["double_pendulum", "cart_pole"]), "four_bar",
                                  *swept(["slider_crank", "three_link_arm"]),
                                  "rolling_disc", *swept(["pendulum_absolute"])])
def test_ordinary_events_are_proved_without_a_warning(name: str) -> None:
    """Height, distance and velocity of the last body; also what rests, and what stays at the same distance."""
    s = sd.systems.get(name)
    body = s.bodies[-1]
    place, v = sd.position(body), sd.velocity(body)
    s.add_event("height", place[1] - sp.Rational(3, 10))
    s.add_event("distance", sp.sqrt(place[0] ** 2 + place[1] ** 2) - sp.Rational(4, 5))
    s.add_event("stands", v[0])
    module = s.compile()
    assert all(event.enclosed for event in module.metadata.events)
    run = module.simulate((0, 2))
    fine = module.simulate((0, 2), event_spacing=1e-3)
    for event, rows in run.events.items():
        assert len(rows.t) == len(fine.events[event].t), event


@pytest.mark.parametrize("backend", swept(["c", "numpy"], "c"))
def test_random_pulses_are_found_without_a_warning(backend: str) -> None:
    """Pulses of widths down to a millionth of the span, as in symdyn.lab.events."""
    module = system().embedding().compile(backend=backend)
    method = "dop853" if backend == "c" else "DOP853"
    for seed in range(3 if backend == "c" else 1):
        for _, rtol, kind, of in measure({backend: module}, [method], [seed], [1e-8]):
            assert of.zeros > 0 and (of.missed, of.superfluous, of.warned) == (0, 0, 0), (rtol, kind)
    drawn = draw(0, 1e-8)
    assert count(drawn.zeros["pulses_bell"][:1], drawn.zeros["pulses_bell"], 1e-6).missed == 1
