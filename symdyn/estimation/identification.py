"""Parameters identified from measured forces, their uncertainty, and what the data leave open."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.estimation.estimate import Estimate
from symdyn.estimation.pseudo_inertia import pseudo_inertia
from symdyn.formulation.identification.regressor import PARAMETERS
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# Combinations that are printed.
_PRINTED = 8


@dataclass(frozen=True)
class Identification(Estimate):
    """Identified parameters and how well the data determine them.

    values       label -> value: base parameters, or the ten inertial parameters of every body about its origin in its axes, such
                 as "m_link2", "h_x_link2" (mass times centre of mass), "I_xx_link2"; friction as "viscous q1_dot", "coulomb
                 q1_dot"
    covariance   (n, n), in the order of values; NaN in rows and columns of what the data do not determine
    noise        standard deviation of the forces by speed, given or estimated, N or N m; with a motion's noise that of tau alone
    condition    of the regressor with columns of length 1: how many times noise is amplified in the worst combination
    undetermined   combinations, each unknown counted in what changes the forces as much (with nominal values: relative to these),
                 that the data do not determine: text, from the singular vectors; shares below a thousandth of the largest are
                 left out
    residuals    of every motion: measured less computed forces along the speeds, (n_t, n_u), as filtered and kept; with
                 constraints along the motions that these allow, (n_t, r), by orthonormal directions
    consistent   whether the values are those of bodies that can exist; degrees: of freedom; known_noise: whether it was given

    >>> module = sd.systems.pendulum().compile(backend="numpy")
    >>> q = np.linspace(0, 1, 20)[:, None]
    >>> tau = module.evaluate("inverse_dynamics", 0.0, np.hstack([q, q]), {"m": 2.0}, ud=q)
    >>> found = sd.identify(module, sd.MeasuredMotion(q[:, 0], q, tau, u=q, ud=q))
    >>> {name: round(value, 9) for name, value in found.values.items()}
    {'h_y_bob': -2.0, 'I_zz_bob': 2.0}
    """

    module: Module
    values: Mapping[str, float]
    covariance: np.ndarray
    noise: Mapping[str, float]
    condition: float
    undetermined: tuple[str, ...]
    residuals: tuple[np.ndarray, ...]
    consistent: bool
    degrees: int
    known_noise: bool

    def body(self, name: str) -> dict[str, float]:
        """The ten inertial parameters of a body about its origin, in its axes: m, h_x ... h_z, I_xx ... I_zz.

        Raises ArgumentError for another name, and where base parameters were identified, which belong to no single body.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> q = np.linspace(0, 1, 20)[:, None]
        >>> tau = module.evaluate("inverse_dynamics", 0.0, np.hstack([q, q]), {"m": 2.0}, ud=q)
        >>> motion, nominal = sd.MeasuredMotion(q[:, 0], q, tau, u=q, ud=q), {"bob": [1, 0, -1, 0, 1.2, 0, 0, 0.2, 0, 1.2]}
        >>> found = sd.identify(module, motion, noise=0.01, consistent=True, nominal=nominal)
        >>> round(found.body("bob")["h_y"], 3), round(found.body("bob")["I_zz"], 3)
        (-2.0, 2.0)
        """
        bodies = self.module.metadata.bodies
        if not self.consistent:
            raise ArgumentError(f"{self.module.name}: the parameters of body {shown(name)} were asked for, but base parameters "
                                "were identified, which belong to no single body; pass consistent=True to sd.identify")
        if name not in bodies:
            raise ArgumentError(f"{self.module.name}: there is no body {shown(name)}; there are {', '.join(bodies)}")
        return {entry: self.values[f"{entry}_{name}"] for entry in PARAMETERS}

    def pseudo_inertia(self, name: str) -> np.ndarray:
        """The pseudo-inertia of a body, (4, 4): [[S, h], [h^T, m]] S = tr(I)/2 1 - I, positive definite; errors as `body`.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> q = np.linspace(0, 1, 20)[:, None]
        >>> tau = module.evaluate("inverse_dynamics", 0.0, np.hstack([q, q]), {"m": 2.0}, ud=q)
        >>> motion, nominal = sd.MeasuredMotion(q[:, 0], q, tau, u=q, ud=q), {"bob": [1, 0, -1, 0, 1.2, 0, 0, 0.2, 0, 1.2]}
        >>> P = sd.identify(module, motion, noise=0.01, consistent=True, nominal=nominal).pseudo_inertia("bob")
        >>> P.shape, bool(np.linalg.eigvalsh(P).min() > 0)
        ((4, 4), True)
        """
        return pseudo_inertia(np.array(list(self.body(name).values())))

    def __str__(self) -> str:
        deviations = self.deviations
        noise = ", ".join(f"{value:.3g}" for value in self.noise.values())
        lines = [f"identification of {self.module.name}: {self.degrees + len(self.values)} values, condition "
                 f"{self.condition:.3g}, noise {noise}"]
        width = max(map(len, self.values))
        lines += [f"  {name:<{width}}  {value: .8g} +- {deviations[name]:.2g}" for name, value in self.values.items()]
        lines += [f"  not determined by the data: {text}" for text in self.undetermined[:_PRINTED]]
        if len(self.undetermined) > _PRINTED:
            lines.append(f"  and {len(self.undetermined) - _PRINTED} combinations more, see `undetermined`")
        return "\n".join(lines)

    def __repr__(self) -> str:
        return str(self)
