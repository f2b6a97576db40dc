"""Radau IIA of 5 and of 3 stages: orders 9 and 5, stiffly accurate, L-stable."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import prod

from symdyn.backend.gathered import Gathered
from symdyn.backend.methods.record import Method

Vector = tuple[float, ...]


@dataclass(frozen=True)
class Collocation:
    """Coefficients of a collocation method with matrix A, of an odd number of stages, as its equations are solved.

    nodes      0 < c_1 < ... < c_s = 1; inverse: A^-1
    roots      (alpha, beta) of the eigenvalues alpha + i beta of A^-1: the real one gamma, then of each pair that with beta > 0
    join, part with w = part z the system A^-1 z / h - J z = r falls apart into (alpha_k + i beta_k) w_k / h - J w_k = (part r)_k,
               real and imaginary parts of w_1, w_2, ... in turn, and z = join w
    estimate   d of the error estimate (gamma/h - J)^-1 (f(t, x) + d z / h), z the stages less x, which vanishes for polynomials
               of degree s
    tail       a polynomial w of the place in the step, lowest power first: the polynomial of the stages and w times the estimate
               are right for polynomials of degree s + 1. 0 at 0 and 1
    extra      a place in the step, where c (c - c_1) ... (c - c_s) is largest: there the polynomial is farthest from stiff
               motion, which goes through its start and its stages
    """

    nodes: Vector
    inverse: tuple[Vector, ...]
    roots: tuple[tuple[float, float], ...]
    join: tuple[Vector, ...]
    part: tuple[Vector, ...]
    estimate: Vector
    tail: Vector
    extra: float

    @property
    def gap_factor(self) -> float:
        """The factor that makes c (c - c_1) ... (c - c_s) 1 at the extra place."""
        return 1.0 / (self.extra * prod(self.extra - c for c in self.nodes))

    @property
    def tail_off(self) -> float:
        """Value at the extra place of the tail, less that of the polynomial which is 1 at the start and 0 at all stages."""
        return sum(w * self.extra**k for k, w in enumerate(self.tail)) - prod((c - self.extra) / c for c in self.nodes)

    @property
    def extra_slope(self) -> Vector:
        """Weights of the stages less x, and of the estimate, in the derivative of the polynomial at the extra place."""
        at, weights = self.extra, []
        for c in self.nodes:
            others = [d for d in (0.0, *self.nodes) if d != c]
            value = prod((at - d) / (c - d) for d in others)
            weights.append(value * sum(1.0 / (at - d) for d in others))
        return (*weights, sum(k * w * at**(k - 1) for k, w in enumerate(self.tail) if k))


@dataclass(frozen=True, kw_only=True)
class OfRadau(Gathered):
    """The coefficients for the template."""

    coefficients: Collocation


FIVE_STAGES = Collocation(
    nodes=(0.05710419611451768, 0.2768430136381238, 0.5835904323689168, 0.8602401356562195, 1.0),
    inverse=((8.755923977938362, 2.8919426153801173, -0.8751863962002651, 0.3997052079399655, -0.13370616384921583),
             (-7.161380720145387, 1.8060777240836443, 2.3637971760686085, -0.8659007802831346, 0.2743380777751942),
             (4.122165246243374, -4.4960171258133945, 0.8567652453971776, 2.5183209492110645, -0.6570627571343601),
             (-3.8786632197240105, 3.3931519180649543, -5.188340906407187, 0.5812330525808164, 2.809983655279712),
             (8.41242422359429, -6.970256116656661, 8.777114204150473, -18.2192823110881, 13.0)),
    roots=((6.2867047517292765, 0.0), (5.70095329867179, 3.2102656003085497), (3.655694325463572, 6.543736899360077)),
    join=((0.013576867344947943, 0.0, -0.011478515255229515, -0.01401985889287541, -0.010242047817908826, 0.04767387729029572),
          (0.0016179004017190875, 0.0, -0.007668830749180163, 0.024708578426518527, 0.05017286451737106, -0.09433181918161143),
          (0.07915785334744721, 0.0, 0.01939846399882895, 0.08180035370375117, -0.23053953404341795, 0.1027030453801259),
          (0.41225608268046143, 0.0, 0.40760117128019907, 0.19968242788680252, 0.37789390224886127, 0.46674413033249434),
          (1.0, 0.0, 1.0, 0.0, 1.0, 0.0)),
    part=((27.697693775684087, 12.783337911304406, 3.20848938671343, -0.9514904122489162, 0.7415504960259897),
          (0.0, 0.0, 0.0, 0.0, 0.0),
          (-33.041880213519, -17.376953479063566, -0.17212906325400557, -0.09916977798254265, 0.5312281158383066),
          (-8.611443979875292, 9.699991409528808, 1.9147286396968743, 2.41869200608494, -1.0474634879353375),
          (5.344186437834912, 4.593615567759161, -3.0363603234594243, 1.050660190231459, -0.27277861186429625),
          (3.748059807439805, -3.984965736343885, -1.0444156416080188, 1.1840985681379486, -0.44991777015678036)),
    estimate=(-27.78093394406464, 3.641478498049213, -1.2525477211691187, 0.5920031671845428, -0.2),
    tail=(0.0, 6.2867047517292765, -78.58380939661596, 314.33523758646385, -550.0866657763117, 440.06933262104934,
          -132.0207997863148),
    extra=0.7339604782881639)

THREE_STAGES = Collocation(
    nodes=(0.1550510257216822, 0.6449489742783178, 1.0),
    inverse=((3.224744871391589, 1.1678400846904056, -0.25319726474218085),
             (-3.5678400846904057, 0.775255128608411, 1.0531972647421808), (5.531972647421808, -7.531972647421808, 5.0)),
    roots=((3.637834252744496, 0.0), (2.6810828736277523, 3.0504301992474105)),
    join=((0.09443876248897524, 0.0, -0.1412552950209542, -0.030029194105147424),
          (0.2502131229653333, 0.0, 0.20412935229379994, 0.3829421127572619), (1.0, 0.0, 1.0, 0.0)),
    part=((4.178718591551905, 0.32768282076106237, 0.5233764454994495), (0.0, 0.0, 0.0),
          (-4.178718591551905, -0.32768282076106237, 0.47662355450055044),
          (-0.5028726349457868, 2.571926949855605, -0.5960392048282249)),
    estimate=(-10.048809399827416, 1.382142733160749, -0.3333333333333333),
    tail=(0.0, 3.637834252744496, -16.37025413735023, 21.827005516466976, -9.09458563186124),
    extra=0.8611601583007704)

SOURCE = (
    "E. Hairer, G. Wanner, Solving Ordinary Differential Equations II: Stiff and Differential-Algebraic Problems, 2nd ed.,",
    "Springer 1996, section IV.8 (Newton's method, error estimate; 3 stages); the same, Stiff differential equations solved by",
    "Radau methods, J. Comput. Appl. Math. 111 (1999) 93-111 (5 stages).")


def _gather(coefficients: Collocation) -> Callable[..., OfRadau]:
    """The coefficients, and the order in which the matrix has a narrow band."""
    return lambda content, *_: OfRadau(coefficients=coefficients, band=content.band)


RADAU = Method(
    "radau", "Radau IIA of 5 stages with the exact Jacobian: order 9, error estimate of order 5, dense output of order 6",
    6, "radau", SOURCE, needs=("jacobian_x",), gather=_gather(FIVE_STAGES))

RADAU5 = Method(
    "radau5", "Radau IIA of 3 stages with the exact Jacobian: order 5, error estimate of order 3, dense output of order 4",
    4, "radau", SOURCE, needs=("jacobian_x",), gather=_gather(THREE_STAGES))
