"""The elastic joint: what the free end of a flexible body does relative to its clamped end."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.flexible.modal_body import ModalBody
from symdyn.model.elements.checks import not_negative, positive
from symdyn.model.joints.base import Joint, JointMotion
from symdyn.shown import name_of, shown
from symdyn.spatial.sixvectors import skew
from symdyn.spatial.vectors import dot, identity, inner, vector, zeros
from symdyn.tape.differentiate import forward
from symdyn.tape.node import exact

if TYPE_CHECKING:
    from symdyn.given import BodyOrName, Scalar


class Modal(Joint):
    """Joins the frame at the free end of a flexible body to the frame at its clamped end; coordinates = the modal ones, eta.

    beam        its integrals; stiffness, damping: factors of its K and D
    carries     whether the frame follows the free end; else it stays with the clamped end, where nothing can be carried but
                nothing has to be computed

    The free end is at L e + Psi eta - e (eta . S eta) / 2 and turned by the rotation that has Theta eta / 2 as Rodrigues
    parameters: R = 1 + (2 [b] + 2 [b][b]) / (1 + b . b), b = Theta eta / 2, which is the rotation by the vector Theta eta to
    second order.
    """

    kind = "modal"
    # Its frames differ at eta = 0 by the length of the body.
    identity_at_zero = False

    def __init__(self, name: str, parent: BodyOrName, child: BodyOrName, beam: ModalBody,
                 coordinates: Sequence[Scalar] | None = None, speeds: Sequence[sp.Symbol] | None = None, stiffness: Scalar = 1,
                 damping: Scalar = 1, carries: bool = True) -> None:
        self.beam = beam
        self.carries = carries
        self.coordinate_units = ("m",) * beam.n
        super().__init__(name, parent, child, coordinates, speeds, (0, 0, 0), (0, 0, 0), None, None)
        self.stiffness = positive(self.faults, stiffness, f"joint {shown(name)}: stiffness")
        self.damping = not_negative(self.faults, damping, f"joint {shown(name)}: damping")
        if not isinstance(carries, (bool, np.bool_)):
            self.faults.append(f"joint {shown(name)}: carries is {shown(carries)}; pass True or False")

    @property
    def reach(self) -> float:
        """Elastic coordinates at which the beam's deflection comes to a tenth of its length, m."""
        return 0.1 * self.beam.length / max(float(np.abs(self.beam.Psi_tip).max(initial=0.0)), 1.0)

    @property
    def symbols_only(self) -> str:
        return "elastic coordinates must be symbols; fix the beam's modes by leaving shapes out"

    @property
    def constants(self) -> list[sp.Expr]:
        return [*super().constants, self.stiffness, self.damping]

    @property
    def record(self) -> dict[str, Any]:
        """Plain data for pictures: names of the bodies at its ends and of the coordinates, and of the stations of
        the beam the places (k, 3), displacements by the modes (k, 3, n), and their second derivatives (k, 3, n, n)."""
        beam = self.beam
        second = -beam.S[:, None] * beam.e[:, None, None]
        return {"body": _name(self.parent), "tip": _name(self.child), "coordinates": [str(q) for q in self.coordinates],
                "stations": np.outer(beam.X, beam.e).tolist(), "shapes": beam.Psi.tolist(), "second": second.tolist()}

    def motion(self, algebra: Any, s: Sequence[Any], sd: Sequence[Any]) -> JointMotion:
        n = self.beam.n
        if not self.carries:
            return JointMotion(identity(), zeros(3), zeros(6, n), zeros(6))
        eta = vector(*s)
        e, Psi, Theta, S = (exactly(a) for a in (self.beam.e, self.beam.Psi_tip, self.beam.Theta_tip, self.beam.S_tip))
        d = e * (exact(self.beam.length) - inner(eta, S @ eta) / 2) + Psi @ eta
        b = Theta @ eta / 2
        B = skew(b)
        R = identity() + (2 * B + 2 * (B @ B)) / (1 + dot(b, b))
        recorder = algebra.recorder

        def rate(values: np.ndarray, along: dict[Any, Any]) -> np.ndarray:
            return vector(*forward(recorder, values.ravel().tolist(), along)).reshape(values.shape)

        columns = []
        for node in s:
            dR = R.T @ rate(R, {node: 1})
            columns.append([dR[2, 1], dR[0, 2], dR[1, 0], *(R.T @ rate(d, {node: 1}))])
        subspace = np.array(columns, dtype=object).T.reshape(6, n)
        turning = dict(zip(s, sd, strict=True))
        bias = np.concatenate([rate(subspace[:3], turning) @ vector(*sd), R.T @ rate(rate(d, turning), turning)])
        return JointMotion(R, d, subspace, bias)


def exactly(values: np.ndarray) -> np.ndarray:
    """Floats as the numbers they are, so that zeros fold."""
    return vector(*[exact(float(v)) for v in values.ravel()]).reshape(values.shape)


def _name(body: Any) -> str:
    return name_of(body)
