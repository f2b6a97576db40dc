"""Functions for JAX: statements that XLA compiles, or the compiled C library that XLA calls."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from symdyn.errors import ArgumentError
from symdyn.formulation.equations import Equations
from symdyn.shown import shown
from symdyn.targets.functions import dtype_of, library, made

THROUGH = ("xla", "c")


def jax_function(equations: Equations, name: str, dtype: str, through: str, unroll: bool | None,
                 specialize: Mapping[Any, float] | None) -> Callable[..., Any]:
    """See Equations.to_jax."""
    if through not in THROUGH:
        raise ArgumentError(f"to_jax: through is {shown(through)}; take 'xla', statements that XLA compiles for any device, or "
                            "'c', the compiled C library, which XLA calls on a CPU")
    if unroll is not None and not isinstance(unroll, bool):
        raise ArgumentError(f"to_jax: unroll is {shown(unroll)}; take True, False or None")
    jax = library("jax", "to_jax")
    if dtype_of(dtype, "to_jax") == "float64" and not jax.config.jax_enable_x64:
        raise ArgumentError("to_jax: JAX computes in float32 unless 64 bits are enabled; call "
                            "jax.config.update('jax_enable_x64', True) before anything else of JAX, or pass dtype='float32'")
    module = made(equations, "jax", name, specialize)
    by = None
    if through == "c":
        from symdyn.targets.jax_library import through_library

        by = through_library(equations, name, module, specialize)
    return module.function(name, dtype, unroll, by)  # type: ignore[no-any-return]
