"""Arguments that frames, points and numbers reject, with their messages."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.frames import numbers
from tests.frames.chains import turn

q, x = sd.coordinates("q x")
n = sd.Frame("n")
b = n.frame("b", rotation=turn("Z", q))
P = b.point("P", [x, 0, 0])
SKEWED = sp.Matrix([[sp.cos(q), sp.sin(q), 0], [sp.sin(q), sp.cos(q), 0], [0, 0, 1]])


@pytest.mark.parametrize(("call", "error", "message"), [
    (lambda: n.frame("c", rotation=SKEWED), sd.NotARotation,
     r"frame c: rotation is not a rotation: R R\^T differs from the identity by 0\.\d+ and det R = .* at q = "),
    (lambda: n.frame("c", rotation=np.diag([1.0, 1.0, -1.0])), sd.NotARotation, "det R = -1, so that it mirrors"),
    (lambda: n.frame("c", rotation=np.diag([1.0, 1.0, 1 + 1e-6])), sd.NotARotation, "by 2e-06"),
    (lambda: n.frame("c", rotation=turn("Z", sp.sqrt(-1 - q**2))), sd.NotARotation, "no finite value at random values"),
    (lambda: n.frame("c", rotation=[[1, 0], [0, 1]], origin="x"), sd.ModelError,
     r"(?s)2 faults.*pass a 3 x 3 matrix.*origin is 'x'"),
    (lambda: n.frame("c", rotation=2 * sp.eye(3), origin=[1, 2]), sd.ModelError, r"(?s)origin has 2 components.*not a rotation"),
    (lambda: n.frame("c", rotation=sp.eye(2)), sd.ModelError, r"has the shape \(2, 2\)"),
    (lambda: n.frame("c", origin=[float("nan"), 0, 0]), sd.ModelError, "origin, component 1 is nan"),
    (lambda: n.frame("c", origin=[sp.Symbol("t", real=True), 0, 0]), sd.ModelError, "a symbol t with assumptions"),
    (lambda: n.frame(3), sd.ModelError, "the name of a frame is 3"),
    (lambda: sd.Frame("c", "n"), sd.ModelError, "its parent is 'n'; pass a frame"),
    (lambda: sd.Frame("c", origin=[1, 0, 0]), sd.ModelError, "a rotation or an origin, but no parent"),
    (lambda: n.point("P", "here"), sd.ModelError, "point P: position is 'here'"),
    (lambda: n.point(None), sd.ModelError, "the name of a point is None"),
    (lambda: n.vector([1, 2, 3], ""), sd.ModelError, "the name of a vector is ''"),
    (lambda: P.velocity(sd.Frame("m")), sd.ArgumentError,
     "frames of different trees.* 'b' hangs on 'n', seen_from 'm' hangs on 'm'"),
    (lambda: P.velocity("n"), sd.ArgumentError, "seen_from is 'n'; pass a frame"),
    (lambda: P.position("n"), sd.ArgumentError, "seen_from is 'n'; pass a frame"),
    (lambda: b.rotation(sd.Frame("m")), sd.ArgumentError, "frames of different trees"),
    (lambda: b.angular_velocity(n, "b"), sd.ArgumentError, "components is 'b'; pass a frame"),
    (lambda: P.acceleration_parts(through=3), sd.ArgumentError, "through is 3; pass a frame"),
    (lambda: P.inertial_forces("m"), sd.ModelError, "mass is the text 'm'"),
    (lambda: n.vector([1, 0, 0]).components(sd.Frame("m")), sd.ArgumentError, "frames of different trees"),
    (lambda: n.point("P", [q.dot, 0, 0]).acceleration(), sd.ModelError, "the rate of q_ddot is asked for"),
])
def test_rejected(call, error, message):
    with pytest.raises(error, match=message):
        call()


def test_velocity_needs_no_third_derivative():
    assert n.point("P", [q.dot, 0, 0]).velocity() == sp.Matrix([q.ddot, 0, 0])


def test_path_of_frames():
    c = b.frame("c")
    assert c.path == (n, b, c)
    assert (repr(n), repr(c)) == ("Frame('n')", "Frame('c', in 'b')")
    assert c.root is n
    assert (repr(P), repr(n.vector([1, 2, 3], "F"))) == ("Point('P', [x, 0, 0] in 'b')", "Vector('F', [1, 2, 3] in 'n')")
    assert repr(b.body(2, [1, 1, 1])) == "Body(mass 2, in 'b')"


T = np.array([0.0, 1.0])


@pytest.mark.parametrize(("call", "error", "message"), [
    (lambda: P.path(n, T, {q: 1}), sd.ArgumentError, "there is no value for x; give one in values"),
    (lambda: P.path(n, T, {q: 1, "xx": 2}), sd.ArgumentError, r"no value for x; .* \(there is 'xx'\)"),
    (lambda: P.path(n, None, {q: 1, x: 1}), sd.ArgumentError, "t is None; pass an array of times"),
    (lambda: P.path(n, 2.0, {q: 1, x: 1}), sd.ArgumentError, "t is 2.0; pass an array of times"),
    (lambda: P.path(n, [0, float("inf")], {q: 1, x: 1}), sd.ArgumentError, "t has 1 entries that are not finite"),
    (lambda: P.path(n, T, {q: 1, x: 1}, "speed"), sd.ArgumentError, "quantity is 'speed'; pass 'position'"),
    (lambda: P.path(n, T, {q: 1, x: float("nan")}), sd.ArgumentError, "the value of x is nan"),
    (lambda: P.path(n, T, {q: "1", x: "2"}), sd.ArgumentError, "the value of q is the text '1'.*the value of x is the text '2'"),
    (lambda: P.path(n, T, {q: 1, x: lambda t: "far"}), sd.ArgumentError, "function given for x does not return a number"),
    (lambda: P.path(n, T, {q: 1, x: lambda t: t / 0 if t < 0 else np.inf}), sd.ArgumentError, "x is not finite at t = 0 s"),
    (lambda: P.path(n, T, {q: 1, x: np.sin}, "velocity"), sd.ArgumentError, "x is given as a function, whose rate is not known"),
    (lambda: P.path(n, T, {q: 1, x: 1 / sd.t}), sd.EvaluationError, "entry 1 has no finite value at t = 0 s; it is x.cos"),
    (lambda: P.path(n, T, {q: x, x: q}), sd.ArgumentError, "values are given in a circle: q -> x -> q"),
    (lambda: P.path(n, T, [1, 2]), sd.ArgumentError, r"values is \[1, 2\]; pass a dict"),
    (lambda: numbers(x.dot, {x: 2}), sd.ArgumentError, "no value for x_dot"),
    (lambda: numbers(x, {x: np.sin}, 1.0), sd.ArgumentError, "x is given as a function, but t is no array"),
    (lambda: numbers(x, {x: 1}, "now"), sd.ArgumentError, "t is 'now'"),
    (lambda: numbers(x, {x: 1}, [[1]]), sd.ArgumentError, r"t has the shape \(1, 1\)"),
    (lambda: numbers(sp.gamma(x), {x: 1}), sd.EvaluationError, "no number comes of"),
    (lambda: numbers(1 / (x - 2), {x: 2}), sd.EvaluationError, "no number comes of|no finite value"),
])
def test_no_numbers(call, error, message):
    with pytest.raises(error, match=message):
        call()


def test_numbers_of_all_shapes():
    assert numbers(x**2, {x: 3}) == 9.0
    assert numbers(sp.Matrix([[x, 1], [0, x]]), {"x": 2}).tolist() == [[2, 1], [0, 2]]
    assert numbers(x.dot, {x: 3 * sd.t}, T).tolist() == [3, 3]
    assert numbers(x.ddot, {x: sd.t**3, sd.t: 2}) == 12.0
    assert numbers(x.dot, {x: 5}, T).tolist() == [0, 0]
    assert numbers(sp.Matrix([x, q]), {x: lambda t: t**2, q: 2 * x}, [1.0, 2.0]).tolist() == [[1, 2], [4, 8]]
