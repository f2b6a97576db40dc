"""The published mechanisms A01 to A05: how each is run, what of its motion is compared, with what, and within which bounds.

Source: library of computational benchmark problems of multibody dynamics (Laboratorio de Ingenieria Mecanica, Ferrol; IFToMM);
Gonzalez, Dopico, Lugris and Cuadrado, A benchmarking system for MBS simulation software, Multibody Syst. Dyn. 16 (2006).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import ellipj, ellipk

from symdyn.bench.work.system_under_test import Formulation, SystemUnderTest
from symdyn.errors import SymdynError
from symdyn.lab.extended import known
from symdyn.model.system import System
from symdyn.systems import get

# Bounds of the library: errors of a program at low and at high precision, and the least size that relative errors are relative
# to.
LOOSE, TIGHT, THRESHOLD = 1e-1, 1e-3, 1e-3
# Runs that a reference is made of, and that must agree, where there is no closed form.
_REFERENCE_RTOL = 1e-13
_METHODS = ("dop853", "bs54", "taylor", "radau", "radau5", "auto")
_GRAVITY = 9.81

# Formulation, times (n_t,), states (n_t, n_x) -> what is compared, (n_t, n_y)
History = Callable[[Formulation, np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Case:
    """One mechanism.

    title      what it is, and what is compared
    systems    formulation -> what makes its system; the first is the reference's; other programs get the first that they take,
               but no absolute one
    end        s; outputs: how many even times the motion is compared at, the last of them the end
    history    what is compared
    closed     times (n_t,) -> what is compared, (n_t, n_y); None: two tight runs with the methods of `pair` that agree
    bounds     of the error, the loosest first; published: bounds, outputs and end are in the library's own text of this mechanism
    relative   the error is the largest relative one, entry by entry; else the library's, see `error`
    methods    of ours
    """

    name: str
    title: str
    systems: Mapping[str, Callable[[], System]]
    end: float
    history: History
    outputs: int = 400
    closed: Callable[[np.ndarray], np.ndarray] | None = None
    pair: tuple[str, str] = ("dop853", "taylor")
    bounds: tuple[float, ...] = (LOOSE, TIGHT)
    published: bool = False
    relative: bool = False
    methods: tuple[str, ...] = _METHODS

    @property
    def times(self) -> np.ndarray:
        """(n_t,) s"""
        return self.end * np.arange(1, self.outputs + 1) / self.outputs

    def formulations(self) -> list[Formulation]:
        """Derived; raises SymdynError where one does not fit."""
        result = []
        for name, make in self.systems.items():
            made, skipped = SystemUnderTest(self.name, {"": make()}, self.end).formulated([name])
            if skipped:
                raise SymdynError(str(skipped[0]))
            result += made
        return result

    def error(self, values: np.ndarray, exact: np.ndarray) -> float:
        """The library's: differences relative to the exact value, or to THRESHOLD if that is larger, as root mean square over
        all variables and times; values, exact (n_t, n_y)."""
        with np.errstate(all="ignore"):
            if self.relative:
                return float(np.max(np.abs((values - exact) / exact)))
            return float(np.sqrt(np.mean(((values - exact) / np.maximum(np.abs(exact), THRESHOLD)) ** 2)))

    def reference(self, first: Formulation) -> tuple[np.ndarray, str]:
        """Reference, (n_t, n_y), and a sentence on how it was made."""
        times = self.times
        if self.closed is not None:
            return self.closed(times), f"extended precision, {_precise()['digits']} digits" if self.relative else "closed form"
        runs = [first.module.simulate(np.r_[0.0, times], method=method, rtol=_REFERENCE_RTOL) for method in self.pair]
        for run, method in zip(runs, self.pair, strict=True):
            if not run.success:
                raise SymdynError(f"{self.name}: the reference with {method} stopped: {run.message}")
        one, other = (self.history(first, times, run.x[1:]) for run in runs)
        return one, (f"{self.pair[0]} at {_REFERENCE_RTOL:g}; {self.pair[1]} at {_REFERENCE_RTOL:g} is off by "
                     f"{self.error(other, one):.1e}")


# -- what is compared


def point(body: str, place: tuple[float, float, float], axes: str) -> History:
    """The coordinates of a point of a body, n-frame, m."""

    def history(formulation: Formulation, t: np.ndarray, x: np.ndarray) -> np.ndarray:
        module, system = formulation.module, formulation.system
        assert system is not None
        k = [b.name for b in system.check().bodies].index(body)
        frames = module.evaluate("frames", t, x, module.default_parameters, np.zeros(0)).reshape(len(x), -1, 12)[:, k]
        result = frames[:, :3] + frames[:, 3:].reshape(-1, 3, 3) @ np.array(place)
        return result[:, ["xyz".index(axis) for axis in axes]]

    return history


def _top(formulation: Formulation, t: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Position (m) and velocity (m/s) of B0 of the windows, from the angle of the first upright."""
    sizes = formulation.module.metadata.sizes
    theta, rate = x[:, 0], x[:, sizes.q]
    return np.transpose([np.sin(theta), np.cos(theta), rate * np.cos(theta), -rate * np.sin(theta)])


def _q(formulation: Formulation, t: np.ndarray, x: np.ndarray) -> np.ndarray:
    return x[:, :formulation.module.metadata.sizes.q]


# -- closed forms


def level_pendulum(t: np.ndarray) -> np.ndarray:
    """x, y (n_t, 2) of a point 1 m from its pivot that starts at rest at (-1, 0): sin(theta/2) = -k sn(K + w t), k^2 = 1/2."""
    m = 0.5
    K = ellipk(m)
    sn, *_ = ellipj((K + math.sqrt(_GRAVITY) * t) % (4 * K), m)
    half = np.arcsin(-math.sqrt(m) * sn)
    return np.transpose([np.sin(2 * half), -np.cos(2 * half)])


def windows(n: int) -> Callable[[np.ndarray], np.ndarray]:
    """x, y (m), their rates (m/s), (n_t, 4), of B0 of n windows: theta_ddot = w^2 sin theta from theta = 0 with 1 rad/s, so that
    theta = pi + 2 am(c t/2 - K, 4 w^2/c^2), c^2 = 1 + 4 w^2."""
    square = 4 * _GRAVITY * ((n + 1) / 2 + n) / ((n + 1) / 3 + n)
    c, m = math.sqrt(1 + square), square / (1 + square)

    def history(t: np.ndarray) -> np.ndarray:
        sn, cn, dn, _ = ellipj(c * t / 2 - ellipk(m), m)
        x, y, rate = -2 * sn * cn, 2 * sn**2 - 1, c * dn
        return np.transpose([x, y, rate * y, -rate * x])

    return history


def _andrews(t: np.ndarray) -> np.ndarray:
    return np.array([_precise()["q"]], dtype=float)


def _precise() -> Mapping[str, Any]:
    """The stored end of Andrews' motion. Raises SymdynError where it is not there."""
    precise = known("andrews_squeezer")
    if precise is None:
        raise SymdynError("the motion of andrews_squeezer with more digits is not there; install symdyn again")
    return precise


# -- the mechanisms


def _level() -> System:
    system = get("pendulum")
    system.initial = {**dict.fromkeys(system.initial, -math.pi / 2)}
    return system


def _case_windows(n: int, end: float, published: bool, methods: tuple[str, ...]) -> Case:
    return Case(f"A02({n})", f"{n} four-bar windows, {end:g} s: position and velocity of B0",
                {"augmented": lambda: get("n_four_bar", n=n)}, end, _top, closed=windows(n), published=published,
                methods=methods)


CASES = {case.name: case for case in (
    Case("A01", "simple pendulum, 2000 s: position of the mass",
         {"embedding": _level, "augmented": lambda: get("pendulum_absolute")}, 2000.0, lambda f, t, x: (
             point("bob", (0, -1, 0), "xy") if f.name == "embedding" else _q)(f, t, x),
         outputs=4000, closed=level_pendulum, published=True),
    _case_windows(2, 10.0, False, _METHODS),
    _case_windows(40, 20.0, True, ("dop853", "bs54")),  # what the others need takes minutes to compile
    Case("A03", "Andrews' squeezing mechanism, 0.05 s: position of F",
         {"augmented": lambda: get("andrews_squeezer"), "absolute": lambda: get("andrews_squeezer")}, 0.05,
         point("K2", (0, 0, 0), "xy")),
    Case("A03 q", "Andrews' squeezing mechanism: coordinates at 0.03 s", {"augmented": lambda: get("andrews_squeezer")}, 0.03,
         _q, outputs=1, closed=_andrews, bounds=(1e-6, 1e-10), relative=True),
    Case("A04", "rectangular Bricard mechanism, 10 s: position of P3", {"augmented": lambda: get("bricard")}, 10.0,
         point("rod2", (0, -1, 0), "xyz"), pair=("dop853", "bs54")),
    Case("A05", "stiff flyball governor, 10 s: height s of the slider", {"embedding": lambda: get("flyball_governor")}, 10.0,
         point("slider", (0, 0, 0), "z"), pair=("dop853", "radau")),
)}
