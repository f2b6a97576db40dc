"""The mechanisms that the programs compute, and the bounds that symdyn is held to."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from symdyn.errors import SymdynError
from symdyn.model.joints import Free, Revolute
from symdyn.model.orientation import EulerAngles, EulerParameters
from symdyn.model.symbols import coordinates, parameters
from symdyn.model.system import System
from symdyn.systems import get


@dataclass(frozen=True)
class Bound:
    """Bounds for symdyn; None: nothing.

    operations   at most, in one evaluation after hoisting; of derivatives those executed in 8 lanes
    ratio        at most, its time over that of CasADi's code with run-time parameters
    pinocchio    at least, the time of Pinocchio's C++ over its own
    """

    operations: int | None = None
    ratio: float | None = None
    pinocchio: float | None = None

    def missed(self, operations: int, ratio: float | None, pinocchio: float | None, digits: int) -> list[str]:
        """Missed bounds, in words, ratios to CasADi with so many digits; a value that was not measured, None, misses nothing."""
        result = []
        if self.operations is not None and operations > self.operations:
            result.append(f"{operations} operations > {self.operations}")
        if self.ratio is not None and ratio is not None and ratio > self.ratio:
            result.append(f"symdyn/CasADi {ratio:.{digits}f} > {self.ratio:.2f}")
        if self.pinocchio is not None and pinocchio is not None and pinocchio < self.pinocchio:
            result.append(f"Pinocchio/symdyn {pinocchio:.1f} < {self.pinocchio:.1f}")
        return result


class Timed:
    """Row with times of programs, program -> ns of one evaluation."""

    times: dict[str, float]

    def over(self, slower: str, faster: str) -> float | None:
        """Ratio of two programs' times; None if one was not measured."""
        if slower not in self.times or faster not in self.times:
            return None
        return self.times[slower] / self.times[faster]


@dataclass(frozen=True)
class Case:
    """A mechanism with its bounds."""

    make: Callable[[], System]
    bound: Bound = Bound()


def turbine_tree(body_rates: bool = False) -> System:
    """A floating wind turbine: platform free in space, nacelle yawing on its tower, rotor spinning in the nacelle.

    The n-frame has z upward. The platform's frame is at its reference point, z along the tower; at q = 0 all frames are
    parallel to the n-frame. Coordinates: x, y, z (m) and the rotation of the platform, q_yaw (rad) of the nacelle about
    z, q_rotor (rad) about the nacelle's x.

    body_rates   False: the platform's rotation is Euler angles ZYX, and all speeds are derivatives of coordinates
                 True: it is Euler parameters, and its angular speeds are the angular velocity in platform axes

    Every number of the model that is not zero is a parameter: g (m/s^2, along -z); of each body mass (kg), the entries
    of its centre of mass (m) and principal inertia about it (kg m^2) in body axes; the entries of the place of each
    joint on the body before (m).
    """
    g = parameters("g")
    system = System("turbine_tree_body_rates" if body_rates else "turbine_tree", gravity=[0, 0, -g])
    system.defaults = {g: 9.81}

    def given(prefix: str, values: tuple[float, float, float]) -> list:
        """A vector with a parameter for each entry that is not zero."""
        entries = [parameters(f"{prefix}_{axis}") if value else 0 for axis, value in zip("xyz", values)]
        system.defaults |= {symbol: value for symbol, value in zip(entries, values) if value}
        return entries

    bodies = {}
    for name, mass, com, inertia in (("platform", 7.7e6, (0.0, 0.0, -78.0), (4.3e9, 4.3e9, 1.7e8)),
                                     ("nacelle", 2.4e5, (1.9, 0.0, 1.75), (1.0e6, 2.2e6, 1.8e6)),
                                     ("rotor", 1.1e5, (0.0, 0.0, 0.0), (3.9e7, 2.0e7, 2.0e7))):
        m = parameters(f"m_{name}")
        system.defaults[m] = mass
        bodies[name] = system.add_body(name, mass=m, com=given(f"c_{name}", com), inertia=given(f"I_{name}", inertia))
    rotation = "e0 e1 e2 e3" if body_rates else "psi theta phi"
    system.add_joint(Free("mooring", system.ground, bodies["platform"], coordinates(f"x y z {rotation}"),
                          orientation=EulerParameters() if body_rates else EulerAngles("ZYX")))
    system.add_joint(Revolute("yaw", bodies["platform"], bodies["nacelle"], axis=[0, 0, 1],
                              parent_point=given("yaw", (0.0, 0.0, 87.6))))
    system.add_joint(Revolute("rotor", bodies["nacelle"], bodies["rotor"], axis=[1, 0, 0],
                              parent_point=given("rotor", (-5.0, 0.0, 2.4))))
    return system


def _pendulum(n: int, bound: Bound = Bound()) -> dict[str, Case]:
    return {f"n_link_pendulum({n})": Case(lambda: get("n_link_pendulum", n=n), bound)}


def _chain(n: int, bound: Bound = Bound()) -> dict[str, Case]:
    return {f"spatial_chain({n})": Case(lambda: get("spatial_chain", n=n), bound)}


CASES: dict[str, Case] = {
    **_pendulum(5, Bound(275, 0.80)), **_pendulum(8, Bound(480, 0.80)), **_pendulum(12), **_pendulum(20),
    **_chain(4), **_chain(6), **_chain(7, Bound(1400, 0.75, 6.0)), **_chain(12, Bound(3400, 0.85)),
    "turbine_tree": Case(turbine_tree, Bound(950, 0.80)),
    "turbine_tree_body_rates": Case(lambda: turbine_tree(body_rates=True)),
}
# The mechanism with a closed loop; see symdyn.lab.peers.four_bar.
LOOP = "four_bar"


def cases(names: Sequence[str] | None) -> tuple[dict[str, Case], bool]:
    """The named mechanisms, all by default, and whether LOOP is one; `spatial_chain` stands for those of every length.

    Raises SymdynError for a name that there is not.
    """
    there = [*CASES, LOOP]
    if not names:
        return CASES, True
    unknown = [n for n in names if not any(n in (c, c.partition("(")[0]) for c in there)]
    if unknown:
        raise SymdynError(f"there is no benchmark model {', '.join(unknown)}; there are {', '.join(there)}")
    return {c: case for c, case in CASES.items() if c in names or c.partition("(")[0] in names}, LOOP in names
