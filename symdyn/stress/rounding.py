"""Rounding errors of generated code against 30 digits: lost digits beyond what the condition of the problem costs."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from symdyn.errors import ArgumentError, CompileError, SymdynError
from symdyn.formulation.equations import Symbols
from symdyn.functions.tapes import function_tape
from symdyn.runtime.building.compiler import Compiler, find_compiler, package_path, probe
from symdyn.stress.coded import SMALLEST, Coded, imbalance
from symdyn.stress.finding import Aside, Finding, first_order_row, judged, rejections, set_aside
from symdyn.stress.record import FAIL, NotApplicable, Row
from symdyn.stress.reference import (
    CORRECTIONS,
    conditions,
    exact,
    halves,
    largest,
    redundant,
    smoothed,
    solved,
    terms,
    together,
    weights,
)
from symdyn.stress.statements import Statements, emitted
from symdyn.stress.system_under_test import EPS, SystemUnderTest, evaluated
from symdyn.turning import in_radians

# Functions that are not checked, as they are no numbers of the state's own.
LEFT_OUT = ("length", "C_scale")
# Quantities that are zero on the constraints are evaluated off them, too: at this distance, of the usual size.
NEARBY, ASIDE = ("C", "C_dot", *CORRECTIONS), 1e-3
# States, fewer of long equations (so many operations at 32 digits altogether) and in the short form.
STATES, WORK, FEW = 1000, 1.5e6, 24
# Relative changes that conditions are estimated by, and how many.
CHANGE, TRIALS = 2.0**-30, 8
# Number of singular configurations that are examined more closely, and distances from them.
LANDMARKS, DISTANCES = 3, (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8)


@dataclass(frozen=True)
class States:
    """Arguments of functions, row by row; the last so many of them were sought close to positions of lost rank."""

    t: np.ndarray
    x: np.ndarray
    inputs: np.ndarray
    ud: np.ndarray
    closer: int = 0


def states(tested: SystemUnderTest, n: int, seed: int = 1) -> States:
    """Random states, half of them adversarial: right angles and folded ones, angles of many turns, tiny and huge speeds,
    denormal numbers; with constraints on them."""
    rng = np.random.default_rng(seed)
    symbols, x0 = tested.symbols, tested.start
    n_q, n_u = len(symbols.coordinates), len(symbols.speeds)
    reach = _reach(symbols)
    x = x0 + rng.uniform(-1, 1, (n, len(x0))) * reach
    angles = _angles(tested)
    for k in range(n // 2):
        kind = k % 6
        if kind == 0 and angles:
            right = rng.choice([0.0, np.pi / 2, -np.pi / 2, np.pi], len(angles))
            x[k, angles] = right + rng.choice([0, 1e-9, -1e-5], len(angles))
        elif kind == 1 and angles:
            x[k, angles] *= 10.0 ** rng.uniform(2, 6)
        elif kind == 2:
            x[k, n_q:n_q + n_u] *= 10.0 ** rng.uniform(2, 6)
        elif kind == 3:
            x[k, n_q:n_q + n_u] *= 1e-160
        elif kind == 4:
            x[k, n_q:] = rng.choice([0.0, 5e-324, -1e-310], len(x0) - n_q)
        else:
            x[k] *= 10.0 ** rng.uniform(-8, 0, len(x0))
    if tested.constrained or tested.module.metadata.unit_groups:
        x = _consistent(tested, x, x0)
    n_in = len(symbols.inputs)
    return States(rng.uniform(0, 1, n), x, rng.uniform(-1, 1, (n, n_in)), rng.uniform(-1, 1, (n, n_u)))


def _consistent(tested: SystemUnderTest, x: np.ndarray, x0: np.ndarray) -> np.ndarray:
    """States on the constraints, from these as guesses; where there is none nearby the start with other speeds."""
    from symdyn.runtime.integrating.stabilization import Projector

    project = Projector(tested.module, tested.params)
    n_q = project.n_q
    rows = x.copy()
    for k, row in enumerate(x):
        guess = row if k % 4 else np.concatenate([x0[:n_q] + (row[:n_q] - x0[:n_q]) * 1e-3, row[n_q:]])
        try:
            rows[k] = project(0.0, guess)
        except SymdynError:
            rows[k] = x0
        if np.abs(rows[k]).max() > 1e9:
            rows[k] = x0
    return rows


def off_constraints(tested: SystemUnderTest, where: States) -> States:
    """The same states, every other one off the constraints by a thousandth of what coordinates and speeds usually are."""
    symbols, x = tested.symbols, where.x.copy()
    x[1::2] += ASIDE * np.random.default_rng(2).uniform(-1, 1, x[1::2].shape) * _reach(symbols)
    return replace(where, x=x)


def towards_lost_rank(tested: SystemUnderTest, where: States) -> States:
    """The same states and, where some of them lie next to a singular configuration, more around these at smaller distances."""
    near = np.flatnonzero(smoothed(tested, "rhs", where.t, where.x))[:LANDMARKS]
    if not len(near):
        return where
    k = np.tile(near, len(DISTANCES))
    sides = np.random.default_rng(4).uniform(-1, 1, where.x[k].shape) * _reach(tested.symbols)
    x = _consistent(tested, where.x[k] + np.repeat(DISTANCES, len(near))[:, None] * sides, tested.start)
    t, x, inputs, ud = (np.concatenate([old, more]) for old, more in (
        (where.t, where.t[k]), (where.x, x), (where.inputs, where.inputs[k]), (where.ud, where.ud[k])))
    return States(t, x, inputs, ud, len(k))


def _reach(symbols: Symbols) -> np.ndarray:
    """Usual sizes of coordinates, speeds and states, (n_x,)."""
    return np.array([float(symbols.reach.get(s, 1)) for s in (*symbols.coordinates, *symbols.speeds, *symbols.states)])


def functions(tested: SystemUnderTest) -> list[str]:
    """The functions that are looked at, those of the user's outputs included."""
    return [name for name in tested.everything if name not in LEFT_OUT
            and any(function_tape(tested.equations, name).running)]


def rounding(tested: SystemUnderTest, short: bool) -> Iterator[Row]:
    """Every function at random and adversarial states, by every compiler and backend, against 32 digits.

    Two bounds: what the condition of the problem costs, which shows whether the equations are solved as well as they can be; and,
    of each result, what rounding every operation once can do, which shows whether the code computes these equations at all, also
    where the condition says nothing, next to lost rank.
    """
    names = functions(tested)
    if not names:
        raise NotApplicable("nothing depends on the state")
    operations = sum(function_tape(tested.equations, name).operations for name in names)
    n = FEW if short else int(np.clip(WORK / max(operations, 1), FEW, STATES))
    where = towards_lost_rank(tested, states(tested, n))
    # Off the constraints, those that depend on others contradict them.
    near = off_constraints(tested, where) if tested.constrained and not redundant(tested, where.t, where.x) else where
    statements = emitted(tested, names)
    measured = [Measured(tested, name, near if name in NEARBY else where, None, statements[name]) for name in names]
    reference: dict[str, np.ndarray] = {}
    every: list[Finding] = []
    for label, unit in _builds(tested, names, short):
        if isinstance(unit, str):
            yield Row("rounding", tested.name, label, None, None, "", FAIL, unit)
            continue
        same, result = bool(reference), []
        for one in measured:
            values = one.run(unit.evaluator(one.name))
            if one.name in reference:
                same &= bool(np.array_equal(values, reference[one.name], equal_nan=True))
            reference.setdefault(one.name, values)
            result.append(one.compared(values, "numpy" if label == "NumPy" else "c"))
        if all(f.digits == -np.inf for f in result):
            raise NotApplicable("no state at which the functions are defined")
        rejected = sum(f.rejected for f in result)
        yield from first_order_row(tested, label, result)
        done = (f"{label}: {len(names)} functions at {len(where.x)} states, half of them adversarial, {rejected} values rejected "
                "where 32 digits have one" + ("; the same bits as the first" if same else ""))
        yield judged("rounding", tested.name, done, result)
        if rejected:
            yield rejections(tested, label, result, rejected)
        every += result
    yield from set_aside(tested, every)


def _resolved(tested: SystemUnderTest, x: np.ndarray) -> np.ndarray:
    """Sizes that the accuracy of entries of states is relative to, (n, n_x): themselves, but angles the largest of them, because
    they are added along a mechanism."""
    angles, sizes = _angles(tested), x.copy()
    if angles:
        sizes[:, angles] = np.abs(x[:, angles]).max(axis=1, keepdims=True)
    return sizes


def _angles(tested: SystemUnderTest) -> list[int]:
    """Places of the coordinates that are angles."""
    units, symbols = tested.module.metadata.units, tested.symbols
    return [k for k, s in enumerate(symbols.coordinates) if in_radians(units.get(s.name)) and s not in symbols.reach]


class Measured:
    """A function's values with 32 digits at states, and how far rounding may carry values away from them.

    one, plain   (n, size), what one rounding of every input and of every entry of what is solved does to each entry; plain: with
                 a system that is solved without scales of its own
    condition    (n,), of what is solved, scaled; 1 where nothing is
    coded        with the statements of generated code: what they give but for rounding
    """

    def __init__(self, tested: SystemUnderTest, name: str, where: States, params: np.ndarray | None = None,
                 statements: Sequence[Statements] = ()) -> None:
        self.name, self.where = name, where
        p = tested.params if params is None else params
        self.chain = max(1, function_tape(tested.equations, name).longest_chain())
        rng = np.random.default_rng(3)
        base = tested.evaluate(name, where.t, where.x, p, where.inputs, where.ud)

        def changed(values: np.ndarray, sizes: np.ndarray | None = None) -> np.ndarray:
            return values + CHANGE * rng.choice([-1, 1], values.shape) * (values if sizes is None else sizes)

        moved, known = np.zeros(base.shape), _resolved(tested, where.x)
        for _ in range(TRIALS):
            other = tested.evaluate(name, changed(where.t), changed(where.x, known), changed(p), changed(where.inputs),
                                    changed(where.ud))
            moved = np.fmax(moved, np.abs(other - base) / CHANGE)
        self.values, self.rest = halves(exact(tested, name, where.t, where.x, where.inputs, where.ud, params), base.shape[1])
        self.condition = (conditions(tested, where.t, where.x, params, gradients=False) if solved(tested, name)
                          else np.ones(len(base)))
        labels = together(tested, name, base.shape[1])
        factors = weights(tested, name, where.t, where.x, base.shape[1], params)
        sizes = np.fmax(np.abs(self.values), terms(tested, name, where.t, where.x, where.inputs, params))
        amplified = np.fmax(self.condition, 1.0)[:, None]
        with np.errstate(invalid="ignore"):  # of conditions that are infinite: set aside
            self.one = EPS * (largest(moved, labels, factors) + largest(sizes, labels, factors) * amplified)
            self.plain = self.one if not solved(tested, name) else self.one * np.fmax(1.0, conditions(
                tested, where.t, where.x, params, False, False)[:, None] / amplified)
        # No bound holds where a relative change by rounding makes the matrix singular.
        self.singular = ~(self.condition * EPS * self.chain < 1)
        self.smoothed = smoothed(tested, name, where.t, where.x, params) & ~self.singular
        rows = np.column_stack([where.t, where.x, where.inputs, where.ud])
        self.coded = Coded(tested, statements, rows, (labels, factors), (self.values, self.rest), params) if statements else None
        self._tested = tested

    def run(self, evaluator: Any) -> np.ndarray:
        """The function of generated code at the states, (n, size)."""
        where = self.where
        return evaluated(evaluator, where.t, where.x, self._tested.params, where.inputs, where.ud)

    def compared(self, values: np.ndarray, backend: str = "c") -> Finding:
        """Values of generated code (n, size) against these."""
        usable = np.isfinite(self.values).all(axis=1) & (values.shape[1] > 0)
        usable &= np.abs(self.values).max(axis=1, initial=0.0) <= 1 / SMALLEST
        rejected = usable & ~np.isfinite(values).all(axis=1)
        usable &= ~rejected
        with np.errstate(invalid="ignore"):
            errors = np.where(usable[:, None], np.abs((self.values - values) + self.rest), 0.0)

        def excess(one: np.ndarray) -> np.ndarray:
            with np.errstate(all="ignore"):
                digits = np.log10(errors / (one * self.chain))
            return np.where(errors > SMALLEST, digits, -16.0).max(axis=1, initial=-16.0)

        scaled = excess(self.one)
        regular = usable & ~(self.singular | self.smoothed)
        # Conditions change within the distance that they are estimated by, close to lost rank.
        apart = regular & (np.arange(len(values)) < len(values) - self.where.closer)
        beyond, known = np.full(len(values), -np.inf), np.ones(len(values), dtype=bool)
        if self.coded is not None:
            beyond, known = self.coded.beyond(values, backend), self.coded.known

        def aside(states: np.ndarray) -> Aside:
            lost = states & (scaled > 0)
            noise = np.zeros(len(values), dtype=bool) if self.coded is None else ~(self.coded.divisors < 1)
            return Aside(int(lost.sum()), scaled[lost].max(initial=-np.inf), self.condition[lost].min(initial=np.inf),
                         beyond[states & known].max(initial=-np.inf), int((states & noise).sum()),
                         self._imbalance(values, states & ~noise & usable, backend))

        return Finding(self.name, scaled[apart].max(initial=-np.inf), excess(self.plain)[apart].max(initial=-np.inf),
                       int(rejected.sum()), self.condition[rejected].min(initial=np.inf), aside(usable & self.smoothed),
                       aside(usable & self.singular), beyond[regular & known].max(initial=-np.inf), int((regular & ~known).sum()))

    def _imbalance(self, values: np.ndarray, states: np.ndarray, backend: str) -> float:
        """Digits by which accelerations miss their equations beyond what is due, at those of the states where they have no bound
        themselves."""
        tested, where = self._tested, self.where
        if self.coded is None or self.name != "rhs" or not tested.has("mass_matrix"):
            return -np.inf
        n_q, n_u = len(tested.symbols.coordinates), len(tested.symbols.speeds)
        states = states & ~np.isfinite(self.coded.bound(backend)[:, n_q:n_q + n_u]).all(axis=1)
        rows = np.column_stack([where.t, where.x, where.inputs, where.ud])[states]
        return float(imbalance(tested, rows, values[states, n_q:n_q + n_u], backend).max(initial=-np.inf))


def compilers() -> list[Compiler]:
    """The usual compiler, and a clang or the one of the package ziglang next to it where there is one."""
    usual = find_compiler()
    if usual is None:
        return []
    result = [usual]
    path, package = os.environ.get("PATH"), package_path("ziglang")
    candidates = [("gcc",), ("clang",), *([(str(Path(package).with_name("zig")), "cc")] if package else [])]
    for command in candidates:
        if shutil.which(command[0]):
            other = probe(command, path)
            if isinstance(other, Compiler) and other.kind not in [c.kind for c in result]:
                result.append(other)
    return result


def _builds(tested: SystemUnderTest, names: list[str], short: bool) -> Iterator[tuple[str, Any]]:
    """Programs that run the functions: name and unit, or what the compiler said."""
    for compiler in compilers():
        levels = ("-O0",) if short else ("-O0", "-O2", "-O3")
        if compiler.kind not in ("gcc", "clang", "zig"):
            levels = ("",)
        for level in levels[-1:] if compiler.kind == "zig" else levels:
            # An earlier level of the same command is replaced.
            words = tuple(w for w in compiler.command if not (level and w in ("-O0", "-O1", "-O2", "-O3")))
            label = f"C, {compiler.kind} {level}".rstrip()
            try:
                yield label, tested.library(names, "c", replace(compiler, command=(*words, level) if level else words))
            except (CompileError, ArgumentError) as error:
                yield label, str(error)
    yield "NumPy", tested.library(names, "numpy")


