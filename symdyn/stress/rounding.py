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
from symdyn.pipeline import function_tape
from symdyn.runtime.compiler import Compiler, find_compiler, package_path, probe
from symdyn.stress.record import DEGRADE, FAIL, PASS, NotApplicable, Row, within
from symdyn.stress.subject import EPS, Subject, evaluated
from symdyn.stress.yardstick import CORRECTIONS, conditions, exact, largest, redundant, smoothed, solved, terms, together, weights

# Not looked at: what is no number of the state's own.
LEFT_OUT = ("length", "C_scale")
# What is zero on the constraints is looked at beside them, too: this far, of the usual size.
BESIDE, ASIDE = ("C", "C_dot", *CORRECTIONS), 1e-3
# States, fewer of long equations (so many operations at 32 digits altogether) and in the short form.
STATES, WORK, FEW = 1000, 1.5e6, 24
# Relative changes that conditions are estimated by, and how many.
CHANGE, TRIALS = 2.0**-30, 8
# Below this numbers lose digits by themselves.
SMALLEST = 1e-290


@dataclass(frozen=True)
class States:
    """Arguments of functions, row by row."""

    t: np.ndarray
    x: np.ndarray
    inputs: np.ndarray
    ud: np.ndarray


def states(subject: Subject, n: int, seed: int = 1) -> States:
    """Random states, half of them adversarial: right angles and folded ones, angles of many turns, tiny and huge speeds,
    denormal numbers; with constraints on them."""
    rng = np.random.default_rng(seed)
    symbols, x0 = subject.symbols, subject.start
    n_q, n_u = len(symbols.coordinates), len(symbols.speeds)
    groups = (symbols.coordinates, symbols.speeds, symbols.states)
    reach = np.array([float(symbols.reach.get(s, 1)) for group in groups for s in group])
    x = x0 + rng.uniform(-1, 1, (n, len(x0))) * reach
    angles = _angles(subject)
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
    if subject.constrained or subject.module.metadata.get("unit_groups"):
        x = _consistent(subject, x, x0)
    n_in = len(symbols.inputs)
    return States(rng.uniform(0, 1, n), x, rng.uniform(-1, 1, (n, n_in)), rng.uniform(-1, 1, (n, n_u)))


def _consistent(subject: Subject, x: np.ndarray, x0: np.ndarray) -> np.ndarray:
    """States on the constraints, from these as guesses; where there is none nearby the start with other speeds."""
    from symdyn.runtime.stabilization import Projector

    project = Projector(subject.module, subject.params)
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


def beside(subject: Subject, where: States) -> States:
    """The same states, every other one off the constraints by a thousandth of what coordinates and speeds usually are."""
    symbols, x = subject.symbols, where.x.copy()
    reach = np.array([float(symbols.reach.get(s, 1)) for group in (symbols.coordinates, symbols.speeds, symbols.states)
                      for s in group])
    x[1::2] += ASIDE * np.random.default_rng(2).uniform(-1, 1, x[1::2].shape) * reach
    return replace(where, x=x)


def functions(subject: Subject) -> list[str]:
    """The functions that are looked at, those of the user's outputs included."""
    return [name for name in subject.everything if name not in LEFT_OUT
            and any(function_tape(subject.equations, name).running)]


def rounding(subject: Subject, short: bool) -> Iterator[Row]:
    """Every function at random and adversarial states, by every compiler and backend, against 32 digits."""
    names = functions(subject)
    if not names:
        raise NotApplicable("nothing depends on the state")
    operations = sum(function_tape(subject.equations, name).operations for name in names)
    n = FEW if short else int(np.clip(WORK / max(operations, 1), FEW, STATES))
    where = states(subject, n)
    # Constraints that depend on others contradict them beside.
    near = beside(subject, where) if subject.constrained and not redundant(subject, where.t, where.x) else where
    measured = [Measured(subject, name, near if name in BESIDE else where) for name in names]
    reference: dict[str, np.ndarray] = {}
    every: list[Finding] = []
    for label, unit in _builds(subject, names, short):
        if isinstance(unit, str):
            yield Row("rounding", subject.name, label, None, None, "", FAIL, unit)
            continue
        same, found = bool(reference), []
        for one in measured:
            values = evaluated(unit.evaluator(one.name), one.where.t, one.where.x, subject.params, one.where.inputs, one.where.ud)
            if one.name in reference:
                same &= bool(np.array_equal(values, reference[one.name], equal_nan=True))
            reference.setdefault(one.name, values)
            found.append(one.compared(values))
        if all(f.digits == -np.inf for f in found):
            raise NotApplicable("no state at which the functions are defined")
        refused = sum(f.refused for f in found)
        yield judged("rounding", subject.name, f"{label}: {len(names)} functions at {n} states, half of them adversarial, "
                     f"{refused} values refused where 32 digits have one" + ("; the same bits as the first" if same else ""),
                     found)
        if refused:
            yield _refusals(subject, label, found, refused)
        every += found
    yield from _set_aside(subject, every)


@dataclass(frozen=True)
class Finding:
    """What came of a function's values: the most decimal digits lost beyond what is due (plain: with a system that is solved in
    plain numbers), how many states were refused and the least condition there; of states that are set aside, next to lost rank
    or singular to the last digit, how many have lost more than that, the most digits, and the least condition."""

    name: str
    digits: float
    plain: float
    refused: int
    least_refused: float
    smoothed: int
    most_smoothed: float
    singular: int
    least_singular: float

    @property
    def verdict(self) -> str:
        return PASS if self.digits <= 0 else DEGRADE if self.plain <= 0 else FAIL


def judged(check: str, system: str, done: str, found: Sequence[Finding]) -> Row:
    """The row of digits that functions lose beyond what the condition costs: every function is judged by itself, and the worst
    verdict counts. Within the condition of plain numbers it is said so."""
    origin = ("decimal digits lost beyond log10(condition of inputs and of what is solved, scaled) + log10(longest chain of "
              "operations), each of which may round once")
    verdict = max((f.verdict for f in found), key=(PASS, DEGRADE, FAIL).index)
    alike = [f for f in found if f.verdict == verdict]
    worst = max(alike, key=lambda f: f.digits)
    named = ", ".join(f.name for f in alike) if verdict != PASS else worst.name
    if verdict == DEGRADE:
        return Row(check, system, f"{done}; beyond it {named}", worst.digits, 0.0, origin, DEGRADE, "more digits are lost than "
                   "the scaled condition costs, but no more than that of the matrix in plain numbers: inertias of very different "
                   "size meet in one body or joint, and the small ones are what is left of sums")
    place = "nearest to it" if verdict == PASS else "beyond it"
    return within(check, system, f"{done}; {place} {named}", worst.digits, 0.0, origin,
                  "no more digits are lost than the problem itself costs", "digits are lost that the problem does not cost")


def _refusals(subject: Subject, label: str, found: Sequence[Finding], refused: int) -> Row:
    """Values that were refused: right where the system that is solved has no digits left."""
    least = min(f.least_refused for f in found)
    return Row("refused states", subject.name, f"{label}: {refused} values refused; condition there from {least:.2g}", 1 / least
               if least > 0 else np.inf, 1e-8, "a pivot that vanishes to half of the digits", DEGRADE if least > 1e8 else FAIL,
               "only states are refused whose equations are singular to half of the digits" if least > 1e8 else
               "states are refused whose equations are well-conditioned")


def _set_aside(subject: Subject, found: Sequence[Finding]) -> Iterator[Row]:
    """Rows of states that no bound is known for: what is computed there, and why."""
    near = [f for f in found if f.smoothed]
    if near:
        names = ", ".join(dict.fromkeys(f.name for f in near))
        yield Row("lost rank", subject.name, f"{names} at {max(f.smoothed for f in near)} of the states, which lie next to a "
                  "position where constraints lose rank: decimal digits lost beyond what is due",
                  max(f.most_smoothed for f in near), None, "", DEGRADE, "the exact multipliers and accelerations grow without "
                  "bound towards such a position; they are smoothed there, so that motions pass it, and only the motion's energy "
                  "and branch tell whether it passes rightly")
    singular = [f for f in found if f.singular]
    if singular:
        names = ", ".join(dict.fromkeys(f.name for f in singular))
        yield Row("singular states", subject.name, f"{names} at {max(f.singular for f in singular)} of the states: condition of "
                  "what is solved, from", min(f.least_singular for f in singular), None, "", DEGRADE, "the mass matrix is "
                  "singular to the last digit, as at gimbal lock: accelerations have no digits there, and a motion that comes "
                  "there stops and names it")


def _resolved(subject: Subject, x: np.ndarray) -> np.ndarray:
    """What entries of states are known relative to, (n, n_x): themselves, but angles of many turns the largest of them, because
    angles are added along a mechanism."""
    angles, sizes = _angles(subject), x.copy()
    if angles:
        most = np.abs(x[:, angles]).max(axis=1, keepdims=True)
        sizes[:, angles] = np.where(most > 2 * np.pi, most, x[:, angles])
    return sizes


def _angles(subject: Subject) -> list[int]:
    """Places of the coordinates that are angles."""
    units, symbols = subject.module.metadata["units"], subject.symbols
    return [k for k, s in enumerate(symbols.coordinates) if units.get(s.name) == "rad" and s not in symbols.reach]


class Measured:
    """A function's values with 32 digits at states, and how far rounding may carry values away from them.

    one, plain   (n, size), what one rounding of every input and of every entry of what is solved does to each entry; plain: with
                 a system that is solved without scales of its own
    condition    (n,), of what is solved, scaled; 1 where nothing is
    """

    def __init__(self, subject: Subject, name: str, where: States, params: np.ndarray | None = None) -> None:
        self.name, self.where = name, where
        self.exact = exact(subject, name, where.t, where.x, where.inputs, where.ud, params)
        p = subject.params if params is None else params
        self.chain = max(1, function_tape(subject.equations, name).longest_chain())
        rng = np.random.default_rng(3)
        base = subject.evaluate(name, where.t, where.x, p, where.inputs, where.ud)

        def changed(values: np.ndarray, sizes: np.ndarray | None = None) -> np.ndarray:
            return values + CHANGE * rng.choice([-1, 1], values.shape) * (values if sizes is None else sizes)

        moved, known = np.zeros(base.shape), _resolved(subject, where.x)
        for _ in range(TRIALS):
            other = subject.evaluate(name, changed(where.t), changed(where.x, known), changed(p), changed(where.inputs),
                                     changed(where.ud))
            moved = np.fmax(moved, np.abs(other - base) / CHANGE)
        self.values = np.array([[float(v) for v in row] if row is not None else [np.nan] * base.shape[1] for row in self.exact])
        self.condition = (conditions(subject, where.t, where.x, params, gradients=False) if solved(subject, name)
                          else np.ones(len(base)))
        labels = together(subject, name, base.shape[1])
        factors = weights(subject, name, where.t, where.x, base.shape[1], params)
        sizes = np.fmax(np.abs(self.values), terms(subject, name, where.t, where.x, where.inputs, params))
        amplified = np.fmax(self.condition, 1.0)[:, None]
        with np.errstate(invalid="ignore"):  # of conditions that are infinite: set aside
            self.one = EPS * (largest(moved, labels, factors) + largest(sizes, labels, factors) * amplified)
            self.plain = self.one if not solved(subject, name) else self.one * np.fmax(1.0, conditions(
                subject, where.t, where.x, params, False, False)[:, None] / amplified)
        # No bound holds where a relative change by rounding makes the matrix singular.
        self.singular = ~(self.condition * EPS * self.chain < 1)
        self.smoothed = smoothed(subject, name, where.t, where.x, params) & ~self.singular

    def compared(self, values: np.ndarray) -> Finding:
        """Values of generated code (n, size) against these."""
        errors = np.zeros(values.shape)
        usable = np.array([row is not None and len(row) > 0 for row in self.exact]) & np.isfinite(self.values).all(axis=1)
        usable &= np.abs(self.values).max(axis=1, initial=0.0) <= 1 / SMALLEST
        refused = usable & ~np.isfinite(values).all(axis=1)
        usable &= ~refused
        for k in np.flatnonzero(usable):
            errors[k] = [abs(float(e - float(v))) for e, v in zip(self.exact[k] or (), values[k], strict=True)]

        def excess(one: np.ndarray) -> np.ndarray:
            with np.errstate(all="ignore"):
                digits = np.log10(errors / (one * self.chain))
            return np.where(errors > SMALLEST, digits, -16.0).max(axis=1, initial=-16.0)

        scaled = excess(self.one)
        aside = usable & (self.singular | self.smoothed) & (scaled > 0)
        usable &= ~(self.singular | self.smoothed)
        near, lost = aside & self.smoothed, aside & self.singular
        return Finding(self.name, scaled[usable].max(initial=-np.inf), excess(self.plain)[usable].max(initial=-np.inf),
                       int(refused.sum()), self.condition[refused].min(initial=np.inf), int(near.sum()),
                       scaled[near].max(initial=-np.inf), int(lost.sum()), self.condition[lost].min(initial=np.inf))


def compilers() -> list[Compiler]:
    """The usual compiler, and a clang or the one of the package ziglang beside it where there is one."""
    usual = find_compiler()
    if usual is None:
        return []
    found = [usual]
    path, package = os.environ.get("PATH"), package_path("ziglang")
    candidates = [("gcc",), ("clang",), *([(str(Path(package).with_name("zig")), "cc")] if package else [])]
    for command in candidates:
        if shutil.which(command[0]):
            other = probe(command, path)
            if isinstance(other, Compiler) and other.kind not in [c.kind for c in found]:
                found.append(other)
    return found


def _builds(subject: Subject, names: list[str], short: bool) -> Iterator[tuple[str, Any]]:
    """What the functions are run by: name and unit, or what the compiler said."""
    for compiler in compilers():
        levels = ("-O0",) if short else ("-O0", "-O2", "-O3")
        if compiler.kind not in ("gcc", "clang", "zig"):
            levels = ("",)
        for level in levels[-1:] if compiler.kind == "zig" else levels:
            # An earlier level of the same command is replaced.
            words = tuple(w for w in compiler.command if not (level and w in ("-O0", "-O1", "-O2", "-O3")))
            label = f"C, {compiler.kind} {level}".rstrip()
            try:
                yield label, subject.unit(names, "c", replace(compiler, command=(*words, level) if level else words))
            except (CompileError, ArgumentError) as error:
                yield label, str(error)
    yield "NumPy", subject.unit(names, "numpy")


