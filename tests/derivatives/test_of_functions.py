"""Derivatives of any function by anything, against differences with many digits of the function's own tape."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest

import symdyn as sd
from symdyn.errors import ArgumentError, EvaluationError, SymdynError
from symdyn.functions.tapes import function_tape, has_function
from symdyn.runtime.building.compiler import find_compiler
from symdyn.tape.evaluate import evaluate
from tests.helpers import swept
from tests.mechanisms import kitchen_sink

FUNCTIONS = ("rhs", "inverse_dynamics", "energy", "mass_matrix", "outputs", "reactions", "lam", "C", "momentum", "power",
             "F_tilde")
DIGITS, STEP = 60, mpmath.mpf(10) ** -20
# A tree with inputs; a loop with eliminated speeds; redundant rows, whose multipliers an algorithm finds; all kinds of steps.
CASES = [("three_link_arm", "embedding"), ("puma560", "recursive"), ("four_bar", "augmented"), ("bricard", "augmented"),
         ("spatial_slider_crank", "augmented"), ("kitchen_sink", "embedding")]


def derived(name: str, formulation: str) -> Any:
    return getattr(kitchen_sink() if name == "kitchen_sink" else sd.systems.get(name), formulation)()


def by_differences(equations: Any, of: str, by: str, values: dict[str, Any]) -> np.ndarray:
    """Central differences of the tape of a function, with so many digits that they are exact in doubles."""
    s = equations.symbols
    groups = {"x": (*s.coordinates, *s.speeds, *s.states), "inputs": s.inputs, "params": s.parameters}
    names = {"t": ["t"], "ud": [f"{u.name}_dot" for u in s.speeds]}.get(by) or [a.name for a in groups.get(by, ())]
    tape = function_tape(equations, of)
    columns = []
    with mpmath.workdps(DIGITS):
        for name in names:
            sides = [next(iter(evaluate(tape, {**values, name: mpmath.mpf(values[name]) + sign * STEP}, DIGITS).values()))
                     for sign in (1, -1)]
            columns.append(np.asarray((sides[0] - sides[1]) / (2 * STEP), dtype=object).astype(float))
    return np.stack(columns, axis=-1)


def point(equations: Any) -> tuple[dict[str, float], dict[str, np.ndarray]]:
    """Random values of all leaves, by name and by group."""
    s, rng = equations.symbols, np.random.default_rng(7)
    defaults = {p.name: v for p, v in s.defaults.items()}
    start = [float(s.initial.get(k, 0)) for k in (*s.coordinates, *s.speeds, *s.states)]
    groups = {"x": np.array(start) + 0.1 * rng.normal(size=len(start)), "inputs": rng.normal(size=len(s.inputs)),
              "params": np.array([defaults.get(p.name, 0.6) for p in s.parameters]), "ud": rng.normal(size=len(s.speeds))}
    names = {"x": (*s.coordinates, *s.speeds, *s.states), "inputs": s.inputs, "params": s.parameters}
    values = {a.name: v for group, held in names.items() for a, v in zip(held, groups[group], strict=True)}
    return {**values, "t": 0.4, **{f"{u.name}_dot": v for u, v in zip(s.speeds, groups["ud"], strict=True)}}, groups


@pytest.mark.parametrize(("name", "formulation"), swept(CASES, CASES[2], CASES[5]))
def test_every_function_by_everything(name: str, formulation: str) -> None:
    equations = derived(name, formulation)
    modules = [equations.compile(backend=b) for b in (["numpy", "c"] if find_compiler() else ["numpy"])]
    values, groups = point(equations)
    condition = np.linalg.cond(evaluate(equations.tape("M_tilde"), values, 30)["M_tilde"].astype(float))
    tried = 0
    for of in (f for f in FUNCTIONS if has_function(equations, f)):
        takes = of == "inverse_dynamics"
        wrt = [w for w in ("x", "inputs", "params", "t", *["ud"] * takes) if w == "t" or len(groups[w])]
        if name == "bricard" and of != "lam":
            wrt = ["x"]
        results = [m.jacobian(0.4, groups["x"], groups["params"], groups["inputs"], wrt, of, groups["ud"] if takes else ())
                   for m in modules]
        for w in wrt:
            exact = by_differences(equations, of, w, values)
            for found in results:
                np.testing.assert_allclose(getattr(found, w), exact, rtol=0, err_msg=f"{of} by {w}",
                                           atol=2e-14 * condition * max(np.abs(exact).max(), 1e-3))
            structure = modules[0].sparsity(w, of)
            assert structure.shape == exact.shape and (exact[~structure] == 0).all(), (of, w)
            tried += 1
    assert tried > 10


def test_accelerations() -> None:
    module = sd.systems.get("puma560").recursive().compile()
    x, rng = np.linspace(-0.4, 0.7, 12), np.random.default_rng(1)
    ud = rng.normal(size=6)
    by = module.jacobian(0, x, of="inverse_dynamics", wrt=["ud"], ud=ud).ud
    np.testing.assert_allclose(by, module.mass_matrix(0, x), rtol=1e-13, atol=1e-13)


def test_rows_of_states() -> None:
    module = sd.systems.get("four_bar").augmented().compile()
    X = np.array([np.concatenate(module.consistent({"q1": angle})) for angle in (1.0, 1.1, 1.2)])
    rows = module.jacobian([0.0, 0.1, 0.2], X, wrt=["x", "params"], of="lam")
    for k, x in enumerate(X):
        one = module.jacobian(0.1 * k, x, wrt=["x", "params"], of="lam")
        np.testing.assert_array_equal(rows.x[k], one.x)
        np.testing.assert_array_equal(rows.params[k], one.params)


def test_the_structure_is_that_of_the_tree() -> None:
    q1, q2, q3 = sd.coordinates("q1:4")
    system = sd.System("two_arms", gravity=[0, 0, -9.81])
    trunk, *arms = (system.add_body(n, mass=1, inertia=[1, 1, 1], com=[0.3, 0, 0.1]) for n in ("trunk", "left", "right"))
    system.add_joint(sd.Revolute("waist", system.ground, trunk, q1))
    for q, arm in zip((q2, q3), arms, strict=True):
        system.add_joint(sd.Revolute(f"to_{arm.name}", trunk, arm, q, axis=[0, 1, 0], parent_point=[0.2, 0, 0]))
    structure = system.recursive().compile(backend="numpy").sparsity(of="inverse_dynamics")
    expected = np.ones((3, 6), dtype=bool)
    expected[1:, 0] = expected[0, 0] = False  # the weight does not feel the angle about the vertical
    expected[1, [2, 4, 5]] = expected[2, [1, 4, 5]] = False  # neither arm feels the other, nor its own rate
    np.testing.assert_array_equal(structure, expected)


def test_faults() -> None:
    module = sd.systems.get("pendulum").embedding().compile(backend="numpy")
    with pytest.raises(ArgumentError, match="jacobian of energy by ud asked for, and energy takes no accelerations; leave ud"):
        module.jacobian(0, [0, 0], of="energy", wrt=["x", "ud"])
    with pytest.raises(ArgumentError, match="jacobian of rhs by ud asked for, and rhs takes no accelerations"):
        module.jacobian(0, [0, 0], wrt=["ud"])
    with pytest.raises(SymdynError, match="has no function lam; it has rhs"):
        module.jacobian(0, [0, 0], of="lam")
    with pytest.raises(SymdynError, match="the name of the function to differentiate"):
        module.jacobian(0, [0, 0], of=3)
    with pytest.raises(ArgumentError, match="sparsity by 'y' asked for; there are x, inputs, params, t and ud"):
        module.sparsity("y")
    with pytest.raises(ArgumentError, match=r"has no function inverse_dynamic; did you mean inverse_dynamics\? There are rhs"):
        module.jacobian(0, [0, 0], of="inverse_dynamic")
    with pytest.raises(SymdynError, match="has no function energy_by_lam"):
        module.evaluate("energy_by_lam", 0, [0, 0])


def test_multipliers_that_the_motion_does_not_determine_have_no_derivatives() -> None:
    """On the constraints one row of Bricard's loop depends on the others: which multipliers are taken is a choice, which turns
    with the state."""
    module = sd.systems.bricard().augmented().compile(backend="numpy")
    q, u = module.consistent()
    x = np.r_[q, u]
    for of in ("lam", "reactions"):
        said = f"derivatives of {of} were requested, .* leave a choice of the multipliers of .*; leave out the redundant"
        with pytest.raises(EvaluationError, match=said):
            module.jacobian(0.0, x, wrt=["x"], of=of)
    assert np.isfinite(module.jacobian(0.0, x, wrt=["x"]).x).all()
    four = sd.systems.four_bar().augmented().compile(backend="numpy")
    q, u = four.consistent()
    assert np.isfinite(four.jacobian(0.0, np.r_[q, u], wrt=["x"], of="lam").x).all()
