"""Other programs compared with symdyn in the same run, one small module each; see `peer` for what each gives.

A module here gives PEERS, a tuple of peers: one program may run with several integrators.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterable

from symdyn.bench.work.against.peer import Peer

# Name as after --against -> module of this package.
_HOME: dict[str, str] = {
    "scipy": "scipy_methods", "cvode": "cvode", "ida": "ida", "heyoka": "heyoka_taylor", "casadi": "casadi_cvodes",
    "pinocchio": "pinocchio_aba", "mujoco": "mujoco_rk4", "exudyn": "exudyn_solvers",
}
ALL = "all"


def names() -> list[str]:
    """Names that --against takes, besides ALL for all of these."""
    return list(_HOME)


def named(asked: Iterable[str]) -> list[str]:
    """Requested names, with all names in the place of ALL."""
    return list(dict.fromkeys(name for one in asked for name in (names() if one == ALL else [one])))


def peers(name: str) -> tuple[Peer, ...]:
    """The peers of a name; nothing of theirs is imported before `available` or `prepare` is called."""
    result: tuple[Peer, ...] = importlib.import_module(f"{__name__}.{_HOME[name]}").PEERS
    return result
