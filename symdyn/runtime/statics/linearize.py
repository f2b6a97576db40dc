"""Linearization: what a user gets of the linear equations about a state."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.runtime.arguments import take
from symdyn.runtime.consistent import normalised, number
from symdyn.runtime.masses import real_parameters
from symdyn.runtime.statics.equilibrium import Equilibrium
from symdyn.runtime.statics.linear import Reduced
from symdyn.runtime.statics.modes import Modes, eigen, modes_of
from symdyn.runtime.statics.selection import Selection, listed, select
from symdyn.runtime.statics.sensitivity import Sensitivity, of_eigenvalue, shift
from symdyn.runtime.statics.terms import Place, coordinate_names, rest

if TYPE_CHECKING:
    from symdyn.runtime.module import Module


class StateSpace(NamedTuple):
    """y' = C x' + D in', x'_dot = A x' + B in'."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray


class Linearization:
    """The linear equations about a state, in n independent velocities.

    M eta_ddot + C eta_dot + K eta = F_in in'   with eta (n,) the changes along `coordinates`; v = Z eta of all speeds
    x'_dot = A x' + B in',  y' = C_out x' + D in'   with x' = [eta; zeta; z'], zeta the changes of the independent speeds
    G   (n, n): eta_dot = zeta - G eta; zero where speeds are rates of coordinates, and at rest. With it M, C, K belong to
        M zeta_dot + C zeta + K eta = F_in in'
    z   extra states couple by A alone

    coordinates   names of the independent changes: of coordinates, of speeds that are no rates (turning about that axis)
    states        names of x'; outputs: names of y', entries of vectors by number
    Along a motion under constraints A and B hold the change of the constraints, too; M, C, K do not.
    """

    def __init__(self, reduced: Reduced, equilibrium: Equilibrium | None) -> None:
        self._reduced = reduced
        self.equilibrium = equilibrium
        self.module = reduced.place.module
        place = reduced.place
        self.t, self.x, self.params, self.inputs = place.t, place.x, place.p, place.inputs
        self.ud, self.lam = place.ud, place.lam
        self.M, self.C, self.K, self.G = reduced.M, reduced.C, reduced.K, reduced.G
        self.F_in, self.Z = reduced.F_in, reduced.Z
        metadata = self.module.metadata
        self.coordinates = reduced.labels
        self.states = (*self.coordinates, *[metadata["u"][k] for k in reduced.independent],
                       *[metadata["z"][k] for k in reduced.states])

    @cached_property
    def state_space(self) -> StateSpace:
        """(A, B, C, D); C and D have no rows without outputs."""
        A, B = self._reduced.state_matrices()
        if not self.module.metadata["outputs"]:
            return StateSpace(A, B, np.zeros((0, len(A))), np.zeros((0, B.shape[1])))
        place = self._reduced.place
        return StateSpace(A, B, place.evaluate("outputs_x") @ self._reduced.tangent(), place.evaluate("outputs_inputs"))

    @property
    def A(self) -> np.ndarray:
        return self.state_space.A

    @property
    def B(self) -> np.ndarray:
        return self.state_space.B

    @property
    def C_out(self) -> np.ndarray:
        return self.state_space.C

    @property
    def D(self) -> np.ndarray:
        return self.state_space.D

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the rows of C_out and D."""
        names: list[str] = []
        for name, shape in self.module.metadata["outputs"]:
            names += [name + (f"[{', '.join(map(str, index))}]" if index else "") for index in np.ndindex(*shape)]
        return tuple(names)

    @cached_property
    def eigenvalues(self) -> np.ndarray:
        """Of A, by size, (m,) complex, 1/s."""
        values = self._eigen[0]
        return np.asarray(values[np.lexsort((values.imag, np.abs(values)))])

    @cached_property
    def _eigen(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return eigen(self._reduced)

    @cached_property
    def _modes(self) -> Modes:
        return modes_of(self._reduced, f"{self.module.name}: modes")

    def modes(self) -> Modes:
        """Natural frequencies, damping ratios, periods, shapes; prints as a table. See symdyn.runtime.statics.modes."""
        return self._modes

    def derivative(self, mode: Any, parameter: Any) -> Sensitivity:
        """Exact derivatives of a mode's eigenvalue, frequency and damping by a parameter.

        mode        number or name in `modes()`; parameter: name or symbol
        About an Equilibrium its shift with the parameter counts, and that of what was solved for; at another state the state
        stays. Raises ArgumentError for double eigenvalues, and where what this needs is not constant: turning Euler parameters,
        motion under constraints, part of an orientation that is kept.
        """
        place, selection = self._reduced.place, self._reduced.selection
        owner = self.module.name
        named = listed(parameter, self.module.metadata["parameters"], "parameter", owner)
        if len(named) != 1:
            raise ArgumentError(f"{owner}: parameter must be one name or symbol, found {parameter!r}")
        (name,) = named
        rows = selection.rows(place)
        if (self.equilibrium is None and not self._at_rest()) or self.G.any():
            raise ArgumentError(f"{owner}: derivatives of eigenvalues hold at a state of rest or of steady motion; linearize at "
                                "an equilibrium")
        if (np.count_nonzero(rows, axis=1) > 1).any() and not _fixed_space(rows):
            raise ArgumentError(f"{owner}: derivatives of eigenvalues with a part of an orientation kept are not available; fix "
                                "all of its coordinates, or none")
        if not all(self.module.metadata.get("holonomic") or [True]):
            raise ArgumentError(f"{owner}: derivatives of eigenvalues are not available with constraints of velocities")
        changes = {name: 1.0}
        if self.equilibrium is not None:
            changes |= shift(place, selection, name)
        return of_eigenvalue(self._reduced, self.modes()[mode], self._eigen[0], changes)

    def _at_rest(self) -> bool:
        """Whether accelerations are but rounding, measured by those of a metre or radian at the highest frequency."""
        largest = float(np.abs(self._eigen[0]).max(initial=0.0))
        return bool(np.abs(self.ud).max(initial=0.0) <= 1e-9 * largest**2) and not (self.lam.size and self._reduced.place.u.any())

    def __repr__(self) -> str:
        about = "an equilibrium" if self.equilibrium is not None else "a state"
        return f"<Linearization of {self.module.name} about {about}: {', '.join(self.coordinates)}>"


def linearize(module: Module, at: Any = None, params: Any = None, t: float | None = None, inputs: Any = None, free: Any = None,
              fixed: Any = None, coordinates: Sequence[Any] | None = None) -> Linearization:
    """See Module.linearize."""
    if isinstance(at, Equilibrium):
        given = [n for n, v in (("params", params), ("t", t), ("inputs", inputs), ("free", free), ("fixed", fixed))
                 if v is not None]
        if given:
            raise ArgumentError(f"{module.name}: {', '.join(given)} given with an equilibrium, which has its own; leave them "
                                "out, or pass at=equilibrium.x")
        if at.module is not module:
            raise ArgumentError(f"{module.name}: the equilibrium is of {at.module.name}, another module; linearize with its own")
        return Linearization(Reduced(at.place, at.selection, _independent(module, coordinates)), at)
    place = _place(module, at, params, t, inputs)
    selection = select(module, free, fixed, None)
    place = in_motion(place.at(x=selection.apply(place.x)), selection)
    return Linearization(Reduced(place, selection, _independent(module, coordinates)), None)


def _independent(module: Module, coordinates: Sequence[Any] | None) -> list[int] | None:
    if coordinates is None:
        return None
    labels = list(coordinate_names(module.metadata))
    names = listed(coordinates, [*labels, *module.metadata["u"]], "coordinates", module.name)
    return [labels.index(n) if n in labels else module.metadata["u"].index(n) for n in names]


def _place(module: Module, at: Any, params: Any, t: float | None, inputs: Any) -> Place:
    """The state that `at` tells; without accelerations."""
    metadata = module.metadata
    sizes = metadata["sizes"]
    if hasattr(at, "t") and hasattr(at, "x") and np.ndim(at.t) == 1:
        return _of_solution(module, at, params, t, inputs)
    time = 0.0 if t is None else number(t, "a finite number of seconds as t", module.name)
    if at is None:
        at = {}
    if isinstance(at, tuple) and len(at) == 2 and np.ndim(at[0]) == 1:
        at = np.concatenate([take(at[0], metadata["q"], "q", {}, module.name), take(at[1], metadata["u"], "u", {}, module.name),
                             np.zeros(sizes["z"])])
    x = take(at, metadata["x"], "at", {n: metadata["initial"].get(n, 0.0) for n in metadata["x"]}, module.name)
    free = take(inputs if inputs is not None else {}, metadata["inputs"], "inputs", dict.fromkeys(metadata["inputs"], 0.0),
                module.name)
    return rest(module, time, normalised(module, x), real_parameters(module, params), free)


def _of_solution(module: Module, at: Any, params: Any, t: float | None, inputs: Any) -> Place:
    if t is None or params is not None or inputs is not None:
        raise ArgumentError(f"{module.name}: at a solution pass the time t alone; parameters and inputs are those of the motion")
    time = number(t, "a finite number of seconds as t", module.name)
    if not len(at.t) or not at.t[0] <= time <= at.t[-1]:
        raise ArgumentError(f"{module.name}: t = {time:g} s is not in the solution, from {at.t[0]:g} to {at.t[-1]:g} s")
    k = int(np.argmin(np.abs(at.t - time)))
    return rest(module, float(at.t[k]), at.x[k].copy(), module.parameters(at.params), np.asarray(at.inputs[k], dtype=float))


def in_motion(place: Place, selection: Selection) -> Place:
    """The place with the accelerations of its motion, what is kept being held, and multipliers of least norm."""
    n_u, n_c = place.sizes[1], place.sizes[3]
    rows = np.vstack([place.C_r, selection.rows(place)])
    right = np.zeros(len(rows))
    if n_c:
        right[:n_c] = place.evaluate("F_d") * place.scale
    scale = 1 / np.sqrt(np.maximum(np.abs(np.diag(place.M)), 1e-12 * np.abs(place.M).max(initial=1e-300)))
    A = rows * scale
    KKT = np.block([[place.M * np.outer(scale, scale), A.T], [A, np.zeros((len(A), len(A)))]])
    found = np.linalg.lstsq(KKT, np.concatenate([-place.forces * scale, right]), rcond=1e-12)[0]
    ud = scale * found[:n_u]
    # Rest is rest: rounding is no motion.
    level = np.abs(scale * place.forces).max(initial=0.0)
    ud = np.where(np.abs(found[:n_u]) <= 1e-13 * max(level, 1e-300), 0.0, ud)
    return place.at(ud=ud, lam=found[n_u:n_u + n_c] * place.scale)


def _fixed_space(rows: np.ndarray) -> bool:
    """Whether what the rows keep is the same at every state: certain speeds as a whole."""
    used = rows.any(axis=0)
    return bool(np.linalg.matrix_rank(rows) == int(used.sum()))
