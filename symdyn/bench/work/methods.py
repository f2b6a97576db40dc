"""Methods of integration as the bench names them, and what each takes: tolerances, or steps of one length."""

from __future__ import annotations

from symdyn.runtime.methods import COMPILED, is_compiled

# Of SciPy, on the compiled right-hand side; measured if they are named.
SCIPY = ("RK45", "DOP853", "Radau", "BDF", "LSODA", "RK23")
# Compiled methods with steps of one length, which they choose by the tolerance unless it is given.
FIXED = ("gauss",)
# Chooses one of them for every run; measured if it is named.
AUTO = "auto"


def names() -> list[str]:
    """Every method that can be asked for."""
    return [*COMPILED, AUTO, *SCIPY]


def usual() -> list[str]:
    """What is measured unless methods are named: all that are compiled."""
    return list(COMPILED)


def takes_steps(name: str) -> bool:
    """Whether a method can be given steps of one length in the place of tolerances."""
    return name in FIXED and is_compiled(name)
