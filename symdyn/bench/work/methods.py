"""Methods of integration as the bench names them, and what each takes: tolerances, or steps of one length."""

from __future__ import annotations

from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.integrating.methods import COMPILED, is_compiled

# Methods of SciPy, on the compiled right-hand side; measured if they are named.
SCIPY = ("RK45", "DOP853", "Radau", "BDF", "LSODA", "RK23")
# Those that are measured by default where there is no compiler; and a remark on it.
INSTEAD = ("RK45", "DOP853", "Radau", "LSODA")
NO_COMPILER = "there is no C compiler: NumPy evaluates the right-hand side, for methods of SciPy; for compiled ones install gcc"
# It evaluates orders of series, not the right-hand side, whose number of operations does not apply.
SERIES = "taylor"
# Compiled methods with steps of one length, which they choose by the tolerance unless it is given.
FIXED = ("gauss",)
# Chooses one of them for every run; measured if it is named.
AUTO = "auto"


def names() -> list[str]:
    """Every method that can be requested."""
    return [*COMPILED, AUTO, *SCIPY]


def usual() -> list[str]:
    """Methods that are measured by default: all that are compiled, or where there is no compiler some of SciPy's."""
    return list(COMPILED) if find_compiler() is not None else list(INSTEAD)


def takes_steps(name: str) -> bool:
    """Whether a method can be given steps of one length in the place of tolerances."""
    return name in FIXED and is_compiled(name)
