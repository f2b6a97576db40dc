"""Forces of regular waves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import sympy as sp

from symdyn.model.elements.base import Element
from symdyn.model.elements.checks import positive, six
from symdyn.model.elements.site import Action, Site
from symdyn.model.symbols import time
from symdyn.spatial.vectors import cross

if TYPE_CHECKING:
    from symdyn.given import BodyOrName, Scalar, Vector


class WaveExcitation(Element):
    """F_k = A_k cos(w t + phase_k) along and about the axes of the n-frame, at a point of the body.

    amplitude   A (6,): N and N m about the point; phase: (6,) rad, as they come from a diffraction analysis times wave height
    frequency   w, rad/s
    point       (3,) body axes, m
    ramp        s: within this time the waves grow from nothing, by (1 - cos(pi t / ramp)) / 2; None: they are there at once

    >>> system = sd.System("float", gravity=[0, 0, -9.81])
    >>> box = system.add_body("box", mass=500, inertia=[100, 100, 100])
    >>> joint = system.add_joint(sd.Prismatic("heave", system.ground, box, axis=[0, 0, 1]))
    >>> wave = system.add_load(sd.WaveExcitation(box, [0, 0, 1e3, 0, 0, 0], [0] * 6, frequency=0.6))
    >>> system.compile(backend="numpy").rhs(0.0, [-0.1, 0.0]).round(4)
    array([ 0.  , -7.81])
    """

    kind = "wave excitation"

    def __init__(self, body: BodyOrName, amplitude: Vector, phase: Vector, frequency: Scalar, point: Vector = (0, 0, 0),
                 ramp: Scalar | None = None, name: str = "") -> None:
        super().__init__(body, name)
        where, faults = self.where, self.faults
        self.amplitude = six(faults, amplitude, f"{where}: amplitude")
        self.phase = six(faults, phase, f"{where}: phase")
        self.frequency = positive(faults, frequency, f"{where}: frequency", "rad/s")
        self.point = faults.vector(point, f"{where}: point")
        self.ramp = None if ramp is None else positive(faults, ramp, f"{where}: ramp", "s, or None")

    @property
    def constants(self) -> Sequence[sp.Expr]:
        return [*self.amplitude, *self.phase, self.frequency, *self.point, *self._ramps]

    @property
    def _ramps(self) -> list[sp.Expr]:
        return [] if self.ramp is None else [self.ramp]

    @property
    def units(self) -> Mapping[str, Sequence[sp.Expr]]:
        return {"N": self.amplitude[:3], "N m": self.amplitude[3:], "rad": self.phase, "rad/s": [self.frequency],
                "m": list(self.point), "s": self._ramps}

    def act(self, site: Site) -> Action:
        a = site.algebra
        t, point, phase = a.expression(time), a.constants(self.point), a.constants(self.phase)
        turn = a.expression(self.frequency) * t
        c, s = a.cos(turn), a.sin(turn)
        grown: Any = 1
        if self.ramp is not None:
            whole = a.divisor(a.expression(self.ramp), 0, f"{self.where}: the time of the ramp is not above zero")
            part = a.recorder.apply("min", a.recorder.apply("max", t / whole, 0), 1)
            grown = (1 - a.cos(a.recorder.pi() * part)) / 2
        F = a.constants(self.amplitude)
        for k, angle in enumerate(phase):
            F[k] = F[k] * (a.cos(angle) * c - a.sin(angle) * s) * grown
        f = site.R.T @ F[:3]
        return Action(other=(f, site.R.T @ F[3:] + cross(point, f)))
