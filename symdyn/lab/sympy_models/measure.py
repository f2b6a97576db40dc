"""Examples of SymPy's taken over, compared with SymPy's own matrices: agreement, linear equations, operations, times.

    symdyn bench sympy [--only NAME ...]

Each row has the example, SymPy's time to derive it, the operations of what it prints, the time in which symdyn takes it over, its
operations, one evaluation of x_dot by symdyn's C module and by `sympy.lambdify(..., cse=True)` with numpy.linalg.solve, and the
largest difference of both relative to x_dot at random states, also of the derivatives by x, unless SymPy takes long for
them, half a minute and more.
The bicycle is compared with published eigenvalues. Exit code 1: a difference above BOUND.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import sympy as sp

import symdyn as sd
from symdyn.formulation.equations import Equations
from symdyn.lab.sympy_models.example import Derived, Example
from symdyn.lab.sympy_models.examples import BICYCLE_EIGENVALUES, EXAMPLES
from symdyn.timing.loops import best_times, compiled_loop

BOUND, OF_EIGENVALUES = 1e-12, 1e-10
STATES = 50


def taken(example: Example, derived: Derived) -> Any:
    """The example's equations in symdyn."""
    name = "".join(c if c.isalnum() else "_" for c in example.name).strip("_")
    known = {z.func.__name__ for z in derived.states}
    start = {name: value for name, value in example.start.items() if value or name in known}
    return sd.from_sympy(derived.equations, name, defaults=example.numbers, initial=start, states=derived.states)


def lambdified(derived: Derived, equations: Equations) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """x_dot of coordinates and speeds (n_q + n_u,) by SymPy's matrices: f(x, inputs)."""
    method, t = derived.equations, sp.physics.mechanics.dynamicsymbols._t
    symbols = equations.symbols
    speeds = list(method.u) if hasattr(method, "_udep") else list(method.q.diff(t))
    inputs = [sp.Function(i.name)(t) for i in symbols.inputs]
    arguments = [[*method.q, *speeds, *derived.states], list(symbols.parameters), inputs]
    formed = sp.lambdify(arguments, [method.mass_matrix_full, method.forcing_full.doit()], cse=True)
    numbers = [float(symbols.defaults[p]) for p in symbols.parameters]

    def rates(x: np.ndarray, given: np.ndarray) -> np.ndarray:
        M, f = formed(x, numbers, given)
        return np.linalg.solve(M, f).ravel()  # type: ignore[no-any-return]

    return rates


def differentiated(derived: Derived, equations: Equations) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """Derivatives of x_dot by x by SymPy: f(x, inputs), from M x_dot = f as M dx_dot = df - dM x_dot."""
    method, t = derived.equations, sp.physics.mechanics.dynamicsymbols._t
    symbols = equations.symbols
    speeds = list(method.u) if hasattr(method, "_udep") else list(method.q.diff(t))
    functions = [*method.q, *speeds, *derived.states]
    x, rates = sp.symbols(f"x_:{len(functions)}"), sp.symbols(f"rate_:{method.mass_matrix_full.rows}")
    inputs = [sp.Function(i.name)(t) for i in symbols.inputs]
    plain = dict(zip(functions, x, strict=True))
    M, f = method.mass_matrix_full.subs(plain), method.forcing_full.doit().subs(plain)
    given = [list(symbols.parameters), inputs]
    formed = sp.lambdify([list(x), *given], [M, f], cse=True)
    slopes = sp.lambdify([list(x), list(rates), *given], (M * sp.Matrix(rates) - f).jacobian(x), cse=True)
    numbers = [float(symbols.defaults[p]) for p in symbols.parameters]

    def derivatives(state: np.ndarray, inputs_now: np.ndarray) -> np.ndarray:
        mass, forcing = formed(state, numbers, inputs_now)
        now = np.linalg.solve(mass, forcing).ravel()
        return -np.linalg.solve(mass, np.array(slopes(state, now, numbers, inputs_now), dtype=float))  # type: ignore[no-any-return]

    return derivatives


def random_states(example: Example, equations: Equations, count: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """States near the example's start, not all of them consistent, and inputs."""
    s, stream = equations.symbols, np.random.default_rng(7)
    start = np.array([float(s.initial.get(a, 0.0)) for a in (*s.coordinates, *s.speeds, *s.states)])
    for _ in range(count):
        yield start + stream.uniform(0.05, 0.5, len(start)), stream.uniform(-1, 1, len(s.inputs))


def run(only: Sequence[str] | None = None) -> int:
    """Print the table; returns how many bounds are missed."""
    missed = 0
    print(f"{'example':22}{'derive':>8}{'printed':>11}{'take':>8}{'steps':>7}{'symdyn':>10}{'lambdify':>10}{'ratio':>7}  "
          "difference  of derivatives")
    for example in EXAMPLES:
        if only and not any(example.name.startswith(name) for name in only):
            continue
        missed += _row(example)
    return missed


def _row(example: Example) -> int:
    start = clock.perf_counter()
    derived = example.make()
    derived_in, start = clock.perf_counter() - start, clock.perf_counter()
    equations = taken(example, derived)
    taken_in = clock.perf_counter() - start
    method = derived.equations
    printed = int(sp.count_ops(method.mass_matrix_full) + sp.count_ops(method.forcing_full))
    module, theirs = equations.compile("c"), lambdified(derived, equations)
    states = list(random_states(example, equations, STATES))
    worst = 0.0
    for x, given in states:
        expected = theirs(x, given)
        result = module.rhs(0.0, x, inputs=given)[:len(expected)]
        worst = max(worst, float(np.abs(result - expected).max() / np.abs(expected).max()))
    of_slopes = 0.0 if example.slow else _of_slopes(derived, equations, module, states[:5])
    x, given = states[0]
    loop = compiled_loop(equations, x, name="rhs")

    def evaluate(n: int) -> None:
        for _ in range(n):
            theirs(x, given)

    ours, other = best_times([loop.run, evaluate], 20)
    print(f"{example.name:22}{derived_in:6.1f} s{printed:11,}{taken_in:6.1f} "
          f"s{equations.tape('rhs').operations:7,}{ours * 1e9:7.0f} ns{other * 1e6:7.0f} us{other / ours:7.0f}  "
          f"{worst:.1e}     {'-' if example.slow else f'{of_slopes:.1e}'}{'' if max(worst, of_slopes) <= BOUND else '  MISSED'}",
          flush=True)
    return int(max(worst, of_slopes) > BOUND) + (_bicycle(module) if example.name == "bicycle" else 0)


def _of_slopes(derived: Derived, equations: Equations, module: Any, states: Sequence[tuple[np.ndarray, np.ndarray]]) -> float:
    """The largest difference of derivatives by x, relative to the largest of them."""
    theirs, worst = differentiated(derived, equations), 0.0
    for x, given in states:
        expected = theirs(x, given)
        result = module.jacobian(0.0, x, inputs=given).x[:len(expected), :expected.shape[1]]
        worst = max(worst, float(np.abs(result - expected).max() / np.abs(expected).max()))
    return worst


def _bicycle(module: Any) -> int:
    """Compare the eigenvalues at 5 m/s with the published ones."""
    result = np.linalg.eigvals(module.linearize().A)
    moving = np.array(sorted(result[np.abs(result) > 1e-6], key=lambda e: (e.real, e.imag)))
    worst = float(np.abs(moving - np.array(BICYCLE_EIGENVALUES)).max())
    print(f"  eigenvalues at 5 m/s: {worst:.1e} 1/s from the published ones{'' if worst <= OF_EIGENVALUES else '  MISSED'}")
    return int(worst > OF_EIGENVALUES)
