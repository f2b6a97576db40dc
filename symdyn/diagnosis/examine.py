"""Examines the constraints of a system in numbers: at the state given, at others near it, and along the motions they allow."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.arguments import some, take
from symdyn.diagnosis.mobility import Mobility, mobility
from symdyn.diagnosis.paths import LOST, NEAR, STEP, Near, Scaled, follow
from symdyn.diagnosis.result import Dependency, Diagnosis, SingularState
from symdyn.errors import ArgumentError, ModelError, SymdynError
from symdyn.formulation.constraints.consistent_states import AtStates, ConstraintStates
from symdyn.formulation.probes.dependent_rows import ranks
from symdyn.model.loop_check import CARRIER
from symdyn.runtime.consistent import number
from symdyn.shown import shown
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.intrinsics import RANK

if TYPE_CHECKING:
    from symdyn.formulation.constraints.augmented import ConstrainedTree
    from symdyn.formulation.equations import Equations
    from symdyn.model.record import Model
    from symdyn.model.system import System

STATES = 6
SPREAD = 0.3
# A residual that counts as fulfilled.
FULFILLED = 1e-10
# States nearer than this are the same: where rank is lost they are not known any better.
APART = 1e-4
# Changes along motions, rad or parts of the length: half a turn.
REACH = math.pi
STARTS = 12


def diagnose(system: System, q: Any = None, params: Any = None, t: float = 0.0, coordinates: str = "relative",
             reach: float = REACH) -> Diagnosis:
    """Diagnosis of the constraints of a system; see System.diagnose."""
    from symdyn.formulation.constraints.absolute import in_absolute_coordinates
    from symdyn.formulation.constraints.absolute_start import absolute_start
    from symdyn.formulation.constraints.augmented import COORDINATES, ConstrainedTree
    from symdyn.formulation.constraints.rows import Gathered
    from symdyn.formulation.printed.augmented import AugmentedEquations
    from symdyn.formulation.probes.contradictions import contradictions
    from symdyn.formulation.trees.equations import tree_of, tree_result

    if not isinstance(coordinates, str) or coordinates not in COORDINATES:
        raise SymdynError(f"coordinates {shown(coordinates)} asked for; there are {' and '.join(map(repr, COORDINATES))}")
    t = number(t, "a finite number of seconds as t", system.name)
    asked, reach = reach, number(reach, f"an angle from 0 on as reach, rad (default: {REACH:.4g})", system.name)
    if reach < 0:
        raise ArgumentError(f"{system.name}: pass an angle from 0 on as reach, rad (default: {REACH:.4g}), found {shown(asked)}")
    model = system.check()
    if coordinates == "absolute":
        rewritten = in_absolute_coordinates(model)
        model = replace(rewritten, initial={**rewritten.initial, **absolute_start(model, rewritten)})
    tree = tree_of(model, "body")
    try:
        gathered = Gathered(tree)
    except ModelError as error:
        rows = len(model.loops) + len(model.constraints)
        return Diagnosis(model.name, len(model.speeds), rows, (), len(model.speeds) - rows, consistent=False, faults=error.faults,
                         remarks=("no more can be found out until this is put right",))
    quantities = ConstrainedTree(tree, gathered, intrinsic=True)
    names = {"constraints": tuple(r.name for r in gathered.rows), "holonomic": tuple(r.holonomic for r in gathered.rows)}
    equations = tree_result(quantities, "augmented", AugmentedEquations, lambda: equations, **names)
    faults = tuple(contradictions(equations)) if gathered.rows else ()
    return _Examination(model, quantities, equations, q, params, t, reach).diagnosis(faults)


@dataclass(frozen=True)
class _Numbers:
    """Parameters, and which of them were taken at random."""

    values: Mapping[Any, float]
    random: tuple[str, ...]


class _Examination:
    def __init__(self, model: Model, quantities: ConstrainedTree, equations: Equations, q: Any, params: Any, t: float,
                 reach: float) -> None:
        self.model, self.gathered, self.equations, self.reach = model, quantities.gathered, equations, reach
        self.numbers = self._numbers(params)
        self.states = ConstraintStates(equations, self.numbers.values, t)
        self.names = list(equations.constraints)
        self.owners = self._owners()
        initial = {c.name: float(model.initial.get(c, 0.0)) for c in model.coordinates}
        self.start = take(q, list(initial), "q", initial, model.name)
        self.remarks: list[str] = []
        self.advice: list[str] = []
        if self.numbers.random:
            self.remarks.append(f"{', '.join(self.numbers.random)}: no numbers, random ones from 0.5 to 1.5 were taken; pass "
                                "params, or put numbers in defaults, for a diagnosis of the real mechanism")

    # -- what was given

    def _numbers(self, params: Any) -> _Numbers:
        symbols = self.equations.symbols
        known = {p.name: float(v) for p, v in symbols.defaults.items()}
        names = [p.name for p in symbols.parameters]
        if params is None or isinstance(params, Mapping):
            known |= some(params, names, "parameters", self.model.name)
        else:
            known = dict(zip(names, take(params, names, "parameters", {}, self.model.name), strict=True))
        stream = np.random.default_rng(3)
        values = {p: known[p.name] if p.name in known else float(stream.uniform(0.5, 1.5)) for p in symbols.parameters}
        return _Numbers(values, tuple(p.name for p in symbols.parameters if p.name not in known))

    def _owners(self) -> list[str]:
        """Loop or constraint that every row belongs to."""
        owners = list(self.names)
        for closure in self.gathered.closures:
            for index in closure.indices:
                owners[index] = closure.joint.name
        return owners

    # -- counting

    def _count(self) -> tuple[tuple[str, ...], int, int]:
        """Gruebler's count, line by line; rows with those that hold by structure; freedoms."""
        model = self.model
        each = 3 if model.planar else 6
        n = len(model.bodies)
        lines = [f"{n} {'body' if n == 1 else 'bodies'} with {each} freedoms each: {each * n}"]
        speeds = len(self.equations.symbols.speeds)
        taken = each * n - speeds
        kinds: dict[str, list[str]] = {}
        for joint in model.joints:
            kinds.setdefault(joint.kind, []).append(joint.name)
        types = "; ".join(f"{kind} {', '.join(listed)}" for kind, listed in kinds.items())
        lines.append(f"joints of the tree ({types}) take {taken}: {speeds} speeds left")
        rows = list(zip(self.owners, self.names, strict=True))
        owners = {c.joint.name for c in self.gathered.closures}
        for name in self.gathered.trivial:
            rows.append((next((o for o in sorted(owners, key=len, reverse=True) if name.startswith(o)), name), name))
        for owner in dict.fromkeys(o for o, _ in rows):
            lines.append(f"{owner} takes {sum(o == owner for o, _ in rows)}")
        return tuple(lines), len(rows), speeds - len(rows)

    # -- the examination

    def diagnosis(self, faults: tuple[str, ...]) -> Diagnosis:
        lines, rows, by_count = self._count()
        n_u = len(self.equations.symbols.speeds)
        plain = Diagnosis(self.model.name, n_u, rows, lines, by_count, faults=faults, remarks=tuple(self.remarks),
                          reach=self.reach)
        here, residual = self._given()
        plain = replace(plain, state=dict(zip(self.states.names, map(float, here), strict=True)),
                        moved=float(np.abs(here - self.start).max(initial=0.0)))
        if residual > FULFILLED:
            return self._without_state(plain, here)
        q = self._near(here)
        found = self.states.at(q)
        if not rows:
            return self._with_motions(replace(plain, by_rank=n_u, at_state=n_u, states=len(q)), q, None)
        scaled, generic = self._scaled(found)
        A, _ = scaled.at(q)
        rank_here = _rank(A[:1])
        dependencies = self._dependencies(A[generic], scaled.rank, A[0], rank_here)
        sizes = np.linalg.svd(A[0], compute_uv=False)
        smallest = float(sizes[scaled.rank - 1]) if scaled.rank else None
        result = replace(plain, by_rank=n_u - scaled.rank, at_state=n_u - rank_here, states=len(generic),
                         dependencies=dependencies, smallest=smallest)
        result = self._with_paths(result, scaled, q[generic[0]] if rank_here < scaled.rank else here, A, rank_here)
        if result.by_rank == 0:
            self.advice.append("the constraints hold every speed: nothing can move; remove one, if it was meant to move")
        return self._with_motions(result, q[generic], scaled)

    def _given(self) -> tuple[np.ndarray, float]:
        """The consistent state nearest to the one given; where there is none, of those near others."""
        q, residual = self.states.nearest(self.start[None])
        if residual[0] <= FULFILLED:
            return q[0], float(residual[0])
        stream = np.random.default_rng(5)
        starts = self.start + stream.uniform(-1, 1, (STARTS, len(self.start))) * np.linspace(0.2, 2.0, STARTS)[:, None]
        tried, left = self.states.nearest(starts)
        good = np.flatnonzero(left <= FULFILLED)
        if len(good):
            best = good[np.argmin(np.abs(tried[good] - self.start).max(axis=1))]
            return tried[best], float(left[best])
        best = int(np.argmin(left)) if left.min(initial=np.inf) < residual[0] else -1
        return (q[0], float(residual[0])) if best < 0 else (tried[best], float(left[best]))

    def _near(self, here: np.ndarray) -> np.ndarray:
        """Consistent states: here, then random ones around, (s, n_q)."""
        stream = np.random.default_rng(1)
        result = self.states.at(here[None])
        n_u = result.N.n
        states = [here[None]]
        for _ in range(4):
            along = SPREAD * stream.uniform(-1, 1, (2 * STATES, n_u))
            moved = here + self.states.moved(result[np.zeros(2 * STATES, dtype=int)], along)
            q, residual = self.states.nearest(moved)
            states.append(q[residual <= FULFILLED])
            if sum(map(len, states)) > STATES:
                break
        others = np.concatenate(states[1:])
        others = others[np.abs(others - here).max(axis=1, initial=0.0) > APART]
        return np.concatenate([here[None], others])[:STATES + 1]

    def _scaled(self, result: AtStates) -> tuple[Scaled, list[int]]:
        """Scales that hold for all states, and the indices of those with the largest rank."""
        rows = np.median(result.C_scale[1:] if len(result.C_scale) > 1 else result.C_scale, axis=0)
        raw = Scaled(self.states, rows, 1.0, 0).of(result)
        sizes = np.linalg.svd(raw, compute_uv=False)
        size = float(np.median(sizes[:, 0])) if sizes.size else 1.0
        ranks = (sizes > RANK * max(size, 1e-300)).sum(axis=1)
        rank = int(ranks.max(initial=0))
        return Scaled(self.states, rows, size or 1.0, rank), [int(k) for k in np.flatnonzero(ranks == rank)]

    # -- redundant rows

    def _dependencies(self, A: np.ndarray, rank: int, here: np.ndarray, rank_here: int) -> tuple[Dependency, ...]:
        listed = [Dependency(name, (), (name,)) for name in self.gathered.trivial]
        always = _implied(A, rank, self._kept(A, rank))
        listed += [self._dependency(k, used, True) for k, used in always.items()]
        if rank_here < rank:
            kept = [k for k in range(len(here)) if k not in always]
            there = _implied(here[None, kept], rank_here)
            listed += [self._dependency(kept[k], [kept[j] for j in used], False) for k, used in there.items()]
        self._advise([d.row for d in listed if d.always], A, rank)
        return tuple(listed)

    def _kept(self, A: np.ndarray, rank: int) -> Sequence[int]:
        """The rows that the equations keep, so that both name the same ones."""
        if rank == A.shape[1]:
            return ()
        symbols = replace(self.equations.symbols, defaults=self.numbers.values, initial=dict(
            zip(self.equations.symbols.coordinates, self.start, strict=True)))
        result = ranks(replace(self.equations, symbols=symbols))
        return result.independent if result is not None and result.rank == rank else ()

    def _dependency(self, k: int, used: Sequence[int], always: bool) -> Dependency:
        joints = tuple(dict.fromkeys(self.owners[j] for j in (*used, k)))
        return Dependency(self.names[k], tuple(self.names[j] for j in used), joints, always)

    def _advise(self, always: Sequence[str], A: np.ndarray, rank: int) -> None:
        if not always:
            return
        self.advice.append(f"{', '.join(always)} can be left out: accelerations stay the same, and multipliers and reactions "
                           "become unique. As long as redundant rows are there, those of least norm are given")
        for closure in self.gathered.closures:
            joint = closure.joint
            turns = [k for k in closure.indices if _turning(self.names[k])]
            trivial = sum(name.startswith(f"{joint.name}_") and _turning(name) for name in self.gathered.trivial)
            rest = [k for k in range(len(self.names)) if k not in turns]
            if joint.kind not in ("revolute", "fixed") or self.model.planar or not (turns or trivial):
                continue
            if rest and _rank(A[:, rest]) == rank:
                self.advice.append(f"sd.Spherical in place of the {joint.kind} joint {joint.name} allows the same motion, with "
                                   f"{len(turns) + trivial} rows fewer")

    # -- states around

    def _with_paths(self, plain: Diagnosis, scaled: Scaled, q: np.ndarray, A: np.ndarray, rank_here: int) -> Diagnosis:
        singular: list[Near] = []
        if rank_here < scaled.rank:
            here = np.array(list(plain.state.values()))
            singular.append(Near(here, float(np.linalg.svd(A[0], compute_uv=False)[scaled.rank - 1]), 0.0))
        if scaled.rank and plain.by_rank:
            near, gone = follow(scaled, q, self.reach)
            singular += [n for n in near if all(np.abs(n.q - s.q).max() > 1e-3 for s in singular)]
            if gone == 0.0:
                self.advice.clear()
                self.remarks.append("the motion that is left by rank is infinitesimal: no step along it stays on the constraints")
            elif gone < self.reach - STEP and not near:
                self.remarks.append(f"motions could be followed up to {gone:.3g} from the state only")
        result = []
        for n in singular:
            J, _ = scaled.at(n.q[None])
            rows = self._lost_there(J[0], scaled.rank)
            result.append(SingularState(dict(zip(self.states.names, map(float, n.q), strict=True)), n.size, n.distance, rows,
                                      n.size < LOST))
        if any(s.lost for s in result):
            self.advice.append("where rank is lost motions can branch, and multipliers of constraints that depend on each other "
                               "there are not unique; keep the motion away from there if that should not matter")
        return replace(plain, singular=tuple(result), remarks=tuple(self.remarks))

    def _lost_there(self, J: np.ndarray, rank: int) -> tuple[str, ...]:
        """Rows that take part in combinations that nearly vanish there, and do not elsewhere."""
        U, sizes, _ = np.linalg.svd(J)
        part = np.abs(U[:, :rank][:, sizes[:rank] < NEAR]).max(axis=1, initial=0.0)
        return tuple(self.names[k] for k in np.flatnonzero(part > 1e-2))

    # -- motions

    def _with_motions(self, plain: Diagnosis, q: np.ndarray, scaled: Scaled | None) -> Diagnosis:
        result = self._motions(q, scaled)
        bodies = [b.name for b in self.model.bodies]
        speeds = [u.name for u in self.equations.symbols.speeds]
        for b in result.idle:
            around = [j for j, c in zip(self.model.joints, self.model.children, strict=True) if c == b and j.kind == "spherical"]
            if around:
                self.advice.append(f"idle rotation of {bodies[b]}: sd.Universal in place of the spherical joint {around[0].name} "
                                   "takes it away; nothing else changes where the body is symmetric about that axis")
        if result.massless:
            self.advice.append(f"{', '.join(speeds[j] for j in result.massless)}: give the bodies that move mass or inertia, or "
                               "hold the motion by a constraint")
        given = {b for b, name in enumerate(bodies) if not name.endswith(f"_{CARRIER}")}
        parts = [tuple(bodies[b] for b in part if b in given) for part in result.parts]
        return replace(plain, parts=tuple(part for part in parts if part),
                       still=tuple(bodies[b] for b in result.still if b in given), idle=tuple(bodies[b] for b in result.idle),
                       massless=tuple(speeds[j] for j in result.massless), advice=tuple(self.advice),
                       remarks=tuple(self.remarks))

    def _motions(self, q: np.ndarray, scaled: Scaled | None) -> Mobility:
        symbols = self.equations.symbols
        tape = self.equations.tape("J", "M_tilde", "F_tilde", "length", "frames")
        stream = np.random.default_rng(2)
        values = {**self.states.values, **dict(zip(self.states.names, q.T, strict=True))}
        values |= {s.name: stream.uniform(0.5, 1.5, len(q)) for s in (*symbols.speeds, *symbols.states, *symbols.inputs)}
        result = evaluate_rows(tape, values, len(q))
        D = np.where(self.states.angular[None, :], result["length"][:, None], 1.0)
        J = result["J"] / D[:, None, :]
        m = 3 if self.model.planar else 6
        angular = np.arange(J.shape[1]) % m >= (2 if m == 3 else 3)
        J[:, angular] *= result["length"][:, None, None]
        M = result["M_tilde"] / D[:, :, None] / D[:, None, :]
        defined = np.isfinite(J).all(axis=(1, 2)) & np.isfinite(M).all(axis=(1, 2))
        n_u = len(symbols.speeds)
        free = [np.eye(n_u)] * len(q) if scaled is None else [np.linalg.svd(A)[2][scaled.rank:].T for A in scaled.at(q)[0]]
        F = np.nan_to_num(result["F_tilde"] / D, nan=1.0)
        return mobility([free[k] for k in np.flatnonzero(defined)], J[defined], M[defined], F[defined],
                        result["frames"][defined][..., 3:].reshape(int(defined.sum()), -1, 3, 3))

    # -- no state

    def _without_state(self, plain: Diagnosis, here: np.ndarray) -> Diagnosis:
        result = self.states.at(here[None])
        residual = self.states.residual(result)[0]
        order = [int(k) for k in np.argsort(-np.abs(residual)) if not abs(residual[k]) <= FULFILLED]
        if np.isfinite(result.C_r.values).all() and self.names:
            A = Scaled(self.states, result.C_scale[0], 1.0, 0).of(result)
            rank = _rank(A / max(np.linalg.norm(A[0], 2), 1e-300))
            A = A[0]
            if rank < len(A):
                self.advice.append(f"at the nearest state only {rank} of the {len(A)} constraints are independent: "
                                   f"{', '.join(self.names[k] for k in order)} pull against each other")
        self.advice.append("pass a q near a consistent state, or check lengths, points and axes of the joints named")
        if self.numbers.random:
            self.advice.append("random numbers need not make a mechanism that can be assembled: pass params")
        return replace(plain, consistent=False, residuals={self.names[k]: float(residual[k]) for k in order},
                       advice=tuple(self.advice))


def _rank(A: np.ndarray) -> int:
    """The largest rank of matrices (s, m, n) whose entries are about 1."""
    return int((np.linalg.svd(A, compute_uv=False) > RANK).sum(axis=1).max()) if A.size else 0


def _implied(A: np.ndarray, rank: int, first: Sequence[int] = ()) -> dict[int, list[int]]:
    """Row -> the rows that it is a combination of at all states (s, m, n); `rank` rows are not in it, preferably
    those of `first`."""
    m = A.shape[1]
    if rank == m:
        return {}
    kept: list[int] = []
    for k in [*first, *[k for k in range(m) if k not in first]]:
        if _rank(A[:, [*kept, k]]) > len(kept):
            kept.append(k)
    result: dict[int, list[int]] = {}
    for k in (k for k in range(m) if k not in kept):
        used: set[int] = set()
        for state in A:
            size = np.linalg.norm(state[k])
            if size <= RANK:
                continue
            factors = np.linalg.lstsq(state[kept].T, state[k], rcond=RANK)[0]
            used |= {j for j, f in zip(kept, factors, strict=True) if abs(f) * np.linalg.norm(state[j]) > 1e-6 * size}
        result[k] = sorted(used)
    return result


def _turning(row: str) -> bool:
    """Whether a row of a joint holds an orientation, by its name."""
    return "_tilt_" in row or "_turn_" in row
