"""Harmonic response of linear equations: y' = H(i omega) in'."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.real_numbers import real_of
from symdyn.shown import shown
from symdyn.statics.selection import listed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from symdyn.given import PathName
    from symdyn.statics.linearize import Linearization

# Frequencies by default: from and to these times the slowest and the fastest eigenvalue, so many.
_BELOW, _ABOVE, _COUNT = 0.1, 10.0, 600
_SLOW = 1e-9


@dataclass(frozen=True, eq=False)
class Response:
    """The harmonic response H (n, n_y, n_in), complex, at frequencies omega (n,), rad/s.

    outputs   names of its rows: outputs, or states of a system without; inputs: names of its columns
    units     of outputs and inputs by name

    >>> linear = sd.systems.cart_pole().compile(backend="numpy").linearize({"q2": np.pi})
    >>> response = linear.response([1.0, 10.0], outputs="q1")
    >>> response.H.shape, response.omega.tolist()
    ((2, 1, 1), [1.0, 10.0])
    """

    title: str
    omega: np.ndarray
    H: np.ndarray
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    units: dict[str, str]

    def __getitem__(self, names: tuple[str, str]) -> np.ndarray:
        """H of an output and an input by name, (n,). Raises ArgumentError for names that there are not."""
        output, given = names
        if output not in self.outputs or given not in self.inputs:
            raise ArgumentError(f"{self.title}: there is no response of {shown(output)} to {shown(given)}; there are outputs "
                                f"{', '.join(self.outputs)} and inputs {', '.join(self.inputs)}")
        return np.asarray(self.H[:, self.outputs.index(output), self.inputs.index(given)])

    @property
    def gain(self) -> np.ndarray:
        """|H|, (n, n_y, n_in).

        >>> linear = sd.systems.cart_pole().compile(backend="numpy").linearize({"q2": np.pi})
        >>> np.round(linear.response([1.0, 10.0], outputs="q1").gain[:, 0, 0], 6)
        array([0.904594, 0.009881])
        """
        return np.abs(self.H)

    @property
    def phase(self) -> np.ndarray:
        """The angle of H, without jumps by turns, rad, (n, n_y, n_in).

        >>> linear = sd.systems.cart_pole().compile(backend="numpy").linearize({"q2": np.pi})
        >>> np.round(linear.response([1.0, 10.0], outputs="q1").phase[:, 0, 0], 6)
        array([3.141593, 3.141593])
        """
        return np.asarray(np.unwrap(np.angle(self.H), axis=0))

    def plot(self, path: PathName | None = None) -> Figure:
        """The Bode diagram, gains over phases with a column for each input, as a figure; saved to a path. Needs matplotlib.

        >>> linear = sd.systems.cart_pole().compile(backend="numpy").linearize({"q2": np.pi})
        >>> figure = linear.response([1.0, 10.0], outputs="q1").plot()
        >>> [axes.get_ylabel() for axes in figure.axes]
        ['gain, output by input', 'phase [°]']
        """
        from symdyn.pictures.bode import plot

        return plot(self, path)

    def __repr__(self) -> str:
        return (f"<Response of {', '.join(self.outputs)} to {', '.join(self.inputs)}, {len(self.omega)} frequencies from "
                f"{self.omega[0]:.4g} to {self.omega[-1]:.4g} rad/s>")


def response(linear: Linearization, omega: Any, inputs: Any, outputs: Any) -> Response:
    """See Linearization.response."""
    owner, metadata = linear.module.name, linear.module.metadata
    if not metadata.inputs:
        raise ArgumentError(f"{owner}: a response was requested, but the system has no inputs; add one with sd.inputs(...)")
    A, B = linear.A, linear.B
    C, D, names = linear.observed()
    # The states themselves, where there are no outputs.
    names = names if linear.outputs else linear.states
    chosen_in = listed(inputs, metadata.inputs, "inputs", owner) if inputs is not None else list(metadata.inputs)
    chosen_out = listed(outputs, names, "outputs", owner) if outputs is not None else list(names)
    rows, columns = [names.index(n) for n in chosen_out], [list(metadata.inputs).index(n) for n in chosen_in]
    at = _default(linear.eigenvalues) if omega is None else np.array(
        real_of(omega, owner, "omega must be frequencies in rad/s"), ndmin=1)
    if at.ndim != 1 or not len(at) or not (np.isfinite(at).all() and (at > 0).all()):
        raise ArgumentError(f"{owner}: omega must be positive frequencies in rad/s, found {shown(omega)}")
    H = np.empty((len(at), len(rows), len(columns)), dtype=complex)
    for k, w in enumerate(at):
        try:
            H[k] = C[rows] @ np.linalg.solve(1j * w * np.eye(len(A)) - A, B[:, columns]) + D[np.ix_(rows, columns)]
        except np.linalg.LinAlgError:  # an undamped eigenvalue, to the last digit
            H[k] = np.inf
    units = {**dict(linear.units), **{n: metadata.units.get(n, "") for n in metadata.inputs}}
    return Response(owner, at, H, tuple(chosen_out), tuple(chosen_in), {n: units.get(n, "") for n in (*chosen_out, *chosen_in)})


def _default(eigenvalues: Sequence[complex] | np.ndarray) -> np.ndarray:
    """Frequencies around those of the system."""
    sizes = np.abs(np.asarray(eigenvalues))
    sizes = sizes[sizes > _SLOW * sizes.max(initial=0.0)]
    low, high = (sizes.min(), sizes.max()) if len(sizes) else (1.0, 1.0)
    return np.geomspace(_BELOW * low, _ABOVE * high, _COUNT)
