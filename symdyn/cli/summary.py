"""A computed motion in a few lines."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution

# States beyond these are not reported.
SHOWN = 12


def summarize(solution: Solution) -> None:
    """Print how it was computed, whether energy is kept, and where it ends."""
    module, metadata = solution.module, solution.module.metadata
    where = {"c": "compiled C", "numpy": "NumPy"}.get(solution.backend, solution.backend)
    end = f"{solution.t[-1]:.6g}" if len(solution.t) else "nothing"
    print(f"{module.name}: {solution.method} on {where} to t = {end} s" + ("" if solution.success else ", stopped early"))
    if module.fallback:
        print(f"  {module.fallback}")
    if solution.why:
        print(f"  {solution.method} because {solution.why}")
    for name, rows in solution.events.items():
        if len(rows.t):
            print(f"  event {name}: {len(rows.t)} times, first at t = {rows.t[0]:.6g} s")
    inside = solution.integrator_seconds
    time = f"{1e3 * solution.seconds:.3g} ms" if inside is None else f"{1e3 * inside:.3g} ms inside the integrator"
    print(f"  {solution.n_steps} steps, {solution.nfev} evaluations, {time}")
    if "energy" in module.functions and len(solution.t):
        print(f"  {_energy(solution)}")
    if metadata.constraints and len(solution.t):
        print(f"  {_constraints(solution)}")
    if len(solution.t):
        names = metadata.x
        state = ", ".join(f"{n} = {v:.6g}" for n, v in list(zip(names, solution.x[-1]))[:SHOWN])
        more = f", and {len(names) - SHOWN} more in the files" if len(names) > SHOWN else ""
        print(f"  at the end: {state}{more}")


def _constraints(solution: Solution) -> str:
    """Quality of the constraints, and its cost."""
    import numpy as np

    off = float(np.nanmax(np.abs(solution.constraint_violation), initial=0.0))
    detail = f"constraints are kept to {off:.2g} of the mechanism's length"
    made = solution.corrections
    if not made.n_steps:
        return detail
    return f"{detail}; projections changed {made.n_steps} steps, q by up to {made.position:.2g}, u by up to {made.speed:.2g}"


def _energy(solution: Solution) -> str:
    """The energy error where energy is kept, else how it changed."""
    module = solution.module
    kept = "power" in module.functions and not solution.rows("power").any()
    if kept:
        # Loads that could do work did none: energy_error() would ask for the work in their case.
        scale, rests = solution.energy_scale
        resets = solution.reset_energy
        change = abs(solution.energy - solution.energy[0] - sum(resets.values())).max()
        took = "".join(f", but for {rows[-1]:.6g} J by resets of {name}" for name, rows in resets.items())
        of = "its potential energy: it rests" if rests else "its largest part"
        return f"energy is kept to {change / scale if scale > 0 else 0.0:.2g} of {of}{took}"
    return f"energy goes from {solution.energy[0]:.6g} J to {solution.energy[-1]:.6g} J by loads and drives"
