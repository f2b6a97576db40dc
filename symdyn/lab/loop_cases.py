"""The mechanisms of `symdyn bench loops`: how each is run, and what its motion is compared with."""

from __future__ import annotations

import difflib
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from symdyn.errors import SymdynError
from symdyn.systems import get

# Published rows and closed forms with their sources, in SI units.
REFERENCE: dict[str, Any] = json.loads(Path(__file__).with_name("loops_reference.json").read_text(encoding="utf-8"))

# Errors of positions (m, rad) and speeds (m/s, rad/s) of a solution.
Errors = tuple[float, float]


@dataclass(frozen=True)
class Reference:
    """Reference that a motion is compared with.

    kind      "published", "closed form" or "tree": a formulation without constraints
    times     s, where; errors: of a solution that has them behind the start
    source    of the numbers
    """

    kind: str
    times: np.ndarray
    errors: Callable[[Any], Errors]
    source: str = ""


@dataclass(frozen=True)
class Case:
    """One mechanism.

    name, options   of the catalogue
    rtol, atol      of the compared run
    long            s over which violations are looked at
    end             s of the compared run (default: the system's duration, which is the published one)
    reference       made when it is requested; None: there is none but the motion at more digits
    bounds          what its figures should be at most: "error_q", "error_u", "precise"
    """

    name: str
    options: Mapping[str, Any] = field(default_factory=dict)
    rtol: float = 1e-11
    atol: float = 1e-12
    long: float = 100.0
    end: float | None = None
    reference: Callable[[], Reference] | None = None
    bounds: Mapping[str, float | None] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """Such as n_four_bar(2) or flyball_governor(rods)."""
        values = [key if value is True else str(value) for key, value in self.options.items()]
        return f"{self.name}({', '.join(values)})" if values else self.name

    def system(self) -> Any:
        return get(self.name, **self.options)

    def duration(self) -> float:
        """s"""
        return float(self.end or self.system().duration)


def largest(values: Any) -> float:
    """The largest absolute value."""
    return float(np.abs(np.asarray(values)).max(initial=0.0))


# -- published


def _published_end(name: str, relative: bool) -> Reference:
    """The end of a motion; relative: entry by entry."""
    row = REFERENCE[name]
    q, u = np.array(row["q"]), np.array(row["q_dot"])

    def errors(sol: Any) -> Errors:
        differ = sol.q[-1] - q, sol.u[-1] - u
        return (largest(differ[0] / q), largest(differ[1] / u)) if relative else (largest(differ[0]), largest(differ[1]))

    return Reference("published", np.array([row["t"]]), errors, row["source"])


def _pendulum() -> Reference:
    row = REFERENCE["pendulum_absolute"]
    rows = np.array(row["t_x_y"])[:3]
    rate = lambda x, y: np.sqrt(np.maximum(-2 * 9.81 * y, 0))  # of energy

    def errors(sol: Any) -> Errors:
        result = sol.q[1:]
        speed = np.hypot(*sol.u[1:].T)
        return largest(result - rows[:, 1:]), largest(speed - rate(*rows[:, 1:].T))

    return Reference("closed form", rows[:, 0], errors, row["source"])


def _windows(n: int) -> Reference:
    row = REFERENCE["n_four_bar"]
    rows = np.array(row["t_x_y_vx_vy"][str(n)])

    def errors(sol: Any) -> Errors:
        theta, rate = sol.q[1:, 0], sol.u[1:, 0]
        result = np.transpose([np.sin(theta), np.cos(theta), rate * np.cos(theta), -rate * np.sin(theta)])
        folded = largest(sol.q[:, :n + 1] - sol.q[:, :1])
        return max(largest(result[:, :2] - rows[:, 1:3]), folded), largest(result[:, 2:] - rows[:, 3:])

    return Reference("closed form", rows[:, 0], errors, row["source"])


def _slider_crank() -> Reference:
    row = REFERENCE["slider_crank"]
    rows = np.array(row["rows"])
    return Reference("published", rows[:, 0], lambda sol: (largest(sol.q[1:, 0] - rows[:, 1]),
                                                           largest(sol.u[1:, 0] - rows[:, 2])), row["source"])


def _spatial_slider_crank() -> Reference:
    row = REFERENCE["spatial_slider_crank"]
    rows = np.array(row["rows"])
    return Reference("published", rows[1:, 0], lambda sol: (largest(sol.q[:, :2] - rows[:, [1, 3]]),
                                                            largest(sol.u[:, 0] - rows[:, 2])), row["source"])


def _governor() -> Reference:
    row = REFERENCE["flyball_governor"]
    rows = np.array(row["rows"])
    columns = [2, 1, 0]  # beta1, s, phi
    return Reference("published", rows[1:, 0], lambda sol: (largest(sol.q[:, columns] - rows[:, 1:4]),
                                                            largest(sol.u[:, columns] - rows[:, 4:])), row["source"])


# -- closed forms


def _track() -> Reference:
    g, theta, times = 9.81, 0.5, np.linspace(0.5, 2, 4)
    direction = np.array([math.cos(theta), -math.sin(theta)])

    def errors(sol: Any) -> Errors:
        t, a = sol.t[:, None], g * math.sin(theta)
        return largest(sol.q - (0.5 * t + a * t**2 / 2) * direction), largest(sol.u - (0.5 + a * t) * direction)

    return Reference("closed form", times, errors, "constant acceleration g sin theta down the track")


def _slope() -> Reference:
    omega, g, times = 2.0, 9.81, np.linspace(0.5, 3, 6)

    def errors(sol: Any) -> Errors:
        t = sol.t
        particular = g / (2 * omega**2)
        b = (-0.5 - particular * omega) / omega
        s = np.cosh(omega * t) + b * np.sinh(omega * t) + particular * np.sin(omega * t)
        rate = omega * (np.sinh(omega * t) + b * np.cosh(omega * t) + particular * np.cos(omega * t))
        along = np.transpose([np.cos(omega * t), np.sin(omega * t)])
        across = np.transpose([-np.sin(omega * t), np.cos(omega * t)])
        q, u = s[:, None] * along, rate[:, None] * along + omega * s[:, None] * across
        return largest(sol.q - q) / largest(q), largest(sol.u - u) / largest(u)

    return Reference("closed form", times, errors, "s_ddot = omega^2 s - g sin(omega t); errors relative to the largest value")


def _skate() -> Reference:
    m, I, a, v, rate = 1.0, 0.02, 0.1, -0.5, 4.0
    V = math.sqrt(v**2 + (I + m * a**2) / m * rate**2)
    gamma = m * a * V / (I + m * a**2)

    def errors(sol: Any) -> Errors:
        phase = gamma * sol.t + math.atanh(v / V)
        turn = V * math.sqrt(m / (I + m * a**2))
        along = sol.u[:, 0] * np.cos(sol.q[:, 2]) + sol.u[:, 1] * np.sin(sol.q[:, 2])
        # theta_dot = turn / cosh: theta is turn / gamma times the Gudermann function of the phase.
        angle = turn / gamma * (np.arctan(np.sinh(phase)) - np.arctan(np.sinh(phase[0])))
        wrong = along - V * np.tanh(phase), sol.u[:, 2] - turn / np.cosh(phase)
        return largest(sol.q[:, 2] - angle), max(map(largest, wrong))

    return Reference("closed form", np.linspace(0.5, 5, 10), errors, "Neimark and Fufaev: v = V tanh(gamma (t - t_0))")


def _rotating_track() -> Reference:
    times = np.linspace(0.1, 1, 10)

    def errors(sol: Any) -> Errors:
        tree = get("vehicle_on_rotating_track").compile().simulate(sol.t, rtol=1e-12, atol=1e-13)
        (q1, q2), (u1, u2), still = tree.q.T, tree.u.T, 0 * sol.t
        c, s = np.cos(q2), np.sin(q2)
        q = np.transpose([-q1 * c, -q1 * s, still, still, q2])
        u = np.transpose([-u1 * c + q1 * s * u2, -u1 * s - q1 * c * u2, still, still, u2])
        return largest(sol.q - q), largest(sol.u - u)

    return Reference("tree", times, errors, "vehicle_on_rotating_track, in the distance on the track and its inclination")


CASES = {case.label: case for case in (
    Case("pendulum_absolute", reference=_pendulum),
    Case("vehicle_on_track_absolute", reference=_track),
    Case("vehicle_on_rotating_track_absolute", reference=_rotating_track, long=5.0),  # then its track stands upright
    Case("particle_on_moving_slope", reference=_slope, long=3.0),  # its distance grows as exp(2 t)
    # Far out the coordinates carry the constraint to eps of the distance only, 4e30 m after 100 s; in 15 s it gets to 3e4 m.
    Case("particle_on_moving_slope", {"rocking": True}, long=15.0),
    Case("four_bar"),
    Case("slider_crank", reference=_slider_crank),
    Case("n_four_bar", {"n": 1}, reference=lambda: _windows(1)),
    Case("n_four_bar", {"n": 2}, reference=lambda: _windows(2)),
    # Published with a bound of its own, 1e-3 of the position of the first corner.
    *(Case("n_four_bar", {"n": n}, reference=partial(_windows, n), end=10.0, long=20.0, bounds={"error_q": 1e-3, "energy": None})
      for n in (40, 100)),
    Case("andrews_squeezer", atol=1e-13, long=0.05, reference=lambda: _published_end("andrews_squeezer", True),
         bounds={"error_q": 1e-9, "precise": 1e-9}),
    Case("car_axis", rtol=1e-12, atol=1e-13, long=3.0, reference=lambda: _published_end("car_axis", False),
         bounds={"error_q": 1e-12, "error_u": 1e-9}),
    Case("bricard"),
    Case("spatial_slider_crank", rtol=1e-12, atol=1e-13, reference=_spatial_slider_crank),
    Case("double_wishbone"),
    Case("rolling_disc"),
    Case("skate", reference=_skate),
    Case("sleigh", long=10.0),  # it swings to and fro ever further
    Case("bicycle"),
    Case("stewart_platform", long=1.0),  # its legs push on, whatever their lengths
    Case("flyball_governor", reference=_governor, atol=1e-11, bounds={"error_q": 1e-7, "error_u": 1e-7}),
    Case("flyball_governor", {"links": "rods"}),
)}


def chosen(names: Sequence[str] | None) -> list[Case]:
    """The cases of these names, of systems (all their variants) or of single cases such as n_four_bar(2); all if there are none.

    Raises SymdynError for a name that there is not.
    """
    result: list[Case] = []
    for name in names or CASES:
        own = [case for case in CASES.values() if name in (case.label, case.name)]
        if not own:
            near = difflib.get_close_matches(name, CASES, 3)
            raise SymdynError(f"there is no loop to measure with the name {name!r}; "
                              + (f"did you mean {' or '.join(near)}?" if near else f"there are {', '.join(CASES)}"))
        result += [case for case in own if case not in result]
    return result
