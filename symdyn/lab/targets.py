"""Agreement of functions for CasADi, JAX and PyTorch, and of files in other languages, with the C module:
python -m symdyn.lab.targets --library jax, or --language rust"""

from __future__ import annotations

import argparse
import importlib
import warnings
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

import symdyn as sd
from symdyn.errors import UnsupportedExpression
from symdyn.formulation.equations import Equations
from symdyn.lab.languages import PROGRAMS, evaluated

STATES = 1000


def compared(name: str, way: str, dtype: str, through: str = "xla") -> tuple[np.ndarray, int]:
    """Differences of the right-hand side at random states, each by its largest entry, and how many states have a result in one of
    both only."""
    system = sd.systems.get(name)
    equations = system.augmented() if system.loops or system.constraints else system.embedding()
    module = equations.compile(backend="c")
    rng, kind = np.random.default_rng(1), np.dtype(dtype)
    start = np.array([module.metadata.initial.get(k, 0.0) for k in module.metadata.x])
    given = (rng.uniform(0, 2, STATES), start + 0.3 * rng.normal(size=(STATES, len(start))), np.array(module.default_parameters),
             rng.normal(size=(STATES, len(module.metadata.inputs))))
    t, x, p, inputs = (a.astype(kind).astype(float) for a in given)
    result = _evaluated(equations, way, dtype, through)(t, x, p, inputs)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        wanted = module.evaluate("rhs", t, x, p, inputs)
    there = np.isfinite(result).all(axis=1), np.isfinite(wanted).all(axis=1)
    both = there[0] & there[1]
    errors = np.abs(result - wanted)[both].max(axis=1) / np.maximum(np.abs(wanted[both]).max(axis=1), 1e-300)
    return errors, int((there[0] != there[1]).sum())


def _evaluated(equations: Equations, way: str, dtype: str, through: str) -> Callable[..., np.ndarray]:
    if way in PROGRAMS:
        return evaluated(equations, way)
    if way == "casadi":
        f = equations.to_casadi("rhs")
        return lambda t, x, p, inputs: f.map(STATES)(t, x.T, np.tile(p[:, None], STATES), inputs.T).full().T
    library: Any = importlib.import_module(way)
    if way == "torch":
        of_tensors = equations.to_torch("rhs", dtype)
        return lambda *given: of_tensors(*map(library.tensor, given)).double().numpy()  # type: ignore[no-any-return]
    library.config.update("jax_enable_x64", dtype == "float64")
    many = library.jit(library.vmap(equations.to_jax("rhs", dtype, through), (0, 0, None, 0)))
    return lambda *given: np.asarray(many(*given), dtype=float)


def run(arguments: Sequence[str] | None = None) -> None:
    """Print a line for each mechanism of the catalogue."""
    parser = argparse.ArgumentParser(prog="python -m symdyn.lab.targets")
    parser.add_argument("--library", choices=("casadi", "jax", "torch"), default="casadi")
    parser.add_argument("--language", choices=tuple(PROGRAMS), help="files in a language in place of a library")
    parser.add_argument("--dtype", choices=("float64", "float32"), default="float64")
    parser.add_argument("--through", choices=("xla", "c"), default="xla")
    parser.add_argument("names", nargs="*", default=sd.systems.names())
    chosen = parser.parse_args(arguments)
    for name in chosen.names:
        try:
            errors, apart = compared(name, chosen.language or chosen.library, chosen.dtype, chosen.through)
        except UnsupportedExpression as error:
            print(f"{name:36} {error}")
            continue
        print(f"{name:36} largest {errors.max():.1e}  median {np.median(errors):.1e}  states with one result only {apart}")


if __name__ == "__main__":
    run()
