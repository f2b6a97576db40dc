"""Variation of one quantity over an ensemble: listed, spaced evenly, or distributed; read from plain values."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.real_numbers import NotReal, number, real
from symdyn.runtime.memory import demand
from symdyn.shown import shown

# Random numbers stay inside (0, 1), where every distribution has a finite value.
SMALLEST = 2.0**-53


@dataclass(frozen=True)
class Axis:
    """One quantity.

    values     what it takes one after the other, (n,); one value: it does not vary; None: it has a distribution only
    quantile   the values of a distribution at probabilities, (n,) -> (n,)
    record     the same as plain values, to compare one ensemble with another
    """

    values: np.ndarray | None
    quantile: Callable[[np.ndarray], np.ndarray]
    record: Any

    @property
    def varies(self) -> bool:
        return self.values is None or len(self.values) > 1


def listed(values: np.ndarray, record: Any) -> Axis:
    """One of several values, each as probable as the others."""
    return Axis(values, lambda p: values[np.minimum((p * len(values)).astype(int), len(values) - 1)], record)


# Arguments of a distribution, and their conditions.
DISTRIBUTIONS: dict[str, tuple[tuple[str, ...], str]] = {
    "uniform": (("from", "to"), "from < to"),
    "loguniform": (("from", "to"), "0 < from < to"),
    "normal": (("mean", "std"), "std > 0"),
    "truncated_normal": (("mean", "std", "from", "to"), "std > 0, from < to"),
    "lognormal": (("median", "sigma"), "median > 0, sigma > 0"),
    "triangular": (("from", "mode", "to"), "from <= mode <= to, from < to"),
}


def _quantile(name: str, a: Mapping[str, float]) -> Callable[[np.ndarray], np.ndarray]:
    from scipy.special import ndtri

    if name == "uniform":
        return lambda p: a["from"] + (a["to"] - a["from"]) * p
    if name == "loguniform":
        return lambda p: a["from"] * (a["to"] / a["from"]) ** p
    if name == "normal":
        return lambda p: a["mean"] + a["std"] * ndtri(p)
    if name == "lognormal":
        return lambda p: a["median"] * np.exp(a["sigma"] * ndtri(p))
    if name == "truncated_normal":
        low, high = ((a[end] - a["mean"]) / a["std"] for end in ("from", "to"))
        return lambda p: np.clip(a["mean"] + a["std"] * _between(low, high, p), a["from"], a["to"])
    width, left = a["to"] - a["from"], a["mode"] - a["from"]
    return lambda p: np.where(p * width < left, a["from"] + np.sqrt(p * width * left),
                              a["to"] - np.sqrt((1 - p) * width * (width - left)))


def _between(low: float, high: float, p: np.ndarray) -> np.ndarray:
    """Values of the standard normal distribution between low and high, at probabilities p within that range.

    Logarithms of the probability below and above a value keep their digits in the far tails, where the probabilities themselves
    are next to 0 or 1; each value comes from the smaller one, the upper tail as the mirror image of the lower.
    """
    from scipy.special import log_ndtr, ndtri_exp

    below = np.logaddexp(log_ndtr(low) + np.log1p(-p), log_ndtr(high) + np.log(p))
    above = np.logaddexp(log_ndtr(-low) + np.log1p(-p), log_ndtr(-high) + np.log(p))
    return np.where(below < above, ndtri_exp(below), -ndtri_exp(above))


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
    array, why = None, ""
    if not isinstance(value, bool) and not (isinstance(value, (list, tuple)) and any(isinstance(v, bool) for v in value)):
        try:
            array = np.array(real(value))
        except NotReal as error:
            why = f": {error}"
    if array is None or array.ndim > 1 or array.size == 0:
        faults.append(f"{where}: give a number, a list of numbers, {{from, to, count}} or {{distribution, ...}}, "
                      f"found {shown(value, 80)}{why}")
        return None
    array = array.reshape(-1)
    return listed(array, array.tolist() if len(array) <= 64 else array)


def _finite(value: Any) -> float | None:
    """A finite number; None for anything else."""
    try:
        result = number(value)
    except NotReal:
        return None
    return result if np.isfinite(result) and not isinstance(value, (bool, np.bool_)) else None


def _from_mapping(value: Mapping[str, Any], where: str, faults: list[str]) -> Axis | None:
    name = value.get("distribution", "uniform")
    if "count" in value and "distribution" not in value:
        wanted: tuple[str, ...] = ("from", "to", "count")
    elif isinstance(name, str) and name in DISTRIBUTIONS:
        wanted = DISTRIBUTIONS[name][0]
    else:
        near = difflib.get_close_matches(str(name), DISTRIBUTIONS, 1)
        faults.append(f"{where}.distribution: there is no {shown(name)}" + (f", did you mean {near[0]}?" if near else
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
        elif (result := _finite(value[key])) is None:
            faults.append(f"{where}.{key}: must be a finite number, found {shown(value[key])}")
        else:
            numbers[key] = result
    if len(numbers) < len(wanted):
        return None
    record = {"distribution": name, **numbers}
    if "count" in wanted:
        if numbers["count"] < 2 or numbers["count"] != int(numbers["count"]):
            faults.append(f"{where}.count: must be a whole number from 2 on, found {shown(value['count'])}")
            return None
        try:
            demand(2 * int(numbers["count"]), where, f"a list of {int(numbers['count'])} values", "give a smaller count, or a "
                   "distribution, which takes none")
        except ArgumentError as error:
            faults.append(str(error))
            return None
        if len(faults) > before:
            return None
        values = np.linspace(numbers["from"], numbers["to"], int(numbers["count"]))
        return listed(values, numbers)
    if not _fits(name, numbers):
        faults.append(f"{where}: {name} needs {DISTRIBUTIONS[name][1]}, found "
                      + ", ".join(f"{k} = {v:.6g}" for k, v in numbers.items()))
    return None if len(faults) > before else Axis(None, _quantile(name, numbers), record)
