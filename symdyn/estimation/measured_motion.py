"""One measured motion with its forces: what inertial parameters are identified from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from symdyn.errors import ArgumentError
from symdyn.real_numbers import real_of
from symdyn.shown import by_name, shown

if TYPE_CHECKING:
    from symdyn.given import Named, Row, States
    from symdyn.runtime.module import Module

# Order of the low-pass filter, which runs forwards and backwards.
ORDER = 4
# Kept samples per period of the cutoff frequency, and periods of it that are left out at both ends.
KEPT, LEFT_OUT = 2.0, 2.0
# Largest relative difference of steps of time for a filter.
EVEN = 1e-6


@dataclass(frozen=True)
class MeasuredMotion:
    """A measured motion with the forces that made it, row by row.

    t        (n_t,) times in increasing order, s
    q        (n_t, n_q) coordinates, in order, or by name or symbol (n_t,)
    tau      (n_t, n_u) measured forces along the speeds, N or N m, in order, or by name or symbol of the speeds; besides the
             loads that the system has. None: there are none but those, such as by inputs
    u, ud    (n_t, n_u) speeds and their rates; None: by differentiation of q, which takes a cutoff
    cutoff   Hz: coordinates pass a low-pass filter forwards and backwards and are differentiated as a cubic spline; both sides of
             the equations pass the same filter, and two samples a period of it are kept, whose errors are independent then
    inputs   (n_t, n_in), or numbers, in order, or by name or symbol; default: their initial values
    z        (n_t, n_z) extra states, where the system has some
    params   parameters of this motion alone, such as a load that was exchanged

    >>> motion = sd.MeasuredMotion(t=[0.0, 0.1], q=[[0.0], [0.1]], tau=[[1.0], [1.1]], u=[[1.0], [1.0]], ud=[[0.2], [0.3]])
    """

    t: Row
    q: States
    tau: States | None = None
    u: States | None = None
    ud: States | None = None
    cutoff: float | None = None
    inputs: States | None = None
    z: States | None = None
    params: Named[float] = field(default_factory=dict)


@dataclass(frozen=True)
class Rows:
    """A measured motion, checked: arrays with one row for each time, and the filter, None without one."""

    t: np.ndarray
    x: np.ndarray
    ud: np.ndarray
    tau: np.ndarray
    inputs: np.ndarray
    params: np.ndarray
    sos: np.ndarray | None
    step: int
    margin: int

    def thinned(self, values: np.ndarray) -> np.ndarray:
        """Values over time (n_t, ...) behind the filter, as many as it leaves."""
        return values if self.sos is None else self.kept(sosfiltfilt(self.sos, values, axis=0))

    def kept(self, values: np.ndarray) -> np.ndarray:
        """Values over time (n_t, ...) at the times that the filter leaves."""
        return values if self.sos is None else values[self.margin:len(values) - self.margin:self.step]

    @property
    def gain(self) -> float:
        """The standard deviation of white noise of deviation 1 behind the filter."""
        if self.sos is None:
            return 1.0
        pulse = np.zeros(len(self.t))
        pulse[len(pulse) // 2] = 1.0
        return float(np.sqrt(np.sum(sosfiltfilt(self.sos, pulse) ** 2)))


def rows_of(module: Module, data: Any) -> list[Rows]:
    """Measured motions, checked. Raises ArgumentError with all faults of all of them."""
    listed = [data] if isinstance(data, MeasuredMotion) else data
    if not isinstance(listed, (list, tuple)) or not listed or not all(isinstance(one, MeasuredMotion) for one in listed):
        raise ArgumentError(f"{module.name}: data is {shown(data)}; pass an sd.MeasuredMotion or a list of them")
    faults: list[str] = []
    result = [_rows(module, motion, f"motion {k + 1}", faults) for k, motion in enumerate(listed)]
    if faults:
        raise ArgumentError(f"{module.name}: {'; '.join(faults)}")
    return [one for one in result if one is not None]


def _rows(module: Module, motion: MeasuredMotion, which: str, faults: list[str]) -> Rows | None:
    metadata, before = module.metadata, len(faults)
    t = real_of(motion.t, module.name, f"t of {which} must be numbers")
    if t.ndim != 1 or len(t) < 2 or not np.isfinite(t).all() or (np.diff(t) <= 0).any():
        faults.append(f"t of {which} must be two or more finite times in increasing order")
        return None
    n = len(t)

    def table(values: Any, names: tuple[str, ...], what: str) -> np.ndarray:
        if isinstance(values, Mapping):
            entries = by_name(values)
            wrong = [f"{what} of {which} has {shown(name)}, which is none of {', '.join(names)}" for name in entries
                     if name not in names]
            wrong += [f"{what} of {which} lacks {name}" for name in names if name not in entries]
            if wrong:
                faults.extend(wrong)
                return np.zeros((n, len(names)))
            values = np.column_stack([np.broadcast_to(real_of(entries[name], module.name, f"{name} of {which} must be numbers"),
                                                      (n,)) for name in names])
        array = real_of(values, module.name, f"{what} of {which} must be numbers")
        if array.shape == (n,) and len(names) == 1:
            array = array[:, None]
        if array.shape != (n, len(names)):
            faults.append(f"{what} of {which} has the shape {array.shape}; needed is {(n, len(names))}, one row for each time")
        elif not np.isfinite(array).all():
            row, column = (int(k[0]) for k in np.nonzero(~np.isfinite(array)))
            faults.append(f"{what} of {which} has the value {array[row, column]} for {names[column]} at t = {t[row]:.6g} s; "
                          "leave out the times at which something is missing")
        else:
            return array
        return np.zeros((n, len(names)))

    q = table(motion.q, metadata.q, "q")
    tau = np.zeros((n, metadata.sizes.u)) if motion.tau is None else table(motion.tau, metadata.u, "tau")
    initial = metadata.initial_values("inputs")
    given: Any = list(initial.values()) if motion.inputs is None else motion.inputs
    if isinstance(given, Mapping):
        given = {**initial, **by_name(given)}
    elif np.shape(given) == (len(initial),) and len(initial) != n:
        given = np.broadcast_to(real_of(given, module.name, f"inputs of {which} must be numbers"), (n, len(initial)))
    inputs = table(given, metadata.inputs, "inputs") if initial else np.zeros((n, 0))
    if not isinstance(motion.params, Mapping):
        faults.append(f"params of {which} are {shown(motion.params)}; pass a dictionary from names to numbers")
    if motion.z is None and metadata.z:
        faults.append(f"{which} has no z, and the system has the extra states {', '.join(metadata.z)}; give them")
    z = np.zeros((n, 0)) if motion.z is None else table(motion.z, metadata.z, "z")
    sos, step, margin = _filter(t, motion.cutoff, which, faults)
    own = {"u": motion.u, "ud": motion.ud}
    known = {what: table(values, metadata.u, what) for what, values in own.items() if values is not None}
    missing = [what for what in own if what not in known]
    if missing and motion.cutoff is None:
        faults.append(f"{which} has no {' and no '.join(missing)}; give them, or a cutoff in Hz to differentiate q with")
    elif missing and metadata.u != tuple(f"{name}_dot" for name in metadata.q):
        faults.append(f"{which} has no {' and no '.join(missing)}, and the speeds {', '.join(metadata.u)} are not the rates of "
                      "the coordinates in their order; give u and ud")
    if len(faults) > before:
        return None
    if sos is not None and missing:
        smooth = CubicSpline(t, sosfiltfilt(sos, q, axis=0))
        q, known = smooth(t), {"u": smooth(t, 1), "ud": smooth(t, 2), **known}
    params = module.parameters(dict(motion.params))
    return Rows(t, np.hstack([q, known["u"], z]), known["ud"], tau, np.ascontiguousarray(inputs), params, sos, step, margin)


def _filter(t: np.ndarray, cutoff: Any, which: str, faults: list[str]) -> tuple[np.ndarray | None, int, int]:
    """The low-pass filter, each how manieth sample is kept, and how many are left out at the ends."""
    if cutoff is None:
        return None, 1, 0
    rate = (len(t) - 1) / (t[-1] - t[0])
    if isinstance(cutoff, bool) or not isinstance(cutoff, (int, float, np.number)) or not 0 < cutoff < rate / 2:
        faults.append(f"cutoff of {which} is {shown(cutoff)}; pass a frequency between 0 and {rate / 2:.4g} Hz, half the "
                      "sampling rate")
        return None, 1, 0
    if np.ptp(np.diff(t)) > EVEN / rate:
        faults.append(f"{which} has a cutoff, but its times are not equally spaced; a filter needs them so")
        return None, 1, 0
    step, margin = max(1, int(rate / (KEPT * cutoff))), int(LEFT_OUT * rate / cutoff)
    if len(t) <= 2 * margin + step:
        faults.append(f"{which} lasts {t[-1] - t[0]:.4g} s, too short for the cutoff {cutoff:g} Hz: {LEFT_OUT:g} periods of it "
                      "are left out at both ends")
        return None, 1, 0
    return butter(ORDER, float(cutoff), fs=rate, output="sos"), step, margin
