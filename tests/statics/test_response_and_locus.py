"""Harmonic response, root locus and modes as motions against closed forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import symdyn as sd
from symdyn.errors import ArgumentError
from symdyn.runtime.module import Module

M, K = 2.0, 50.0


@pytest.fixture(scope="module")
def stage() -> Module:
    """A mass on a spring and a damper, pushed by F."""
    m, c, k = sd.parameters("m c k", positive=True)
    x, F = sd.coordinates("x"), sd.inputs("F")
    system = sd.System("stage", gravity=[0, 0])
    body = system.add_body("block", mass=m)
    system.add_joint(sd.Prismatic("rail", system.ground, body, axis=[1, 0], coordinate=x))
    system.add_joint_force("rail", F - k * x - c * x.dot)
    system.defaults = {m: M, c: 4.0, k: K}
    return system.compile(backend="numpy")


@pytest.fixture(scope="module")
def loop() -> Module:
    return sd.systems.four_bar().augmented().compile("numpy")


def test_the_response_is_that_of_an_oscillator(stage: Module, tmp_path: Path) -> None:
    response = stage.linearize(stage.equilibrium()).response([0.5, 5.0, 40.0])
    w = response.omega
    wanted = 1 / (K - M * w**2 + 4j * w)
    assert np.allclose(response["x", "F"], wanted, rtol=1e-12)
    assert np.allclose(response["x_dot", "F"], 1j * w * wanted, rtol=1e-12)
    assert np.allclose(response.gain[:, 0, 0] * np.exp(1j * response.phase[:, 0, 0]), wanted, rtol=1e-12)
    figure = response.plot(tmp_path / "bode.pdf")
    above, below = figure.axes
    assert [line.get_label() for line in above.lines] == ["$x$ [m]", r"$\dot{x}$ [m/s]"]
    assert np.allclose(above.lines[0].get_ydata(), abs(wanted)) and below.get_xlabel() == r"$\omega$ [rad/s]"
    assert (tmp_path / "bode.pdf").stat().st_size > 5000


def test_many_outputs_differ_by_colours_and_dashes_and_inputs_without_effect_are_named(tmp_path: Path) -> None:
    """Units stand with what they are of: an output by several inputs has one unit of its own."""
    x, y, F, G = *sd.coordinates("x y"), *sd.inputs("F G")
    k = sd.parameters("k")
    system = sd.System("two", gravity=[0, 0])
    for name, q, force in (("one", x, F), ("other", y, 0 * G)):
        body = system.add_body(name, mass=1.0)
        system.add_joint(sd.Prismatic(f"rail_{name}", system.ground, body, axis=[1, 0], coordinate=q))
        system.add_joint_force(f"rail_{name}", force - k * q)
    system.add_force("one", [0, G])
    for n in range(10):
        system.add_output(f"o{n}", (n + 1) * x)
    system.defaults = {k: 1.0}
    system.units = {F: "N", G: "N"}
    module = system.compile(backend="numpy")
    figure = module.linearize(module.equilibrium()).response([0.1, 0.5]).plot(tmp_path / "bode.png")
    first, second = figure.axes[:2]
    drawn = {(line.get_color(), line.get_linestyle()) for line in first.lines}
    assert len(drawn) == len(first.lines) == 10
    assert [axes.get_title() for axes in (first, second)] == ["input $F$ [N]", "input $G$ [N]"]
    assert [text.get_text() for text in second.texts] == ["no effect on these outputs"] and not first.texts


def test_numbers_of_damping_do_not_overlap(stage: Module) -> None:
    """In a picture whose real parts are much larger than its imaginary ones."""
    figure = stage.root_locus("c", np.linspace(100, 1000, 10)).plot()
    figure.canvas.draw()
    boxes = [text.get_window_extent() for text in figure.axes[0].texts]
    assert boxes and not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[:k])


def test_by_default_the_response_covers_all_eigenvalues(stage: Module) -> None:
    response = stage.linearize(stage.equilibrium(params={"c": 0.0})).response()
    natural = np.sqrt(K / M)
    assert np.allclose(response.omega[[0, -1]], [0.1 * natural, 10 * natural])
    # At the undamped frequency itself nothing bounds the response.
    at = stage.linearize(stage.equilibrium(params={"c": 0.0})).response(natural)
    assert not np.isfinite(at.H).all() or at.gain.max() > 1e12


def test_roots_over_a_parameter_are_those_of_the_polynomial(stage: Module, tmp_path: Path) -> None:
    """A pair goes to the left, meets on the real axis at critical damping, and parts."""
    values = np.array([0.0, 4.0, 12.0, 19.0, 21.0, 30.0])
    locus = stage.root_locus("c", values)
    for value, row in zip(values, locus.eigenvalues, strict=True):
        wanted = np.roots([M, value, K])
        found = row[np.isfinite(row)]
        for root in wanted[wanted.imag >= 0]:
            assert np.abs(found - root).min() < 1e-9 * abs(root)
        assert len(found) == len(wanted[wanted.imag >= 0])
    assert np.allclose(locus.growth, [np.roots([M, value, K]).real.max() for value in values], atol=1e-9)
    figure = locus.plot(tmp_path / "locus.png")
    assert figure.axes[0].get_xlabel() == "real part [1/s]" and (tmp_path / "locus.png").stat().st_size > 10_000
    assert repr(locus).splitlines()[0] == "stage: eigenvalues over c, 1/s" and "-1 +- 4.89898i" in repr(locus)


def test_the_locus_about_a_given_state_keeps_it(stage: Module) -> None:
    locus = stage.root_locus("k", [50.0, 200.0], at={"x": 0.0}, params={"c": 0.0})
    assert np.allclose(locus.eigenvalues.ravel(), [5j, 10j])
    assert all(each.x[0] == 0.0 for each in locus.linear)


def test_a_mode_moves_with_its_period_and_its_shape(stage: Module) -> None:
    linear = stage.linearize(stage.equilibrium(params={"c": 0.0}))
    motion = linear.mode_motion(0, amplitude=0.2, periods=2)
    t, natural = motion.t, np.sqrt(K / M)
    assert t[-1] == pytest.approx(4 * np.pi / natural)
    assert np.allclose(motion["x"], 0.2 * np.cos(natural * t))
    assert np.allclose(motion["x_dot"], -0.2 * natural * np.sin(natural * t))
    assert "not a solution of the equations" in motion.message


def test_damping_is_left_out_and_real_modes_decay(stage: Module) -> None:
    weak, strong = (stage.linearize(stage.equilibrium(params={"c": c})) for c in (4.0, 40.0))
    assert weak.mode_motion(0, amplitude=0.1)["x"][-1] == pytest.approx(0.1)
    slow = strong.modes()[0]
    motion = strong.mode_motion(slow, amplitude=0.1)
    assert np.allclose(motion["x"], 0.1 * np.exp(motion.t * slow.eigenvalue.real))
    assert motion.t[-1] == pytest.approx(3 * slow.time_constant)


def test_loops_stay_closed_in_a_mode_that_is_seen(loop: Module) -> None:
    motion = loop.linearize(loop.equilibrium()).mode_motion(0)
    assert np.abs(motion.constraint_violation).max() < 1e-9
    moved = np.ptp(motion.rows("positions").reshape(len(motion.t), -1, 3), axis=0)
    assert np.linalg.norm(moved, axis=1).max() > 0.1
    assert len(motion.view().html) > 10_000


def test_what_cannot_be_shown_is_reported(stage: Module, loop: Module) -> None:
    linear = stage.linearize(stage.equilibrium())
    with pytest.raises(ArgumentError, match="there is no response of 'y' to 'F'; there are outputs x, x_dot and inputs F"):
        linear.response()["y", "F"]
    with pytest.raises(ArgumentError, match="omega must be positive frequencies in rad/s, found 0"):
        linear.response(0.0)
    with pytest.raises(ArgumentError, match="the system has no inputs"):
        loop.linearize(loop.equilibrium()).response()
    with pytest.raises(ArgumentError, match="amplitude must be positive, found 0"):
        linear.mode_motion(0, amplitude=0.0)
    with pytest.raises(ArgumentError, match="pass one of linear"):
        linear.mode_motion(1.5)  # type: ignore[arg-type]
    with pytest.raises(ArgumentError, match=r"the mechanism cannot be moved so far in this shape: .* pass a smaller amplitude"):
        loop.linearize(loop.equilibrium()).mode_motion(0, amplitude=3.0)
    cart = sd.systems.cart_pole().compile(backend="numpy")
    with pytest.raises(ArgumentError, match="has no frequency and no time constant"):
        cart.linearize({"q2": np.pi}).mode_motion(0)
    with pytest.raises(ArgumentError, match="c is in params, too; leave it out there"):
        stage.root_locus("c", [1.0], params={"c": 2.0})
    with pytest.raises(ArgumentError, match="values must be numbers of c"):
        stage.root_locus("c", [])
    with pytest.raises(ArgumentError, match="both at and start are given"):
        stage.root_locus("c", [1.0], at={"x": 0.0}, start={"x": 0.0})
    with pytest.raises(ArgumentError, match="parameter must be one name or symbol"):
        stage.root_locus(["c", "k"], [1.0])  # type: ignore[arg-type]
    with pytest.raises(ArgumentError, match="there is no mode 'y'"):
        stage.root_locus("c", [1.0])["y"]
