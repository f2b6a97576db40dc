"""Models in MJCF read by symdyn and compared with MuJoCo: python -m symdyn.lab.robots FOLDER-OR-FILE ..."""

from __future__ import annotations

import time as clock
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from symdyn.errors import ModelError, ModelWarning, SymdynError
from symdyn.lab.robots.mujoco_robot import MujocoRobot
from symdyn.mjcf.compiled import Compiled
from symdyn.mjcf.read import read_mjcf
from symdyn.model.system import System
from symdyn.urdf.values import FileFaults

# Largest difference of a model.
AGREEMENT = 1e-12
# Random states of each model.
STATES = 5
# Number of draws of a state that has to fulfil constraints, anywhere and then near the start, and its tolerance, m or rad.
TRIES, CLOSED = 20, 1e-9


@dataclass
class Row:
    """A model that was compared, `fault` empty, or why it was not.

    mass     largest difference of mass, centre of mass and inertia of a body, relative to the largest
    M, ud    norm of the difference over the norm, of mass matrix and accelerations, the worst state
    """

    speeds: int = 0
    constraints: int = 0
    mass: float = 0.0
    M: float = 0.0
    ud: float = 0.0
    condition: float = 0.0
    seconds: float = 0.0
    fault: str = ""

    def __str__(self) -> str:
        if self.fault:
            return self.fault
        return (f"{self.speeds:>4}{self.constraints:>4}{self.seconds:>7.1f}  {self.mass:8.1e} {self.M:8.1e} {self.ud:8.1e}  "
                f"{self.condition:7.0e}{'' if self.agrees else '  DIFFERS'}")

    @property
    def agrees(self) -> bool:
        return max(self.mass, self.M, self.ud) <= AGREEMENT


def models(paths: Sequence[str | Path]) -> Iterator[Path]:
    """The files that are given, and those in MJCF in folders that are given."""
    for path in map(Path, paths):
        yield from [path] if path.is_file() else sorted(
            p for p in path.rglob("*.xml") if "<mujoco" in p.read_text(encoding="utf-8", errors="replace")[:20000]
            and "<mujocoinclude" not in p.read_text(encoding="utf-8", errors="replace")[:20000])


def measure(path: Path, folder: Path, states: int = STATES, seed: int = 0) -> Row:
    """The comparison of one model; folder: that holds its files. Raises SymdynError for a model that is not read."""
    start = clock.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        system = read_mjcf(path, folder=folder)
    row = measure_system(system, path, folder, states, seed)
    row.seconds = clock.perf_counter() - start
    return row


def measure_system(system: System, path: Path, folder: Path, states: int = STATES, seed: int = 0,
                   weights: bool = True) -> Row:
    """The comparison of a system with the file that it was read from, or written to, with numbers for all parameters.

    weights   whether to compare the inertia of the bodies
    Raises SymdynError."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        model = system.check()
        equations = system.augmented() if system.loops or system.constraints else system.embedding()
        module = equations.compile("numpy")
    row = Row(len(model.speeds))
    peer = MujocoRobot(Compiled(path, folder, FileFaults(path)), model)
    row.mass = peer.weights() if weights else 0.0
    rng = np.random.default_rng(seed)
    for _ in range(states):
        closed = bool(system.loops or system.constraints)
        _draw(peer, rng, closed)
        wanted = peer.constrained() if closed else peer.free()
        row.constraints = len(peer.constraints()[0]) if closed else 0
        M = peer.mass_matrix()
        x = peer.state()
        result = module.rhs(0.0, x, inputs=peer.commands())
        n_q, n_u = len(model.coordinates), len(model.speeds)
        ours = module.mass_matrix(x[:n_q])
        row.M = max(row.M, _apart(ours, M[np.ix_(peer.u_at, peer.u_at)]))
        row.ud = max(row.ud, _apart(result[n_q:n_q + n_u], wanted[peer.u_at]))
        row.condition = max(row.condition, float(np.linalg.cond(M)))
    return row


def _draw(peer: MujocoRobot, rng: np.random.Generator, closed: bool) -> None:
    """A random state, with constraints one that fulfils them and is not singular. Raises SymdynError where there is none."""
    for draw in (peer.random, peer.near_start):
        for _ in range(TRIES):
            draw(rng)
            if not closed or (peer.close() < CLOSED and not peer.singular()):
                return
    raise SymdynError("no regular state that fulfils the constraints was found")


def run(paths: Sequence[str | Path], folder: str | Path | None = None, states: int = STATES) -> int:
    """Print the table; returns how many models that were read differ by more than AGREEMENT.

    folder   that holds the files of all models; default: each model's own
    """
    counts = {"read": 0, "agree": 0, "rejected": 0}
    print(f"{'model':60}{'n_u':>4}{'n_c':>4}{'s':>7}  {'mass':>8} {'M':>8} {'ud':>8}  {'cond M':>7}")
    for path in models(paths):
        try:
            row = measure(path, Path(folder) if folder is not None else path.parent, states)
            counts["read"] += 1
            counts["agree"] += row.agrees
        except SymdynError as error:
            first = error.faults[0] if isinstance(error, ModelError) else str(error)
            row = Row(fault="rejected: " + first.replace(str(path.parent) + "/", "")[:150])
            counts["rejected"] += 1
        print(f"{'/'.join(path.parts[-3:])[-58:]:60}{row}", flush=True)
    print(f"{counts['read']} models read, {counts['agree']} agree to {AGREEMENT:.0e}; {counts['rejected']} rejected")
    return counts["read"] - counts["agree"]


def _apart(result: np.ndarray, wanted: np.ndarray) -> float:
    size = float(np.linalg.norm(wanted))
    return float(np.linalg.norm(result - wanted)) / size if size else float(np.linalg.norm(result))
