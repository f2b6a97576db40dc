"""What becomes of small disturbances of a steady motion, by simulation: do they decay, stay, drift away or grow?

All disturbances are simulated together, in every direction of the manifold and both ways; differences give the change of state
over a span T as a matrix Phi, relative to the undisturbed motion. Where the linear equations are constant along the motion, every
span does the same, so that Phi^n is the change after n T: growth over thousands of seconds follows without simulating them, and
rates down to about 1e-8 1/s are resolved. Neither the state matrix nor its eigenvalues are used.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import count
from typing import Any

import numpy as np
import scipy.integrate
import scipy.linalg

from symdyn.lab.flow import Flow, romberg

# The span of one simulation, s, its tolerances, and the largest disturbance.
SPAN, RELATIVE, ABSOLUTE, STEP, HALVINGS = 0.2, 1e-12, 1e-14, 4e-3, 4
# A simulation that takes more evaluations has come near a singular configuration.
MOST = 20000
# Phi is no more exact than this, relative to its norm; rates count as zero within so many times what its error makes of them.
EXACT, MARGIN = 2e-12, 5
# Rates larger than this, 1/s, are no double eigenvalue split by rounding; growth without a rate is followed for so long, s.
CLEAR, LONG = 2e-3, 2000.0
# Growth with this power of time, or more, is drift; sizes are the largest of so many powers in a row, to cover oscillations.
DRIFT, ROW = 0.5, 24
# Drift goes with a whole power of time, to so much; else a small rate may hide in it.
WHOLE = 0.004
# Eigenvalues of Phi that are nearer to each other are the same.
SAME_VALUE = 1e-6
# Later times at which the linear equations are compared, s, and how nearly they are then the same.
LATER, SAME = (0.13, 0.31), 1e-5


@dataclass(frozen=True)
class Observed:
    """Verdict by simulation: "stable", "neutral", "drifts", "unstable", or "not decided".

    rate    of the slowest decay or fastest growth, 1/s
    power   of time with which disturbances that neither decay nor grow exponentially grow
    """

    word: str
    rate: float
    power: float


def simulated(flow: Flow, x: np.ndarray, span: float) -> np.ndarray:
    """The states (n, n_x) after a span, all with the same steps."""
    shape = x.shape

    evaluations = count()

    def field(t: float, y: np.ndarray) -> np.ndarray:
        if next(evaluations) > MOST:
            raise RuntimeError(f"{flow.module.name}: simulation over {span} s takes more than {MOST} evaluations")
        result: np.ndarray = flow.module.evaluate("rhs", t, y.reshape(shape), flow.p, flow.inputs)
        return result.ravel()

    solution = scipy.integrate.solve_ivp(field, (flow.t, flow.t + span), x.ravel(), method="DOP853", rtol=RELATIVE, atol=ABSOLUTE)
    if not solution.success:
        raise RuntimeError(f"{flow.module.name}: {solution.message}")
    end: np.ndarray = solution.y[:, -1].reshape(shape)
    return end


def transition(flow: Flow) -> tuple[np.ndarray, float]:
    """Phi (m, m): changes of eta, zeta and z after the span for those before; and how uncertain its entries are."""
    end = simulated(flow, flow.x[None], SPAN)[0]
    result, change = romberg(lambda h: simulated(flow, flow.states(h), SPAN), flow.coordinates.size, STEP, HALVINGS)
    return flow.values(end, result), float(change.max(initial=0.0))


def observe(flow: Flow) -> Observed:
    """The verdict of simulation on a motion whose linear equations are constant."""
    Phi, error = transition(flow)
    error = MARGIN * max(error, EXACT * float(np.linalg.norm(Phi)))
    values, left, right = scipy.linalg.eig(Phi, left=True)
    rates = np.log(np.maximum(np.abs(values), 1e-300)) / SPAN
    fastest = float(rates.max())
    # An eigenvalue changes by that of Phi over the cosine between its eigenvectors, which is none where it is defective.
    cosines = np.abs(np.sum(left.conj() * right, axis=0)) / np.linalg.norm(left, axis=0) / np.linalg.norm(right, axis=0)
    uncertain = error / SPAN / np.maximum(cosines * np.abs(values), 1e-300)
    if (rates > np.minimum(uncertain, CLEAR)).any():
        return Observed("unstable", fastest, 0.0)
    zero = np.abs(rates) <= np.minimum(uncertain, CLEAR)
    if not zero.any():
        return Observed("stable", fastest, 0.0)
    T, _, count_zero = scipy.linalg.schur(Phi.astype(complex), output="complex",
                                          sort=lambda value: np.abs(values[zero] - value).min() < SAME_VALUE)
    power = _power(T[:count_zero, :count_zero])
    if power > DRIFT and abs(power - round(power)) < WHOLE:
        return Observed("drifts", fastest, power)
    return Observed("neutral" if power < DRIFT / 2 and uncertain[zero].max() < CLEAR else "not decided", fastest, power)


def _power(block: np.ndarray) -> float:
    """Slope of log |block^n| over log n for large n: 0 where the powers stay bounded, 1 of a double Jordan block."""
    sizes, power = [], block
    doublings = int(np.ceil(np.log2(LONG / SPAN)))
    for _ in range(doublings):
        power = power @ power
        row, largest = power, 0.0
        for _ in range(ROW):
            largest = max(largest, float(np.linalg.norm(row)))
            row = row @ block
        sizes.append(largest)
    last, before = (2.0 ** (doublings - k) + ROW - 1 for k in (0, 3))
    return float(np.log(sizes[-1] / sizes[-4]) / np.log(last / before))


def constant(flow: Flow) -> bool:
    """Whether the linear equations are the same a little later along the motion."""
    A = flow.matrices()[0].A
    for later in LATER:
        there = _at(flow, later)
        if np.linalg.norm(there.matrices()[0].A - A) > SAME * max(1.0, float(np.linalg.norm(A))):
            return False
    return True


def _at(flow: Flow, later: float) -> Any:
    """The flow at a later state of the motion."""
    x = simulated(flow, flow.x[None], later)[0]
    return Flow(flow.module, flow.t + later, x, flow.p, flow.inputs, replace(flow.coordinates))
