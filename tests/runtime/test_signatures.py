"""Options have names in the signatures that `help` shows; functions of a state are called by time and state, or by parts."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.errors import ArgumentError
from symdyn.formulation.equations import Equations
from symdyn.model.system import System
from symdyn.runtime.module import Module

X = [0.3, -0.8, 1.5, 0.4]


@pytest.mark.parametrize("function", [
    Module.simulate, Module.simulate_batch, Module.equilibria, Module.campbell, Equations.compile, Equations.write,
    System.compile, sd.ensemble])
def test_every_option_has_a_name_and_a_line_in_the_documentation(function: Callable[..., Any]) -> None:
    named = [p for p in inspect.signature(function).parameters.values() if p.name != "self"]
    assert all(p.kind is not p.VAR_KEYWORD and p.annotation is not p.empty for p in named)
    text = inspect.getdoc(function) or ""
    assert [p.name for p in named if p.name not in text] == []


@pytest.mark.parametrize(("call", "option"), [
    (lambda module: module.simulate((0, 1), metod="dop853"), "metod"),
    (lambda module: module.campbell("q1_dot", [1], foo=3), "foo"),
    (lambda module: module.equilibria(sartts=3), "sartts")])
def test_an_unknown_option_is_an_error(call: Callable[[Any], Any], option: str, double: Any) -> None:
    with pytest.raises(TypeError, match=f"unexpected keyword argument '{option}'"):
        call(double)


def test_inputs_by_name_of_one_state(compiled: Callable[..., Any], backend: str) -> None:
    sink = compiled("kitchen_sink", backend)
    x = np.linspace(0.1, 0.5, len(sink.metadata.x))
    F, tau = sink.metadata.inputs
    wanted = sink.rhs(0.2, x, None, [0.3, -0.5])
    for given in ({F: 0.3, tau: -0.5}, {tau: -0.5, F: 0.3}):
        np.testing.assert_array_equal(sink.rhs(0.2, x, None, given), wanted)
        np.testing.assert_array_equal(sink.bind().rhs(0.2, x, given), wanted)
    np.testing.assert_array_equal(sink.bind().jacobian_x(0.2, x, {F: 0.3}), sink.jacobian(0.2, x, None, {F: 0.3}, wrt=("x",)).x)
    with pytest.raises(ArgumentError, match="inputs: there is no 'G'"):
        sink.bind().rhs(0.2, x, {"G": 1.0})


def test_one_input_by_name(backend: str) -> None:
    q = sd.coordinates("q")
    T = sd.inputs("T")
    system = sd.System("motor")
    wheel = system.add_body("wheel", mass=1, inertia=[1, 1, 2])
    system.add_joint(sd.Revolute("shaft", parent=system.ground, child=wheel, axis=[0, 0, 1], coordinate=q))
    system.add_torque(wheel, [0, 0, T])
    module = system.compile(backend=backend)
    for given in ({"T": 1}, {T: 1.0}, [1.0], np.array([1.0]), 1.0):
        np.testing.assert_allclose(module.rhs(0.0, [0.1, 0.2], inputs=given), [0.2, 0.5], rtol=1e-15)
    np.testing.assert_allclose(module.bind().rhs(0.0, [0.1, 0.2], {"T": 1}), [0.2, 0.5], rtol=1e-15)
    np.testing.assert_allclose(module.mass_matrix(0.0, [0.1]), [[2.0]])
    np.testing.assert_allclose(module.mass_matrix(0.1), [[2.0]])
    np.testing.assert_allclose(module.energy(0.1, 0.2), [0.04, 0.0])


def test_both_orders_of_arguments_give_the_same(compiled: Callable[..., Any], backend: str) -> None:
    sink = compiled("kitchen_sink", backend)
    q, u, t, inputs, ud = np.array([0.1, 0.2, 0.3]), np.array([0.4, -0.5, 0.6]), 0.7, [0.3, -0.2], [1.0, 2.0, 3.0]
    x = np.concatenate([q, u, [sink.metadata.initial.get(n, 0.0) for n in sink.metadata.z]])
    p = {"m1": 3.0}
    for new, old in (
            (sink.mass_matrix(t, x, p), sink.mass_matrix(q, p, t)), (sink.mass_matrix(t, q, p), sink.mass_matrix(q, p, t=t)),
            (sink.mass_matrix(t, dict(zip(sink.metadata.x, x, strict=True)), p), sink.mass_matrix(q=q, params=p, t=t)),
            (sink.J(t, x, p), sink.J(q, p, t)), (sink.k_tilde(t, x, p), sink.k_tilde(q, u, p, t)),
            (sink.energy(t, x, p), sink.energy(q, u, params=p, t=t)), (sink.energy(t=t, x=x, params=p), sink.energy(q, u, p, t)),
            (sink.F_tilde(t, x, p, inputs), sink.F_tilde(q, u, p, t, inputs)),
            (sink.inverse_dynamics(t, x, ud, p, inputs), sink.inverse_dynamics(q, u, ud, p, t, inputs))):
        np.testing.assert_array_equal(new, old)
    rows, times = np.tile(x, (4, 1)), np.linspace(0, 1, 4)
    np.testing.assert_array_equal(sink.mass_matrix(times, rows)[2], sink.mass_matrix(q, None, times[2]))
    np.testing.assert_array_equal(sink.energy(times, rows, p)[3], sink.energy(q, u, p, times[3]))


def test_arguments_that_fit_no_order_are_reported(double: Any) -> None:
    single = sd.System("single")
    q, m = sd.coordinates("q"), sd.parameters("m")
    body = single.add_body("body", mass=m, inertia=[1, 1, 1])
    single.add_joint(sd.Revolute("hinge", parent=single.ground, child=body, axis=[0, 0, 1], coordinate=q))
    module = single.compile(backend="numpy")
    with pytest.raises(ArgumentError, match="single: mass_matrix may be called with a time and a state here, or with q"):
        module.mass_matrix(0.1, [2.0])
    np.testing.assert_allclose(module.mass_matrix(q=0.1, params=[2.0]), [[1.0]])
    for call, message in (
            (lambda: double.mass_matrix(X[:2], None, 0.0, None, 1.0),
             r"takes 4 arguments at most, found 5; call mass_matrix\(t, x"),
            (lambda: double.energy(X[:2], X[2:], u=X[2:]), "energy got u twice, with a name and by place"),
            (lambda: double.energy(params=None), "energy needs a state; call energy"),
            (lambda: double.energy(0.0, X, q=X[:2]), "energy got the state x and its parts, too")):
        with pytest.raises(ArgumentError, match=message):
            call()


def test_whole_numbers_are_times_and_as_quick(compiled: Callable[..., Any], backend: str,
                                              monkeypatch: pytest.MonkeyPatch) -> None:
    """They do not take the way of text, masks and mappings, which takes ten times as long."""
    module = compiled("double_pendulum", backend)
    x = np.array([0.1, 0.2, 0.3, 0.4])
    wanted = module.rhs(2.0, x)
    monkeypatch.setattr(type(module), "evaluate", None)
    assert np.array_equal(module.rhs(2, x), wanted) and np.array_equal(module.bind().rhs(2, x), wanted)
