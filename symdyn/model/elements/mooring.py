"""Mooring lines, at rest at each instant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import sympy as sp

from symdyn.model.algorithms.catenary import SYMDYN_NEAREST
from symdyn.model.elements.base import Element
from symdyn.model.elements.catenary import Catenary, potential
from symdyn.model.elements.checks import not_negative, positive
from symdyn.model.elements.site import Action, Site, Validity
from symdyn.model.symbols import symbols_of
from symdyn.spatial.vectors import cross, vector
from symdyn.tape.node import is_zero

if TYPE_CHECKING:
    from symdyn.given import BodyOrName, Scalar, Vector

# Largest strain that is meant: steel is torn at less, and ropes of fibres do not follow Hooke's law as far.
STRAIN = 0.05


class MooringLine(Element):
    """An elastic line from a fairlead of the body to an anchor, in the shape it has at rest (quasi-static catenary).

    fairlead    (3,) body axes, m; anchor: (3,) n-frame, whose z is upward whatever the model's gravity, m
    length      unstretched, m
    weight      in water per unstretched length, N/m
    stiffness   EA, N
    seabed      True: the anchor stands on a level seabed, on which part of the line may lie; False: it hangs freely
    friction    of the line with the seabed, C_B (1 is usual, 0 none)

    Without friction the line has a potential: the elastic energy of the line and that of its weight in water, zero at the
    level of the anchor. With friction the force still follows from the place alone, but is no gradient (dH/dz and dV/dx differ,
    by 2.5e-4 for the lines of a barge), so that it counts as one that does work. A line that is longer than what hangs
    and what lies on the seabed is slack: it hangs straight down, without horizontal force.
    A fairlead may be straight above or below its anchor, as that of a tension leg is: horizontal distances below 2e-9 of the
    length count as such. The run stops with the reason where the fairlead is not above the seabed; a strain at the fairlead
    above 5 % gives a warning.
    Source: Jonkman, NREL/TP-500-41958 (2007), quasi-static mooring lines; see symdyn.model.elements.catenary for the equations.

    >>> system = sd.System("float", gravity=[0, 0, -9.81])
    >>> box = system.add_body("box", mass=500, inertia=[100, 100, 100])
    >>> joint = system.add_joint(sd.Prismatic("heave", system.ground, box, axis=[0, 0, 1]))
    >>> line = system.add_load(sd.MooringLine(box, [0, 0, 0], [60, 0, -20], length=70, weight=100, stiffness=1e6))
    >>> system.compile(backend="numpy").rhs(0.0, [-0.1, 0.0]).round(4)
    array([  0.    , -15.6414])
    """

    kind = "mooring line"

    def __init__(self, body: BodyOrName, fairlead: Vector, anchor: Vector, length: Scalar, weight: Scalar, stiffness: Scalar,
                 seabed: bool = True, friction: Scalar = 0, name: str = "") -> None:
        super().__init__(body, name)
        where, faults = self.where, self.faults
        self.fairlead = faults.vector(fairlead, f"{where}: fairlead")
        self.anchor = faults.vector(anchor, f"{where}: anchor")
        self.length = positive(faults, length, f"{where}: length", "m")
        self.weight = positive(faults, weight, f"{where}: weight", "N/m (in water, per length)")
        self.stiffness = positive(faults, stiffness, f"{where}: stiffness", "N (EA)")
        self.friction = not_negative(faults, friction, f"{where}: friction")
        self.seabed = bool(seabed)
        if self.friction != 0 and not seabed:
            faults.append(f"{where}: friction is {self.friction}, but seabed is False, so that there is nothing to rub on; leave "
                          "friction out, or pass seabed=True")

    @property
    def constants(self) -> Sequence[sp.Expr]:
        return [*self.fairlead, *self.anchor, self.length, self.weight, self.stiffness, self.friction]

    @property
    def units(self) -> Mapping[str, Sequence[sp.Expr]]:
        return {"m": [*self.fairlead, *self.anchor, self.length], "N/m": [self.weight], "N": [self.stiffness],
                "1": [self.friction]}

    def act(self, site: Site) -> Action:
        a, recorder = site.algebra, site.algebra.recorder
        length, weight, stiffness = (a.divisor(a.expression(value), 0, f"{self.where}: the {what} of the line is not above zero")
                                     for value, what in ((self.length, "length"), (self.weight, "weight"),
                                                         (self.stiffness, "stiffness")))
        friction = a.expression(self.friction)
        fairlead = a.constants(self.fairlead)
        d = site.p + site.R @ fairlead - a.constants(self.anchor)
        # H / distance has a limit where the distance vanishes; the root keeps away from it, and the force stays the gradient.
        nearest = 2 * length * SYMDYN_NEAREST
        distance = a.sqrt(d[0] * d[0] + d[1] * d[1] + nearest * nearest)
        height = d[2]
        if self.seabed:
            height = recorder.guard(height, height, f"{self.where}: the fairlead is not above the seabed, on which the anchor "
                                    "stands; move it, or pass seabed=False")
        values = [distance / length, height / length, weight * length / stiffness, friction]
        intrinsic = Catenary((int(self.seabed),), f"{self.where}: no shape at rest was found; look at its length, weight, "
                             "stiffness and friction and at the place of the fairlead: some of them is negative or not finite")
        h, v = recorder.call(intrinsic, values)
        total = weight * length
        pull = total * h / distance
        f = -(site.R.T @ vector(pull * d[0], pull * d[1], total * v))
        wrench = f, cross(fairlead, f)
        validity_checks = (self._strain(site, total / stiffness * a.sqrt(h * h + v * v)),)
        if not is_zero(friction):
            return Action(other=wrench, validity_checks=validity_checks)
        return Action(elastic=wrench, potential=total * length * potential(recorder, self.seabed, (h, v), values),
                      validity_checks=validity_checks)

    def _strain(self, site: Site, strain: Any) -> Validity:
        unit = "" if symbols_of(self.stiffness) else f" of {float(self.stiffness):.4g} N"
        return Validity(f"strain of {self.where}", strain, -1.0, STRAIN,
                        f"{self.where}: it is stretched by {{value}} of its length, with that part of EA{unit} as its tension; "
                        f"lines are meant up to {STRAIN:g}; look at its length, its stiffness and its places")
