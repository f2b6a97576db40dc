"""Rounding errors of generated code against 30 digits: lost digits beyond what the condition of the problem costs."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from symdyn.errors import ArgumentError, CompileError, SymdynError
from symdyn.pipeline import function_tape
from symdyn.runtime.compiler import Compiler, _installed, _probe, find_compiler
from symdyn.stress.record import DEGRADE, FAIL, NotApplicable, Row, within
from symdyn.stress.subject import EPS, Subject, evaluated
from symdyn.stress.yardstick import conditions, exact, terms

# Not looked at: what is no number of the state's own.
LEFT_OUT = ("length", "C_scale")
# What is solved for: its errors go with the condition of the system that is solved.
SOLVED = ("rhs", "lam", "reactions", "power", "position_correction", "velocity_correction")
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
    units = subject.module.metadata["units"]
    angles = [k for k, s in enumerate(symbols.coordinates) if units.get(s.name) == "rad" and s not in symbols.reach]
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


def functions(subject: Subject) -> list[str]:
    """The functions that are looked at, those of the user's outputs included."""
    return [name for name in subject.everything if name not in LEFT_OUT
            and any(function_tape(subject.equations, name).running)]


def rounding(subject: Subject, short: bool) -> Iterator[Row]:
    """Every function at random and adversarial states, by every compiler and backend, against 30 digits."""
    names = functions(subject)
    if not names:
        raise NotApplicable("nothing depends on the state")
    operations = sum(function_tape(subject.equations, name).operations for name in names)
    n = FEW if short else int(np.clip(WORK / max(operations, 1), FEW, STATES))
    where = states(subject, n)
    found = {name: Measured(subject, name, where) for name in names}
    reference: dict[str, np.ndarray] = {}
    for label, unit in _builds(subject, names, short):
        if isinstance(unit, str):
            yield Row("rounding", subject.name, label, None, None, "", FAIL, unit)
            continue
        same, worst, name_of, refused = bool(reference), -np.inf, "", 0
        for name in names:
            values = evaluated(unit.evaluator(name), where.t, where.x, subject.params, where.inputs, where.ud)
            if name in reference:
                same &= bool(np.array_equal(values, reference[name], equal_nan=True))
            reference.setdefault(name, values)
            digits, n_refused = found[name].excess(values)
            refused += n_refused
            if digits > worst:
                worst, name_of = digits, name
        if worst == -np.inf:
            raise NotApplicable("no state at which the functions are defined")
        yield judged("rounding", subject.name, f"{label}: {len(names)} functions at {n} states, half of them adversarial, "
                     f"{refused} "
                     f"values refused where 32 digits have one; worst {name_of}" + ("; the same bits as the first" if same else
                                                                                    ""),
                     worst, found[name_of], evaluated(unit.evaluator(name_of), where.t, where.x, subject.params, where.inputs,
                                                      where.ud))
        if refused:
            yield _refusals(subject, label, found, refused)


def judged(check: str, system: str, done: str, worst: float, measured: Measured, values: np.ndarray) -> Row:
    """The row of digits that are lost beyond what the condition costs; within that of plain numbers it is said so."""
    origin = ("decimal digits lost beyond log10(condition of inputs and of what is solved, scaled) + log10(longest chain of "
              "operations), each of which may round once")
    if worst > 0 and measured.excess(values, False)[0] <= 0:
        return Row(check, system, done, worst, 0.0, origin, DEGRADE, "more digits are lost than the scaled condition costs, but "
                   "no more than that of the matrix in plain numbers: it is near a position of lost rank, or entries of very "
                   "different size meet in one joint")
    return within(check, system, done, worst, 0.0, origin, "no more digits are lost than the problem itself costs",
                  "digits are lost that the problem does not cost")


def _refusals(subject: Subject, label: str, found: dict[str, Any], refused: int) -> Row:
    """Values that were refused: right where the system that is solved has no digits left."""
    least = min(m.least_refused for m in found.values())
    return Row("refused states", subject.name, f"{label}: {refused} values refused; condition there from {least:.2g}", 1 / least
               if least > 0 else np.inf, 1e-8, "a pivot that vanishes to half of the digits", DEGRADE if least > 1e8 else FAIL,
               "only states are refused whose equations are singular to half of the digits" if least > 1e8 else
               "states are refused whose equations are well-conditioned")


class Measured:
    """A function's values with 32 digits at states, and how far rounding may carry values away from them."""

    def __init__(self, subject: Subject, name: str, where: States, params: np.ndarray | None = None) -> None:
        rows = exact(subject, name, where.t, where.x, where.inputs, where.ud, params)
        p = subject.params if params is None else params
        self.known = np.array([row is not None for row in rows])
        self.exact = rows
        self.chain = max(1, function_tape(subject.equations, name).longest_chain())
        rng = np.random.default_rng(3)
        base = subject.evaluate(name, where.t, where.x, p, where.inputs, where.ud)

        def changed(values: np.ndarray) -> np.ndarray:
            return values * (1 + CHANGE * rng.choice([-1, 1], values.shape))

        moved = np.zeros(len(base))
        for _ in range(TRIALS):
            other = subject.evaluate(name, changed(where.t), changed(where.x), changed(p), changed(where.inputs),
                                     changed(where.ud))
            difference = np.abs(other - base).max(axis=1, initial=0.0) / CHANGE
            moved = np.fmax(moved, difference)
        self.size = np.array([max((abs(float(v)) for v in row), default=0.0) if row is not None else np.nan for row in rows])
        self.solved = conditions(subject, where.t, where.x, params) if name in SOLVED else np.ones(len(base))
        # What one rounding error of every input, and of every entry of what is solved, does to the result.
        self.one = EPS * (moved + np.fmax(self.size, terms(subject, name, where.t, where.x, where.inputs, params))
                          * np.fmax(self.solved, 1.0))
        # The same where the system is solved in plain numbers, without scales of its own.
        self.plain = self.one if name not in SOLVED else self.one * np.fmax(1.0, conditions(
            subject, where.t, where.x, params, False) / np.fmax(self.solved, 1.0))
        self.least_refused = np.inf

    def excess(self, values: np.ndarray, scaled: bool = True) -> tuple[float, int]:
        """The most digits lost beyond what is due, and how many states were refused that have a value."""
        worst, refused, one = -np.inf, 0, self.one if scaled else self.plain
        for k in np.flatnonzero(self.known):
            row = self.exact[k]
            assert row is not None
            if not np.isfinite(self.size[k]) or self.size[k] > 1e290 or not row:
                continue
            if not np.isfinite(values[k]).all():
                refused += 1
                self.least_refused = min(self.least_refused, float(self.solved[k]))
                continue
            error = max(abs(float(e - float(v))) for e, v in zip(row, values[k], strict=True))
            if error > SMALLEST and one[k] > 0:
                worst = max(worst, float(np.log10(error / (one[k] * self.chain))))
            elif error > SMALLEST:
                worst = np.inf
            else:
                worst = max(worst, -16.0)
        return worst, refused


def compilers() -> list[Compiler]:
    """The usual compiler, and a clang or the one of the package ziglang beside it where there is one."""
    usual = find_compiler()
    if usual is None:
        return []
    found = [usual]
    path, package = os.environ.get("PATH"), _installed("ziglang")
    candidates = [("gcc",), ("clang",), *([(str(Path(package).with_name("zig")), "cc")] if package else [])]
    for command in candidates:
        if shutil.which(command[0]):
            other = _probe(command, path)
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


