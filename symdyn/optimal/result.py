"""An optimal motion: its course at any time, its cost, how exact it is, and what follows it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import PPoly

from symdyn.errors import ArgumentError
from symdyn.optimal.course import OverTime
from symdyn.runtime.inputs.tables import ORDER, Pieces, Piecewise
from symdyn.shown import name_of, shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from symdyn.given import Key, PathName, Row
    from symdyn.optimal.tracking import Tracking
    from symdyn.runtime.module import Module
    from symdyn.runtime.solutions.solution import Solution
    from symdyn.statics.regulator import Weights


@dataclass(frozen=True)
class MeshRecord:
    """One mesh: intervals (of shooting also the steps in each), iterations, cost, largest error of an interval, time, s."""

    n_intervals: int
    steps: int
    iterations: int
    cost: float
    error: float
    seconds: float


@dataclass(frozen=True, eq=False)
class Optimum(OverTime):
    """An optimal motion of a module.

    t, x, inputs   times of the nodes (n_t,), s, states (n_t, n_x) and inputs (n_t, n_in) there; a name or symbol as an index
                   gives one of them over these times
    params         all parameters (n_p,); values: those that were free, by name
    undetermined   names of free parameters and inputs that nothing depends on along the motion: they have their guesses
    cost, duration, iterations   cost: that is least, by the quadrature of the mesh; iterations: on all meshes; meshes: what each
                   of them took
    integrated_cost, simulated_cost   the cost integrated along the polynomials, and along the motion `simulated`, with error
                   control: both near `cost` where the mesh is fine enough; NaN where it cannot be computed
    error          largest error of an interval of the last mesh, of states and cost, relative: see docs/optimal_motion.md;
                   errors: of all (K,)
    simulated      the motion by `simulate` with these inputs; None where it cannot be computed
    sizes          by state: its largest value, which errors are relative to
    difference     by state: largest difference of it, in units of the state; NaN where it cannot be computed
    multipliers    by condition: of the path (n,), of the boundary (1,); derivatives of the cost by what is demanded, with the
                   sign of f + multipliers^T g; NaN where the solver has none
    costates       (n, n_x) at costate_times (n,): derivatives of the cost by a shift of the state there; NaN likewise
    success, message   whether the solver ended at a minimum, and why it ended
    seconds        of the whole call
    breaks         (K + 1,) ends of the intervals, s; states_over_time, inputs_over_time: the polynomials between them

    >>> module = sd.systems.cart_pole().compile()
    >>> F = sd.inputs("F")
    >>> there = {"q1": 0.5, "q2": 0, "q1_dot": 0, "q2_dot": 0}
    >>> found = sd.optimize(module, sd.Loss(integral=F**2), 1.0, start={"q2": 0.0}, end=there, intervals=12, tolerance=None,
    ...                     method="slsqp")
    >>> found.x.shape, bool(abs(found["q1"][-1] - 0.5) < 1e-6)
    ((25, 4), True)
    """

    module: Module
    t: np.ndarray
    x: np.ndarray
    inputs: np.ndarray
    params: np.ndarray
    values: Mapping[str, float]
    undetermined: tuple[str, ...]
    cost: float
    integrated_cost: float
    simulated_cost: float
    duration: float
    iterations: int
    meshes: tuple[MeshRecord, ...]
    error: float
    errors: np.ndarray
    difference: Mapping[str, float]
    simulated: Solution | None
    multipliers: Mapping[str, np.ndarray]
    costate_times: np.ndarray
    costates: np.ndarray
    transcription: str
    success: bool
    message: str
    seconds: float
    breaks: np.ndarray
    sizes: Mapping[str, float]
    states_over_time: PPoly = field(repr=False)
    inputs_over_time: PPoly = field(repr=False)

    def __getitem__(self, name: Key) -> np.ndarray:
        """A state or input over the times t, (n_t,). Raises ArgumentError for another name."""
        metadata, requested = self.module.metadata, name_of(name)
        if requested in metadata.x:
            return self.x[:, metadata.x.index(requested)]
        if requested in metadata.inputs:
            return self.inputs[:, metadata.inputs.index(requested)]
        raise ArgumentError(f"{self.module.name}: the optimal motion has no {shown(requested)}; it has "
                            f"{', '.join((*metadata.x, *metadata.inputs))}")

    @property
    def cost_difference(self) -> float:
        """By how much the cost integrated along the motion is above that of the quadrature of the mesh.

        >>> F = sd.inputs("F")
        >>> found = sd.optimize(sd.systems.cart_pole().compile(), sd.Loss(integral=F**2), 0.5, start={"q2": 0.0}, end={"q1": 0.1},
        ...                     intervals=4, tolerance=None, method="slsqp")
        >>> bool(abs(found.cost_difference) < 1e-3 * found.cost)
        True
        """
        return self.integrated_cost - self.cost

    @property
    def table(self) -> Piecewise:
        """The inputs as `simulate` takes them, inputs=optimum.table: exactly these, steps end where intervals do.

        >>> F = sd.inputs("F")
        >>> found = sd.optimize(sd.systems.cart_pole().compile(), sd.Loss(integral=F**2), 0.5, start={"q2": 0.0}, end={"q1": 0.1},
        ...                     intervals=4, tolerance=None, method="slsqp")
        >>> motion = found.module.simulate(found.t, [0.0, 0.0], inputs=found.table)
        >>> bool(np.allclose(motion.inputs[:, 0], found["F"], atol=1e-9))
        True
        """
        return as_table(self.inputs_over_time)

    def simulate(self, t: Row | None = None, rtol: float = 1e-9, method: str | None = None) -> Solution:
        """The motion from the same start with these inputs, integrated with error control, rtol being relative to the sizes of
        states, too; t: output times, default: the nodes.

        >>> F = sd.inputs("F")
        >>> found = sd.optimize(sd.systems.cart_pole().compile(), sd.Loss(integral=F**2), 0.5, start={"q2": 0.0}, end={"q1": 0.1},
        ...                     intervals=4, tolerance=None, method="slsqp")
        >>> round(float(found.simulate()["q1"][-1]), 4)
        0.1
        """
        sizes = self.module.metadata.sizes
        q, u, z = np.split(self.x[0], [sizes.q, sizes.q + sizes.u])
        atol = rtol * np.array(list(self.sizes.values()))
        return self.module.simulate(self.t if t is None else t, q, u, self.params, z=z, rtol=rtol, atol=atol, method=method,
                                    events=False, inputs=self.table if sizes.inputs else None)

    def lqr(self, Q: Weights, R: Weights, Qf: Weights | None = None) -> Tracking:
        """The time-varying linear-quadratic regulator about the motion: inputs of least integral of dx^T Q dx + din^T R din and
        dx^T Qf dx at the end.

        Q, R, Qf   matrices, their diagonals, or weights by name or symbol: of the states (n_x,), of inputs, of the states at the
                   end (default: the numbers of Q)
        Returns a function of (t, x) for simulate(inputs=...). Raises ArgumentError for weights that do not fit.

        >>> F = sd.inputs("F")
        >>> found = sd.optimize(sd.systems.cart_pole().compile(), sd.Loss(integral=F**2), 0.5, start={"q2": 0.0}, end={"q1": 0.1},
        ...                     intervals=4, tolerance=None, method="slsqp")
        >>> found.lqr(Q=[1, 1, 0, 0], R=[0.1])
        <Tracking of cart_pole from 0 to 0.5 s by F>
        """
        from symdyn.optimal.tracking import tracking

        return tracking(self, Q, R, Qf)

    def plot(self, path: PathName | None = None) -> Figure:
        """States, inputs and errors over time; written to a file if a path is given.

        >>> F = sd.inputs("F")
        >>> found = sd.optimize(sd.systems.cart_pole().compile(), sd.Loss(integral=F**2), 0.5, start={"q2": 0.0}, end={"q1": 0.1},
        ...                     intervals=4, tolerance=None, method="slsqp")
        >>> len(found.plot().axes)
        4
        """
        from symdyn.pictures.optima import plot

        return plot(self, path)

    def __str__(self) -> str:
        last = self.meshes[-1]
        meshes = f"{len(self.meshes)} mesh{'es' if len(self.meshes) > 1 else ''}"
        lines = [f"optimal motion of {self.module.name}: cost {self.cost:.9g}, {self.duration:.6g} s; {self.message}",
                 f"  {self.transcription}, {meshes}, at last {last.n_intervals} intervals, {self.iterations} iterations, "
                 f"{self.seconds:.2g} s",
                 f"  error of an interval {self.error:.2g}; simulated back, the largest difference is "
                 f"{max(self.difference.values(), default=0.0):.2g}",
                 f"  integrated along it the cost is {self.integrated_cost:.9g}, {self.cost_difference:+.2g}; simulated back "
                 f"{self.simulated_cost:.9g}"]
        lines += [f"  {name} = {value:.9g}{', undetermined' * (name in self.undetermined)}"
                  for name, value in self.values.items()]
        return "\n".join(lines)

    def __repr__(self) -> str:
        return str(self)


def as_table(inputs: PPoly) -> Piecewise:
    """A piecewise polynomial of inputs as a table."""
    c = np.zeros((inputs.c.shape[1], inputs.c.shape[2], ORDER))
    c[:, :, :len(inputs.c)] = inputs.c[::-1].transpose(1, 2, 0)
    return Piecewise(Pieces(inputs.x, c))
