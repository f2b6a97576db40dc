"""Gradients of losses of motions, backwards: against differences at given steps, sensitivities forwards, and closed forms."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ArgumentError, EvaluationError
from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.integrating import gradient as backwards
from symdyn.runtime.integrating import way_back
from tests.helpers import swept

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")

Q1, Q2 = sd.coordinates("q1 q2")
L1, G = sd.parameters("l1 g")
NAMES = ["g", "m1", "l1", "q1(0)", "q2_dot(0)"]
LOSS = sd.Loss(integral=L1 * Q1**2 + sp.cos(Q2.dot) * sd.t, end=Q1 + Q2.dot**2 * G)


@cache
def module() -> Any:
    return sd.systems.n_link_pendulum(2).embedding().compile()


@pytest.mark.native  # its bound is that of fused operations
@pytest.mark.parametrize("method", ["dop853", *swept(["bs54"])])
def test_exact_for_the_steps_that_were_taken(method: str) -> None:
    """At steps of one length, long ones, the loss is a smooth function, whose differences the gradient is."""
    steps = {"t": (0, 2.0), "rtol": 0.1, "atol": 1e9, "first_step": 0.125, "max_step": 0.125, "method": method}
    start = {"q1": -1.2, "q2": 0.3, "q1_dot": 0.1, "q2_dot": -0.2}
    values = dict(zip(module().metadata.parameters, module().default_parameters, strict=True))

    def loss_of(name: str, change: float) -> float:
        x, p = dict(start), dict(values)
        if name.endswith("(0)"):
            x[name[:-3]] += change
        else:
            p[name] += change
        q, u = {k: v for k, v in x.items() if "_" not in k}, {k: v for k, v in x.items() if "_" in k}
        return module().gradient(LOSS, ["g"], q=q, u=u, params=p, **steps).value

    q, u = {"q1": -1.2, "q2": 0.3}, {"q1_dot": 0.1, "q2_dot": -0.2}
    found = module().gradient(LOSS, NAMES, q=q, u=u, **steps)
    assert found.n_steps == 16
    h = 2e-4
    for name in NAMES:
        near, far = ((loss_of(name, k * h) - loss_of(name, -k * h)) / (2 * k * h) for k in (1, 2))
        assert found[name] == pytest.approx((4 * near - far) / 3, rel=1e-9, abs=1e-9)


def test_like_sensitivities_forwards() -> None:
    run = module().simulate((0, 1), [-1.2, 0.3], rtol=1e-12, sensitivities=NAMES)
    found = module().gradient(sd.Loss(end=Q1 + 2 * Q2.dot), NAMES, (0, 1), [-1.2, 0.3], rtol=1e-12)
    assert found.value == pytest.approx(run.x[-1, 0] + 2 * run.x[-1, 3], rel=1e-11)
    np.testing.assert_allclose(found.array, run.sensitivity.matrix[-1].T @ [1, 0, 0, 2], rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(found.x, run.x[-1], rtol=0, atol=1e-10)
    assert found.t == 1.0 and list(found) == NAMES and len(found) == 5 and L1 in found and found[L1] == found["l1"]
    assert repr(found).startswith("<Gradient of a loss of") and repr(found).endswith(f"by 5 numbers, {found.n_steps} steps>")


@pytest.mark.parametrize("name", ["four_bar", *swept(["spatial_slider_crank"])])
def test_on_constraints_like_sensitivities_forwards(name: str) -> None:
    """The projection after every step, and of the start, is carried back, too."""
    mechanism = sd.systems.get(name).augmented().compile()
    metadata = mechanism.metadata
    names = [*metadata.parameters[1:5], f"{metadata.q[0]}(0)", f"{metadata.u[0]}(0)"]
    last = sp.Symbol(metadata.x[-1])
    run = mechanism.simulate((0, 0.5), rtol=1e-11, sensitivities=names)
    found = mechanism.gradient(sd.Loss(end=last), names, (0, 0.5), rtol=1e-11)
    expected = run.sensitivity.of(metadata.x[-1])[-1]
    np.testing.assert_allclose(found.array, expected, rtol=0, atol=1e-7 * np.abs(expected).max())


def test_functions_are_like_expressions() -> None:
    p = module().metadata.parameters

    def integral(t: float, x: np.ndarray, values: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        length = values[p.index("l1")]
        by_p = np.zeros(len(p))
        by_p[p.index("l1")] = x[0] ** 2
        return length * x[0] ** 2, np.array([2 * length * x[0], 0, 0, 0]), by_p

    def end(t: float, x: np.ndarray, values: np.ndarray) -> tuple[float, np.ndarray]:
        return t * x[3] ** 2, np.array([0, 0, 0, 2 * t * x[3]])

    arguments = {"by": NAMES, "t": (0, 1.5), "q": [-1.2, 0.3]}
    mine = module().gradient(sd.Loss(integral, end), **arguments)
    ours = module().gradient(sd.Loss(L1 * Q1**2, sd.t * Q2.dot**2), **arguments)
    assert mine.value == pytest.approx(ours.value, rel=1e-14)
    np.testing.assert_allclose(mine.array, ours.array, rtol=1e-12)


def test_input_and_function_of_time() -> None:
    """A cart that is pushed: x = F t^2/(2 m) with m the whole mass; and one that is pushed by a function of time."""
    cart = sd.systems.cart_pole().embedding().compile()
    place = sp.Symbol(cart.metadata.x[0])
    run = cart.simulate((0, 1), inputs=[0.7], rtol=1e-11, sensitivities=["F", "m_c"])
    found = cart.gradient(sd.Loss(end=place), ["F", "m_c"], (0, 1), inputs=[0.7], rtol=1e-11)
    np.testing.assert_allclose(found.array, run.sensitivity.matrix[-1, 0], rtol=1e-8)
    pushed = {"inputs": {"F": lambda t, x: np.sin(3 * t)}, "rtol": 1e-11}
    run = cart.simulate((0, 1), sensitivities=["m_c"], **pushed)
    F = sp.Symbol("F")
    found = cart.gradient(sd.Loss(end=place, integral=0 * F), ["m_c"], (0, 1), **pushed)
    np.testing.assert_allclose(found.array, run.sensitivity.matrix[-1, 0], rtol=1e-7)
    squares = cart.gradient(sd.Loss(integral=F**2), ["F"], (0, 2), inputs=[0.7])
    assert squares.value == pytest.approx(0.98, rel=1e-12) and squares["F"] == pytest.approx(2.8, rel=1e-12)


def test_memory_grows_with_the_square_root_of_the_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(way_back, "STRETCH", 8)
    monkeypatch.setattr(backwards, "KEPT", 0)
    arguments = {"by": NAMES, "q": [-1.2, 0.3], "max_step": 0.01}
    runs = [module().gradient(sd.Loss(end=Q1), t=(0, end), **arguments) for end in (2, 8, 32)]
    steps, memory = np.array([r.n_steps for r in runs]), np.array([r.memory for r in runs])
    assert steps[-1] > 3000
    assert (memory / np.sqrt(steps)).max() < 2.5 * (memory / np.sqrt(steps)).min()


def test_stretches_do_not_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    arguments = {"by": NAMES, "t": (0, 3), "q": [-1.2, 0.3], "max_step": 0.02}
    whole = module().gradient(LOSS, **arguments)
    for stretch, kept in ((1, 0), (2, 0), (7, 0), (7, 20_000), (7, 2**22)):
        monkeypatch.setattr(way_back, "STRETCH", stretch)
        monkeypatch.setattr(backwards, "KEPT", kept)
        parts = module().gradient(LOSS, **arguments)
        assert parts.n_steps == whole.n_steps
        np.testing.assert_allclose(parts.array, whole.array, rtol=1e-13)
        assert parts.value == pytest.approx(whole.value, rel=1e-14)


def test_backward_in_time() -> None:
    run = module().simulate((1, 0), [-1.2, 0.3], rtol=1e-12, sensitivities=NAMES)
    found = module().gradient(sd.Loss(end=Q1), NAMES, (1, 0), [-1.2, 0.3], rtol=1e-12)
    np.testing.assert_allclose(found.array, run.sensitivity.matrix[-1, 0], rtol=1e-8, atol=1e-10)


END = sd.Loss(end=Q1)


@pytest.mark.parametrize(("loss", "more", "message"), [
    (Q1**2, {}, r"the loss is q1\*\*2; pass sd.Loss\(integral=..., end=...\)"),
    (sd.Loss(end="q1**2"), {}, r"the end of the loss is 'q1\*\*2'; pass an expression of coordinates"),
    (sd.Loss(integral=sp.Symbol("q9")), {}, "the integral of the loss has q9, which is no state, input or parameter here; there"),
    (sd.Loss(integral=sp.zeta(Q1)), {}, "the integral of the loss: .*; write it in coordinates and speeds, or pass a function"),
    (sd.Loss(end=lambda t, x, p: (1.0, np.array([1 + 1j, 0, 0, 0]))), {}, r"needed are its value, its derivatives by the 4"),
    (sd.Loss(end=lambda t, x, p: 3.0), {}, r"returned 3.0 at t = 0.1; needed are its value, its derivatives by the 4 states"),
    (END, {"by": []}, "a gradient by nothing was asked for; name parameters"),
    (END, {"by": ["l7"]}, "neither a parameter, an input nor the initial value"),
    (END, {"method": "radau"}, "with method 'radau'; the way back is there for dop853 and bs54")])
def test_what_does_not_fit(loss: Any, more: dict[str, Any], message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        module().gradient(loss, **{"by": ["l1"], "t": (0, 0.1), "q": [-1.2, 0.3], **more})


def test_what_has_no_gradient() -> None:
    with pytest.raises(ArgumentError, match=r"sd.Loss needs an integral, an end, or both"):
        sd.Loss()
    asked = {"by": ["l1"], "t": (0, 1), "q": [-1.2, 0.3]}
    with pytest.raises(EvaluationError, match="the integral of the loss is nan at t = "):
        module().gradient(sd.Loss(integral=sp.log(Q1)), **asked)
    with pytest.raises(EvaluationError, match="the end of the loss has a derivative that is inf at t = 1 s"):
        module().gradient(sd.Loss(end=lambda t, x, p: (0.0, np.array([np.inf, 0, 0, 0]))), **asked)
    with pytest.raises(EvaluationError, match=r"the function for the end of the loss raised ZeroDivisionError: .*, in line"):
        module().gradient(sd.Loss(end=lambda t, x, p: 1 / 0), **asked)
    with pytest.raises(ArgumentError, match=r"a gradient was asked for on the backend numpy; the way back is compiled"):
        sd.systems.pendulum().compile(backend="numpy").gradient(sd.Loss(end=Q1), ["l"], (0, 1))
    with pytest.raises(ArgumentError, match="the gradient has no 'm2'; it is by l1"):
        module().gradient(END, **asked)["m2"]


def test_motion_that_stops_early() -> None:
    q = sd.coordinates("q")
    k, m = sd.parameters("k m", positive=True)
    system = sd.System("blow_up")
    body = system.add_body("body", mass=m)
    joint = system.add_joint(sd.Prismatic("slide", system.ground, body, axis=[1, 0], coordinate=q))
    system.add_joint_force(joint, k * q**3, name="push")
    system.defaults, system.initial = {k: 1, m: 1}, {q: 1}
    with pytest.raises(EvaluationError, match=r"the step became too small|is not finite"):
        system.embedding().compile().gradient(sd.Loss(end=q), ["k"], (0, 10))


def test_outputs_in_a_loss() -> None:
    """The tip of two bars like its closed form, also in an expression that jumps where it passes."""
    system = sd.systems.n_link_pendulum(2)
    tip = sd.position(system.bodies[-1], [1, 0])
    system.add_output("tip", tip)
    arm = system.compile()
    a, b, end = sp.Symbol("tip[0]"), sp.Symbol("tip[1]"), {"t": (0, 1), "q": [-1.2, 0.3], "rtol": 1e-10}
    names = ["l1", "m2", "q1(0)"]
    own = (L1 * sp.cos(Q1) + sp.cos(Q1 + Q2), L1 * sp.sin(Q1) + sp.sin(Q1 + Q2))
    place = [float(e.subs({Q1: 0.4, Q2: 0.9, L1: 1})) for e in own]
    np.testing.assert_allclose(arm.evaluate("outputs", 0, [0.4, 0.9, 0, 0]).ravel(), place, rtol=1e-12)
    for of in (lambda x, y: sd.Loss(integral=x**2 + y * Q1, end=x * y), lambda x, y: sd.Loss(integral=sp.sign(x))):
        by_outputs, explicit = arm.gradient(of(a, b), names, **end), arm.gradient(of(*own), names, **end)
        assert by_outputs.value == pytest.approx(explicit.value, rel=1e-9)
        np.testing.assert_allclose(by_outputs.array, explicit.array, rtol=1e-7, atol=1e-9)
        assert explicit.array.any()
    with pytest.raises(ArgumentError, match=r"tip\[2\], which is no state.* tip\[0\], tip\[1\]"):
        arm.gradient(sd.Loss(end=sp.Symbol("tip[2]")), names, **end)
    with pytest.raises(ArgumentError, match=r"make what it says of bodies outputs, system.add_output, and name these"):
        arm.gradient(sd.Loss(end=tip[0]), names, **end)
