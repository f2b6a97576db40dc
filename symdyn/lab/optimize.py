"""Optimal motions compared with the same problems in plain CasADi, one run: `symdyn bench optimize`.

CasADi gets Hermite and Simpson's separated collocation on the same mesh from the same guess, written in its scalar symbols: its
own derivatives and virtual machine, the same IPOPT. The right-hand sides of the cart with a pole and of the biped are symdyn's
statements; that of the linkage is one equation of its crank's angle alone, with the other angles in closed form, so that its cost
checks the constraints, too. The least processor time of each counts: of symdyn the whole call, with the motion simulated back, of
CasADi making the problem and solving it.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import sympy as sp

import symdyn as sd
from symdyn.bench.toolchain import package_folder
from symdyn.formulation.equations import Equations
from symdyn.lab import gait
from symdyn.lab.casadi_field import casadi_field
from symdyn.lab.figures import Figure, print_figures

# Timed calls of each.
REPEATS = 5
# Largest differences of costs on the same mesh, and of those of the linkage, whose states differ, on their meshes.
SAME, NEAR = 1e-6, 1e-5
# Kelly, SIAM Review 59 (2017), section 5, and the cost of an independent collocation with 320 intervals, N^2 s.
CONVERGED = 58.807667
SWING: dict[str, Any] = {"start": {"q1": 0, "q2": -np.pi}, "end": {"q1": 1, "q2": 0, "q1_dot": 0, "q2_dot": 0},
                         "bounds": {"F": (-20, 20), "q1": (-2, 2)}, "params": {"m_c": 1, "m_p": 0.3, "I_p": 0, "l": 0.5}}


def cart_pole() -> Iterator[Figure]:
    """The swing-up of a pole on a cart."""
    equations = sd.systems.cart_pole().embedding()
    module, K = equations.compile(backend="c"), 40
    force = sp.Symbol("F")
    solve = lambda **more: sd.optimize(module, sd.Loss(integral=force**2), 2.0, **SWING, **more)
    p = dict(zip(module.metadata.parameters, module.parameters(SWING["params"]).tolist(), strict=True))
    start, end = [0.0, -np.pi, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]
    peer = _Collocation(4, 1, K, lambda ca, x, u: (_statements(ca, equations, x, u, p), u[0] ** 2), (2.0, 2.0))
    peer.states, peer.inputs = ([-2, -np.inf, -np.inf, -np.inf], [2, np.inf, np.inf, np.inf]), ([-20], [20])
    peer.start, peer.end = (start, start), (end, end)
    peer.guess = lambda share: (1 - share) * np.array(start) + share * np.array(end)
    yield from _compared("cart-pole", lambda: solve(intervals=K, tolerance=None), peer, SAME)
    result = solve(tolerance=1e-7)
    yield "cart-pole: cost of a refined mesh less the published one", abs(result.cost - CONVERGED), "", "<= 5e-06"
    yield "cart-pole: iterations on all meshes", result.iterations, "", ""
    yield "cart-pole: simulated back, largest difference", max(result.difference.values()), "", "<= 1e-4"
    yield "cart-pole: time with refinement", result.seconds, "s", "< 10"


def minimum_time() -> Iterator[Figure]:
    """A mass by a bounded force, from rest to rest: T = 2 sqrt(m d/F)."""
    x, force = sd.coordinates("x"), sd.inputs("F")
    system = sd.System("slider")
    body = system.add_body("body", mass=1)
    slide = system.add_joint(sd.Prismatic("slide", system.ground, body, axis=[1, 0], coordinate=x))
    system.add_joint_force(slide, force)
    module = system.compile(backend="c")
    solve = lambda: sd.optimize(module, sd.Loss(end=sd.t), (0.1, 10), end={x: 1, x.dot: 0}, bounds={force: (-1, 1)},
                                tolerance=None)
    peer = _Collocation(2, 1, 20, lambda ca, x, u: (ca.vertcat(x[1], u[0]), 0 * u[0]), (0.1, 10.0))
    peer.inputs, peer.start, peer.end = ([-1], [1]), ([0, 0], [0, 0]), ([1, 0], [1, 0])
    peer.guess = lambda share: np.array([share, 0.0])
    yield from _compared("minimum time", solve, peer, SAME)
    yield "minimum time: less the closed form", abs(solve().duration - 2), "s", "<= 1e-6"


def linkage() -> Iterator[Figure]:
    """A four-bar linkage with a torque at its crank, from 0.5 to 2.5 rad in 1 s, from rest to rest."""
    system = sd.systems.four_bar()
    system.add_joint_force("hinge1", sd.inputs("tau"))
    module, K = system.compile(backend="c"), 40
    q = module.consistent({"q1": 0.5}, keep=["q1"])[0]
    start = dict(zip(module.metadata.q, q.tolist(), strict=True))
    cost, end = sd.Loss(integral=sp.Symbol("tau") ** 2), {"q1": 2.5, "q1_dot": 0}
    solve = lambda **more: sd.optimize(module, cost, 1.0, start, end, **more)
    p = dict(zip(module.metadata.parameters, module.parameters().tolist(), strict=True))
    peer = _Collocation(2, 1, K, lambda ca, x, u: (_crank(ca, x, u, p), u[0] ** 2), (1.0, 1.0))
    peer.start, peer.end = ([0.5, 0], [0.5, 0]), ([2.5, 0], [2.5, 0])
    peer.guess = lambda share: np.array([0.5 + 2 * share, 0.0])
    yield from _compared("linkage", lambda: solve(intervals=K, tolerance=None), peer, NEAR)
    result = solve(transcription="radau", degree=4, tolerance=1e-8)
    fine = _Collocation(2, 1, 320, peer.field, (1.0, 1.0))
    fine.start, fine.end, fine.guess = peer.start, peer.end, peer.guess
    less = abs(result.cost / fine.solve().cost - 1)
    yield "linkage: refined cost less CasADi's of 320 intervals, relative", less, "", "<= 1e-7"
    yield "linkage: simulated back, largest difference", max(result.difference.values()), "", "<= 1e-5"


def biped() -> Iterator[Figure]:
    """A step of a five-link biped with the impact of its heel."""
    equations = gait.biped().embedding()
    module, K = equations.compile(backend="c"), 25
    p = dict(zip(module.metadata.parameters, module.parameters().tolist(), strict=True))
    T = gait.DURATION
    peer = _Collocation(10, 5, K, lambda ca, x, u: (_statements(ca, equations, x, u, p), ca.sumsqr(ca.vertcat(*u))), (T, T))
    first, last = np.array(gait.POSTURE), np.array(gait.POSTURE[::-1])
    peer.guess = lambda share: np.concatenate([(1 - share) * first + share * last, (last - first) / T])
    peer.states = ([-np.pi / 2] * 5 + [-np.inf] * 5, [np.pi / 2] * 5 + [np.inf] * 5)
    conditions = gait.boundary()
    names = [sp.Symbol(f"{n}{at}") for at in ("(0)", "") for n in module.metadata.x]
    sides = [sp.Symbol(f"s{k}") for k in range(20)]
    at = dict(zip(names, sides, strict=True))
    made = [(c.lhs - c.rhs).xreplace(at) for c in conditions]
    peer.boundary = lambda ca, begin, end: [sp.lambdify(sides, e, [{"sin": ca.sin, "cos": ca.cos}])(*begin, *end) for e in made]
    peer.of_boundary = ([0.0 if not isinstance(c, sp.Le) else -np.inf for c in conditions],
                        [0.0 if not isinstance(c, sp.Ge) else np.inf for c in conditions])
    yield from _compared("biped", lambda: gait.step(module, intervals=K, tolerance=None), peer, SAME)
    result = gait.step(module, intervals=10, transcription="radau", tolerance=1e-6)
    yield "biped: cost of a refined mesh", result.cost, "N2m2s", ""
    yield "biped: iterations on all meshes", result.iterations, "", ""
    yield "biped: simulated back, largest difference", max(result.difference.values()), "", "<= 1e-2"
    yield "biped: time with refinement", result.seconds, "s", "< 10"
    published = gait.step(module, intervals=10, transcription="radau", degree=4, tolerance=None, inputs={"u1": 0},
                          **gait.PUBLISHED)
    less = abs(published.cost / gait.PUBLISHED_COST - 1)
    yield "biped, no torque at the ankle: cost less the published one, relative", less, "", "<= 2e-3"
    yield "biped, no torque at the ankle: iterations (published: 143)", published.iterations, "", ""


class _Found:
    """Solution of CasADi: cost, iterations, times of making the problem and of solving it, s."""

    def __init__(self, cost: float, iterations: int, made: float, solved: float) -> None:
        self.cost, self.iterations, self.made, self.solved = cost, iterations, made, solved


class _Collocation:
    """Hermite and Simpson's separated collocation in CasADi's scalar symbols."""

    def __init__(self, n_x: int, n_in: int, K: int, field: Callable[[Any, Any, Any], tuple[Any, Any]],
                 duration: tuple[float, float]) -> None:
        self.n_x, self.n_in, self.K, self.field, self.duration = n_x, n_in, K, field, duration
        none = lambda n: ([-np.inf] * n, [np.inf] * n)
        self.states, self.inputs, self.start, self.end = none(n_x), none(n_in), none(n_x), none(n_x)
        self.guess: Callable[[float], np.ndarray] = lambda share: np.zeros(n_x)
        self.boundary: Callable[[Any, Any, Any], list[Any]] = lambda ca, begin, end: []
        self.of_boundary: tuple[list[float], list[float]] = ([], [])

    def solve(self) -> _Found:
        """Make the problem and solve it."""
        import casadi as ca

        begun = clock.process_time()
        N, h = 2 * self.K + 1, 1 / self.K
        X, U, free = ca.SX.sym("X", self.n_x, N), ca.SX.sym("U", self.n_in, N), self.duration[0] < self.duration[1]
        T = ca.SX.sym("T") if free else self.duration[0]
        x, u = ca.SX.sym("x", self.n_x), ca.SX.sym("u", self.n_in)
        rates, integrand = self.field(ca, ca.vertsplit(x), ca.vertsplit(u))
        f = ca.Function("f", [x, u], [rates, integrand])
        at = [f(X[:, k], U[:, k]) for k in range(N)]
        g, cost = [], T if free else 0
        for k in range(0, N - 2, 2):
            (f0, L0), (f1, L1), (f2, L2) = at[k], at[k + 1], at[k + 2]
            g += [X[:, k + 1] - (X[:, k] + X[:, k + 2]) / 2 - T * h / 8 * (f0 - f2),
                  X[:, k + 2] - X[:, k] - T * h / 6 * (f0 + 4 * f1 + f2)]
            if not free:
                cost = cost + T * h / 6 * (L0 + 4 * L1 + L2)
        extra = self.boundary(ca, ca.vertsplit(X[:, 0]), ca.vertsplit(X[:, N - 1]))
        z = ca.vertcat(ca.vec(X), ca.vec(U), *([T] if free else []))
        solver = ca.nlpsol("peer", "ipopt", {"x": z, "f": cost, "g": ca.vertcat(*g, *extra)},
                           {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": False})
        least, most = (self._bounds(k, N, free) for k in (0, 1))
        shares = np.linspace(0, 1, N)
        z0 = np.clip(np.concatenate([np.concatenate([self.guess(s) for s in shares]), np.zeros(N * self.n_in),
                                     [sum(self.duration) / 2] * free]), least, most)
        zeros = np.zeros(2 * self.K * self.n_x)
        made = clock.process_time()
        result = solver(x0=z0, lbx=least, ubx=most, lbg=np.concatenate([zeros, self.of_boundary[0]]),
                        ubg=np.concatenate([zeros, self.of_boundary[1]]))
        stats = solver.stats()
        assert stats["success"], stats["return_status"]
        return _Found(float(result["f"]), int(stats["iter_count"]), made - begun, clock.process_time() - made)

    def _bounds(self, side: int, N: int, free: bool) -> np.ndarray:
        worst = np.maximum if side == 0 else np.minimum
        states = np.tile(np.array(self.states[side], dtype=float), (N, 1))
        states[0], states[-1] = worst(states[0], self.start[side]), worst(states[-1], self.end[side])
        return np.concatenate([states.ravel(), np.tile(np.array(self.inputs[side], dtype=float), N),
                               [self.duration[side]] * free])


def _compared(name: str, ours: Callable[[], sd.Optimum], peer: _Collocation, bound: float) -> Iterator[Figure]:
    """Costs, iterations and least processor times of both, in turns."""
    package_folder("casadi")
    ours()  # compiles
    result, theirs, seconds, made, solved = ours(), peer.solve(), np.inf, np.inf, np.inf
    for _ in range(REPEATS):
        begun = clock.process_time()
        result = ours()
        seconds = min(seconds, clock.process_time() - begun)
        theirs = peer.solve()
        made, solved = min(made, theirs.made), min(solved, theirs.solved)
    yield f"{name}: cost", result.cost, "", ""
    yield f"{name}: less that of CasADi, relative", abs(result.cost / theirs.cost - 1), "", f"<= {bound:g}"
    yield f"{name}: iterations", result.iterations, "", ""
    yield f"{name}: iterations of CasADi", theirs.iterations, "", ""
    yield f"{name}: time", seconds, "s", "< 10"
    yield f"{name}: time of CasADi to make the problem", made, "s", ""
    yield f"{name}: time of CasADi to solve it", solved, "s", ""
    yield f"{name}: CasADi's time by symdyn's", (made + solved) / seconds, "", ""


def _statements(ca: Any, equations: Equations, x: Any, u: Any, p: dict[str, float]) -> Any:
    """x_dot by symdyn's own statements."""
    symbols = equations.symbols
    names = [s.name for s in (*symbols.coordinates, *symbols.speeds)]
    return casadi_field(ca, equations, {**dict(zip(names, x, strict=True)), **p,
                                        **dict(zip([s.name for s in symbols.inputs], u, strict=True))})


def _crank(ca: Any, x: Any, u: Any, p: dict[str, float]) -> Any:
    """The four-bar linkage by its crank's angle alone: M(q) q_ddot + M' q_dot^2/2 + V' = tau, with the other angles by the law of
    cosines."""
    q = ca.SX.sym("q")
    dx, dy = p["d"] - p["l1"] * ca.cos(q), -p["l1"] * ca.sin(q)  # from hinge 2 to hinge 4
    r2 = dx**2 + dy**2
    r, toward = ca.sqrt(r2), ca.atan2(dy, dx)
    second = toward + ca.acos((p["l2"] ** 2 + r2 - p["l3"] ** 2) / (2 * p["l2"] * r))
    third = toward - ca.acos((p["l3"] ** 2 + r2 - p["l2"] ** 2) / (2 * p["l3"] * r))
    angles, hinge = (q, second, third), ca.SX.zeros(2)
    M, V = 0, 0
    for k, angle in enumerate(angles, 1):
        along = ca.vertcat(ca.cos(angle), ca.sin(angle))
        centre = hinge + p[f"lc{k}"] * along
        M += p[f"m{k}"] * ca.sumsqr(ca.jacobian(centre, q)) + p[f"I{k}"] * ca.jacobian(angle, q) ** 2
        V += p[f"m{k}"] * p["g"] * centre[1]
        hinge = hinge + p[f"l{k}"] * along
    terms = ca.Function("terms", [q], [M, ca.jacobian(M, q), ca.jacobian(V, q)])
    mass, slope, weight = terms(x[0])
    return ca.vertcat(x[1], (u[0] - slope * x[1] ** 2 / 2 - weight) / mass)


GROUPS = (cart_pole, minimum_time, linkage, biped)


def run(only: Sequence[str] | None = None) -> int:
    """Print every figure; returns the number of those that miss their bound."""
    return print_figures(GROUPS, only)
