"""Written mechanisms with the program of a trajectory, and how they are compiled."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from symdyn import systems
from symdyn.pipeline import emit, write_source

TRAJECTORY = Path(__file__).parent / "trajectory.c"


@dataclass(frozen=True)
class Written:
    """A mechanism in files of C: its name, its folder, and whether it has code for SIMD lanes."""

    name: str
    folder: Path
    lanes: bool

    @property
    def source(self) -> Path:
        return self.folder / f"{self.name}.c"

    def trajectory(self) -> list[str]:
        """Arguments of a compiler for the program of a trajectory, whose output are its bits."""
        lanes = ["-DBATCH"] if self.lanes else []
        return [f"-DMECHANISM={self.name}", f'-DHEADER="{self.name}.h"', *lanes, f"-I{self.folder}", str(TRAJECTORY),
                str(self.source)]

    def selftest(self) -> list[str]:
        """Arguments of a compiler for the program that compares every function with its reference vectors."""
        return [f"-I{self.folder}", str(self.folder / "main.c"), str(self.source)]


def written(name: str, folder: Path, method: str = "dop853") -> Written:
    """The files of a mechanism of the catalogue; one without constraints has lanes, too."""
    constrained, system = name in systems.names(constrained=True), systems.get(name)
    lanes = not constrained and method == "dop853"
    equations = system.augmented() if constrained else system.embedding()
    write_source(emit(equations, "c", method=method, batch=lanes), folder)
    return Written(name, folder, lanes)
