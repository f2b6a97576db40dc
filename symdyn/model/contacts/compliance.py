"""The compliant law: a normal force by the depth of penetration, friction by the slip or by bristles.

Source: Hunt and Crossley, Coefficient of restitution interpreted as damping in vibroimpact, 1975; Johnson, Contact Mechanics,
1985, section 4.2 (Hertz); Canudas de Wit, Olsson, Astrom and Lischinsky, A new model for control of systems with friction, 1995
(LuGre); Dupont, Hayward, Armstrong and Altpeter, Single state elastoplastic friction models, 2002.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import sympy as sp

from symdyn.errors import ModelError
from symdyn.model.faults import Faults
from symdyn.real_numbers import in_range, range_text
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.given import Scalar

# The exponent of Hertz's contact.
HERTZ = sp.Rational(3, 2)
# The square of a deflection is smoothed below this part of that at sliding, and that of a slip in space below STILL, m^2/s^2.
SMOOTH, STILL = sp.Rational(1, 10**18), sp.Rational(1, 10**30)


@dataclass(frozen=True)
class Bristles:
    """Friction by the deflection z of bristles, one state for each tangent, which sticks truly: F = -N (s0 z + s1 z_dot).

    stiffness   s0, 1/m: friction force by normal force and deflection
    damping     s1, s/m
    elastic     part of the deflection at sliding up to which bristles only deflect (Dupont's elasto-plastic model: loads below
                that part of the friction make no creep); None: the LuGre model, which creeps

    >>> sd.contacts.Bristles(1e5, 300.0).elastic
    0.7
    """

    stiffness: Scalar
    damping: Scalar = 0
    elastic: Scalar | None = 0.7


@dataclass(frozen=True)
class Compliance:
    """Compliance of a contact: N = stiffness d^exponent (1 + dissipation d_dot) at the depth d, never below 0.

    stiffness    N/m^exponent; `sd.contacts.hertz` gives that of spheres and planes
    exponent     a number from 1 on; 3/2: Hertz
    dissipation  s/m; about 3/2 (1 - e)/v for a restitution e near 1 at the speed v
    slip_speed   m/s: friction grows linearly with the slip up to about this speed, kinetic N slip/sqrt(slip^2 + slip_speed^2)
    stribeck     m/s: friction falls from the static to the kinetic one over this speed, as exp(-(slip/stribeck)^2); None: with
                 one coefficient of friction only
    viscous      s/m: friction that grows with the slip, by the normal force
    bristles     friction by bristles in place of the slip alone, see Bristles
    depth        m: runs that go deeper report it; None: no limit
    creep        m: runs in which it creeps further while friction holds report it: the slip at speeds where friction is below
                 99 % of the kinetic one, up to 7 slip_speed, summed over time; None: no limit
    located      whether steps end where the gap closes or opens, and where damping lets go, the kinks of the force: motions are
                 more exact, and batches run one by one. The events are NAME_touches and NAME_releases

    >>> sd.contacts.Compliance(1e5).exponent
    3/2
    """

    stiffness: Scalar
    exponent: Scalar = HERTZ
    dissipation: Scalar = 0
    slip_speed: Scalar = 1e-3
    stribeck: Scalar | None = None
    viscous: Scalar = 0
    bristles: Bristles | None = None
    depth: float | None = None
    creep: float | None = None
    located: bool = False


def hertz(radius: Scalar, modulus: Scalar, poisson: Scalar = 0.3, radius_b: Scalar | None = None,
          modulus_b: Scalar | None = None, poisson_b: Scalar = 0.3) -> sp.Expr:
    """The stiffness 4/3 E* sqrt(R) of Hertz's contact of a sphere with a plane or a sphere, N/m^(3/2).

    radius, modulus, poisson   of the sphere on a, m and Pa; radius_b: of that on b, of a hollow one negative; None: a plane
    modulus_b, poisson_b       of the material of b; None: as rigid

    Raises ModelError with everything that is neither a number nor an expression (text is never evaluated), and with numbers that
    no material or pair of shapes has.

    >>> round(float(sd.contacts.hertz(0.01, 2.1e11) / 1e10), 3)
    3.077
    """
    faults = Faults()
    wanted: dict[str, Any] = {"radius": radius, "modulus": modulus, "poisson": poisson}
    wanted |= {what: value for what, value in (("radius_b", radius_b), ("modulus_b", modulus_b)) if value is not None}
    if modulus_b is not None:
        wanted["poisson_b"] = poisson_b
    known = {what: faults.expression(value, f"hertz: {what}") for what, value in wanted.items()}
    if faults:
        raise ModelError(list(faults), "contact")
    for what, value in known.items():
        if what.startswith("poisson") and value.is_number and not -1 < value <= 0.5:
            faults.append(f"hertz: {what} is {value}; pass Poisson's ratio, above -1 and up to 0.5")
        elif not what.startswith("poisson") and what != "radius_b" and value.is_number and not value > 0:
            faults.append(f"hertz: {what} is {value}; pass a number above 0")
    R, E, nu = (known[what] for what in ("radius", "modulus", "poisson"))
    R_b = known.get("radius_b", sp.oo)
    if R_b == 0 or (not faults and R.is_number and R_b.is_number and not 1 / R + 1 / R_b > 0):
        faults.append(f"hertz: radius is {R} and radius_b {R_b}; pass a positive radius_b of a sphere, or of a hollow one a "
                      "negative one, larger than that of the sphere inside")
    if faults:
        raise ModelError(list(faults), "contact")
    yielding, curved = (1 - nu**2) / E, 1 / R
    if modulus_b is not None:
        yielding = yielding + (1 - known["poisson_b"]**2) / known["modulus_b"]
    if radius_b is not None:
        curved = curved + 1 / known["radius_b"]
    return sp.Rational(4, 3) / yielding / sp.sqrt(curved)


class Range(NamedTuple):
    """The numbers that a value of a contact may have: from `least` on, which is one of them if `reached`, and below `below`."""

    what: str
    value: Any
    least: float = 0.0
    reached: bool = True
    below: float = math.inf


@dataclass(frozen=True)
class Law:
    """A compliant contact's forces along its rows, the rates of its bristles, and what its normal force has kinks at besides the
    gap."""

    forces: tuple[sp.Expr, ...]
    rates: tuple[sp.Expr, ...]
    kinks: tuple[sp.Expr, ...] = ()


def positive_part(value: sp.Expr) -> sp.Expr:
    """Max(0, value). Where assumptions do not tell the sign, SymPy looks for common factors of the whole value to find it, which
    takes a second for the gap of a torus; that is left out."""
    known = value >= 0
    return sp.Max(0, value, evaluate=known in (sp.true, sp.false))


def law_of(compliance: Compliance, static: sp.Expr, kinetic: sp.Expr, gap: sp.Expr, rows: Sequence[sp.Expr],
           deflections: Sequence[sp.Symbol], faults: Faults, where: str) -> Law:
    """The forces by the gap, the relative velocities (normal, tangents) and the deflections of bristles."""
    def number(value: Any, what: str) -> sp.Expr:
        return faults.expression(value, f"{where}: {what}")

    depth = positive_part(-gap)
    elastic = number(compliance.stiffness, "stiffness") * depth ** number(compliance.exponent, "exponent")
    damped = 1 - number(compliance.dissipation, "dissipation") * rows[0]
    normal = elastic if damped == 1 else elastic * positive_part(damped)
    slips, kinks = rows[1:], () if damped == 1 else (damped,)
    if not slips:
        return Law((normal,), (), kinks)
    square = sp.Add(*[v**2 for v in slips])
    coefficient = kinetic
    if compliance.stribeck is not None:
        coefficient = kinetic + (static - kinetic) * sp.exp(-square / number(compliance.stribeck, "stribeck") ** 2)
    viscous = number(compliance.viscous, "viscous")
    if compliance.bristles is None:
        speed = sp.sqrt(square + number(compliance.slip_speed, "slip_speed") ** 2)
        return Law((normal, *[-normal * (coefficient / speed + viscous) * v for v in slips]), (), kinks)
    bristles = compliance.bristles
    stiffness, damping = number(bristles.stiffness, "stiffness of bristles"), number(bristles.damping, "damping of bristles")
    limit = coefficient / stiffness
    if bristles.elastic is None:
        speed = sp.Abs(slips[0]) if len(slips) == 1 else sp.sqrt(square + STILL)
        rates = [v - speed * z / limit for v, z in zip(slips, deflections, strict=True)]
    else:
        part = number(bristles.elastic, "elastic part of bristles")
        size = sp.sqrt(sp.Add(*[z**2 for z in deflections]) + SMOOTH * (kinetic / stiffness) ** 2)
        share = sp.Max(0, sp.Min(1, (size / limit - part) / (1 - part)))
        plastic = (1 - sp.cos(sp.pi * share)) / 2
        outwards = positive_part(sp.Add(*[v * z for v, z in zip(slips, deflections, strict=True)]))
        rates = [v - plastic * outwards * z / (size * limit) for v, z in zip(slips, deflections, strict=True)]
    forces = [-normal * (stiffness * z + damping * rate + viscous * v)
              for z, rate, v in zip(deflections, rates, slips, strict=True)]
    return Law((normal, *forces), tuple(rates), kinks)


def _ranges(given: Compliance) -> list[Range]:
    """Ranges of the numbers of a compliance."""
    result = [Range("stiffness", given.stiffness, reached=False), Range("exponent", given.exponent, 1.0),
              Range("dissipation", given.dissipation), Range("slip_speed", given.slip_speed, reached=False),
              Range("viscous", given.viscous)]
    result += [Range(what, value, reached=False) for what, value in (("stribeck", given.stribeck), ("depth", given.depth),
                                                                        ("creep", given.creep))
               if value is not None]
    if isinstance(given.bristles, Bristles):
        result += [Range("stiffness of bristles", given.bristles.stiffness, reached=False),
                   Range("damping of bristles", given.bristles.damping)]
        if given.bristles.elastic is not None:
            result.append(Range("elastic part of bristles", given.bristles.elastic, below=1.0))
    return result


def by_parameters(ranges: Iterable[Range]) -> tuple[Range, ...]:
    """Those of values that follow from parameters."""
    return tuple(one for one in ranges if isinstance(one.value, sp.Basic) and not one.value.is_number)


def numbers_of(ranges: Iterable[Range]) -> list[sp.Expr]:
    """The values of ranges that are no parameters but expressions of these."""
    return [one.value for one in ranges if not one.value.is_Symbol]


def ranges_of(given: Compliance, static: sp.Expr, kinetic: sp.Expr) -> list[Range]:
    """Ranges of coefficients of a compliant contact."""
    friction = [Range("static friction", static), Range("kinetic friction", kinetic, reached=given.bristles is None)]
    if static != kinetic:
        friction.append(Range("static friction less kinetic friction", static - kinetic))
    return [*friction, *_ranges(given)]


def compliance_faults(where: str, given: object, numbers: Callable[[Any], float | None], static: sp.Expr,
                      kinetic: sp.Expr) -> list[str]:
    """Faults of a compliance; numbers: gives the number of an expression, None where it has none."""
    if not isinstance(given, Compliance):
        return [f"{where}: law='compliant' takes compliance=sd.contacts.Compliance(stiffness, ...), found {shown(given)}"]
    result = [] if isinstance(given.located, bool) else [f"{where}: located is {shown(given.located)}; pass True or False"]
    if given.stribeck is None and not (static - kinetic).is_zero:
        result.append(f"{where}: static friction is {static} and kinetic friction {kinetic}, and compliant contacts take static "
                      "friction by Stribeck's curve; pass stribeck=, m/s, to the compliance, or one coefficient of friction")
    limits = (("depth", given.depth), ("creep", given.creep))
    result += [f"{where}: {what} is {value}; pass a number, in m" for what, value in limits
               if isinstance(value, sp.Basic) and not value.is_number]
    if given.creep is not None and numbers(kinetic) == 0:
        result.append(f"{where}: creep is limited, and there is no friction that holds; pass friction, or leave creep out")
    if isinstance(given.bristles, Bristles):
        if numbers(kinetic) == 0:
            result.append(f"{where}: bristles need friction; pass friction, or leave bristles out")
    elif given.bristles is not None:
        result.append(f"{where}: bristles is {shown(given.bristles)}; pass sd.contacts.Bristles(...), or None")
    for what, value, least, reached, below in _ranges(given):
        wrong = Faults()
        wrong.expression(value, f"{where}: {what}")
        result += wrong
        number = None if wrong else numbers(value)
        if number is not None and not in_range(number, least, reached, below):
            result.append(f"{where}: {what} is {number:g}; {range_text(least, reached, below)}")
    return result
