"""How one quantity varies over an ensemble: listed, spaced evenly, or distributed; read from plain values."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

# Random numbers stay inside (0, 1), where every distribution has a finite value.
SMALLEST = 2.0**-53


@dataclass(frozen=True)
class Axis:
    """One quantity.

    values     what it takes one after the other, (n,); one value: it does not vary; None: it has a distribution only
    quantile   the values of a distribution at probabilities, (n,) -> (n,)
    told       the same as plain values, to compare one ensemble with another
    """

    values: np.ndarray | None
    quantile: Callable[[np.ndarray], np.ndarray]
    told: Any

    @property
    def varies(self) -> bool:
        return self.values is None or len(self.values) > 1


def listed(values: np.ndarray, told: Any) -> Axis:
    """One of several values, each as probable as the others."""
    return Axis(values, lambda p: values[np.minimum((p * len(values)).astype(int), len(values) - 1)], told)


# What a distribution takes, and which values it has at probabilities.
DISTRIBUTIONS: dict[str, tuple[tuple[str, ...], str]] = {
    "uniform": (("from", "to"), "from < to"),
    "loguniform": (("from", "to"), "0 < from < to"),
    "normal": (("mean", "std"), "std > 0"),
    "truncated_normal": (("mean", "std", "from", "to"), "std > 0, from < to"),
    "lognormal": (("median", "sigma"), "median > 0, sigma > 0"),
    "triangular": (("from", "mode", "to"), "from <= mode <= to, from < to"),
}


def _quantile(name: str, a: Mapping[str, float]) -> Callable[[np.ndarray], np.ndarray]:
    from scipy.special import ndtr, ndtri

    if name == "uniform":
        return lambda p: a["from"] + (a["to"] - a["from"]) * p
    if name == "loguniform":
        return lambda p: a["from"] * (a["to"] / a["from"]) ** p
    if name == "normal":
        return lambda p: a["mean"] + a["std"] * ndtri(p)
    if name == "lognormal":
        return lambda p: a["median"] * np.exp(a["sigma"] * ndtri(p))
    if name == "truncated_normal":
        low, high = (ndtr((a[end] - a["mean"]) / a["std"]) for end in ("from", "to"))
        return lambda p: np.clip(a["mean"] + a["std"] * ndtri(low + (high - low) * p), a["from"], a["to"])
    width, left = a["to"] - a["from"], a["mode"] - a["from"]
    return lambda p: np.where(p * width < left, a["from"] + np.sqrt(p * width * left),
                              a["to"] - np.sqrt((1 - p) * width * (width - left)))


def _fits(name: str, a: Mapping[str, float]) -> bool:
    if "std" in a and not a["std"] > 0:
        return False
    if "from" in a and not a["from"] < a["to"]:
        return False
    if name == "loguniform":
        return a["from"] > 0
    if name == "lognormal":
        return a["median"] > 0 and a["sigma"] > 0
    return name != "triangular" or a["from"] <= a["mode"] <= a["to"]


def read_axis(value: Any, where: str, faults: list[str]) -> Axis | None:
    """The axis that a value stands for; what is wrong with it is added to the faults.

    A number; a list or array of numbers (which may hold values that are not finite: those samples fail and are reported);
    {from, to, count} for evenly spaced values, {from, to} for a uniform distribution; {distribution, ...}, see DISTRIBUTIONS.
    """
    if isinstance(value, Mapping):
        return _from_mapping(value, where, faults)
    if isinstance(value, (str, bool)) or (isinstance(value, (list, tuple)) and any(isinstance(v, (str, bool)) for v in value)):
        array = None
    else:
        try:
            array = np.array(value, dtype=float)
        except (TypeError, ValueError):
            array = None
    if array is None or array.ndim > 1 or array.size == 0:
        faults.append(f"{where}: give a number, a list of numbers, {{from, to, count}} or {{distribution, ...}}, "
                      f"found {value!r:.80}")
        return None
    array = array.reshape(-1)
    return listed(array, array.tolist() if len(array) <= 64 else array)


def _from_mapping(value: Mapping[str, Any], where: str, faults: list[str]) -> Axis | None:
    name = value.get("distribution", "uniform")
    if "count" in value and "distribution" not in value:
        wanted: tuple[str, ...] = ("from", "to", "count")
    elif isinstance(name, str) and name in DISTRIBUTIONS:
        wanted = DISTRIBUTIONS[name][0]
    else:
        near = difflib.get_close_matches(str(name), DISTRIBUTIONS, 1)
        faults.append(f"{where}.distribution: there is no {name!r}" + (f", did you mean {near[0]}?" if near else
                      f"; there are {', '.join(DISTRIBUTIONS)}"))
        return None
    before = len(faults)
    for key in value:
        if key not in wanted and key != "distribution":
            near = difflib.get_close_matches(key, wanted, 1)
            faults.append(f"{where}.{key}: not known here" + (f", did you mean {near[0]}?" if near else
                          f"; known are {', '.join(wanted)}"))
    numbers: dict[str, float] = {}
    for key in wanted:
        if key not in value:
            faults.append(f"{where}.{key}: is missing")
        elif isinstance(value[key], (bool, str)) or not isinstance(value[key], (int, float, np.number)) \
                or not np.isfinite(value[key]):
            faults.append(f"{where}.{key}: must be a finite number, found {value[key]!r}")
        else:
            numbers[key] = float(value[key])
    if len(numbers) < len(wanted):
        return None
    told = {"distribution": name, **numbers}
    if "count" in wanted:
        if numbers["count"] < 2 or numbers["count"] != int(numbers["count"]):
            faults.append(f"{where}.count: must be a whole number from 2 on, found {value['count']!r}")
            return None
        if len(faults) > before:
            return None
        values = np.linspace(numbers["from"], numbers["to"], int(numbers["count"]))
        return listed(values, numbers)
    if not _fits(name, numbers):
        faults.append(f"{where}: {name} needs {DISTRIBUTIONS[name][1]}, found "
                      + ", ".join(f"{k} = {v:.6g}" for k, v in numbers.items()))
    return None if len(faults) > before else Axis(None, _quantile(name, numbers), told)
