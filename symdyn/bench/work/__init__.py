"""Work against error: what a motion costs at every accuracy, by formulation, method and tolerance (`symdyn bench`, `sd.bench`).

    cases, bodies, closed_forms   the mechanisms of --all, and how a name becomes what is measured
    system_under_test             its formulations, and errors of motions in any coordinates
    start                         where motions begin, and whether anything moves
    reference, converged, store   what errors are measured by: closed forms, runs with more digits, runs that agree
    methods, asked                what can be requested, checked
    measure, against              one row of ours, and of another program
    plan, timing                  all rows in their order, and passes over them for their times
    benchmark, resume, carried    the run that goes on where it was stopped, the result, rows kept for later runs
    table, picture, page          how it is shown
    command                       `symdyn bench`
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from symdyn.errors import ArgumentError
from symdyn.runtime.paths import as_path

if TYPE_CHECKING:
    from symdyn.bench.work.benchmark import Benchmark


def bench(system: Any, formulations: Sequence[str] | None = None, methods: Sequence[str] | None = None,
          tolerances: Sequence[float] | None = None, steps: Sequence[float] | None = None, end: float | None = None,
          repeats: int = 5, against: Sequence[str] = (), budget: float | None = None, folder: Any = None,
          progress: bool = False, at: Sequence[float] = (), per_decade: int = 1) -> Benchmark:
    """Measure what the motion of a mechanism costs at every accuracy.

    system         a System, equations such as those of sd.embedding, or a name of the catalogue, such as "double_pendulum" or
                   "n_link_pendulum(5)", or of the list of `symdyn bench --all`
    formulations   some of "embedding", "recursive", "augmented", "absolute", "absolute:angles", and where the system can be had
                   with Euler parameters also "embedding:parameters" and so on; default: all that the mechanism has
    methods        compiled ones, SciPy's, and "auto", as for `simulate`; default: all compiled ones, without a compiler SciPy's
    tolerances     relative and absolute ones of a step; default: 1e-3 to 1e-15
    steps          s, for methods with steps of one length; besides the tolerances; default: none
    end            s; default: the system's duration; the motion begins at t = 0 in the system's initial state, or the nearest
                   one that fulfils its constraints; a motion that stands still is reported
    repeats        timed runs of a row, of which the least time is compared; of very short ones up to eight times as many
    against        other programs to compare with: "scipy", "cvode", "ida", "heyoka", "casadi", "pinocchio", "mujoco", "exudyn",
                   or "all" of these
    budget         s after which no further run is begun; derivation, compilation and the reference count, which is given a third
                   to two thirds of it, but a run or a compilation that has begun is brought to its end. Other programs have
                   processes of their own then, on Linux; preparing counts, and is ended, and reported, where it takes too long
                   of what is left
    folder         where results are written, after every run; what an unfinished run left there is gone on with, and timed again
                   at the end if there is time for that, else the rows report it; rows that are not requested stay in the file for
                   a later run
    progress       show a bar (needs tqdm)
    at             times besides the end at which errors are of interest, s; runs that end there are timed alone
    per_decade     tolerances to a decade, 1 to 10; more than one begin at 0.1, and determine the least time below an error more
                   sharply

    Raises ArgumentError that lists everything that is wrong with what is requested; SymdynError if nothing can be measured.

    >>> found = sd.bench("pendulum", ["embedding"], methods=["dop853"], tolerances=[1e-6], end=1.0, repeats=1)
    >>> [(row.method, row.tolerance) for row in found.rows]
    [('dop853', 1e-06)]
    """
    from symdyn.bench.work.asked import checked
    from symdyn.bench.work.benchmark import run
    from symdyn.bench.work.cases import taken
    from symdyn.bench.work.command import FILES
    from symdyn.bench.work.resume import check_writable

    if end is not None and (isinstance(end, bool) or not isinstance(end, (int, float))):
        raise ArgumentError(f"the end is {end!r}; pass a time, s")
    tested = taken(system, end)
    asked = checked([tested], formulations, methods, tolerances, steps, repeats, against, budget, at,
                    per_decade)
    place = None if folder is None else as_path(folder, "of the folder", "generated/bench/arm")
    if place is not None:
        check_writable(place, FILES)
    result = run(tested, asked, place, progress)
    if folder is not None:
        result.save(folder)
    return result
