"""One body whose pose and motion are leaves of a tape: what a load element does with it, without a mechanism."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import sympy as sp

from symdyn.formulation.algebra import TapeAlgebra
from symdyn.model.elements import Action, Element
from symdyn.model.symbols import time
from symdyn.spatial.vectors import dot, identity, vector
from symdyn.tape import Recorder, Tape
from symdyn.tape.differentiate import forward
from symdyn.tape.node import COORDINATE, INPUT, PARAMETER, SPEED, TIME

PLACE = ("x", "y", "z")
ANGLES = ("phi", "theta", "psi")
VECTOR = ("r1", "r2", "r3")
MOTION = ("omega1", "omega2", "omega3", "v1", "v2", "v3")


class LeafSite:
    """R = R_z(psi) R_y(theta) R_x(phi), or the rotation about the rotation vector r by its length (not at r = 0)."""

    def __init__(self, turned: bool = False, inputs: Sequence[sp.Symbol] = (), parameters: Sequence[sp.Symbol] = ()) -> None:
        r = self.recorder = Recorder()
        self.angles_given = not turned
        self.names = (*PLACE, *(VECTOR if turned else ANGLES))
        self.coordinates = [r.leaf(name, COORDINATE) for name in self.names]
        motion = [r.leaf(name, SPEED) for name in MOTION]
        self.omega, self.v = vector(*motion[:3]), vector(*motion[3:])
        self.p = vector(*self.coordinates[:3])
        self.gravity = vector(0, 0, -9.81)
        self.algebra = TapeAlgebra(r, {time: r.leaf("t", TIME), **{s: r.leaf(s.name, INPUT) for s in inputs},
                                       **{s: r.leaf(s.name, PARAMETER) for s in parameters}})
        if turned:
            self.rotation_vector = vector(*self.coordinates[3:])
            self.R = self._about(self.rotation_vector)
        else:
            self.angles = self.coordinates[3:]
            self.R = self._zyx(*self.angles)

    def _zyx(self, phi: Any, theta: Any, psi: Any) -> np.ndarray:
        (c1, s1), (c2, s2), (c3, s3) = ((self.recorder.cos(a), self.recorder.sin(a)) for a in (phi, theta, psi))
        Rx = np.array([[1, 0, 0], [0, c1, -s1], [0, s1, c1]], dtype=object)
        Ry = np.array([[c2, 0, s2], [0, 1, 0], [-s2, 0, c2]], dtype=object)
        Rz = np.array([[c3, -s3, 0], [s3, c3, 0], [0, 0, 1]], dtype=object)
        return Rz @ Ry @ Rx

    def _about(self, r: np.ndarray) -> np.ndarray:
        angle = self.recorder.sqrt(dot(r, r))
        a = r / angle
        S = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]], dtype=object)
        return identity() + self.recorder.sin(angle) * S + (1 - self.recorder.cos(angle)) * (S @ S)

    def generalized(self, wrench: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
        """Forces (6,) along the coordinates, by the work that a wrench does when one of them changes."""
        f, n = wrench
        result = []
        for leaf in self.coordinates:
            change = np.array(forward(self.recorder, [*self.p, *self.R.ravel()], {leaf: 1}), dtype=object)
            S = self.R.T @ change[3:].reshape(3, 3)
            result.append(dot(f, self.R.T @ change[:3]) + dot(n, vector(S[2, 1], S[0, 2], S[1, 0])))
        return vector(*result)

    def power(self, wrench: tuple[np.ndarray, np.ndarray]) -> Any:
        """W"""
        return dot(wrench[0], self.v) + dot(wrench[1], self.omega)

    def upright(self, wrench: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
        """Force and moment about the body's origin, n-frame components, (6,)."""
        return vector(*(self.R @ wrench[0]), *(self.R @ wrench[1]))

    def tape(self, action: Action) -> Tape:
        """Generalized forces (elastic, other), wrenches, the potential and minus its gradient, checked values, power."""
        gradient = [forward(self.recorder, [action.potential], {leaf: 1})[0] for leaf in self.coordinates]
        return Tape.of(self.recorder, elastic=self.generalized(action.elastic), other=self.generalized(action.other),
                       f=action.other[0] + action.elastic[0], n=action.other[1] + action.elastic[1],
                       potential=np.array([action.potential], dtype=object), gradient=-vector(*gradient),
                       validity_checks=np.array([w.value for w in action.validity_checks], dtype=object),
                       power=self.power(action.other))


def tape_of(element: Element, turned: bool = False, **symbols: Sequence[sp.Symbol]) -> Tape:
    """The tape of LeafSite for one element, which must be without faults."""
    assert not element.faults
    site = LeafSite(turned, **symbols)
    return site.tape(element.act(site))  # type: ignore[arg-type]


def pose(seed: int, turned: bool = False, reach: float = 0.5, **given: float) -> Mapping[str, float]:
    """Numbers for all leaves: places within 5 m, angles within reach, rates."""
    rng = np.random.default_rng(seed)
    values = dict(zip(PLACE, rng.uniform(-5, 5, 3), strict=True))
    values |= dict(zip(VECTOR if turned else ANGLES, rng.uniform(-reach, reach, 3), strict=True))
    values |= dict(zip(MOTION, rng.normal(size=6), strict=True))
    return {**{name: float(value) for name, value in values.items()}, "t": 0.0, **given}
