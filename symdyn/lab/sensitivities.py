"""Sensitivities of motions: errors, times compared with CasADi's CVODES and diffrax's, the cost of gradients: `symdyn bench
sensitivities`.

All figures of one group come from one run. CVODES (Hindmarsh and others, ACM TOMS 31, 2005) gets the same right-hand side:
symdyn's own statements as compiled C, with CasADi's derivatives of them; Adams' method with functional iteration, which is the
quickest here; and errors of the sensitivities under control, as symdyn has them. diffrax (Kidger, On Neural Differential
Equations, thesis, Oxford 2021) gets the statements as JAX traces them, its method of order 8, and the same tolerances. The best
timing of each counts, without compilation.
"""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import tempfile
import time as clock
import warnings
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import sympy as sp

import symdyn as sd
from symdyn.bench.toolchain import package_folder
from symdyn.errors import MissingExtra, SimulationWarning
from symdyn.formulation.equations import Equations
from symdyn.lab.casadi_field import casadi_field
from symdyn.lab.figures import Figure, print_figures

NAMES = ("m1", "m3", "l1", "l2", "lc5")
START = np.array([-np.pi / 2 + 0.2, 0.1, -0.1, 0.05, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0])
END, RTOL = 10.0, 1e-9
# Its tolerances, from the loosest on, until the error is that of symdyn.
TRIED = (1e-9, 1e-10, 1e-11, 1e-12, 1e-13)


def cvodes() -> Iterator[Figure]:
    """A pendulum of five links that swings for 10 s, by five parameters, at rtol 1e-9."""
    equations = sd.systems.n_link_pendulum(5).embedding()
    module = equations.compile(backend="c")

    def run(rtol: float, method: str = "dop853") -> Any:
        return module.simulate(np.array([0.0, END]), START[:5], START[5:], rtol=rtol, method=method, sensitivities=NAMES)

    exact = run(1e-14, "taylor").sensitivity.matrix[-1]
    error = lambda result: float(np.abs(result - exact).max() / np.abs(exact).max())
    ours = run(RTOL)
    quickest = min(_seconds(lambda: run(RTOL)) for _ in range(100))
    own = error(ours.sensitivity.matrix[-1])
    yield "error of the sensitivities, relative", own, "", f"< {10 * RTOL:g}"
    yield "time of the motion with sensitivities", 1e3 * quickest, "ms", ""
    yield "steps", ours.n_steps, "", ""
    for rtol in TRIED:
        seconds, result = _by_cvodes(equations, module.default_parameters, rtol)
        if error(result) <= own or rtol == TRIED[-1]:
            yield f"CVODES at {rtol:g}: error, relative", error(result), "", ""
            yield "CVODES: time", 1e3 * seconds, "ms", ""
            yield "CVODES' time by symdyn's", seconds / quickest, "", ">= 10"
            return


def _in_turns(*calls: Any, read: Callable[[], float] = clock.process_time) -> list[float]:
    """The least time of each of some calls, s; read: the clock, of this process unless calls wait for others."""
    result = [[_seconds(call, read) for call in calls] for _ in range(60)]
    return [min(column) for column in zip(*result, strict=True)]


def _seconds(call: Any, read: Callable[[], float] = clock.perf_counter) -> float:
    begun = read()
    call()
    return read() - begun


def _by_cvodes(equations: Equations, values: np.ndarray, rtol: float) -> tuple[float, np.ndarray]:
    """Time of CasADi's CVODES with forward sensitivities, s, and the sensitivities at the end, (n_x, n)."""
    package_folder("casadi")
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):  # CasADi compiles in the present one
        return _within_folder(equations, values, rtol)


def _within_folder(equations: Equations, values: np.ndarray, rtol: float) -> tuple[float, np.ndarray]:
    import casadi as ca

    symbols = equations.symbols
    x = ca.SX.sym("x", len(START))
    p, by = ca.SX(values), ca.SX.sym("p", len(NAMES))
    places = [[s.name for s in symbols.parameters].index(name) for name in NAMES]
    for k, place in enumerate(places):
        p[place] = by[k]
    leaves = dict(zip([s.name for s in (*symbols.coordinates, *symbols.speeds, *symbols.parameters)],
                      [*ca.vertsplit(x), *ca.vertsplit(p)], strict=True))
    options: Any = {"abstol": rtol, "reltol": rtol, "max_num_steps": 10**7, "fsens_err_con": True,
                    "linear_multistep_method": "adams", "nonlinear_solver_iteration": "functional",
                    "jit": True, "compiler": "shell", "jit_options": {"flags": ["-O3", "-march=native"]}}
    integrator = ca.integrator("motion", "cvodes", {"x": x, "p": by, "ode": casadi_field(ca, equations, leaves)}, 0, END, options)
    forward = integrator.forward(len(NAMES))
    call = lambda: forward(x0=START, p=values[places], fwd_x0=np.zeros((len(START), len(NAMES))), fwd_p=np.eye(len(NAMES)))
    result = np.array(call()["fwd_xf"])
    return min(_seconds(call) for _ in range(10)), result


def gradient() -> Iterator[Figure]:
    """A loss of PUMA's free fall for 10 s by its parameters and its start, and one of a chain of seven links by 60 numbers."""
    options: dict[str, Any]
    for name, n, options in (("puma560", 46, {}), ("spatial_chain", 60, {"n": 7})):
        module = sd.systems.get(name, **options).equations().compile(backend="c")
        metadata = module.metadata
        by = [*[f"{x}(0)" for x in metadata.x], *metadata.parameters][:n]
        q = [sp.Symbol(name) for name in metadata.q]
        loss = sd.Loss(integral=q[0] ** 2 + sp.Symbol(metadata.u[1]) ** 2, end=(q[2] - 1) ** 2)
        motion: dict[str, Any] = {"q": np.linspace(0.1, 0.6, len(q)), "u": np.zeros(len(q)), "rtol": 1e-8}
        result = module.gradient(loss, by, (0, END), **motion)
        once, back = _in_turns(partial(module.simulate, np.array([0.0, END]), **motion),
                               partial(module.gradient, loss, by, (0, END), **motion))
        yield f"{name}: numbers that the gradient is by", len(by), "", ""
        yield f"{name}: steps", result.n_steps, "", ""
        yield f"{name}: time of a motion", 1e3 * once, "ms", ""
        yield f"{name}: time of its gradient, in motions", back / once, "", "<= 6"
        yield f"{name}: most memory kept", result.memory / 2**10, "KiB", ""


def diffrax() -> Iterator[Figure]:
    """A loss of PUMA's free fall for 1 s by the ten inertial parameters of its six links, compared with diffrax's adjoints: the
    discrete one, which is its default, and the continuous one, which integrates the motion backwards."""
    missing = _missing()
    if missing:
        raise MissingExtra(f"the Python package {missing[0]} is not installed; run: pip install jax diffrax")
    equations = sd.systems.get("puma560", general=True).equations()
    module = equations.compile(backend="c")
    metadata = module.metadata
    by = [name for name in metadata.parameters if name[0] in "mcI"]
    start, end = np.append(np.linspace(0.1, 0.6, 6), np.zeros(6)), 1.0
    q1, q3, u2 = sp.symbols("q1 q3 q2_dot")
    loss = sd.Loss(integral=q1**2 + u2**2, end=(q3 - 1) ** 2)
    call = partial(module.gradient, loss, by, (0, end), start[:6], start[6:], rtol=1e-8)
    result = call()
    yield "numbers that the gradient is by", len(by), "", ""
    yield "steps", result.n_steps, "", ""
    yield "most memory kept", result.memory / 2**10, "KiB", ""
    forward = partial(module.simulate, np.array([0.0, end]), start[:6], start[6:], rtol=1e-8, sensitivities=by)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SimulationWarning)  # some parameters have no effect
        compiled = _seconds(forward)
        once, forwards = _in_turns(call, forward, read=clock.perf_counter)
    yield "time of the gradient", 1e3 * once, "ms", ""
    yield "time of sensitivities forwards, by the same numbers", 1e3 * forwards, "ms", ""
    yield "forwards: compilation, or loading", compiled, "s", ""
    for adjoint in ("RecursiveCheckpointAdjoint", "BacksolveAdjoint"):
        theirs = _ByDiffrax(equations, module.default_parameters, by, start, end, adjoint)
        value, gradient = theirs()
        yield f"{adjoint}: compilation", theirs.compiled, "s", ""
        yield f"{adjoint}: steps", theirs.steps, "", ""
        yield f"{adjoint}: memory for what lies between", theirs.memory / 2**10, "KiB", ""
        yield "difference of the losses, relative", abs(value / result.value - 1), "", "< 1e-7"
        apart = np.abs(gradient - result.array).max() / np.abs(gradient).max()
        yield "difference of the gradients, relative", apart, "", "< 1e-6"
        once, their_time = _in_turns(call, theirs, read=clock.perf_counter)
        yield f"{adjoint}: time", 1e3 * their_time, "ms", ""
        yield f"{adjoint}: time by symdyn's", their_time / once, "", ">= 20"


def _missing() -> list[str]:
    """Packages that the comparison with diffrax needs and that are not installed."""
    return [name for name in ("jax", "diffrax") if importlib.util.find_spec(name) is None]


class _ByDiffrax:
    """A loss and its gradient by diffrax, compiled by XLA.

    compiled: time that it took, s; steps: of the motion, and tried ones; memory: bytes that XLA takes besides arguments and
    results
    """

    def __init__(self, equations: Equations, values: np.ndarray, by: Sequence[str], start: np.ndarray, end: float,
                 adjoint: str) -> None:
        jax, solver = importlib.import_module("jax"), importlib.import_module("diffrax")
        jnp = importlib.import_module("jax.numpy")
        jax.config.update("jax_enable_x64", True)
        symbols = equations.symbols
        names = [s.name for s in (*symbols.coordinates, *symbols.speeds)]
        parameters = [s.name for s in symbols.parameters]
        places = np.array([parameters.index(name) for name in by])
        words = SimpleNamespace(sin=jnp.sin, cos=jnp.cos, vertcat=lambda *entries: jnp.stack([jnp.asarray(e) for e in entries]))
        n, costs = len(names), [names.index(name) for name in ("q1", "q2_dot", "q3")]

        def field(t: Any, x: Any, p: Any) -> Any:
            entries = [*[x[k] for k in range(n)], *[p[k] for k in range(len(values))]]
            leaves = dict(zip([*names, *parameters], entries, strict=True))
            return jnp.append(casadi_field(words, equations, leaves), x[costs[0]] ** 2 + x[costs[1]] ** 2)

        def loss(given: Any) -> Any:
            p = jnp.asarray(values).at[places].set(given)
            run = solver.diffeqsolve(solver.ODETerm(field), solver.Dopri8(), 0.0, end, None, jnp.append(jnp.asarray(start), 0.0),
                                     args=p, stepsize_controller=solver.PIDController(rtol=1e-8, atol=1e-8),
                                     adjoint=getattr(solver, adjoint)(), max_steps=4096)
            return run.ys[-1, n] + (run.ys[-1, costs[2]] - 1) ** 2, run.stats["num_steps"]

        begun = clock.perf_counter()
        self._given = values[places]
        self._call = jax.jit(jax.value_and_grad(loss, has_aux=True)).lower(self._given).compile()
        self.compiled = clock.perf_counter() - begun
        self.steps = int(self._call(self._given)[0][1])
        self.memory = int(self._call.memory_analysis().temp_size_in_bytes)

    def __call__(self) -> tuple[float, np.ndarray]:
        (value, _), gradient = self._call(self._given)
        return float(value), np.asarray(gradient)


def memory() -> Iterator[Figure]:
    """Memory of the gradient of a pendulum's swing, over the number of steps."""
    module = sd.systems.pendulum().embedding().compile(backend="c")
    result = [module.gradient(sd.Loss(end=sp.Symbol("q1")), ["l"], (0, end), [0.5], max_step=0.01) for end in (100, 400, 6400)]
    for one in result:
        yield f"memory that a gradient of {one.n_steps} steps keeps", one.memory / 2**10, "KiB", ""
    yield "that of the last by that of the one before, of 16 times fewer", result[2].memory / result[1].memory, "", "< 5"


def fit() -> Iterator[Figure]:
    """Damping, mass and start of a pendulum from 1,002 noisy values of its angle over 10 s."""
    q, (m, d) = sd.coordinates("q"), sd.parameters("m d")
    system = sd.System("damped", gravity=[0, -9.81])
    bob = system.add_body("bob", mass=m, inertia=0.01, com=[0, -0.5])
    hinge = system.add_joint(sd.Revolute("hinge", system.ground, bob, q))
    system.add_joint_force(hinge, -d * q.dot, name="friction")
    system.defaults, system.initial = {m: 1, d: 0.2}, {q: 1}
    module = system.embedding().compile(backend="c")
    t, rng = np.linspace(0, 10, 1002), np.random.default_rng(0)
    measured = module.simulate(t, params={m: 1.3, d: 0.15}).q[:, 0] + 0.01 * rng.normal(size=1002)
    experiment = sd.Experiment(t, {q: measured}, q=[0.9])
    result = sd.fit(module, experiment, [d, m], initial=[q])
    off = [(result.values[name] - truth) / result.deviations[name] for name, truth in (("d", 0.15), ("m", 1.3), ("q(0)", 1.0))]
    yield "fit of 1,002 values: largest error, in standard deviations", float(np.abs(off).max()), "", "< 3"
    for what, more in (("damping and mass", {}), ("damping, mass and start", {"initial": [q]})):
        quickest, = _in_turns(lambda more=more: sd.fit(module, experiment, [d, m], **more))
        yield f"fit of 1,002 values, {what}: time", 1e3 * quickest, "ms", "<= 10"


GROUPS = (cvodes, gradient, memory, fit, diffrax)


def run(only: Sequence[str] | None = None) -> int:
    """Print every figure; returns the number of those that miss their bound. diffrax is left out where it is not installed,
    unless it is requested by name, which raises MissingExtra."""
    missing = _missing()
    if missing and not only:
        count = print_figures(GROUPS[:-1])
        print(f"diffrax: not measured, {' and '.join(missing)} not installed; run: pip install jax diffrax")
        return count
    return print_figures(GROUPS, only)
