"""One measured motion: times, what was measured, and what is known of its start and inputs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.real_numbers import real_of
from symdyn.shown import name_of, shown

if TYPE_CHECKING:
    from symdyn.given import Named, Row, Values
    from symdyn.runtime.module import InputValues, Module


@dataclass(frozen=True)
class Experiment:
    """Measured values over time, of one motion.

    t          (n_t,) times in increasing order, s; the motion begins at the first one
    measured   coordinates, speeds, extra states or outputs, by name or symbol -> (n_t,), or (n_t, ...) for outputs with several
               entries; NaN where a value is missing
    q, u, z    its start, as for `simulate`; what is fitted is a guess there
    inputs     as for `simulate`
    params     parameters of this experiment alone, such as a load that was exchanged, by name or symbol

    >>> experiment = sd.Experiment(t=[0.0, 0.1, 0.2], measured={"q1": [0.3, 0.28, 0.24]}, q=[0.3])
    """

    t: Row
    measured: Named[Row]
    q: Values | None = None
    u: Values | None = None
    z: Values | None = None
    inputs: InputValues | None = None
    params: Named[float] = field(default_factory=dict)


@dataclass(frozen=True)
class Measured:
    """Measured values of an experiment, checked: name -> values (n_t, ...); n: number of values that are there."""

    experiment: Experiment
    t: np.ndarray
    values: Mapping[str, np.ndarray]
    n: int


def taken(module: Module, data: Any) -> list[Measured]:
    """Experiments as they are fitted to. Raises ArgumentError with all faults of all of them."""
    listed = [data] if isinstance(data, Experiment) else data
    if not isinstance(listed, (list, tuple)) or not listed or not all(isinstance(e, Experiment) for e in listed):
        raise ArgumentError(f"{module.name}: data is {shown(data)}; pass an sd.Experiment or a list of them")
    faults: list[str] = []
    result = [_checked(module, experiment, f"experiment {k + 1}", faults) for k, experiment in enumerate(listed)]
    if faults:
        raise ArgumentError(f"{module.name}: {'; '.join(faults)}")
    return result


def _checked(module: Module, experiment: Experiment, which: str, faults: list[str]) -> Measured:
    t = real_of(experiment.t, module.name, f"t of {which} must be numbers")
    if t.ndim != 1 or len(t) < 2 or not np.isfinite(t).all() or (np.diff(t) <= 0).any():
        faults.append(f"t of {which} must be two or more finite times in increasing order")
    if not isinstance(experiment.params, Mapping):
        faults.append(f"params of {which} are {shown(experiment.params)}; pass a dictionary from names to numbers")
    shapes: dict[str, tuple[int, ...]] = {**dict.fromkeys(module.metadata.x, ()), **dict(module.metadata.outputs)}
    values: dict[str, np.ndarray] = {}
    if not isinstance(experiment.measured, Mapping) or not experiment.measured:
        faults.append(f"{which} measures nothing; pass measured={{name: values}}")
        return Measured(experiment, t, values, 0)
    for key, given in experiment.measured.items():
        name = str(name_of(key))
        if name not in shapes:
            faults.append(f"{which} measures {shown(name)}, which is neither a state nor an output; there are "
                          f"{', '.join(shapes)}")
            continue
        result = real_of(given, module.name, f"{name} of {which} must be numbers")
        if result.shape != (len(t), *shapes[name]):
            faults.append(f"{name} of {which} has the shape {result.shape}; needed is {(len(t), *shapes[name])}, one row for "
                          "each time")
        elif np.isinf(result).any():
            faults.append(f"{name} of {which} has infinite values; write NaN for those that are missing")
        elif np.isnan(result).all():
            faults.append(f"{name} of {which} has no value")
        else:
            values[name] = result
    return Measured(experiment, t, values, sum(int(np.isfinite(v).sum()) for v in values.values()))
