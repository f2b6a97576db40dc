"""The linear-quadratic regulator along a motion: S and the gain over time, by Riccati's differential equation backwards.

    -S_dot = A^T S + S A - S B R^-1 B^T S + Q,    S(t_f) = Q_f,    din = -R^-1 B^T S dx

with the exact derivatives A(t), B(t) of the equations along the motion. On constraints dx lies in their tangent space, which A
and B do not leave, so that what S holds across it does not matter.
Source: Anderson and Moore, Optimal Control: Linear Quadratic Methods, 1990, chapter 2.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import PPoly

from symdyn.errors import ArgumentError, EvaluationError
from symdyn.optimal.transcription import through
from symdyn.real_numbers import number_of, real_of
from symdyn.shown import name_of
from symdyn.statics.regulator import demand_definite, weights_of

if TYPE_CHECKING:
    from symdyn.optimal.course import Course
    from symdyn.optimal.result import Optimum

# Relative error of a step of S; points of a polynomial of the gain; breaks of these that are nearer are one, as a part of the
# whole.
RTOL, POINTS, CLOSE = 1e-8, 6, 1e-9


@dataclass(frozen=True, eq=False)
class Tracking:
    """Inputs that keep a mechanism near a motion: din = -K(t) dx.

    Q, Qf   weights of the states (n_x, n_x) over time and at the end; R: of the driven inputs (k, k)
    driven  names of the inputs that have weights; all others are those of the motion

    `tracking(t, x)` are the inputs (n_in,), to be passed to `simulate` as inputs=tracking, or sd.Sampled(tracking, period=0.01).

    >>> module = sd.systems.cart_pole().compile()
    >>> swing = sd.optimize(module, sd.Loss(integral=sp.Symbol("F") ** 2), 0.5, end={"q1": 0, "q2": 0}, tolerance=None,
    ...                     intervals=5, method="slsqp")
    >>> tracking = swing.lqr(Q=[1, 1, 0, 0], R=[0.01], Qf={"q2": 10})
    >>> bool(tracking(0.0, swing.x[0])[0] == swing.inputs[0, 0]), tracking.K(0.2).shape
    (True, (1, 4))
    """

    motion: Optimum | Course
    Q: np.ndarray
    R: np.ndarray
    Qf: np.ndarray
    driven: tuple[str, ...]
    _S: Callable[[float], np.ndarray] = field(repr=False)
    _K: PPoly = field(repr=False)

    def __call__(self, t: float, x: Sequence[float] | np.ndarray) -> np.ndarray:
        """Raises ArgumentError beyond the motion, and for what is no time or no state."""
        motion = self.motion
        try:
            if not self._begin <= t <= self._end:
                t = float(motion.within(t))
            result: np.ndarray = motion.inputs_over_time(t)
            result[self._driven_indices] -= self._K(t) @ (np.asarray(x, dtype=float) - motion.states_over_time(t))
        except (TypeError, ValueError):  # checked afterwards: it is called at every step of a motion
            number_of(t, motion.module.name, "t of a regulator must be a number")
            state = real_of(x, motion.module.name, "x of a regulator must be numbers")
            if state.shape != (len(self.Q),):
                raise ArgumentError(f"{motion.module.name}: x of a regulator has the shape {state.shape}; needed is "
                                    f"{(len(self.Q),)}") from None
            raise
        return result

    @cached_property
    def _driven_indices(self) -> list[int]:
        names = self.motion.module.metadata.inputs
        return [names.index(n) for n in self.driven]

    @cached_property
    def _begin(self) -> float:
        return float(self.motion.t[0])

    @cached_property
    def _end(self) -> float:
        return float(self.motion.t[-1])

    def S(self, t: float) -> np.ndarray:
        """(n_x, n_x): what is left to pay for a deviation dx at a time is dx^T S dx.

        >>> F = sd.inputs("F")
        >>> found = sd.optimize(sd.systems.cart_pole().compile(), sd.Loss(integral=F**2), 0.5, start={"q2": 0.0}, end={"q1": 0.1},
        ...                     intervals=4, tolerance=None, method="slsqp")
        >>> tracking = found.lqr(Q=[1, 1, 0, 0], R=[0.1], Qf=[5, 6, 7, 8])
        >>> np.round(tracking.S(found.duration).diagonal(), 6)
        array([5., 6., 7., 8.])
        """
        n = len(self.Q)
        result = np.asarray(self._S(float(self.motion.within(t)))).reshape(n, n)
        return np.asarray((result + result.T) / 2)

    def K(self, t: float) -> np.ndarray:
        """The gain at a time, (k, n_x), rows as driven, columns as the state; by polynomials through exact values. Raises
        ArgumentError beyond the motion.

        >>> F = sd.inputs("F")
        >>> found = sd.optimize(sd.systems.cart_pole().compile(), sd.Loss(integral=F**2), 0.5, start={"q2": 0.0}, end={"q1": 0.1},
        ...                     intervals=4, tolerance=None, method="slsqp")
        >>> found.lqr(Q=[1, 1, 0, 0], R=[0.1]).K(0.25).shape
        (1, 4)
        """
        return np.asarray(self._K(float(self.motion.within(t))))

    def __repr__(self) -> str:
        first, last = self.motion.t[0], self.motion.t[-1]
        return f"<Tracking of {self.motion.module.name} from {first:g} to {last:g} s by {', '.join(self.driven)}>"


def tracking(motion: Optimum | Course, Q: Any, R: Any, Qf: Any = None) -> Tracking:
    """See Optimum.lqr and Solution.lqr."""
    module = motion.module
    owner, states, inputs = module.name, module.metadata.x, module.metadata.inputs
    if not inputs:
        raise ArgumentError(f"{owner}: a regulator was requested, but the system has no inputs; add loads with sd.inputs(...)")
    driven = tuple(n for n in inputs if not isinstance(R, Mapping) or n in {name_of(key) for key in R})
    wrong = [str(name_of(key)) for key in R if name_of(key) not in inputs] if isinstance(R, Mapping) else []
    if wrong or not driven:
        raise ArgumentError(f"{owner}: R has weights of {', '.join(wrong) or 'nothing'}; give weights of inputs: "
                            f"{', '.join(inputs)}")
    none = dict.fromkeys(states, 0.0)
    of_states, of_inputs = weights_of(Q, states, "Q", owner, none), weights_of(R, driven, "R", owner, {})
    at_end = of_states if Qf is None else weights_of(Qf, states, "Qf", owner, none)
    for matrix, names, what, strictly in ((of_states, states, "Q", False), (of_inputs, driven, "R", True),
                                          (at_end, states, "Qf", False)):
        demand_definite(matrix, names, what, owner, strictly=strictly)
    indices, n = [inputs.index(name) for name in driven], len(states)
    inverse = np.linalg.inv(of_inputs)
    without = (f"{owner}: Riccati's equation along the motion has no finite solution to working precision; change the weights by "
               "less extreme ratios")

    def rate(t: float, flat: np.ndarray) -> np.ndarray:
        S = flat.reshape(n, n)
        if not np.isfinite(flat).all() or not np.isfinite(t):
            raise EvaluationError(without)
        result = module.jacobian(t, motion.at(t), motion.params, motion.inputs_at(t), wrt=["x", "inputs"])
        assert result.x is not None and result.inputs is not None
        A, SB = result.x, S @ result.inputs[:, indices]
        return np.asarray(-(A.T @ S + S @ A - SB @ inverse @ SB.T + of_states)).ravel()

    first, last = float(motion.t[0]), float(motion.t[-1])
    size = max(np.abs(of_states).max(), np.abs(at_end).max(), 1e-300)
    with np.errstate(all="ignore"):
        result = solve_ivp(rate, (last, first), at_end.ravel(), method="DOP853", rtol=RTOL, atol=RTOL * size, dense_output=True)
    if not result.success:
        raise EvaluationError(without)
    return Tracking(motion, of_states, of_inputs, at_end, driven, result.sol, _gain(motion, result, indices, inverse))


def _gain(motion: Optimum | Course, result: Any, indices: Sequence[int], inverse: np.ndarray) -> PPoly:
    """R^-1 B^T S as polynomials through its values in every interval of the mesh and step of Riccati's equation."""
    breaks = np.unique(np.concatenate([motion.breaks, result.t[(result.t > motion.t[0]) & (result.t < motion.t[-1])]]))
    apart = np.append(np.diff(breaks) > CLOSE * (breaks[-1] - breaks[0]), True)
    apart[0] = True
    breaks, h = breaks[apart], np.diff(breaks[apart])
    inner = (1 - np.cos(np.pi * (2 * np.arange(POINTS) + 1) / (2 * POINTS))) / 2
    t = (breaks[:-1, None] + h[:, None] * inner).ravel()
    B = motion.module.jacobian(t, motion.at(t), motion.params, motion.inputs_at(t), wrt=["inputs"]).inputs
    assert B is not None
    n = motion.module.metadata.sizes.x
    S = np.asarray(result.sol(t)).T.reshape(-1, n, n)
    K = np.einsum("ij,tkj,tkl->til", inverse, B[:, :, indices], (S + S.transpose(0, 2, 1)) / 2)
    c = through(inner, K.reshape(len(h), POINTS, -1), h)
    return PPoly(c.reshape(*c.shape[:2], len(indices), n), breaks)
