"""Jacobians by several columns at once are those by one column after the other, in every way that they are written."""

from __future__ import annotations

import ctypes
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from symdyn import systems
from symdyn.backend import columns, source
from symdyn.backend.dialect import read_dialect
from symdyn.backend.right_side import RightSide
from symdyn.emission import emit
from symdyn.functions.tapes import columns_of, function_tape
from symdyn.runtime.building.compiler import find_compiler, flags, require_compiler
from symdyn.runtime.building.library import CLibrary, PythonLibrary
from symdyn.tape.evaluate import evaluate
from tests.backend.c_warnings import RUNTIME, faults_of
from tests.backend.test_runtime_in_c import Build, build
from tests.helpers import swept
from tests.mechanisms import kitchen_sink

__all__ = ["build"]
pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
JACOBIANS = ("jacobian_x", "jacobian_inputs", "jacobian_params")
# A tree, gears and tables of the tape, a loop by eliminated speeds, redundant rows, a singular fallback, extra states.
CASES = [("double_pendulum", "embedding"), ("puma560", "recursive"), ("cart_pole", "embedding"), ("four_bar", "augmented"),
         ("spatial_slider_crank", "augmented"), ("bricard", "augmented"), ("floating_wind_turbine", "embedding"),
         ("kitchen_sink", "embedding")]


@pytest.fixture
def always(monkeypatch: pytest.MonkeyPatch) -> None:
    """Several columns at once also where that is slower."""
    monkeypatch.setattr(columns, "LEAST", 0)
    monkeypatch.setattr(columns, "GAIN", 0)


def equations_of(name: str, formulation: str) -> Any:
    system = kitchen_sink() if name == "kitchen_sink" else systems.get(name)
    return getattr(system, formulation)()


def both(equations: Any, names: list[str], **options: Any) -> tuple[Any, Any]:
    """The functions in C, several columns at once, and in NumPy, one after the other."""
    c = emit(equations, "c", names, standalone=False, integrator=False, **options)
    python = emit(equations, "numpy", names, standalone=False, **options)
    return (CLibrary(next(iter(c.files.values())), c.metadata, require_compiler()),
            PythonLibrary.from_source(next(iter(python.files.values())), equations.name))


def states_of(equations: Any, n: int, extra: int = 0) -> tuple[np.ndarray, ...]:
    """Random p, t, x, inputs; extra: further parameters at the end."""
    s, rng = equations.symbols, np.random.default_rng(4)
    by_name = {p.name: value for p, value in s.defaults.items()}
    p = np.array([by_name.get(q.name, 0.7) for q in s.parameters] + [1.3] * extra)
    x = np.array([float(s.initial.get(k, 0)) for k in (*s.coordinates, *s.speeds, *s.states)])
    return p, np.full(n, 0.3), x + 0.05 * rng.normal(size=(n, len(x))), rng.normal(size=(n, len(s.inputs)))


def difference(equations: Any, units: tuple[Any, Any], name: str, extra: int = 0, further_states: int = 0) -> float:
    """Largest difference of both at three states, relative to the largest entry."""
    p, t, x, inputs = states_of(equations, 3, extra)
    x = np.hstack([x, np.zeros((3, further_states))])
    results = []
    for unit in units:
        evaluator = unit.evaluator(name)
        evaluator.set_params(p)
        results.append(evaluator.many(t, x, inputs, np.zeros((1, len(unit.metadata.ud)))))
    assert np.abs(results[1]).max() > 0
    return float(np.abs(results[0] - results[1]).max() / np.abs(results[1]).max())


@pytest.mark.usefixtures("always")
@pytest.mark.parametrize(("name", "formulation"), swept(CASES, CASES[0], CASES[2], CASES[3], CASES[-1]))
def test_both_ways_agree(name: str, formulation: str) -> None:
    equations = equations_of(name, formulation)
    names = [n for n in JACOBIANS if columns_of(equations, n, RightSide()) is not None]
    assert "jacobian_x" in names
    text = next(iter(emit(equations, "c", names, standalone=False, integrator=False).files.values()))
    assert text.count("symdyn_put_columns(columns") >= len(names)
    units = both(equations, names)
    for function in names:
        assert difference(equations, units, function) < 2e-12, function


@pytest.mark.usefixtures("always")
@pytest.mark.parametrize(("name", "formulation"), [("puma560", "embedding"), ("four_bar", "augmented")])
def test_no_warnings(name: str, formulation: str, tmp_path: Path) -> None:
    made = emit(equations_of(name, formulation), "c", ["rhs", "jacobian_x"], standalone=False, integrator=False)
    (tmp_path / "made.c").write_text(next(iter(made.files.values())))
    assert faults_of(tmp_path / "made.c", tidy=False) == ""
    assert faults_of(tmp_path / "made.c", "-D__TINYC__", tidy=False) == ""


@pytest.mark.usefixtures("always")
@pytest.mark.parametrize(("work", "baumgarte"), [(True, False), (False, True), (True, True)])
def test_with_the_work_of_the_loads_and_baumgartes_stabilization(work: bool, baumgarte: bool) -> None:
    equations = systems.get("four_bar").augmented()
    units = both(equations, ["rhs", "jacobian_x"], work=work, baumgarte=baumgarte)
    assert units[0].metadata.shapes["jacobian_x"] == (6 + work, 6 + work)
    assert difference(equations, units, "jacobian_x", extra=int(baumgarte), further_states=int(work)) < 1e-12


@pytest.mark.usefixtures("always")
def test_bound_parameters() -> None:
    equations = systems.get("three_link_arm").embedding()
    first, *_ = equations.symbols.parameters
    c, python = both(equations, ["jacobian_x"], specialize={first: 0.5})
    p, t, x, inputs = states_of(equations, 2)
    results = []
    for unit in (c, python):
        evaluator = unit.evaluator("jacobian_x")
        evaluator.set_params(p[1:])
        results.append(evaluator.many(t, x, inputs, np.zeros((1, 3))))
    np.testing.assert_allclose(results[0], results[1], rtol=0, atol=1e-12 * np.abs(results[1]).max())


@pytest.mark.usefixtures("always")
def test_long_functions_in_parts(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def short(folder: Path) -> Any:
        dialect = read_dialect(folder)
        return replace(dialect, parts=replace(dialect.parts, whole=100, longest=60)) if dialect.parts else dialect

    monkeypatch.setattr(source, "read_dialect", short)
    equations = systems.get("spatial_chain", n=4).embedding()
    text = next(iter(emit(equations, "c", ["jacobian_x"], standalone=False, integrator=False).files.values()))
    assert "jacobian_x_values_part_3(" in text and "jacobian_x_along_q_3(" in text and "jacobian_x_along_u_2(" in text
    (tmp_path / "made.c").write_text(text)
    assert faults_of(tmp_path / "made.c", tidy=False) == ""
    assert difference(equations, both(equations, ["jacobian_x"]), "jacobian_x") < 1e-12


@pytest.mark.usefixtures("always")
def test_without_vectors_in_the_compiler(tmp_path: Path) -> None:
    equations = systems.get("three_link_arm").embedding()
    made = emit(equations, "c", ["jacobian_x"], standalone=False, integrator=False)
    text = next(iter(made.files.values()))
    plain = CLibrary(f"#define __TINYC__ 1\n{text}", made.metadata, require_compiler())
    usual = CLibrary(text, made.metadata, require_compiler())
    p, t, x, inputs = states_of(equations, 3)
    results = []
    for unit in (plain, usual):
        evaluator = unit.evaluator("jacobian_x")
        evaluator.set_params(p)
        results.append(evaluator.many(t, x, inputs, np.zeros((1, 3))))
    np.testing.assert_allclose(results[0], results[1], rtol=0, atol=1e-13 * np.abs(results[1]).max())


def test_where_they_are_chosen() -> None:
    chain = systems.get("spatial_chain", n=7).embedding()
    made = columns_of(chain, "jacobian_x", RightSide())
    assert made is not None and made.one_by_one() > 2 * made.together()
    assert [(group.name, group.first, len(group.seeds)) for group in made.groups] == [("q", 0, 7), ("u", 7, 7)]
    # One by one takes as many operations as the function that is written so, less what solving for a column leaves out.
    straight = function_tape(chain, "jacobian_x").operations - function_tape(chain, "rhs").operations
    assert 0.9 < made.one_by_one() / straight < 1.4
    assert columns_of(systems.get("cart_pole").embedding(), "jacobian_x", RightSide()) is None
    assert columns_of(chain, "rhs", RightSide()) is None


def test_digits() -> None:
    equations = systems.get("spatial_chain", n=7).embedding()
    unit = both(equations, ["jacobian_x"])[0]
    p, t, x, inputs = states_of(equations, 3)
    evaluator = unit.evaluator("jacobian_x")
    evaluator.set_params(p)
    found = evaluator.many(t, x, inputs, np.zeros((1, 7)))
    s = equations.symbols
    for row, state in zip(found, x, strict=True):
        named = {q.name: v for q, v in zip((*s.coordinates, *s.speeds, *s.parameters), (*state, *p), strict=True)}
        exact = evaluate(equations.tape("jacobian_x"), named, 40)["jacobian_x"].astype(float)
        M = evaluate(equations.tape("M_tilde"), named, 40)["M_tilde"].astype(float)
        assert np.abs(row - exact).max() < 1e-15 * np.linalg.cond(M) * np.abs(exact).max()


HELPERS = """
#include "columns.h"
int width(void);
void directions(int first, int n, double *out);
void put(int first, int n, double *out);
int width(void) { return SYMDYN_WIDTH; }
void directions(int first, int n, double *out) {
    symdyn_vector change[20];
    symdyn_directions(first, n, change);
    for (int k = 0; k < n; k++)
        for (int l = 0; l < SYMDYN_WIDTH; l++) out[k * SYMDYN_WIDTH + l] = LANE(change[k], l);
}
void put(int first, int n, double *out) {
    symdyn_vector derivatives[2];
    for (int i = 0; i < 2; i++)
        for (int l = 0; l < SYMDYN_WIDTH; l++) LANE(derivatives[i], l) = 100.0 * i + l;
    symdyn_put_columns(derivatives, 2, 20, first, n, out);
}
"""


def test_directions_and_columns(build: Build) -> None:
    library = build(HELPERS, f"-I{RUNTIME}", *[f for f in flags(require_compiler()) if f.startswith("-m")])
    width = library.width()
    made = np.full((13, width), np.nan)
    pointer = ctypes.POINTER(ctypes.c_double)
    library.directions(11, 13, made.ctypes.data_as(pointer))
    np.testing.assert_array_equal(made, np.eye(13)[:, 11:] @ np.eye(2, width) if width >= 2 else np.eye(13)[:, 11:12])
    for n in (1, width, width + 3):
        out = np.full((2, 20), np.nan)
        library.put(3, n, out.ctypes.data_as(pointer))
        put = min(n, width)
        np.testing.assert_array_equal(out[:, 3:3 + put], np.add.outer([0.0, 100.0], np.arange(put)))
        assert np.isnan(np.delete(out, np.s_[3:3 + put], axis=1)).all()
