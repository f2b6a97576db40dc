"""Derivatives of random mechanisms and of the catalogue against differences of the tape with 60 digits.

    python -m symdyn.lab.derivatives --count 1000 --seed 0      as many random mechanisms of all kinds
    python -m symdyn.lab.derivatives --catalogue                all mechanisms of the catalogue
    python -m symdyn.lab.derivatives --only 17                  one of them
    python -m symdyn.lab.derivatives --keep FILE --seconds 600  for ten minutes; the same line again goes on with the others

The derivatives of x_dot, multipliers and inverse dynamics by x, inputs, parameters, time and accelerations are taken along a
random direction in each group, by module.jacobian, and compared with the central difference of the function's own tape.
Along Euler parameters a direction keeps their norm; where constraints are redundant it stays on them. An error is that of J v
relative to |J| |v| (Frobenius), or to the size of the function where its derivative vanishes, by the condition number of the
equations that accelerations and multipliers are solved from; it must be at most BOUND. The size of a function is that of the
terms that it adds, not of their sum: at rest forces cancel to a rounding error, 1e-14 of what each of them makes, and nothing
computed from them can be known better than to the rounding of these terms. The sizes of the terms are what the numbers that the
function takes contribute by their own size, sum |df/dd_k d_k| over its arguments d_k: the function's norm times its componentwise
condition number (Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., section 1.6; Gohberg and Koltracht, Mixed,
componentwise, and structured condition numbers, 1993). Multipliers of redundant constraints, which the
motion does not determine, have no derivatives and are left out. Derivatives of rows of states must have the bits of those of
each state.
"""

from __future__ import annotations

import argparse
import json
import sys
import time as clock
import warnings
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import mpmath
import numpy as np

from symdyn.bench.work.resume import code
from symdyn.errors import SymdynError
from symdyn.formulation.equations import Equations
from symdyn.functions.tapes import function_tape, has_function
from symdyn.lab.mechanisms import draw
from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.constraints import unique
from symdyn.systems import get, names
from symdyn.tape.evaluate import evaluate
from symdyn.tape.intrinsics import RANK

FUNCTIONS = ("rhs", "lam", "inverse_dynamics")
GROUPS = ("x", "inputs", "params", "t", "ud")
BOUND = 1e-13
DIGITS, STEP = 60, mpmath.mpf(10) ** -20
# One random mechanism in so many is compiled to C besides, of which this is measured there: long code takes long to compile.
IN_C = 20
OF_C = ("rhs", "x")


@dataclass(frozen=True)
class Point:
    """Where derivatives are taken: t (s), x (n_x,), inputs (n_in,), params (n_p,), ud (n_u,)."""

    t: float
    x: np.ndarray
    inputs: np.ndarray
    params: np.ndarray
    ud: np.ndarray

    def group(self, by: str) -> np.ndarray:
        """The numbers that a group of arguments has."""
        return np.array([self.t]) if by == "t" else np.asarray(getattr(self, by), dtype=float)


@dataclass(frozen=True)
class Result:
    """Errors of one mechanism.

    errors      "rhs by x" -> error, see above; condition: of the equations
    same_bits   whether rows of states have the bits of each state
    """

    name: str
    errors: dict[str, float]
    condition: float
    same_bits: bool
    seconds: float
    fault: str = ""

    @property
    def worst(self) -> tuple[str, float]:
        """Name of the derivative with the largest error, and the error."""
        return max(self.errors.items(), key=lambda one: one[1] if np.isfinite(one[1]) else np.inf, default=("nothing", 0.0))

    @property
    def passed(self) -> bool:
        """Whether everything is within the bound."""
        return not self.fault and self.same_bits and all(e <= BOUND for e in self.errors.values())

    def __str__(self) -> str:
        what, error = self.worst
        verdict = "passed" if self.passed else "FAILED"
        return (f"{self.name:44} {verdict}  {error:.1e} {what:26} condition {self.condition:.0e}"
                f"{'' if self.same_bits else '  ROWS DIFFER'}{f'  {self.fault}' if self.fault else ''}  {self.seconds:.1f} s")


def measure(name: str, equations: Equations, modules: Sequence[Any], point: Point, seed: int) -> Result:
    """The errors at a point of equations in NumPy and, of OF_C, in further modules of the same."""
    begun = clock.perf_counter()
    rng = np.random.default_rng(seed)
    values = _values(equations, point)
    condition = condition_of(equations, values)
    errors: dict[str, float] = {}
    same = True
    left_out = () if unique(modules[0], point.t, point.x, point.params).all() else ("lam",)
    for of in (f for f in FUNCTIONS if has_function(equations, f) and f not in left_out):
        tape = function_tape(equations, of)
        value = _exact(equations, tape, values).astype(float)
        by_group = {by: _derivative(modules[0], of, by, point, 1)[0] for by in _groups(of, point)}
        level = size_of_terms(value, [(matrix, point.group(by)) for by, matrix in by_group.items()])
        for by in by_group:
            direction = _direction(equations, modules[0], by, point, rng)
            exact = _difference(equations, tape, values, by, point, direction)
            for module in modules if (of, by) == OF_C else modules[:1]:
                result = _derivative(module, of, by, point, 1)[0]
                size = max(float(np.linalg.norm(result) * np.linalg.norm(direction)), level, 1e-30)
                error = float(np.linalg.norm(result @ direction - exact)) / (size * condition)
                errors[f"{of} by {by}"] = max(errors.get(f"{of} by {by}", 0.0), error)
                rows = _derivative(module, of, by, point, 3)
                same &= all(np.array_equal(row, result) for row in rows)
    return Result(name, errors, condition, same, clock.perf_counter() - begun)


def size_of_terms(value: np.ndarray, derivatives: Sequence[tuple[np.ndarray, np.ndarray]]) -> float:
    """The norm of a function times its componentwise condition number: of its value (n,), or of what each number contributes by
    its own size if that is more; derivatives: by groups of numbers, (n, k), with these numbers, (k,)."""
    parts = sum((np.abs(matrix) @ np.abs(numbers) for matrix, numbers in derivatives), np.zeros(len(value)))
    return max(float(np.linalg.norm(parts)), float(np.linalg.norm(value)))


def _groups(of: str, point: Point) -> list[str]:
    return [by for by in GROUPS if len(point.group(by)) and (by != "ud" or of == "inverse_dynamics")]


def _derivative(module: Any, of: str, by: str, point: Point, n: int) -> np.ndarray:
    """The matrix at n rows of the same state."""
    rows = [np.repeat(a[None], n, axis=0) for a in (point.x, point.ud)]
    ud = rows[1] if of == "inverse_dynamics" else ()
    result = module.jacobian(np.full(n, point.t), rows[0], point.params, point.inputs, [by], of, ud)
    return np.asarray(getattr(result, by))


def _values(equations: Equations, point: Point) -> dict[str, float]:
    """Leaf -> number."""
    s = equations.symbols
    named = zip((*s.coordinates, *s.speeds, *s.states, *s.inputs, *s.parameters),
                (*point.x, *point.inputs, *point.params), strict=True)
    rates = zip(s.speeds, point.ud, strict=True)
    return {**{a.name: float(v) for a, v in named}, "t": point.t, **{f"{u.name}_dot": float(v) for u, v in rates}}


def _names(equations: Equations, by: str) -> list[str]:
    s = equations.symbols
    result = {"x": [a.name for a in (*s.coordinates, *s.speeds, *s.states)], "inputs": [a.name for a in s.inputs],
              "params": [a.name for a in s.parameters], "t": ["t"], "ud": [f"{u.name}_dot" for u in s.speeds]}
    return result[by]


def _direction(equations: Equations, module: Any, by: str, point: Point, rng: np.random.Generator) -> np.ndarray:
    """A random direction, of parameters in the size of their numbers; of x one along which Euler parameters stay of unit length
    and redundant constraints hold."""
    numbers = point.group(by)
    direction = rng.normal(size=len(numbers)) * (np.abs(numbers) if by == "params" else 1.0)
    if by != "x":
        return direction
    held = np.zeros((len(equations.unit_groups), len(numbers)))
    for row, group in zip(held, equations.unit_groups, strict=True):
        at = [equations.symbols.coordinates.index(q) for q in group]
        row[at] = numbers[at]
    if equations.constraints:
        rows = np.vstack([module.jacobian(point.t, point.x, point.params, point.inputs, ["x"], of).x for of in ("C", "C_dot")])
        if np.linalg.matrix_rank(rows, RANK * np.linalg.norm(rows)) < np.count_nonzero(rows.any(axis=1)):
            held = np.vstack([held, rows])
    if len(held):
        direction -= np.linalg.pinv(held, RANK) @ (held @ direction)
    return direction


def _difference(equations: Equations, tape: Any, values: dict[str, float], by: str, point: Point,
                direction: np.ndarray) -> np.ndarray:
    """The derivative along a direction with 60 digits, rounded."""
    with mpmath.workdps(DIGITS):
        sides = []
        for sign in (1, -1):
            moved = {n: mpmath.mpf(v) + sign * STEP * mpmath.mpf(float(d))
                     for n, v, d in zip(_names(equations, by), point.group(by), direction, strict=True)}
            sides.append(_exact(equations, tape, {**values, **moved}))
        return np.asarray((sides[0] - sides[1]) / (2 * STEP), dtype=object).astype(float)


def _exact(equations: Equations, tape: Any, values: dict[str, Any]) -> np.ndarray:
    """A function with 60 digits, with Euler parameters of unit length to as many: rows may depend on each other only then."""
    with mpmath.workdps(DIGITS):
        for group in equations.unit_groups:
            length = mpmath.sqrt(sum(mpmath.mpf(values[q.name]) ** 2 for q in group))
            values = {**values, **{q.name: values[q.name] / length for q in group}}
        return np.asarray(next(iter(evaluate(tape, values, DIGITS).values())))


def condition_of(equations: Equations, values: dict[str, float]) -> float:
    """Condition number of the mass matrix or, with constraints, of the matrix that accelerations and multipliers are solved from,
    without zeros of dependent constraints."""
    M = evaluate(equations.tape("M_tilde"), values, 30)["M_tilde"].astype(float)
    if has_function(equations, "C_r"):
        C = evaluate(equations.tape("C_r"), values, 30)["C_r"].astype(float)
        M = np.block([[M, C.T], [C, np.zeros((len(C), len(C)))]])
    sizes = np.linalg.svd(M, compute_uv=False)
    kept = sizes[sizes > RANK * sizes[0]]
    return float(kept[0] / kept[-1])


def random_result(number: int, seed: int) -> Result:
    """Result of a random mechanism."""
    m = draw(number, seed)
    name = f"{number} {' '.join(m.kinds)}"
    ud = np.random.default_rng(number).normal(size=len(m.module.metadata.u))
    x = off_constraints(m.equations, m.x, np.random.default_rng(number)) if m.equations.constraints else m.x
    point = Point(m.t, x, m.inputs, m.module.parameters(m.params), ud)
    modules = [m.module if m.module.backend == "numpy" else m.equations.compile(backend="numpy")]
    if number % IN_C == 0 and find_compiler() is not None:
        modules.append(m.equations.compile(backend="c"))
    return _measured(name, m.equations, modules, point, number)


def off_constraints(equations: Equations, x: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A state near x, Euler parameters of unit length, that is not on the constraints: on them rows that are redundant depend on
    each other as far as doubles go, and not with 60 digits."""
    moved = x + 0.05 * rng.normal(size=len(x))
    for group in equations.unit_groups:
        at = [equations.symbols.coordinates.index(q) for q in group]
        moved[at] /= np.linalg.norm(moved[at])
    return moved


def catalogue_result(name: str) -> Result:
    """Result of a mechanism of the catalogue, in NumPy and in part in C, near its start."""
    system = get(name)
    equations = system.augmented() if name in names(constrained=True) else system.embedding()
    modules = [equations.compile(backend=b) for b in (("numpy", "c") if find_compiler() is not None else ("numpy",))]
    rng, s = np.random.default_rng(5), equations.symbols
    start = np.array([float(s.initial.get(a, 0)) for a in (*s.coordinates, *s.speeds, *s.states)])
    start = off_constraints(equations, start, rng)
    params = np.array([0.6 if v is None else v for v in modules[0].metadata.defaults])
    point = Point(0.3, start, rng.normal(size=len(s.inputs)), params, rng.normal(size=len(s.speeds)))
    return _measured(name, equations, modules, point, 5)


def _measured(name: str, equations: Equations, modules: Sequence[Any], point: Point, seed: int) -> Result:
    """The result; what raises an error is a fault."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return measure(name, equations, modules, point, seed)
        except SymdynError as error:
            return Result(name, {}, np.nan, True, 0.0, f"{type(error).__name__}: {error}")


def results(numbers: Sequence[int], seed: int, jobs: int) -> Iterator[Result]:
    """Results of random mechanisms, in their order."""
    one = partial(random_result, seed=seed)
    if jobs == 1:
        yield from map(one, numbers)
        return
    with ProcessPoolExecutor(jobs) as pool:
        yield from pool.map(one, numbers)


def kept(path: Path, seed: int) -> dict[int, Result]:
    """Number -> result of what a file holds of these random mechanisms, measured with the code as it is now."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    # A run that was killed may have left part of a line.
    whole = [json.loads(line) for line in lines if line.endswith("}}")]
    return {one["number"]: Result(**one["result"]) for one in whole if (one["seed"], one["code"]) == (seed, code())}


def going_on(numbers: Sequence[int], seed: int, jobs: int, path: Path) -> Iterator[Result]:
    """Results of random mechanisms: those in the file first, then the others, each written into it."""
    known = kept(path, seed)
    yield from (known[n] for n in numbers if n in known)
    left = [n for n in numbers if n not in known]
    with path.open("a", encoding="utf-8") as file:
        file.write("\n" if file.tell() else "")  # after what a run that was killed wrote of a line
        for number, result in zip(left, results(left, seed, jobs), strict=True):
            file.write(json.dumps({"seed": seed, "code": code(), "number": number, "result": asdict(result)}) + "\n")
            file.flush()
            yield result


def within(running: Iterable[Result], seconds: float) -> Iterator[Result]:
    """Results until so many seconds have passed."""
    begun = clock.perf_counter()
    for result in running:
        yield result
        if clock.perf_counter() - begun > seconds:
            return


def summary(result: Sequence[Result]) -> str:
    """Largest error of each derivative, and how many fail."""
    kinds = dict.fromkeys(kind for r in result for kind in r.errors)
    lines = [f"{kind:26} {max(r.errors[kind] for r in result if kind in r.errors):.1e} at most, in "
             f"{sum(kind in r.errors for r in result)}" for kind in sorted(kinds)]
    failed = sum(not r.passed for r in result)
    differ = sum(not r.same_bits for r in result)
    return "\n".join([*lines, f"{len(result)} mechanisms, {failed} fail, {differ} with rows that differ, "
                      f"{sum(r.seconds for r in result) / max(1, len(result)):.2f} s each"])


def main(arguments: Sequence[str] | None = None) -> int:
    """The command."""
    about = __doc__.splitlines()[0] if __doc__ else ""
    parser = argparse.ArgumentParser(prog="python -m symdyn.lab.derivatives", description=about)
    parser.add_argument("--count", type=int, default=1000, help="how many random mechanisms (default 1000)")
    parser.add_argument("--seed", type=int, default=0, help="of the random numbers (default 0)")
    parser.add_argument("--only", type=int, nargs="+", metavar="K", help="these mechanisms alone, by number")
    parser.add_argument("--catalogue", action="store_true", help="the mechanisms of the catalogue instead")
    parser.add_argument("--names", nargs="+", metavar="NAME", help="some of the catalogue")
    parser.add_argument("--jobs", type=int, default=1, help="processes (default 1)")
    parser.add_argument("--keep", type=Path, metavar="FILE", help="write every result into a file, and go on with what it holds")
    parser.add_argument("--seconds", type=float, default=np.inf, help="stop after so many (default: when all are done)")
    parser.add_argument("--quiet", action="store_true", help="print failures and the summary alone")
    options = parser.parse_args(arguments)
    of_catalogue = options.catalogue or options.names
    if of_catalogue and options.keep:
        parser.error("--keep is of random mechanisms; leave out --catalogue and --names")
    numbers = options.only or range(options.count)
    running = (map(catalogue_result, options.names or names()) if of_catalogue else
               going_on(numbers, options.seed, options.jobs, options.keep) if options.keep else
               results(numbers, options.seed, options.jobs))
    found = []
    for result in within(running, options.seconds):
        found.append(result)
        if not (options.quiet and result.passed):
            print(result, flush=True)
    print(summary(found))
    return int(not all(r.passed for r in found))


if __name__ == "__main__":
    sys.exit(main())
