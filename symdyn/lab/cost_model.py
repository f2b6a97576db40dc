"""`symdyn bench costs`: measures the candidates of many systems and fits the constants of symdyn.choice.

Several cost models are compared by what they lose where they were not fitted: each family of systems (all lengths of a
chain, all random trees, ...) is predicted with constants from the others. A loss is the measured time of the candidate that
is predicted to be the fastest, over that of the fastest, minus 1.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.optimize import nnls

from symdyn.choice import (
    COSTS,
    HEADING,
    Candidate,
    Derived,
    derived_in_frames,
    factorizing_instructions,
    solving_instructions,
    terms,
)
from symdyn.errors import ArgumentError
from symdyn.formulation.trees.embedding import embed
from symdyn.formulation.trees.recursive import recursive
from symdyn.lab.peers.models import turbine_tree
from symdyn.lab.random_tree import random_tree
from symdyn.model.system import System
from symdyn.systems import get
from symdyn.timing.side_by_side import times_side_by_side

# A candidate within this of the fastest is as good as the fastest.
GOOD = 0.05
# Name -> what is added up, each with a constant: terms of symdyn.choice and of `further_terms`.
MODELS = {
    "operations": ("operations", "sines", "angles"),
    "operations, longest chain": ("operations", "divisions", "chain", "sines", "angles"),
    "fused operations, longest chain": ("instructions", "divisions", "chain", "sines", "angles"),
    "fused operations, longest chain, decoding": ("instructions", "beyond", "divisions", "chain", "sines", "angles"),
    "cycles": ("cycles", "sines", "angles"),
    "cycles, decoding": ("cycles", "beyond", "sines", "angles"),
}


def systems() -> dict[str, Callable[[], System]]:
    """The systems that are measured, by name; what stands before the bracket is the family."""
    result: dict[str, Callable[[], System]] = {}
    for n in (2, 3, 4, 5, 6, 8, 10, 12, 16, 20):
        result[f"n_link_pendulum({n})"] = partial(get, "n_link_pendulum", n=n)
    for n in (2, 3, 4, 5, 6, 7, 8, 10, 12, 16):
        result[f"spatial_chain({n})"] = partial(get, "spatial_chain", n=n)
    for convention in ("standard", "modified"):
        for general in (False, True):
            name = f"puma560({convention}{', general' if general else ''})"
            result[name] = partial(get, "puma560", convention=convention, general=general)
    for body_rates in (False, True):
        result[f"turbine_tree({'body rates' if body_rates else 'Euler angles'})"] = partial(turbine_tree, body_rates)
    for name in ("cart_pole", "two_link_arm", "three_link_arm", "prismatic_chain"):
        result[name] = partial(get, name)
    for seed, n in enumerate(range(3, 13), start=1):
        result[f"random_tree({n}, seed {seed})"] = partial(random_tree, n, seed)
    return result


@dataclass(frozen=True)
class Sample:
    """A candidate of a system with the terms of its tape and the time that was measured, ns."""

    system: str
    candidate: Candidate
    terms: Mapping[str, float]
    ns: float

    @property
    def family(self) -> str:
        return self.system.partition("(")[0]


@dataclass(frozen=True)
class Regret:
    """Loss by taking the candidates that are predicted to be the fastest.

    good    systems whose predicted fastest is within GOOD of the fastest, of `systems`
    worst   the largest loss and its system; mean: over all systems
    error   of the predicted times, root of the mean square, relative
    """

    good: int
    systems: int
    worst: float
    where: str
    mean: float
    error: float

    @classmethod
    def of(cls, samples: Sequence[Sample], predicted: Sequence[float]) -> Regret:
        """The losses of predictions, one for each sample."""
        losses: dict[str, float] = {}
        for system in dict.fromkeys(s.system for s in samples):
            own = [k for k, s in enumerate(samples) if s.system == system]
            taken = min(own, key=lambda k: predicted[k])
            losses[system] = samples[taken].ns / min(samples[k].ns for k in own) - 1
        where = max(losses, key=lambda system: losses[system])
        error = np.sqrt(np.mean([(p / s.ns - 1) ** 2 for s, p in zip(samples, predicted, strict=True)]))
        return cls(sum(loss <= GOOD for loss in losses.values()), len(losses), losses[where], where,
                   float(np.mean(list(losses.values()))), float(error))

    def __str__(self) -> str:
        return (f"{self.good} of {self.systems} within {GOOD:.0%} of the fastest, worst loss {self.worst:.1%} "
                f"({self.where}), mean loss {self.mean:.2%}, error of the times {self.error:.0%}")


def measure(name: str, system: System, repeats: int) -> list[Sample]:
    """Count and time all candidates of a system, also those that a choice would not derive."""
    model = system.check()
    derived = [*derived_in_frames(embed, model), *derived_in_frames(recursive, model)]
    times = times_side_by_side([d.equations for d in derived], repeats)
    solved = {"speeds": len(model.speeds), "solving": factorizing_instructions(model) + solving_instructions(model)}
    return [Sample(name, d.candidate(t), {**terms(d.tape, d.run), **further_terms(d), **solved}, t * 1e9)
            for d, t in zip(derived, times, strict=True)]


def forming(samples: Sequence[Sample]) -> list[float]:
    """Instructions of forces and mass matrix, without factorizing and solving, over those of the recursion in the same frames,
    of systems with more than two speeds."""
    by = {(s.system, s.candidate.formulation, s.candidate.frames): s.terms for s in samples if s.terms["speeds"] > 2}
    return [(result["instructions"] - result["solving"]) / by[system, "recursive", frames]["instructions"]
            for (system, formulation, frames), result in by.items() if formulation == "embedding"]


def further_terms(derived: Derived) -> dict[str, float]:
    """Terms of simpler models: operations without sines and cosines, the same with each product and the sum that takes it
    counted once, divisions, longest chain."""
    counts = derived.tape.count()
    return {"operations": derived.tape.operations - counts.get("trig", 0), "instructions": derived.run.instructions,
            "divisions": counts.get("div", 0), "chain": derived.tape.longest_chain()}


def fit(samples: Sequence[Sample], names: Sequence[str]) -> dict[str, float]:
    """Nanoseconds for each term, none negative, with the least squares of the relative errors."""
    rows = np.array([[s.terms[name] / s.ns for name in names] for s in samples], dtype=float)
    return dict(zip(names, map(float, nnls(rows, np.ones(len(samples)))[0]), strict=True))


def predict(sample: Sample, costs: Mapping[str, float]) -> float:
    """Nanoseconds that the constants give for a sample."""
    return sum(cost * sample.terms[name] for name, cost in costs.items())


def cross_validated(samples: Sequence[Sample], names: Sequence[str]) -> Regret:
    """Regret where each family is predicted with constants from all others."""
    costs = {family: fit([s for s in samples if s.family != family], names) for family in {s.family for s in samples}}
    return Regret.of(samples, [predict(s, costs[s.family]) for s in samples])


def print_system(samples: Sequence[Sample]) -> None:
    """The candidates of one system, what is chosen, and the loss by it."""
    chosen = min(samples, key=lambda s: s.candidate.predicted)
    loss = chosen.ns / min(s.ns for s in samples) - 1
    print(f"{samples[0].system}: loss {loss:.1%}")
    for sample in samples:
        print(f"  {replace(sample.candidate, chosen=sample is chosen)}", flush=True)


def run(repeats: int = 40) -> int:
    """Measure, print every system, what each model loses, its constants, and what the constants in use lose; returns 0."""
    if repeats < 1:
        raise ArgumentError(f"{repeats} repeats were asked for; pass 1 or more")
    samples: list[Sample] = []
    print(f"  {HEADING}")
    for name, make in systems().items():
        result = measure(name, make(), repeats)
        print_system(result)
        samples += result
    ratios = forming(samples)
    print(f"\nforces and mass matrix take {min(ratios):.2f} to {max(ratios):.2f} of the instructions of the recursion")
    print("\nlosses where not fitted, and constants fitted to all systems, ns:")
    for title, names in MODELS.items():
        constants = ", ".join(f"{name} {cost:.3g}" for name, cost in fit(samples, names).items())
        print(f"{title}:\n  {cross_validated(samples, names)}\n  {constants}")
    print(f"\nwith the constants in symdyn.choice, {', '.join(f'{name} {cost:.3g}' for name, cost in COSTS.items())}:\n"
          f"  {Regret.of(samples, [predict(s, COSTS) for s in samples])}")
    return 0
