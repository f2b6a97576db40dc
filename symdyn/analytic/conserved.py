"""Quantities that stay constant along every motion: momenta, momenta of the whole mechanism, energy or Jacobi's integral.

Candidates are momenta dT/du_k; the components of linear and angular momentum of the whole, which are w . dT/du with the speeds w
that move all bodies as one (Noether's theorem); T + V, or Jacobi's integral u . dL/du - L where motions are prescribed. Each is
w . dT/du - ..., so that its rate along the motion is its rate at any accelerations less w . r, with what the equations make zero,
r = M_tilde u_dot + k_tilde - F_tilde + C_r^T lam. Exact algebra decides whether this is zero for all states and accelerations,
and whether C_r w is zero or, for w = u, C_t, which is -C_r u where the constraints hold. Momenta of the whole are written by the
sums over the bodies, which divide by nothing, also where w has poles, such as at gimbal lock; the proof holds there by
continuity. Source: Goldstein, Poole, Safko, Classical Mechanics, 3rd ed., sections 2.6, 2.7 and 13.7.
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.analytic.lagrange import Mechanics
from symdyn.analytic.minors import solve
from symdyn.errors import SymdynError
from symdyn.exact.prove import Proof, decide, drawn_state
from symdyn.exact.shortest import written
from symdyn.kinds import flag
from symdyn.shown import shown
from symdyn.spatial.vectors import inner, vector
from symdyn.tape.evaluate import evaluate
from symdyn.tape.intrinsics import RANK
from symdyn.tape.node import Node, is_zero
from symdyn.tape.tape import Tape

if TYPE_CHECKING:
    from symdyn.formulation.equations import Equations

# Terms that a product may have in a proof of a rate, and in a power that is printed; digits of numbers that sort candidates out,
# and differences that decimal numbers of the user may make there.
BOUND, WRITTEN, DIGITS, SAME = 200_000, 2_000, 30, 1e-12
# Speeds that the motion of the whole as one may take.
MOVED = 8
AXES = "xyz"


@dataclass(frozen=True)
class Conserved:
    """A quantity that every motion keeps: its name, what it is in words, its expression, and the proof that its rate is zero."""

    name: str
    meaning: str
    expression: sp.Expr
    proof: Proof

    def __str__(self) -> str:
        return f"{self.name} = {self.expression}   ({self.meaning}; {self.proof})"


@dataclass(frozen=True, repr=False)
class ConservedQuantities:
    """Quantities that every motion conserves; a sequence of Conserved that prints as a list, and by name: found["energy"].

    cyclic   coordinates that neither T and V hold nor the loads and constraints
    notes    what changes the momenta of cyclic coordinates and the energy, coordinates that stand in loads or constraints alone,
             and what could not be decided
    undriven whether inputs are taken as zero
    """

    name: str
    found: tuple[Conserved, ...]
    cyclic: tuple[sp.Symbol, ...]
    notes: tuple[str, ...] = ()
    undriven: bool = False

    def __len__(self) -> int:
        return len(self.found)

    def __iter__(self) -> Iterator[Conserved]:
        return iter(self.found)

    def __getitem__(self, which: int | str) -> Conserved:
        if isinstance(which, int):
            return self.found[which]
        for quantity in self.found:
            if quantity.name == which:
                return quantity
        there = ", ".join(q.name for q in self.found) or "nothing"
        raise SymdynError(f"{self.name} conserves no {shown(which)}; it conserves {there}"
                          + "".join(f"; {note}" for note in self.notes))

    def __str__(self) -> str:
        motions = " with inputs at zero" if self.undriven else ""
        what = "conserved along every motion" if self.found else "nothing conserved was found"
        lines = [f"{self.name}: {what}{motions}"]
        lines += [f"  {quantity}" for quantity in self.found]
        lines += [f"  cyclic coordinates: {', '.join(map(str, self.cyclic))}"] if self.cyclic else []
        return "\n".join([*lines, *[f"  {note}" for note in self.notes]])

    def __repr__(self) -> str:
        return str(self)

    def _repr_latex_(self) -> str:
        rows = [rf"{sp.latex(sp.Symbol(q.name))} &= {sp.latex(q.expression)} && \text{{{q.meaning}}}" for q in self.found]
        rows = rows or [r"&\text{nothing conserved was found}"]
        return "$\\displaystyle \\begin{aligned}\n" + " \\\\\n".join(rows) + "\n\\end{aligned}$"


@dataclass(frozen=True)
class _Candidate:
    """value with d value / d u = M w; zeros: what else must be zero for its name; along: w is u."""

    name: str
    meaning: str
    value: Any
    w: np.ndarray
    zeros: tuple[Any, ...] = ()
    along: bool = False


def conserved(equations: Equations, undriven: bool = False) -> ConservedQuantities:
    """The conserved quantities among the candidates of this module, each proved.

    undriven   True: with all inputs zero, those of prescribed motions (sd.motions) with their rates too; motions that are
               functions of the time go on
    Raises SymdynError where loads depend on accelerations, multipliers or reactions.
    """
    flag(undriven, f"{equations.name}: undriven")
    if equations.implicit_loads:
        raise SymdynError(f"{equations.name}: conserved quantities were requested, but {', '.join(equations.implicit_loads)} "
                          "depends on accelerations or reactions, so that it is not known which power it has; leave it out")
    return _Search(Mechanics(equations), undriven).result()


class _Search:
    def __init__(self, mechanics: Mechanics, undriven: bool) -> None:
        self.m, self.equations, self.undriven = mechanics, mechanics.equations, undriven and bool(mechanics.inputs)
        self.off = dict.fromkeys(mechanics.inputs, 0) if undriven else {}
        self.symbols = self.equations.printed_leaves()
        self.units = [[self.equations.leaves[p] for p in group] for group in self.equations.unit_groups]
        self.residual = self.equations.quantity("inverse_dynamics")
        self.by_hand = "energy" not in self.equations.quantities
        self.notes: list[str] = []

    def result(self) -> ConservedQuantities:
        m = self.m
        candidates = [*self.momenta(), *self.energies()]
        kept = self.perhaps(candidates)
        whole = self.perhaps(self.of_the_whole())
        found: list[Conserved] = []
        for c in _merged(kept, whole):
            proof = self.proof(c)
            if proof.proved:
                value = written([m.at([c.value], self.off)[0]], self.symbols, unit_vectors=self.units)[0]
                if value.free_symbols:
                    found.append(Conserved(c.name, c.meaning, value, proof))
            elif not proof.refuted:
                self.notes.append(f"{c.name}: not decided, {proof.reason}")
        if not any(q.name in ("energy", "jacobi") for q in found) and not any(n.startswith("energy") for n in self.notes):
            self.notes.append(self.why_no_energy(candidates[-1]))
        cyclic = self.cyclic(candidates)
        return ConservedQuantities(self.equations.name, tuple(found), cyclic, tuple(self.notes), self.undriven)

    # -- candidates

    def momenta(self) -> list[_Candidate]:
        """dT/du, speed by speed."""
        m, n = self.m, len(self.m.u)
        names = self.equations.symbols.coordinates if m.plain else self.equations.symbols.speeds
        return [_Candidate(f"p_{names[k]}", f"momentum of {names[k]}", p, _unit(k, n)) for k, p in enumerate(m.momenta())]

    def energies(self) -> list[_Candidate]:
        """T + V or, where motions are prescribed, Jacobi's integral."""
        m = self.m
        V = 0 if self.by_hand else m.V
        u, p = vector(*m.u), m.momenta()
        jacobi = inner(u, p) - m.T + V
        same = decide(m.recorder, [(jacobi, m.T + V)], self.symbols, bound=BOUND).proved
        first = _Candidate("energy", "T" if self.by_hand else "T + V", m.T + V, u, along=True)
        return [first] if same else [_Candidate("jacobi", "Jacobi's integral, which is not T + V", jacobi, u, along=True), first]

    def of_the_whole(self) -> list[_Candidate]:
        """Linear and angular momentum about the origin, n-frame, of all bodies."""
        equations, m = self.equations, self.m
        if "J" not in equations.quantities or "positions" not in equations.quantities or not equations.bodies:
            return []
        planar = equations.planar
        J = equations.quantity("J")
        positions = equations.quantity("positions")
        p = m.momenta()
        sums = equations.quantity("momentum") if "momentum" in equations.quantities else None
        result = []
        for turning in (False, True):
            for axis in ((2,) if planar and turning else range(2 if planar else 3)):
                e = [int(k == axis) for k in range(3)]
                target = []
                for x, y, z in positions:
                    v = [e[1] * z - e[2] * y, e[2] * x - e[0] * z, e[0] * y - e[1] * x] if turning else e
                    omega = e if turning else [0, 0, 0]
                    target += [*v[:2], omega[2]] if planar else [*v, *omega]
                w = self._speeds(J, vector(*target))
                if w is not None:
                    what = "angular momentum about" if turning else "linear momentum along"
                    where = "z" if planar and turning else AXES[axis]
                    gaps = [a - b for a, b in zip(J @ w, target, strict=True)]
                    value = inner(w, p)
                    if sums is not None:
                        total = sums[(2 if planar else axis) if turning else 3 + axis]
                        if _close(*self._numbers([total, value])):
                            gaps, value = [*gaps, total - value], total
                    result.append(_Candidate(f"{'H' if turning else 'P'}_{where}", f"{what} {where}", value, w, tuple(gaps)))
        return result

    def _speeds(self, J: np.ndarray, target: np.ndarray) -> np.ndarray | None:
        """w with J w = target, by rows with orthonormal columns, such as rotations, which divide by nothing, or by those that say
        it in the simplest way; None if there is none."""
        numbers = self._numbers([*J.ravel(), *target])
        A, b = np.array(numbers[:J.size]).reshape(J.shape).astype(float), np.array(numbers[J.size:]).astype(float)
        if not J.size or not np.any(b):
            return None
        w = np.linalg.lstsq(A, b, rcond=None)[0]
        if np.abs(A @ w - b).max() > 1e-9 * (1 + np.abs(w).max()):
            return None
        columns = [k for k in range(len(w)) if abs(w[k]) > 1e-9]
        if len(columns) > MOVED:
            return None
        if all(abs(w[k] - round(w[k])) < 1e-9 for k in columns):
            return np.array([round(e) for e in w], dtype=object)
        direct = self._by_rotations(J, A, target, columns)
        if direct is not None:
            return direct
        chosen: list[int] = []
        for row in sorted(range(len(J)), key=lambda i: (sum(isinstance(e, Node) for e in J[i, columns]), i)):
            if np.linalg.matrix_rank(A[np.ix_([*chosen, row], columns)], tol=RANK) > len(chosen):
                chosen.append(row)
        if len(chosen) < len(columns):
            return None
        result = np.zeros(len(w), dtype=object)
        result[columns] = solve(J[np.ix_(chosen, columns)], target[chosen])
        return result

    def _by_rotations(self, J: np.ndarray, A: np.ndarray, target: np.ndarray, columns: Sequence[int]) -> np.ndarray | None:
        """The same in turn by the angular or linear rows of a body in which those that are left are orthonormal; None where
        there are none."""
        size = (2, 1) if self.equations.planar else (3, 3)
        rows = [np.arange(first, first + n) for body in range(0, len(J), sum(size))
                for first, n in ((body + size[0], size[1]), (body, size[0]))]
        left, result = list(columns), np.zeros(A.shape[1], dtype=object)
        while left:
            for own in rows:
                used = [k for k in left if np.abs(A[own, k]).max() > 1e-9]
                block = A[own][:, used]
                if used and np.abs(block.T @ block - np.eye(len(used))).max() < 1e-9:
                    done = [k for k in columns if k not in left]
                    result[used] = J[own][:, used].T @ (target[own] - J[own][:, done] @ result[done])
                    left = [k for k in left if k not in used]
                    break
            else:
                return None
        return result

    # -- verdicts

    def claims(self, c: _Candidate) -> list[Any]:
        """Sides that must be equal for all states and accelerations, pairs one after the other."""
        rate = [*self.m.rate([c.value]), inner(c.w, self.residual)]
        held: list[Any] = []
        if self.equations.constraints:
            held = list(self.equations.quantity("C_t") if c.along else self.equations.quantity("C_r") @ c.w)
        others = [e for zero in (*c.zeros, *held) for e in (zero, 0)]
        return [*self.m.at([*rate, *others], self.off)]

    def perhaps(self, candidates: Sequence[_Candidate]) -> list[_Candidate]:
        """Those whose claims hold at a random state."""
        rows = [self.claims(c) for c in candidates]
        values = iter(self._numbers([e for row in rows for e in row]))
        same = [[_close(next(values), next(values)) for _ in row[::2]] for row in rows]
        return [c for c, row in zip(candidates, same, strict=True) if all(row)]

    def proof(self, c: _Candidate) -> Proof:
        claims = self.claims(c)
        pairs = list(zip(claims[::2], claims[1::2], strict=True))
        return decide(self.m.recorder, pairs, self.symbols, unit_vectors=self.units, bound=BOUND)

    def _numbers(self, entries: Sequence[Any]) -> list[Any]:
        """Values at a random state, always the same."""
        tape = Tape.of(self.m.recorder, entries=np.array([*entries, 0], dtype=object))
        values = drawn_state(random.Random(3), tape.inputs, 0.2, self.symbols, self.units)
        return list(evaluate(tape, {leaf.args[1]: value for leaf, value in values.items()}, DIGITS)["entries"])[:-1]

    def cyclic(self, candidates: Sequence[_Candidate]) -> tuple[sp.Symbol, ...]:
        """Coordinates that neither T and V hold nor the loads and constraints; notes say what changes the momenta of these, and
        which ones stand in loads or constraints alone."""
        m, equations = self.m, self.equations
        result = []
        coordinates = equations.symbols.coordinates
        # Where speeds are no rates of coordinates, T holds a coordinate that these rates hold.
        in_energy = self._absent([m.T, *([] if self.by_hand else [m.V]), *m.rates])
        C_dot: Any = equations.quantity("C_dot") if equations.constraints else []
        F: Any = m.at(equations.quantity("F_tilde"), self.off) if "F_tilde" in equations.quantities else []
        bound, loaded = self._absent(C_dot, in_energy), self._absent(F, in_energy)
        for k in sorted(in_energy):
            stands = [*["loads without potential"] * (k not in loaded), *["constraints"] * (k not in bound)]
            if stands:
                self.notes.append(f"{coordinates[k]} is not cyclic: it stands in {' and '.join(stands)}, though not in T and V")
                continue
            result.append(coordinates[k])
            p = candidates[k]
            if not m.plain or self.proof(p).proved:
                continue
            if equations.constraints and not self._vanish(equations.quantity("C_r")[:, k]):
                self.notes.append(f"{p.name} is not conserved: forces of constraints change it")
            else:
                rate = self._shown(F[k])
                self.notes.append(f"{p.name} is not conserved: its rate is {rate}" if rate
                                  else f"{p.name} is not conserved: loads without potential change it")
        return tuple(result)

    def _absent(self, entries: Any, among: Iterable[int] | None = None) -> set[int]:
        """Indices of coordinates that entries do not hold."""
        m = self.m
        left = sorted(range(len(m.q)) if among is None else among)
        slopes = {k: m.by(entries, m.q[k]) for k in left}
        values = iter(self._numbers([e for k in left for e in slopes[k]]))
        still = [k for k in left if max([abs(next(values)) for _ in slopes[k]], default=0) < SAME]
        return {k for k in still if self._vanish(slopes[k])}

    def _vanish(self, entries: Iterable[Any]) -> bool:
        pairs = [(e, 0) for e in entries]
        return not pairs or decide(self.m.recorder, pairs, self.symbols, unit_vectors=self.units, bound=BOUND).proved

    def _shown(self, entry: Any) -> str:
        """An entry written out; "" where it is too long."""
        try:
            return shown(written([entry], self.symbols, bound=WRITTEN)[0])
        except SymdynError:
            return ""

    def why_no_energy(self, energy: _Candidate) -> str:
        """Terms that change T + V."""
        if self.by_hand:
            return "energy: T changes by the power of the forces, of which it is not known whether they have a potential"
        rate, work, *held = self.claims(energy)
        if not all(map(is_zero, held)):
            return "energy: the constraints, which depend on the time, change T + V"
        power = self._shown(self.m.recorder.sub(rate, work))
        return (f"energy: the rate of T + V is {power}" if power
                else "energy: loads without potential, or prescribed motions, change T + V")


def _merged(momenta: Sequence[_Candidate], whole: Sequence[_Candidate]) -> list[_Candidate]:
    """Momenta of speeds that move the whole as one are named once."""
    left = list(whole)
    result = []
    for c in momenta:
        same = next((o for o in left if all(a is b or (not isinstance(a, Node) and a == b)
                                            for a, b in zip(o.w, c.w, strict=True))), None)
        if same is not None:
            left.remove(same)
            c = replace(c, meaning=f"{c.meaning}, {same.meaning}", zeros=same.zeros)
        result.append(c)
    energy = [c for c in result if c.name in ("energy", "jacobi")]
    return [*[c for c in result if c not in energy], *left, *energy]


def _close(a: Any, b: Any) -> bool:
    return bool(abs(a - b) <= SAME * (1 + abs(a) + abs(b)))


def _unit(k: int, n: int) -> np.ndarray:
    w = np.zeros(n, dtype=object)
    w[k] = 1
    return w
