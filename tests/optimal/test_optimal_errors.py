"""Problems that cannot be optimized: faults of a call, conditions that contradict each other, solvers that end early or are not
there."""

from __future__ import annotations

import sys
import warnings
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.optimal import ipopt
from symdyn.optimal.problem import problem_of
from symdyn.runtime.module import Module

x, v, F = sp.symbols("x x_dot F")
EFFORT = sd.Loss(integral=F**2)
REST = {"x": 1, "x_dot": 0}


def _slider(force: Any = F, **more: Any) -> sd.System:
    position = sd.coordinates("x")
    system = sd.System("slider")
    body = system.add_body("body", mass=1)
    slide = system.add_joint(sd.Prismatic("slide", system.ground, body, axis=[1, 0], coordinate=position))
    system.add_joint_force(slide, force.subs({F: sd.inputs("F"), x: position, v: position.dot}))
    return system


@pytest.fixture(scope="module")
def slider() -> Module:
    return _slider().compile(backend="c")


@pytest.mark.parametrize(("given", "text"), [
    ({"start": {"y": 1}}, "start has 'y', which is not there; there are x, x_dot"),
    ({"start": {"x_dto": 1}}, "start has 'x_dto', which is not there; did you mean x_dot?"),
    ({"start": [1.0]}, "start has the shape \\(1,\\), needed are 2 numbers: x, x_dot"),
    ({"end": {"x": (2, 1)}}, "end of x contradict each other: at least 2 and at most 1"),
    ({"end": {"x": "far"}}, "end of x is 'far'; pass a number or \\(least, most\\)"),
    ({"bounds": {"F": (1, 2, 3)}}, "bounds of F is \\(1, 2, 3\\); pass a number"),
    ({"bounds": {"x": (0, 0.5)}, "end": {"x": 1}}, "the end of x, 1, is outside of its bounds \\(0, 0.5\\)"),
    ({"bounds": {"x": (0, 2)}, "start": {"x": -1}}, "the start of x, -1, is outside of its bounds \\(0, 2\\)"),
    ({"bounds": {"x": (0, 2)}, "start": {"x": (-2, -1)}}, "the start of x, -2 to -1, is outside of its bounds"),
    ({"bounds": 3}, "bounds is 3; pass a mapping from names or symbols"),
    ({"rates": {"x": 1}}, "rates has 'x', which is not there; there are F"),
    ({"inputs": {"F": 1}, "bounds": {"F": (0, 2)}}, "F has bounds and a prescribed value"),
    ({"inputs": {"F": (0, 1)}}, "inputs of F is \\(0, 1\\); pass a number"),
    ({"duration": -1}, "duration is -1; pass a positive number of seconds"),
    ({"duration": (2, 1)}, "duration is \\(2, 1\\)"),
    ({"t": np.nan}, "t, the time at the start, is nan"),
    ({"cost": 3}, "the cost is 3; pass sd.Loss"),
    ({"cost": [EFFORT, 3]}, "the cost is .*pass sd.Loss.*or several, which are added up"),
    ({"cost": sd.Loss(integral="x")}, "the integral of the cost is 'x'; pass an expression of coordinates, speeds, inputs"),
    ({"cost": sd.Loss(end=lambda t, x, p: 3.0)}, "the function for the end of the cost of the loss returned 3.0 at t = 2; "),
    ({"cost": sd.Loss(end=lambda t, x, p: (t, 0 * x)), "duration": (1, 3)},
     "the duration is free, and a function for the end of the cost depends on t, by which it gives no derivative"),
    ({"cost": sd.Loss(integral=sp.Symbol("w"))}, "the integral of the cost has w, which is not there; there are x, x_dot, F, t"),
    ({"cost": sd.Loss(end=sp.Function("f")(x))}, "the end of the cost: "),
    ({"path": [x]}, "a condition of path is x; write sp.Eq\\(a, b\\), a <= b or a >= b"),
    ({"path": x <= 1, "boundary": [sp.true]}, "a condition of boundary is True whatever the motion is"),
    ({"path": [x + sp.Symbol("y") <= 1]}, "the condition x \\+ y <= 1 of path has y"),
    ({"parameters": {"m": (0, 1)}}, "parameters has 'm', which is not there; there are none"),
    ({"parameters": ["m"]}, "parameters is \\['m'\\]; pass a mapping from names to bounds"),
    ({"guess": 3}, "guess is 3; pass a Solution, an Optimum, or a mapping"),
    ({"guess": {"y": 1}}, "guess has 'y', which is not there"),
    ({"guess": {"x": ["a"]}}, "x of the guess must be numbers"),
    ({"guess": {"x": [[1, 2]]}}, "x of the guess must be numbers in a row, found the shape \\(1, 2\\)"),
    ({"guess": {"t": [0, 1], "x": [0, np.nan]}}, "x of the guess must be finite, and is nan at its index 1$"),
    ({"guess": {"t": [0, 1, 2], "x": [0, np.inf, np.nan]}},
     "x of the guess must be finite, and is inf at its index 1, of 3 values 2 are not"),
    ({"guess": {"x": np.nan}}, "x of the guess must be finite, and is nan$"),
    ({"guess": {"t": [0, 1, 2], "x": [1, 2]}}, "x of the guess has 2 values, and t has 3"),
    ({"guess": {"t": [0, 0]}}, "t of the guess must be two or more increasing times"),
    ({"transcription": "euler"}, "transcription is 'euler'; there are 'hermite-simpson', 'radau', 'shooting'"),
    ({"method": "snopt"}, "method is 'snopt'; there are 'ipopt', 'slsqp', 'trust-constr'"),
    ({"intervals": 0}, "intervals is 0; pass a whole number from 1 to 2000"),
    ({"intervals": [0, 0.7, 0.5, 1]}, "or increasing numbers from 0 to 1"),
    ({"degree": 5}, "degree is 5; pass a whole number from 1 to 4"),
    ({"steps": True}, "steps is True"),
    ({"max_iterations": 0}, "max_iterations is 0"),
    ({"tolerance": -1}, "tolerance is -1; pass a number between 0 and 1, or None"),
    ({"accuracy": None}, "accuracy is None; pass a number between 0 and 1$"),
    ({"options": 1}, "options is 1; pass a mapping"),
    ({"options": {"no_such": 3}}, "IPOPT does not take options {'no_such': 3}"),
    ({"hold": True}, "hold is True, and transcription is None; inputs are held with \"shooting\" alone"),
    ({"hold": True, "transcription": "radau"}, "hold is True, and transcription is 'radau'; inputs are held"),
    ({"hold": True, "transcription": "shooting", "rates": {"F": (-1, 1)}}, "inputs that are held jump between intervals"),
])
def test_faults_of_a_call(slider: Module, given: dict[str, Any], text: str) -> None:
    call: dict[str, Any] = {"cost": EFFORT, "duration": 2.0, "end": REST, **given}
    with pytest.raises(sd.ArgumentError, match=text):
        sd.optimize(slider, **call)


def test_all_faults_at_once(slider: Module) -> None:
    with pytest.raises(sd.ArgumentError) as error:
        sd.optimize(slider, sd.Loss(integral=sp.Symbol("w")), -2, {"y": 1}, {"x": 3}, bounds={"x": (0, 1), "G": 1},
                    method="snopt", intervals=0)
    for part in ("'y'", "has w", "-2", "outside of its bounds", "'G'", "snopt", "intervals"):
        assert part in str(error.value)


def test_an_infeasible_end_by_how_much(slider: Module) -> None:
    """By |F| <= 1 the slider comes 1/4 m far in 1 s, from rest to rest."""
    text = r"cannot all be met within the bounds\. The nearest motion violates some: x = 1 at t = 1 s is missed by 0\.75"
    with pytest.raises(sd.NoOptimum, match=text) as error:
        sd.optimize(slider, EFFORT, 1.0, end=REST, bounds={"F": (-1, 1)})
    kept = error.value.optimum
    assert isinstance(kept, sd.Optimum) and not kept.success and kept.x.shape[1] == 2 and kept.iterations > 0


def test_an_infeasible_path_by_how_much(slider: Module) -> None:
    with pytest.raises(sd.NoOptimum, match=r"is missed by 0\.[67]"):
        sd.optimize(slider, EFFORT, 3.0, end=REST, path=[v <= sp.Rational(1, 10)], transcription="radau")
    with pytest.raises(sd.NoOptimum, match=r"x <= x\(0\) - 1|x = 1"):
        sd.optimize(slider, EFFORT, 3.0, end={"x": (0, 1)}, boundary=[x <= sp.Symbol("x(0)") - 1])


def test_conditions_that_what_is_given_violates(slider: Module) -> None:
    with pytest.raises(sd.ArgumentError, match=r"what is prescribed violates x >= 1/2 at t = 0 s by 0.5; change the start"):
        sd.optimize(slider, EFFORT, 2.0, end=REST, path=[x >= sp.Rational(1, 2)])
    constant = [sp.Ge(sd.t, 3, evaluate=False)]  # at none of the 41 nodes, which depend on nothing that is free
    text = r"violates t >= 3 at t = 0 s by 3; .*; .*; t >= 3 at t = 0.15 s by .*; and 37 more; "
    with pytest.raises(sd.ArgumentError, match=text):
        sd.optimize(slider, EFFORT, 2.0, end=REST, path=constant)
    module = sd.systems.four_bar().compile(backend="c")
    with pytest.raises(sd.ArgumentError, match=r"the constraint hinge4_x at t = 0 s by .*module.consistent finds"):
        sd.optimize(module, sd.Loss(end=sp.Symbol("q1") ** 2), 1.0, start={"q1": 1.2})


def test_iterations_used_up(slider: Module) -> None:
    with pytest.raises(sd.NoOptimum, match=r"in 2 iterations .*allow more iterations, or begin with a better guess") as error:
        sd.optimize(slider, sd.Loss(integral=F**4 + x**2), 2.0, end=REST, bounds={"F": (-5, 5)}, max_iterations=2)
    assert error.value.optimum.iterations == 2
    with pytest.raises(sd.NoOptimum, match=r"the largest violation left is .*, of the equation of motion of x"):
        sd.optimize(slider, EFFORT, 1.0, end=REST, bounds={"F": (-1, 1)}, max_iterations=3, method="slsqp")


def test_costs_and_rates_that_are_not_finite() -> None:
    module = _slider().compile(backend="c")
    with pytest.raises(sd.EvaluationError, match=r"the cost, or its derivative, is not finite at the guess: -?inf; pass another"):
        sd.optimize(module, sd.Loss(integral=sp.log(F)), 2.0, end=REST)
    singular = _slider(F + 1 / x).compile(backend="c")
    with pytest.raises(sd.EvaluationError, match=r"the equation of motion of x at t = .* cannot be evaluated at the guess"):
        sd.optimize(singular, EFFORT, 2.0, end=REST)
    found = sd.optimize(singular, EFFORT, 2.0, start={"x": 1}, end={"x": 2, "x_dot": 0})  # away from it all is well
    assert found.success


@pytest.mark.parametrize("method", ["ipopt", "slsqp"])
def test_exceptions_of_cost_functions(slider: Module, method: str) -> None:
    """Those of the guess and later ones are what they are, with their cause and line."""
    def misspelled(t: float, x: np.ndarray, p: np.ndarray) -> Any:
        return xx[0] ** 2, x  # type: ignore[name-defined]  # noqa: F821

    def misspelled_beyond(t: float, x: np.ndarray, p: np.ndarray) -> Any:
        return ((x[0] - 3) ** 2 if x[0] < 0.5 else xx), np.array([2 * (x[0] - 3), 0])  # type: ignore[name-defined]  # noqa: F821

    def short_beyond(t: float, x: np.ndarray, p: np.ndarray) -> Any:
        return ((x[0] - 3) ** 2, np.array([2 * (x[0] - 3), 0])) if x[0] < 0.5 else 1.0

    small: dict[str, Any] = {"method": method, "tolerance": None, "intervals": 3}
    for one, cause, text in ((misspelled, NameError, r"integral of the cost of the loss \(misspelled\) raised NameError: name "
                              r"'xx' is not defined, in line \d+ of test_optimal_errors.py"),
                             (lambda t, x: 0, TypeError, r"raised TypeError: .*takes 2 positional arguments but 3 were given"),
                             (lambda t, x, p: 1 / 0, ZeroDivisionError, r"raised ZeroDivisionError: division by zero, in line")):
        with pytest.raises(sd.EvaluationError, match=text) as error:
            sd.optimize(slider, sd.Loss(integral=one), 1.0, **small)
        assert isinstance(error.value.__cause__, cause)
    with pytest.raises(sd.EvaluationError, match=r"end of the cost of the loss \(misspelled_beyond\) raised NameError") as error:
        sd.optimize(slider, [EFFORT, sd.Loss(end=misspelled_beyond)], 1.0, **small)
    assert isinstance(error.value.__cause__, NameError)
    with pytest.raises(sd.ArgumentError, match=r"the function for the end of the cost of the loss returned 1.0 at t = 1; needed"):
        sd.optimize(slider, [EFFORT, sd.Loss(end=short_beyond)], 1.0, **small)


@pytest.mark.parametrize("where", ["integral", "end"])
def test_derivatives_of_cost_functions_that_are_wrong(slider: Module, where: str) -> None:
    """Against differences of the values: at the guess, and at the result where the guess does not show it."""
    wrong = lambda t, x, p: ((x[0] - 1) ** 2 + x[1], np.array([-2 * (x[0] - 1), 1.0]))
    text = (rf"the function for the {where} of the cost of the loss gives 2 as its derivative by x at t = \d, and differences of "
            r"its values give -2; correct the derivative")
    with pytest.raises(sd.ArgumentError, match=text):
        sd.optimize(slider, [EFFORT, sd.Loss(**{where: wrong})], 1.0)

    def by_factor(t: float, x: np.ndarray, p: np.ndarray) -> Any:
        return x[0] ** 2 + 3 * x[1], np.array([2 * x[0], 3.01])

    with pytest.raises(sd.ArgumentError, match=r"\(by_factor\) gives 3.01 as its derivative by x_dot at t = .* give 3;"):
        sd.optimize(slider, [EFFORT, sd.Loss(**{where: by_factor})], 1.0)
    # At the guess, x = 0 all along, this is right.
    later = lambda t, x, p: (x[0] ** 3 - 2 * x[0], np.array([-3 * x[0] ** 2 - 2, 0.0]))
    with pytest.raises(sd.ArgumentError, match=r"gives \S+ as its derivative by x at t = \S+, and differences of its values"):
        sd.optimize(slider, [EFFORT, sd.Loss(**{where: later})], 1.0)


def test_derivatives_of_cost_functions_at_kinks_and_where_they_are_not_defined(slider: Module) -> None:
    """Derivatives to either side are right at a kink; where a function is not defined to both sides, nothing is compared."""
    for side in (-1.0, 1.0):
        kinked = lambda t, x, p, side=side: (abs(x[1]), np.array([0.0, np.sign(x[1]) or side]))
        assert sd.optimize(slider, [EFFORT, sd.Loss(end=kinked)], 2.0, end=REST).cost == pytest.approx(1.5)
    root = lambda t, x, p: (np.sqrt(x[0]) ** 3 if x[0] >= 0 else np.nan, np.array([1.5 * np.sqrt(x[0]), 0.0]))
    assert sd.optimize(slider, [EFFORT, sd.Loss(end=root)], 2.0, end=REST).cost == pytest.approx(2.5)


def test_mesh_that_is_not_fine_enough(slider: Module) -> None:
    text = r"the error of an interval, of the integral of the cost, is .* after 1 meshes, above the tolerance 1e-08"
    with pytest.warns(sd.OptimumWarning, match=text):
        found = sd.optimize(slider, sd.Loss(integral=F**2 + x**4), 2.0, end=REST, tolerance=1e-8, max_refinements=0, intervals=3)
    assert found.error > 1e-8 and len(found.meshes) == 1
    with pytest.warns(sd.OptimumWarning, match=r"the error of an interval is .* after 1 meshes, above the tolerance 1e-08"):
        sd.optimize(sd.systems.pendulum().compile(backend="c"), sd.Loss(end=sp.Symbol("q1") ** 2), 0.5, start={"q1": (0.1, 1)},
                    tolerance=1e-8, max_refinements=0, intervals=3)


def test_a_finer_mesh_without_a_solution_keeps_that_of_the_mesh_before(slider: Module, monkeypatch: pytest.MonkeyPatch) -> None:
    solve, calls = ipopt.solve, list[int]()

    def second_fails(*given: Any) -> ipopt.Found:
        calls.append(1)
        found = solve(*given)
        return replace(found, solved=False, message="Restoration Failed") if len(calls) == 2 else found

    monkeypatch.setattr(ipopt, "solve", second_fails)
    text = r"\(Restoration Failed\) on a finer mesh of .* intervals, that of 3 is kept; a motion that fulfils all conditions"
    with pytest.raises(sd.NoOptimum, match=text) as error:
        sd.optimize(slider, sd.Loss(integral=F**2 + x**4), 2.0, end=REST, tolerance=1e-9, intervals=3)
    kept = error.value.optimum
    assert kept.success and len(kept.breaks) == 4 and max(kept.difference.values()) < 1e-2


@pytest.mark.parametrize("method", ["ipopt", "slsqp"])
def test_costs_that_go_to_minus_infinity(slider: Module, method: str) -> None:
    small: dict[str, Any] = {"method": method, "tolerance": None, "intervals": 4, "max_iterations": 100}
    text = r"the cost goes to minus infinity: it is -\S+ at the last point, and these have no bounds: F \(up to \S+\); give them"
    with pytest.raises(sd.NoOptimum, match=text):
        sd.optimize(slider, sd.Loss(end=-x), 1.0, **small)
    assert sd.optimize(slider, sd.Loss(end=-x), 1.0, bounds={"F": (-1, 2)}, **small).cost == pytest.approx(-1.0)  # F T^2/2
    if method == "slsqp":  # ends before it is far down by the parameter
        return
    system, a = _slider(), sd.parameters("a")
    system.add_output("scaled", a * sd.coordinates("x"))
    system.defaults = {a: 1}
    with pytest.raises(sd.NoOptimum, match=r"these have no bounds: a \(up to \S+\); give them"):
        sd.optimize(system.compile(backend="c"), sd.Loss(end=-sp.Symbol("scaled")), 1.0, bounds={"F": (1, 2)},
                    parameters={"a": (0, np.inf)}, **small)


def test_costs_with_kinks() -> None:
    """The least integral of |F|, |F| <= 3, over d = 1/2 in T = 2: 3 N for t, then for as long back, 3 t (T - t) = d."""
    system = _slider()
    position, (plus, minus) = sd.coordinates("x"), sd.inputs("F_plus F_minus")
    split = sd.System("split")
    body = split.add_body("body", mass=1)
    slide = split.add_joint(sd.Prismatic("slide", split.ground, body, axis=[1, 0], coordinate=position))
    split.add_joint_force(slide, plus - minus)
    given: dict[str, Any] = {"end": {"x": 0.5, "x_dot": 0}}
    text = (r"the cost has kinks, by Abs\(F\), where solvers .*: write F as the difference of two inputs with bounds \(0, ...\), "
            r"whose sum is what it costs, or take a smooth law")
    with pytest.raises(sd.NoOptimum, match=text):
        sd.optimize(system.compile(backend="c"), sd.Loss(integral=sp.Abs(F)), 2.0, bounds={"F": (-3, 3)}, **given)
    found = sd.optimize(split.compile(backend="c"), sd.Loss(integral=plus + minus), 2.0, bounds={plus: (0, 3), minus: (0, 3)},
                        transcription="shooting", hold=True, intervals=80, **given)
    assert found.cost == pytest.approx(6 * (1 - np.sqrt(1 - 0.5 / 3)), rel=2e-3)
    with pytest.raises(sd.NoOptimum) as error:
        sd.optimize(system.compile(backend="c"), EFFORT, 1.0, end=REST, bounds={"F": (-1, 1)})
    assert "kinks" not in str(error.value)


def test_costs_and_conditions_that_jump(slider: Module) -> None:
    """The place from 1/2 on costs 100 more: the solver ends at 62, and staying below 1/2 for longer costs 57 or less."""
    jump: sp.Expr = sp.Heaviside(x - sp.Rational(1, 2))
    given: dict[str, Any] = {"end": REST, "intervals": 4, "tolerance": None}
    text = (r"the integral of the cost jumps by the condition x - 1/2 > 0 where x - 1/2 passes zero "
            r"\(write \(1 \+ tanh\(\(x - 1/2\)/eps\)\)/2 .*Solvers that go by derivatives do not see jumps, .* "
            r"with the side as a condition of path, and compare the costs")
    with pytest.warns(sd.OptimumWarning, match=text):
        found = sd.optimize(slider, sd.Loss(integral=F**2 + 100 * jump), 1.0, **given)
    assert found.cost > 57
    stepped = sp.Piecewise((1, v > 3), (2, True))
    late: sp.Expr = sp.Heaviside(sd.t - 2)
    for options, text in (
            ({"path": [F * sp.sign(v) <= 30]}, r"the condition F\*sign\(x_dot\) <= 30 of path jumps by sign\(x_dot\)"),
            ({"boundary": [sp.floor(x) + sp.Symbol("x(0)") <= 3]}, r"the condition .* of boundary jumps by floor\(x\)"),
            ({"cost": sd.Loss(end=stepped)}, "the end of the cost jumps by the condition"),
            ({"duration": (0.9, 1.1), "path": [x <= 2 + late]}, "of path jumps by the condition t")):
        with pytest.warns(sd.OptimumWarning, match=text):
            sd.optimize(slider, **{"cost": EFFORT, "duration": 1.0, **given, **options})
    smooth = [x * sp.sign(x), (x - 2) * sp.Heaviside(x - 2), sp.Piecewise((v**2 / 2, sp.Abs(v) < 1), (sp.Abs(v) - 0.5, True)),
              sp.Heaviside(sd.t - sp.Rational(1, 2)), sp.Max(x, v), sp.Abs(F), sp.sin(5 * x) / sp.sqrt(1 + v**2)]
    problem = problem_of(slider, sd.Loss(integral=sum(smooth)), 1.0, None, None, None, None, [e <= 3 for e in smooth], [],
                         None, None, None, 0.0)
    assert problem.jumps == ()


@pytest.mark.parametrize("method", ["ipopt", "slsqp"])
def test_parameters_and_inputs_that_nothing_depends_on(method: str) -> None:
    system = sd.System("idle")
    position, mass, a, force, idle = sd.coordinates("x"), sd.parameters("m"), sd.parameters("a"), sd.inputs("F"), sd.inputs("G")
    body = system.add_body("body", mass=mass)
    slide = system.add_joint(sd.Prismatic("slide", system.ground, body, axis=[1, 0], coordinate=position))
    system.add_joint_force(slide, force)
    system.add_output("scaled", a * position + idle)
    system.defaults = {mass: 1, a: 1}
    module = system.compile(backend="c")
    given: dict[str, Any] = {"end": REST, "method": method, "tolerance": None, "intervals": 4, "parameters": {"a": (0, 3)},
                             "bounds": {"G": (-1, 4)}}
    with pytest.warns(sd.OptimumWarning, match=r"nothing depends on a, G along the motion, so that they keep their guess and"):
        found = sd.optimize(module, EFFORT, 1.0, guess={"G": 0.25}, **given)
    assert found.undetermined == ("a", "G") and found.values["a"] == 1 and np.ptp([*found["G"], 0.25]) == 0
    assert found.cost == pytest.approx(12) and "a = 1, undetermined" in str(found)
    with warnings.catch_warnings():
        warnings.simplefilter("error", sd.OptimumWarning)
        known = sd.optimize(module, sd.Loss(integral=F**2, end=(sp.Symbol("scaled") - 2) ** 2), 1.0, **given)
    assert known.undetermined == () and known.cost == pytest.approx(12)


def test_without_casadi(slider: Module, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "casadi", None)
    with pytest.raises(sd.MissingExtra, match=r"pip install 'symdyn\[opt\]'.*slsqp.*trust-constr"):
        sd.optimize(slider, EFFORT, 2.0, end=REST)
    assert sd.optimize(slider, EFFORT, 2.0, end=REST, method="slsqp", intervals=4, tolerance=None).cost == pytest.approx(1.5)


def test_systems_that_are_not_optimized() -> None:
    events = _slider()
    events.add_event("wall", x.subs(x, sd.coordinates("x")) - 5, reset={sd.coordinates("x").dot: 0})
    with pytest.raises(sd.ArgumentError, match=r"the events wall reset the state"):
        sd.optimize(events.compile(backend="c"), EFFORT, 2.0, end=REST)
    z = sd.motions("z")
    moved = sd.System("moved")
    body = moved.add_body("body", mass=1)
    moved.add_joint(sd.Prismatic("slide", moved.ground, body, axis=[1, 0], coordinate=z))
    carried = moved.add_body("carried", mass=1)
    moved.add_joint(sd.Prismatic("second", body, carried, axis=[0, 1], coordinate=sd.coordinates("y")))
    with pytest.raises(sd.ArgumentError, match=r"with motions as inputs"):
        sd.optimize(moved.compile(backend="c"), sd.Loss(end=sp.Symbol("y")), 2.0)
    timed = _slider(F + sp.sin(sd.t)).compile(backend="c")
    found = sd.optimize(timed, EFFORT, 2.0, end=REST)
    assert found.success and max(found.difference.values()) < 1e-4


def test_what_a_result_does_not_have(slider: Module) -> None:
    found = sd.optimize(slider, EFFORT, 2.0, end=REST, tolerance=None, intervals=3)
    with pytest.raises(sd.ArgumentError, match=r"the optimal motion has no 'y'; it has x, x_dot, F"):
        found["y"]
    for at in (found.at, found.inputs_at):
        with pytest.raises(sd.ArgumentError, match=r"goes from t = 0 to 2 s; found 2.5"):
            at(2.5)
    with pytest.raises(sd.ArgumentError, match=r"R has weights of G; give weights of inputs: F"):
        found.lqr(Q=[1, 1], R={"G": 1})
    with pytest.raises(sd.ArgumentError, match=r"R is not positive definite"):
        found.lqr(Q=[1, 1], R=[0.0])
    with pytest.raises(sd.ArgumentError, match=r"Qf has the shape"):
        found.lqr(Q=[1, 1], R=[1.0], Qf=[1])
    free = sd.systems.pendulum().compile(backend="c")
    fall = sd.optimize(free, sd.Loss(end=sp.Symbol("q1") ** 2), 0.5, start={"q1": (0.1, 1)}, tolerance=None)
    assert fall.inputs.shape[1] == 0 and max(fall.difference.values()) < 1e-3
    with pytest.raises(sd.ArgumentError, match=r"the system has no inputs"):
        fall.lqr(Q=[1, 1], R=[1])


def test_euler_parameters_that_vanish_on_the_way_of_the_guess() -> None:
    p, w = sd.coordinates("p0:4"), sd.speeds("w1:4")
    system = sd.System("body")
    body = system.add_body("body", mass=1, inertia=[1, 2, 3])
    system.add_joint(sd.Spherical("pivot", system.ground, body, coordinates=p, speeds=w, orientation=sd.EulerParameters()))
    system.add_torque(body, sd.inputs("T1:4"))
    module, cost = system.compile(backend="c"), sd.Loss(integral=sum(e**2 for e in sp.symbols("T1:4")))
    with pytest.raises(sd.ArgumentError, match=r"p0, p1, p2, p3 have unit length together, and are zero in the guess"):
        sd.optimize(module, cost, 1.0, [1, 0, 0, 0, 0, 0, 0], [-1, 0, 0, 0, 0, 0, 0])
    with pytest.raises(sd.ArgumentError, match=r"violates the unit length of p0, p1, p2, p3 at t = 1 s by 0.44"):
        sd.optimize(module, cost, 1.0, [1, 0, 0, 0, 0, 0, 0], [1.2, 0, 0, 0, 0, 0, 0])


def test_riccati_that_overflows(slider: Module) -> None:
    found = sd.optimize(slider, EFFORT, 2.0, end=REST, tolerance=None, intervals=3)
    with pytest.raises(sd.EvaluationError, match=r"Riccati's equation along the motion has no finite solution"):
        found.lqr(Q=[1e300, 1], R=[1e-200], Qf=[0, 1e300])
