"""Views in a notebook of modules, motions, linear equations and ensembles: tables with the numbers that they have."""

from __future__ import annotations

import re

import numpy as np
import pytest

import symdyn as sd


@pytest.fixture(scope="module")
def module() -> sd.Module:
    return sd.systems.double_pendulum().compile(backend="numpy")


def rows(page: str) -> dict[str, list[str]]:
    """Cells of the rows by the first of them; the page begins with how the object prints."""
    assert page.startswith("<div><b>&lt;") and page.count("<table>") == page.count("</table>")
    found = [re.findall(r"<t[dh]>(.*?)</t[dh]>", row) for row in re.findall(r"<tr>(.*?)</tr>", page)]
    return {first: others for first, *others in found}


def test_a_module_shows_states_and_parameters(module: sd.Module) -> None:
    shown = rows(module._repr_html_())
    assert shown["q2"] == ["rad", "0.1"] and shown["q1_dot"] == ["rad/s", "0"] and shown["g"] == ["m/s^2", "9.81"]


def test_a_parameter_without_a_number_stays_empty() -> None:
    q, m, k = sd.coordinates("q"), *sd.parameters("m k")
    system = sd.System("slider")
    block = system.add_body("block", mass=m)
    system.add_joint(sd.Prismatic("rail", system.ground, block, axis=[1, 0, 0], coordinate=q))
    system.add_joint_force("rail", -k * q)
    system.defaults = {m: 2.0}
    page = system.compile(backend="numpy")._repr_html_()
    assert rows(page)["k"][1] == "" and rows(page)["m"][1] == "2"


def test_a_motion_shows_ends_and_extremes(module: sd.Module) -> None:
    motion = module.simulate((0, 1))
    unit, start, end, least, most = rows(motion._repr_html_())["q1"]
    q = motion["q1"]
    assert unit == "rad" and [float(v) for v in (start, end, least, most)] == pytest.approx(
        [q[0], q[-1], q.min(), q.max()], rel=1e-5)


def test_linear_equations_show_their_matrix(module: sd.Module) -> None:
    linear = module.linearize(module.equilibrium(start={"q1": -1.5, "q2": 0.0}))
    shown = rows(linear._repr_html_())
    assert shown["A"] == list(linear.states)
    assert np.allclose([float(v) for v in shown["d/dt q1_dot"]], linear.A[2], rtol=1e-3, atol=1e-6)


def test_long_tables_are_complete_and_scroll() -> None:
    """Every row and column is there, in a box that the keyboard reaches; short tables need none."""
    module = sd.systems.n_link_pendulum(8).compile(backend="numpy")
    linear = module.linearize(module.equilibrium(start={"q1": -1.5}))
    page = linear._repr_html_()
    shown = rows(page)
    assert [name for name in shown if name.startswith("d/dt")] == [f"d/dt {n}" for n in linear.states]
    assert np.allclose([[float(v) for v in shown[f"d/dt {n}"]] for n in linear.states], linear.A, rtol=1e-3, atol=1e-6)
    assert 'tabindex="0" role="region" aria-label="16 rows: A"' in page and "overflow: auto" in page
    parameters = sd.systems.n_link_pendulum(8)._repr_html_()
    assert all(f"<td>{p}</td>" in parameters for p in ("m1", "m8", "lc8", "I8"))
    assert "overflow" not in sd.systems.pendulum()._repr_html_()


def test_an_ensemble_shows_its_outcomes(module: sd.Module, tmp_path: object) -> None:
    many = sd.ensemble(module, {"q1": [0.1, 0.2, 0.3]}, (0, 0.5), ["end q1", "trace q2"], path=str(tmp_path))
    mean, deviation, least, most = map(float, rows(many._repr_html_())["end q1"])
    ends = many["end q1"]
    assert [mean, deviation, least, most] == pytest.approx([ends.mean(), ends.std(), ends.min(), ends.max()], rel=1e-5)
    assert "trace q2</td>" not in many._repr_html_()
