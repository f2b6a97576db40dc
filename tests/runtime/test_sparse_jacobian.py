"""Derivatives whose entries are mostly zero: the same as the dense ones, in SciPy's implicit methods, and cables at rest."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from scipy.sparse import issparse

import symdyn as sd
from symdyn.cli import main
from symdyn.errors import ArgumentError, NoEquilibrium
from symdyn.functions import packed
from symdyn.lab import stiff_cables
from symdyn.lab.stiff_cables import at_rest, elastic_cable, elastic_catenary, frequencies, irvine
from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.integrating import methods, scipy_run

needs_c = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


@pytest.fixture(scope="module")
def cable() -> Any:
    """The module of a cable of 30 links, 116 states."""
    return elastic_cable(30).embedding().compile()


def matrix(module: Any, x: np.ndarray) -> np.ndarray:
    """The derivative from its entries."""
    pattern = module.jacobian_indices()
    found = np.zeros((pattern.n, pattern.n))
    found[pattern.rows, pattern.columns] = module.evaluate("jacobian_x_packed", 0.0, x)
    return found


def near_the_start(module: Any) -> np.ndarray:
    x = np.array([module.metadata.initial.get(name, 0.0) for name in module.metadata.x])
    return x + 1e-2 * np.random.default_rng(3).standard_normal(len(x)) / len(x)


@pytest.mark.parametrize("make", [lambda: elastic_cable(30).embedding(), lambda: sd.systems.get("double_pendulum").embedding(),
                                  lambda: sd.systems.get("spatial_chain", n=3).recursive()])
def test_entries_are_those_of_the_whole_derivative(make: Any) -> None:
    module = make().compile()
    x = near_the_start(module)
    whole = module.bind(None).jacobian_x(0.0, x)
    assert np.abs(matrix(module, x) - whole).max() <= 1e-12 * np.abs(whole).max()
    assert (module.sparsity() >= (whole != 0)).all()


def test_entries_follow_differences(cable: Any) -> None:
    x, h = near_the_start(cable), 1e-7
    steps = h * np.eye(len(x))
    differences = np.transpose([(cable.rhs(0.0, x + step) - cable.rhs(0.0, x - step)) / (2 * h) for step in steps])
    found = matrix(cable, x)
    assert np.abs(found - differences).max() <= 1e-6 * np.abs(found).max()


def test_where_factors_are_sparse(cable: Any) -> None:
    assert cable.jacobian_indices().sparse
    assert len(cable.jacobian_indices().rows) <= 26 * 29  # 6 entries of each neighbour, 12 of its own, 2 rates
    assert not sd.systems.get("double_pendulum").compile().jacobian_indices().sparse
    assert sd.systems.get("four_bar").compile().jacobian_indices() is None


@pytest.mark.every_value
@needs_c
@pytest.mark.parametrize("method", ["Radau", "BDF"])
@pytest.mark.parametrize("work", [False, True])
def test_stiff_motion_is_that_of_dense_factors(cable: Any, method: str, work: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    made = []
    call = scipy_run.SparseJacobian.__call__

    def noted(self: Any, *given: Any) -> Any:
        made.append(call(self, *given))
        return made[-1]

    monkeypatch.setattr(scipy_run.SparseJacobian, "__call__", noted)
    exact = cable.simulate([0, 0.02], method="radau5", rtol=1e-9, atol=1e-9)
    found = cable.simulate([0, 0.02], method=method, rtol=1e-7, atol=1e-9, work=work)
    assert found.success and made and all(issparse(J) and J.shape[0] == 116 + work for J in made)
    assert np.abs(found.q[-1] - exact.q[-1]).max() <= 1e-7
    if work:
        assert found.energy_error() <= 1e-5


@needs_c
def test_inputs_that_vary() -> None:
    system = elastic_cable(30)
    pushes = sd.inputs("F1 F2")
    for joint, push in zip(("up10", "up20"), pushes, strict=True):
        system.add_joint_force(joint, push)
    module = system.embedding().compile()
    given = {"inputs": lambda t, x: [np.sin(100 * t), 2.0], "rtol": 1e-8, "atol": 1e-10}
    found = [module.simulate([0, 0.02], method=method, **given).q[-1] for method in ("Radau", "radau5")]
    assert module.jacobian_indices().sparse and np.abs(found[0] - found[1]).max() <= 1e-8


@needs_c
def test_dense_matrices_that_are_too_large_are_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(methods, "LARGEST_MATRICES", 8 * 4**2 * 7)
    module = sd.systems.get("double_pendulum").compile(backend="c")
    assert module.simulate((0, 0.1), method="radau").success
    monkeypatch.setattr(methods, "LARGEST_MATRICES", 8 * 4**2 * 7 - 1)
    with pytest.raises(ArgumentError, match=r"4 states take .* use method='dop853'"):
        module.simulate((0, 0.1), method="radau")


def test_sag_and_frequencies_converge_to_closed_forms() -> None:
    """The elastic catenary, and Irvine's frequencies of cables with little sag, from twenty and forty links."""
    H, sag = elastic_catenary(1e7, 4e3)
    exact, sags, found = irvine(H, 1e7), [], []
    for n in (20, 40):
        q, slope = at_rest(elastic_cable(n, 1e7, 4e3).embedding().compile())
        sags.append(-q[n - 1:].min())
        found.append(frequencies(slope))
    assert sags[1] / sag - 1 == pytest.approx((sags[0] / sag - 1) / 4, rel=0.02) and abs(sags[1] / sag - 1) < 1e-3
    assert (4 * sags[1] - sags[0]) / (3 * sag) == pytest.approx(1, abs=1e-9)
    # Those of a taut string of n links are known: 2 n sin(k pi / 2 n) in place of k pi.
    links = 2 * 40 * np.sin(np.arange(2, 6) * np.pi / 80) * np.sqrt(H)
    assert found[1][1::2] == pytest.approx(links[::2], rel=1e-6)
    assert (4 * found[1] - found[0]) / 3 == pytest.approx(exact, rel=1e-4)


def test_shapes_with_deep_sag_converge_to_the_elastic_catenary() -> None:
    deep = {n: stiff_cables._deep(n) for n in (20, 40)}
    for k, exact in ((0, stiff_cables.DEEP), (1, 0.0)):
        coarse, fine = (deep[n][k] - exact for n in (20, 40))
        assert fine == pytest.approx(coarse / 4, rel=0.02) and 0 < fine < 1e-3
    # Without stretch it is a hyperbolic cosine through both supports.
    H, rest = stiff_cables.deep_catenary(0.3, 1e13)
    x, y = stiff_cables.hanging(H, rest, 1e13, np.linspace(0, 1, 9))
    a = H * rest / stiff_cables.WEIGHT
    assert y == pytest.approx(a * (np.cosh((x - 0.5) / a) - np.cosh(0.5 / a)), abs=1e-11) and y.min() == pytest.approx(-0.3)
    assert rest == pytest.approx(2 * a * np.sinh(0.5 / a), rel=1e-11) and x[-1] == pytest.approx(1, rel=1e-14)


def test_errors_of_cables_of_links_are_of_second_order(capsys: pytest.CaptureFixture[str]) -> None:
    """Those of their shapes and of their frequencies, whose limit is nearer to the closed form."""
    few, many = stiff_cables.compare(24), stiff_cables.compare(48)
    for name in ("shape_error", "deep_shape_error", "sag_error", "deep_sag_error"):
        assert getattr(many, name) == pytest.approx(getattr(few, name) / 4, rel=0.03), name
    own, limit = np.array(many.own_errors), np.array(many.limit_errors)
    assert own == pytest.approx(np.array(few.own_errors) / 4, rel=0.05) and (limit < own / 10).all()
    assert len(stiff_cables.compare(10).limit) == 4 and few.bounded[-5:] == few.limit_errors
    assert max(*few.knots_errors, *many.knots_errors) < 1e-6  # a taut string with its mass at knots, Lagrange's closed form
    assert few.bounded[4:9] == few.knots_errors


def test_shapes_that_are_not_found_raise(cable: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(NoEquilibrium, match=r"^elastic_cable_12: .* step 1 the stiffness of the 22 coordinates is singular"):
        at_rest(elastic_cable(12, tension=0.0).embedding().compile(backend="numpy"))
    monkeypatch.setattr(stiff_cables, "NEWTON_STEPS", 2)
    with pytest.raises(NoEquilibrium, match=r"after 2 steps the last one is \d\.\de-0\d m long, more than 1e-14 m"):
        at_rest(cable)


def test_where_entries_stand_is_looked_for_once(monkeypatch: pytest.MonkeyPatch) -> None:
    looked, look = [], packed._looked_for
    monkeypatch.setattr(packed, "_looked_for", lambda equations: looked.append(equations) or look(equations))
    module = sd.systems.get("double_pendulum").embedding().compile(backend="numpy")
    matrix(module, np.array([0.1, 0.2, 0.3, 0.4]))
    assert len(looked) == 1
    another = sd.systems.get("double_pendulum").embedding()
    assert packed.pattern(another) is packed.pattern(another) and len(looked) == 2


def test_ratios_and_growth_of_measurements() -> None:
    """Powers are found to the digit; runs are compared at the same error, those that are more exact than all others are left."""
    def row(links: int, method: str, rtol: float, seconds: float, error: float) -> stiff_cables.Row:
        return stiff_cables.Row(links, 4 * links, 26 * links, 1.0, method, rtol, 10, 1, 20, 8 * links**2, seconds, error)

    own = [row(100, "radau5", 1e-4, 1.0, 1e-4), row(100, "radau5", 1e-6, 4.0, 1e-8)]
    scipy = [row(100, "Radau", 1e-4, 30.0, 1e-3), row(100, "Radau", 1e-6, 60.0, 1e-6), row(100, "Radau", 1e-8, 99.0, 1e-9)]
    assert stiff_cables.speedups([*own, *scipy], "radau5") == pytest.approx([30.0, 30.0])
    grown = [row(n, "radau5", 1e-6, 1e-3 * n**1.5, 1e-8) for n in (10, 100, 200, 400)]
    assert stiff_cables.exponent(grown, "radau5", lambda one: one.of_a_step) == pytest.approx(1.5)
    assert stiff_cables.exponent(grown, "radau5", lambda one: one.memory) == pytest.approx(2.0)


@needs_c
def test_measurement(tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "stiff", "--sizes", "10", "--json", str(tmp_path / "found.json")]) == 0
    lines = capsys.readouterr().out.splitlines()
    rows = json.loads((tmp_path / "found.json").read_text())["motions"]
    assert lines[0] == stiff_cables.HEADING and [line.split()[4] for line in lines[1:12]] == [row["method"] for row in rows]
    assert [row["rtol"] for row in rows] == [rtol for some in stiff_cables.TOLERANCES.values() for rtol in some]
    # Errors fall with the tolerance, and are those of the motion, which is compared with explicit steps.
    assert all(row["error"] <= 10 * row["rtol"]**1.1 for row in rows)
    assert lines[12].startswith("    10 links: at equal error Radau of SciPy takes") and lines[14] == stiff_cables.REST_HEADING
    with pytest.raises(ArgumentError, match=r"10 or more; found 3 20$"):
        stiff_cables.run((3, 20))
