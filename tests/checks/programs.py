"""Written mechanisms with the program of a trajectory, and how they are compiled."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from symdyn import systems
from symdyn.pipeline import emit, write_source
from symdyn.translation_units import translation_units

TRAJECTORY = Path(__file__).parent / "trajectory.c"


@dataclass(frozen=True)
class Written:
    """A mechanism in files of C.

    units   what is compiled side by side where it is called from Python
    lanes   whether it has code for SIMD lanes
    """

    name: str
    folder: Path
    units: list[Path]
    lanes: bool

    @property
    def source(self) -> Path:
        return self.folder / f"{self.name}.c"

    @property
    def calls_sines(self) -> bool:
        """Whether sines come from the math library, not only from symdyn's own, whose bits are the same everywhere."""
        return re.search(r"\b(sin|cos)\((?!double)\w+\)", self.source.read_text(encoding="utf-8")) is not None

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
    source = emit(equations, "c", method=method, batch=lanes)
    write_source(source, folder)
    (text,) = emit(equations, "c", standalone=False, method=method).files.values()
    units = [folder / f"unit_{k}.c" for k, _ in enumerate(translation_units(text))]
    for path, unit in zip(units, translation_units(text), strict=True):
        path.write_text(unit.text, encoding="utf-8")
    return Written(source.metadata.name, folder, units, lanes)
