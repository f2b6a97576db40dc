"""Fits of measured motions: known parameters from noisy data, statistics against many repetitions, and what data leave open."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.errors import ArgumentError, EvaluationError, SimulationWarning
from symdyn.estimation.experiment import taken
from symdyn.estimation.fit import _problem
from symdyn.pictures.fits import _title
from symdyn.runtime.building.compiler import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
T = np.linspace(0, 10, 201)
TRUTH = {"m": 1.3, "d": 0.15}


@cache
def damped() -> Any:
    q = sd.coordinates("q")
    m, d, inertia, c = sd.parameters("m d inertia c")
    system = sd.System("damped", gravity=[0, -9.81])
    bob = system.add_body("bob", mass=m, inertia=inertia, com=[0, -c])
    hinge = system.add_joint(sd.Revolute("hinge", system.ground, bob, q))
    system.add_joint_force(hinge, -d * q.dot, name="friction")
    system.add_output("tip", sd.position(bob, [0, -2 * c]))
    system.defaults, system.initial = {m: 1.0, d: 0.2, inertia: 0.01, c: 0.5}, {q: 1.0}
    return system.embedding().compile()


def measured(seed: int, noise: float = 0.01, **start: Any) -> sd.Experiment:
    truth, rng = damped().simulate(T, params=TRUTH, **start), np.random.default_rng(seed)
    return sd.Experiment(T, {"q": truth.q[:, 0] + noise * rng.normal(size=len(T))}, **start)


def test_exact_values_without_noise() -> None:
    found = sd.fit(damped(), measured(0, 0.0), ["d", "m"])
    assert found.success and found.values == pytest.approx({"d": 0.15, "m": 1.3}, rel=1e-7) and found.n_runs < 12


def test_statistics_of_many_repetitions() -> None:
    fits = [sd.fit(damped(), measured(seed), ["d", "m"]) for seed in range(60)]
    values = np.array([[f.values["d"], f.values["m"]] for f in fits])
    deviations = np.array([[f.deviations["d"], f.deviations["m"]] for f in fits]).mean(axis=0)
    np.testing.assert_allclose(values.std(axis=0), deviations, rtol=0.3)  # three times the 10 % of 60 draws
    assert np.mean([f.noise["q"] for f in fits]) == pytest.approx(0.01, rel=0.03)
    inside = np.mean([f.confidence(0.95)["m"][0] < 1.3 < f.confidence(0.95)["m"][1] for f in fits])
    assert inside > 0.85
    repeated = np.corrcoef(values.T)[0, 1]
    assert fits[0].correlation[0, 1] == pytest.approx(repeated, abs=0.15)


def test_several_experiments_with_unknown_starts_outputs_and_priors() -> None:
    one, other = measured(1, q=[0.9]), measured(2, q=[0.4])
    truth, rng = damped().simulate(T, params=TRUTH, q=[0.4]), np.random.default_rng(3)
    values = truth.outputs["tip"] + 0.02 * rng.normal(size=(len(T), 2))
    values[::7] = np.nan
    third = sd.Experiment(T, {"tip": values}, q={"q": 0.5})
    found = sd.fit(damped(), [one, other, third], ["d", "m"], ["q"], noise={"q": 0.01, "tip": 0.02}, priors={"m": (1.3, 0.05)})
    assert list(found.values) == ["d", "m", "q(0) of experiment 1", "q(0) of experiment 2", "q(0) of experiment 3"]
    expected = [0.15, 1.3, 0.9, 0.4, 0.4]
    for (name, value), true in zip(found.values.items(), expected, strict=True):
        assert abs(value - true) < 4 * found.deviations[name], name
    assert found.misfit == pytest.approx(1, abs=0.1) and len(found.motions) == 3
    left = found.residuals[2, "tip"]
    assert np.isnan(left[::7]).all() and np.isfinite(left[1]).all()


def test_derivatives_of_residuals() -> None:
    experiments = taken(damped(), [measured(1), sd.Experiment(T, {"tip": np.zeros((len(T), 2))}, params={"c": 0.4})])
    problem = _problem(damped(), experiments, ["d", "m"], ["q"], None, {"d": (0.1, 0.2)}, None, None, 1e-11, "dop853")
    at, step = np.array([0.18, 1.1, 0.9, 0.95]), 1e-5
    sides = [[problem.residuals(at + sign * step * e) for sign in (1, -1)] for e in np.eye(4)]
    differences = np.stack([(a - b) / (2 * step) for a, b in sides], axis=-1)
    np.testing.assert_allclose(problem.jacobian(at), differences, rtol=0, atol=1e-7 * np.abs(differences).max())


def test_what_the_data_leave_open_is_named() -> None:
    """Mass, inertia and damping together may be any multiple: a free motion does not feel it."""
    found = sd.fit(damped(), measured(4), ["m", "inertia", "d"], start={"m": 1.3, "inertia": 0.01, "d": 0.15})
    assert len(found.undetermined) == 1 and np.isnan(found.covariance).all()
    shares = [float(part.split()[0]) for part in found.undetermined[0].split(" + ")]
    ratios = [found.values[name] / guess for name, guess in (("m", 1.3), ("inertia", 0.01), ("d", 0.15))]
    np.testing.assert_allclose(shares, np.array(ratios) / max(ratios), rtol=2e-2)
    assert "not determined by the data: " in str(found)


def test_bounds_hold_and_motions_that_fail_are_steps_not_taken() -> None:
    found = sd.fit(damped(), measured(5), ["d", "m"], bounds={"d": (0.16, 0.3)})
    assert found.values["d"] == 0.16 and found.at_bounds == ("d",)
    x = sd.coordinates("x")
    k = sd.parameters("k")
    system = sd.System("escape")
    body = system.add_body("body", mass=1)
    joint = system.add_joint(sd.Prismatic("slide", system.ground, body, x, axis=[1, 0]))
    system.add_joint_force(joint, k * x**3)
    system.defaults, system.initial = {k: 0.4}, {x: 1.0}
    module = system.embedding().compile()
    t = np.linspace(0, 1.2, 50)
    truth = module.simulate(t, params={"k": 1.2})
    assert sd.fit(module, sd.Experiment(t, {x: truth.q[:, 0]}), [k]).values["k"] == pytest.approx(1.2, rel=1e-7)
    with pytest.raises(EvaluationError, match=r"no motion from the guess of the fit, .*; take another start"), \
            pytest.warns(SimulationWarning, match="escape: stopped at"):
        sd.fit(module, sd.Experiment(t, {x: truth.q[:, 0]}), [k], start={k: 400})


def test_what_runs_off_is_no_minimum() -> None:
    """From a negative length the pendulum is upside down, and the longer it is the nearer it stays to where it is let go."""
    module = sd.systems.pendulum().compile()
    truth = module.simulate(np.linspace(0, 2, 50), q=[0.5])
    with pytest.warns(SimulationWarning, match="pendulum: the fit found no minimum: ran off to where the data say nothing"):
        found = sd.fit(module, sd.Experiment(truth.t, {"q1": truth.q[:, 0]}, q=[0.5]), ["l"], start={"l": -1.0})
    assert not found.success
    assert found.message == "ran off to where the data say nothing: l from -1; give bounds or priors, or another start"
    assert sd.fit(module, sd.Experiment(truth.t, {"q1": truth.q[:, 0]}, q=[0.5]), ["l"], start={"l": 0.7}).success


@pytest.mark.parametrize(("level", "text"), [
    (95, "found 95.0; pass a probability, such as 0.95"), (-1, "found -1"), (0, "found 0"), (1.0, "found 1"),
    (float("nan"), "found nan"), ("a", "found 'a'"), (True, "found True")])
def test_levels_that_are_no_probability(level: Any, text: str) -> None:
    with pytest.raises(ArgumentError, match="damped: the level of confidence must be a number between 0 and 1, ") as found:
        sd.fit(damped(), measured(0), ["d"]).confidence(level)
    assert text in str(found.value)


def test_motions_that_an_event_ends_before_the_data() -> None:
    """A fall: from a guess that lands early there is no motion; on the way such a step is not taken."""
    y = sd.coordinates("y")
    g = sd.parameters("g")
    system = sd.System("drop", gravity=[0, -g])
    system.add_joint(sd.Prismatic("fall", system.ground, system.add_body("body", mass=1), y, axis=[0, 1]))
    system.add_event("lands", y, direction=-1, stop=True)
    system.defaults, system.initial = {g: 9.0}, {y: 1.0}
    module, t = system.compile(), np.linspace(0, 0.45, 46)
    experiment = sd.Experiment(t, {y: 1 - 9.81 * t**2 / 2}, q=[1.0])
    assert sd.fit(module, experiment, [g]).values["g"] == pytest.approx(9.81, rel=1e-8)
    assert sd.fit(module, sd.Experiment(t, experiment.measured, q=0.9), [g], ["y"]).values["y(0)"] == pytest.approx(1, rel=1e-8)
    with pytest.raises(EvaluationError, match=r"no motion from the guess of the fit, event lands ended the motion at t = 0\.408"):
        sd.fit(module, experiment, [g], start={g: 12.0})


def test_picture(tmp_path: Path) -> None:
    found = sd.fit(damped(), [measured(1), measured(2)], ["d", "m"])
    figure = found.plot(tmp_path / "fit.png")
    assert (tmp_path / "fit.png").stat().st_size > 10_000 and len(figure.axes) == 4


def test_titles_and_labels_of_pictures_have_room() -> None:
    truth, rng = damped().simulate(T, params=TRUTH), np.random.default_rng(0)
    values = {"q": truth.q[:, 0] + 0.01 * rng.normal(size=len(T)), "tip": truth.outputs["tip"] + 0.01 * rng.normal(size=(201, 2))}
    found = sd.fit(damped(), [sd.Experiment(T, values)] * 3, ["d", "m"], ["q", "q_dot"], noise=0.01)
    figure = found.plot()
    figure.canvas.draw()
    title = figure.texts[0].get_window_extent()
    assert title.x0 > 0 and title.x1 < figure.bbox.x1 and title.y1 < figure.bbox.y1 and len(figure.axes) == 12
    boxes = [axes.yaxis.label.get_window_extent() for axes in figure.axes]
    assert not any(one.overlaps(other) for k, one in enumerate(boxes) for other in boxes[:k])
    assert figure.texts[0].get_text().replace("\n", " ") == f"damped: fit of {', '.join(found.values)}"
    assert _title(found, 44) == "damped: fit of d, m, q(0) of experiment 1,\nq_dot(0) of experiment 1, 4 more"


def test_faults_are_listed_together() -> None:
    with pytest.raises(ArgumentError) as found:
        sd.fit(damped(), measured(1), ["mm", "m", "m"], ["r"], bounds={"m": (2, 1), "z": (0, 1)}, priors={"m": (1, 0)}, noise=-1,
               start={"d": 1})
    for text in ("parameters has 'mm', which is no parameter; did you mean m?", "parameters has m twice",
                 "initial has 'r', which is no state", "bounds has 'z', which is not fitted; fitted are m",
                 "bounds of m are (2, 1); the first must be less", "the prior of m has the standard deviation 0",
                 "noise of q is -1; it must be a positive number", "start has 'd', which is not fitted"):
        assert text in str(found.value)


@pytest.mark.parametrize(("change", "text"), [
    ({"t": [0, 0, 1]}, "t of experiment 1 must be two or more finite times in increasing order"),
    ({"measured": {}}, "experiment 1 measures nothing"),
    ({"params": [1]}, "params of experiment 1 are [1]; pass a dictionary from names to numbers"),
    ({"params": {"m": 1}}, "m is fitted, and experiment 1 has a value of its own for it in params; leave one of them out"),
    ({"measured": {"r": T}}, "experiment 1 measures 'r', which is neither a state nor an output; there are q, q_dot, tip"),
    ({"measured": {"tip": T}}, r"tip of experiment 1 has the shape (201,); needed is (201, 2), one row for each time"),
    ({"measured": {"q": np.full(201, np.inf)}}, "q of experiment 1 has infinite values; write NaN for those that are missing"),
    ({"measured": {"q": np.full(201, np.nan)}}, "q of experiment 1 has no value")])
def test_faults_of_data(change: dict[str, Any], text: str) -> None:
    with pytest.raises(ArgumentError) as found:
        sd.fit(damped(), sd.Experiment(**{"t": T, "measured": {"q": T}, **change}), ["m"])
    assert text in str(found.value)


@pytest.mark.parametrize(("arguments", "text"), [
    (([], ["m"]), "data is []; pass an sd.Experiment or a list of them"),
    ((sd.Experiment(T, {"q": T}),), "nothing is fitted; pass parameters, or initial"),
    ((sd.Experiment(T[:2], {"q": T[:2]}), ["m", "d", "c"]), "3 unknowns are fitted to 2 values; measure more, or fit less"),
    ((sd.Experiment(T, {"q": T}), ["m"], (), {"m": (2, 3)}), "the guess 1 of m is not inside its bounds (2, 3)"),
    ((sd.Experiment(T, {"q": T}), ["m"], (), {"m": 2}), "bounds of m is 2; pass a pair of numbers"),
    ((sd.Experiment(T, {"q": T}), ["m"], (), {"m": (0.5, 10**400)}), "; pass a pair of numbers"),
    ((sd.Experiment(T, {"q": T}), ["m"], (), None, None, {"r": 1}), "noise has 'r', which is not measured; noise of q"),
    ((sd.Experiment(T, {"q": T}), ["m"], (), [(0, 1)], [(0, 1)], None, [1.0]),
     "start is [1.0]; pass a dictionary from names to values, such as {l: 1.0}; bounds is [(0, 1)]; pass a dictionary from names "
     "to values, such as {l: (0.5, 2.0)}; priors is [(0, 1)]; pass a dictionary"),
    ((sd.Experiment(T, {"q": T}), ["m"], (), None, {"m": (np.inf, 1)}), "priors of m is (inf, 1); pass a finite mean"),
    ((sd.Experiment(T, {"q": T}, q=[0.5, 0.3]), ["m"], ["q"]), "q of an experiment has 2 numbers, needed are 1: q"),
    ((sd.Experiment(T, {"q": T}, q={"q": "x"}), ["m"], ["q"]), "q at the start of an experiment must be a number, found 'x'"),
    ((sd.Experiment(T, {"q": T}), ["m"], (), None, None, None, None, 1e-8, "dop853", 0), "max_steps is 0; pass a whole number"),
    ((sd.Experiment(T, {"q": T}), ["m"], (), None, None, None, None, -1), "damped: tolerances must be positive, found rtol = -1"),
    ((sd.Experiment(T, {"q": T}), ["m"], (), None, None, None, None, 1e-8, "euler"), "damped: there is no method 'euler'"),
])
def test_faults_of_what_is_fitted(arguments: tuple[Any, ...], text: str) -> None:
    with pytest.raises(ArgumentError) as found:
        sd.fit(damped(), *arguments)
    assert text in str(found.value)
