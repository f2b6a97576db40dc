"""Samples: which values the members of an ensemble have. Every block of them can be made by itself, at any time, anywhere."""

from __future__ import annotations

import hashlib
import math
import threading
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from symdyn.ensembles.axes import SMALLEST, Axis, read_axis
from symdyn.errors import ArgumentError
from symdyn.runtime.memory import in_bytes
from symdyn.shown import name_of, shown

if TYPE_CHECKING:
    from symdyn.given import Named, Row

    # A number, a list, or what describes a distribution or spaced values: {"from": ..., "to": ..., "count": ...}.
    SampleValue: TypeAlias = float | Row | Mapping[str, float] | Mapping[str, str | float]
    SampleValues: TypeAlias = Named[float] | Named[Row] | Named[SampleValue]

SAMPLINGS = ("paired", "grid", "random", "latin_hypercube", "sobol")
# Rounds of the network that permutes numbers; from four on it is as good as random.
ROUNDS = 6
SOBOL_LIMIT = 2**30
# Threads that draw continue sequences one at a time.
_SEQUENCES = threading.Lock()
# Bytes that all samples may take on the disk, in the results of an ensemble.
MOST = 2**40


class Samples:
    """Values of parameters, initial coordinates, speeds, extra states and inputs, by name.

    values     name or symbol -> a number; a list or array; {"from", "to", "count"}; {"from", "to"} or {"distribution": "normal",
               "mean", "std"}, also "uniform", "loguniform" (from, to), "truncated_normal" (mean, std, from, to), "lognormal"
               (median, sigma), "triangular" (from, mode, to)
    sampling   "paired": the k-th values of all lists belong together; "grid": every combination, the last varies fastest;
               "random", "latin_hypercube", "sobol": `count` samples, also of lists and spaced values.
               Default: "random" where there is a count or a distribution, else "grid"
    seed       of the last three

    A random or Sobol sample k depends on the seed and k alone: with a larger count the first ones stay. A Latin hypercube depends
    on the count as well: it has one value in each of `count` equally probable intervals of every quantity, which move with the
    count, so that more samples are another design. `block` takes memory for its own samples only, whatever the sampling.
    Raises ArgumentError with all that is wrong.

    >>> sd.Samples({"m": {"from": 1, "to": 2, "count": 3}, "l": [0.5, 1.0]}).count
    6
    """

    def __init__(self, values: SampleValues, sampling: str | None = None, count: int | None = None, seed: int = 0,
                 where: str = "samples") -> None:
        faults: list[str] = []
        axes: dict[str, Axis] = {}
        if not isinstance(values, Mapping) or not values:
            raise ArgumentError(f"{where}: give a mapping from names to values, with one name at least; found "
                                f"{shown(values, 80)}")
        for key, value in values.items():
            name = name_of(key)
            axis = read_axis(value, f"{where}.{name}", faults)
            if axis is not None:
                axes[name] = axis
        free = [n for n, a in axes.items() if a.values is None]
        if sampling is None:
            sampling = "random" if free or count is not None else "grid"
        self.names = tuple(axes)
        self.sampling = sampling
        self._axes = tuple(axes.values())
        drawn = isinstance(sampling, str) and sampling in ("random", "latin_hypercube", "sobol")
        if not isinstance(sampling, str) or sampling not in SAMPLINGS:
            faults.append(f"{where}: sampling {shown(sampling)} asked for; there are {', '.join(SAMPLINGS)}")
        elif drawn and (isinstance(count, bool) or not isinstance(count, (int, np.integer)) or count < 1):
            faults.append(f"{where}: {sampling} needs a count, a whole number from 1 on, found {shown(count)}")
        elif not drawn and free:
            faults.append(f"{where}: {sampling} needs lists or {{from, to, count}}; {', '.join(free)} "
                          f"{'have' if len(free) > 1 else 'has'} a distribution, for which there are random, latin_hypercube "
                          "and sobol")
        if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or not 0 <= seed < 2**128:
            faults.append(f"{where}: the seed must be a whole number from 0 on, below 2^128, found {shown(seed)}")
        lengths = {n: len(a.values) for n, a in axes.items() if a.values is not None and a.varies}
        if isinstance(sampling, str) and sampling == "paired" and len(set(lengths.values())) > 1:
            faults.append(f"{where}: paired values must be as many of each, found "
                          + ", ".join(f"{n}: {k}" for n, k in lengths.items()))
        if not faults and not drawn:
            result = math.prod(lengths.values()) if sampling == "grid" else max(lengths.values(), default=1)
            if count is not None and count != result:
                faults.append(f"{where}: the {sampling} has {result} samples, but the count is {count}; leave the count out")
            count = result
        taken = 0 if faults else 8 * len(axes) * int(count or 0)
        if taken > MOST:
            faults.append(f"{where}: {shown(count)} samples of {len(axes)} numbers take {in_bytes(taken)}; the most is "
                          f"{in_bytes(MOST)}: give "
                          "a smaller count")
        if not faults and sampling == "sobol" and int(count or 0) > SOBOL_LIMIT:
            faults.append(f"{where}: sobol has {SOBOL_LIMIT} points at most, found the count {count}")
        if faults:
            raise ArgumentError("\n".join(faults))
        assert count is not None
        self.count, self.seed = int(count), int(seed)
        self._sequence: tuple[Any, int] | None = None

    def block(self, first: int, stop: int) -> np.ndarray:
        """Samples first to stop - 1, (stop - first, n_names).

        >>> sd.Samples({"m": {"from": 1, "to": 2, "count": 3}, "l": [0.5, 1.0]}).block(0, 3)
        array([[1. , 0.5],
               [1. , 1. ],
               [1.5, 0.5]])
        """
        k = np.arange(first, stop)
        if self.sampling == "paired":
            columns = [_values(a)[k if a.varies else 0 * k] for a in self._axes]
        elif self.sampling == "grid":
            columns, left = [], k
            for axis in reversed(self._axes):
                columns.append(_values(axis)[left % len(_values(axis))])
                left = left // len(_values(axis))
            columns.reverse()
        else:
            drawn = iter(np.clip(self._probabilities(k), SMALLEST, 1 - SMALLEST).T)
            columns = [a.quantile(next(drawn)) if a.varies else np.full(len(k), _values(a)[0]) for a in self._axes]
        return np.column_stack(columns)

    def record(self) -> dict[str, object]:
        """Plain values that are the same for the same samples only."""
        values = {n: a.record for n, a in zip(self.names, self._axes, strict=True)}
        return {"sampling": self.sampling, "count": self.count, "seed": self.seed, "values": {
            n: hashlib.sha256(v.tobytes()).hexdigest() if isinstance(v, np.ndarray) else v for n, v in values.items()}}

    @property
    def varied(self) -> tuple[str, ...]:
        """Names of what is not the same in all samples.

        >>> sd.Samples({"m": 1.0, "l": [0.5, 1.0]}).varied
        ('l',)
        """
        return tuple(n for n, a in zip(self.names, self._axes, strict=True) if a.varies)

    def _probabilities(self, k: np.ndarray) -> np.ndarray:
        n, first = len(self.varied), int(k[0]) if len(k) else 0
        if self.sampling == "sobol" and n:
            return self._sobol(n, first, len(k))
        # Philox counts in fours of numbers: any of them is reached at once.
        generator = np.random.Philox(self.seed)
        generator.advance(first * n // 4)
        skip = first * n % 4
        drawn = np.random.Generator(generator).random(skip + len(k) * n)[skip:].reshape(len(k), n)
        if self.sampling == "random":
            return drawn
        places = np.column_stack([_permuted(k, self.count, (self.seed, d)) for d in range(n)]) if n else drawn
        return (places + drawn) / self.count

    def _sobol(self, n: int, first: int, count: int) -> np.ndarray:
        """Points of a scrambled Sobol sequence, (count, n). To skip points takes SciPy time for each, so that the sequence of the
        last call is continued where that is possible."""
        from scipy.stats import qmc

        with _SEQUENCES:
            engine, there = self._sequence or (None, 0)
            if engine is None or there > first:
                engine, there = qmc.Sobol(n, seed=self.seed), 0
            if first > there:
                engine.fast_forward(first - there)
            # The first point by itself, so that no power of two is requested.
            parts = [engine.random(m) for m in ((1, count - 1) if first == 0 and count else (count,)) if m]
            self._sequence = engine, first + count
        return np.vstack([np.zeros((0, n)), *parts])

    def __repr__(self) -> str:
        return f"<Samples: {self.count} of {', '.join(self.names)} ({self.sampling})>"


def _values(axis: Axis) -> np.ndarray:
    assert axis.values is not None
    return axis.values


def _permuted(k: np.ndarray, n: int, seed: tuple[int, int]) -> np.ndarray:
    """Where a permutation of 0 ... n - 1 sends the numbers k: a Feistel network on the next power of four, walked through until
    it is back below n. No table is needed, however large n is."""
    half = np.uint64(max(1, ((n - 1).bit_length() + 1) // 2))
    mask = (np.uint64(1) << half) - np.uint64(1)
    keys = np.random.SeedSequence(seed).generate_state(ROUNDS, np.uint64)

    def walk(x: np.ndarray) -> np.ndarray:
        left, right = x >> half, x & mask
        for key in keys:
            left, right = right, left ^ (_mixed(right + key) & mask)
        return (left << half) | right

    x = walk(k.astype(np.uint64))
    while (outside := x >= n).any():
        x[outside] = walk(x[outside])
    return x.astype(np.int64)


def _mixed(x: np.ndarray) -> np.ndarray:
    """The finalizer of SplitMix64 (Steele, Lea, Flood: Fast splittable pseudorandom number generators, 2014)."""
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))
