"""The linear-quadratic regulator along a motion: S and the gain over time, by Riccati's differential equation backwards.

    -S_dot = A^T S + S A - S B R^-1 B^T S + Q,    S(t_f) = Q_f,    din = -R^-1 B^T S dx

with the exact derivatives A(t), B(t) of the equations along the motion. On constraints dx lies in their tangent space, which A
and B do not leave, so that what S holds across it does not matter.
Source: Anderson and Moore, Optimal Control: Linear Quadratic Methods, 1990, chapter 2.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.integrate import solve_ivp

from symdyn.errors import ArgumentError, EvaluationError
from symdyn.shown import name_of
from symdyn.statics.regulator import demand_definite, weights_of

if TYPE_CHECKING:
    from symdyn.optimal.result import Optimum

# Relative error of a step of S.
RTOL = 1e-8


@dataclass(frozen=True, eq=False)
class Tracking:
    """Inputs that keep a mechanism near an optimal motion: din = -K(t) dx.

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

    optimum: Optimum
    Q: np.ndarray
    R: np.ndarray
    Qf: np.ndarray
    driven: tuple[str, ...]
    _S: Callable[[float], np.ndarray] = field(repr=False)

    def __call__(self, t: float, x: Sequence[float] | np.ndarray) -> np.ndarray:
        """Raises ArgumentError beyond the motion."""
        found = self.optimum.inputs_at(t).copy()
        found[self._places] -= self.K(t) @ (np.asarray(x, dtype=float) - self.optimum.at(t))
        return found

    @property
    def _places(self) -> list[int]:
        names = self.optimum.module.metadata.inputs
        return [names.index(n) for n in self.driven]

    def S(self, t: float) -> np.ndarray:
        """(n_x, n_x): what is left to pay for a deviation dx at a time is dx^T S dx."""
        n = len(self.Q)
        found = np.asarray(self._S(float(t))).reshape(n, n)
        return np.asarray((found + found.T) / 2)

    def K(self, t: float) -> np.ndarray:
        """The gain at a time, (k, n_x), rows as driven, columns as the state."""
        optimum = self.optimum
        B = optimum.module.jacobian(float(t), optimum.at(t), optimum.params, optimum.inputs_at(t), wrt=["inputs"]).inputs
        assert B is not None
        return np.asarray(np.linalg.solve(self.R, B[:, self._places].T @ self.S(t)))

    def __repr__(self) -> str:
        first, last = self.optimum.t[0], self.optimum.t[-1]
        return f"<Tracking of {self.optimum.module.name} from {first:g} to {last:g} s by {', '.join(self.driven)}>"


def tracking(optimum: Optimum, Q: Any, R: Any, Qf: Any = None) -> Tracking:
    """See Optimum.lqr."""
    module = optimum.module
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
    places, n = [inputs.index(name) for name in driven], len(states)
    inverse = np.linalg.inv(of_inputs)
    without = (f"{owner}: Riccati's equation along the motion has no finite solution to working precision; change the weights by "
               "less extreme ratios")

    def rate(t: float, flat: np.ndarray) -> np.ndarray:
        S = flat.reshape(n, n)
        if not np.isfinite(flat).all() or not np.isfinite(t):
            raise EvaluationError(without)
        found = module.jacobian(t, optimum.at(t), optimum.params, optimum.inputs_at(t), wrt=["x", "inputs"])
        assert found.x is not None and found.inputs is not None
        A, SB = found.x, S @ found.inputs[:, places]
        return np.asarray(-(A.T @ S + S @ A - SB @ inverse @ SB.T + of_states)).ravel()

    first, last = float(optimum.t[0]), float(optimum.t[-1])
    size = max(np.abs(of_states).max(), np.abs(at_end).max(), 1e-300)
    with np.errstate(all="ignore"):
        found = solve_ivp(rate, (last, first), at_end.ravel(), method="DOP853", rtol=RTOL, atol=RTOL * size, dense_output=True)
    if not found.success:
        raise EvaluationError(without)
    return Tracking(optimum, of_states, of_inputs, at_end, driven, found.sol)
