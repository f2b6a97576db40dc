"""Operations of the inverse dynamics of a six-joint arm with spherical wrist and dense inertias, compared with published ones."""

from __future__ import annotations

from symdyn.formulation.algebra import TapeAlgebra, leaves_of
from symdyn.formulation.trees.quantities import TreeQuantities
from symdyn.formulation.trees.tree import build
from symdyn.systems import get
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import Tape

# Multiplications and additions of the best published generated code for a 6R arm with spherical wrist, ten inertial
# parameters of every link: M. Schappler's library of serial robots (SchapplM/robsynth-serroblib on GitHub), model
# S6RRRRRR10V2, invdynJ_fixb_snew_vp2 (Newton-Euler, optimized by Maple's tryhard).
PUBLISHED = (388, 304)


def counts(grouped: bool) -> tuple[int, int]:
    """Multiplications and additions for the PUMA 560, the fewest over frames; grouped: in base parameters."""
    model = get("puma560", general=True).check()
    result = []
    for aligned in (False, True):
        recorder = Recorder()
        tree = build(model, TapeAlgebra(recorder, leaves_of(model, recorder)), aligned, grouped)
        count = Tape.of(recorder, tau=TreeQuantities(tree).inverse_dynamics()).count()
        result.append((count["mul"], count["add"]))
    return min(result, key=sum)


def misses() -> list[str]:
    """Counts that exceed the published ones, in words."""
    return [f"{ours} {what} > {bound}" for ours, bound, what in zip(counts(False), PUBLISHED, ("mul", "add"), strict=True)
            if ours > bound]


def line() -> str:
    """The counts in words, with the verdict."""
    dense, grouped = counts(False), counts(True)
    verdict = "; ".join(misses())
    return (f"puma560, dense inertias, inverse dynamics: {dense[0]} mul + {dense[1]} add; in base parameters {grouped[0]} mul + "
            f"{grouped[1]} add; published {PUBLISHED[0]} mul + {PUBLISHED[1]} add  {f'MISSED: {verdict}' if verdict else 'MET'}")
