"""The meshes that a file of a robot names."""

from __future__ import annotations

from pathlib import Path

from symdyn.shown import shown
from symdyn.urdf.meshes import Piece, pieces
from symdyn.urdf.values import FileFaults


class MeshFiles:
    """Reads meshes; folder: that none may be outside of."""

    def __init__(self, faults: FileFaults, folder: Path) -> None:
        self.faults, self.base, self.folder = faults, faults.path.parent, folder.resolve()

    def pieces(self, name: str, line: int, what: str) -> list[Piece]:
        """The reduced triangles of a mesh by its colours; none, and a fault, where it cannot be read."""
        path = self._file(name, line, what)
        try:
            return [] if path is None else list(pieces(path))
        except ValueError as error:
            self.faults.at(line, f"{what}: the mesh {shown(name)} {error}")
            return []

    def _file(self, name: str, line: int, what: str) -> Path | None:
        """The file of a name: after package://NAME/ or model://NAME/ the path is seen from the folder, with NAME or without, or
        from a folder NAME that holds the robot."""
        inside = name.removeprefix("package://").removeprefix("model://").removeprefix("file://")
        package, _, rest = inside.partition("/")
        if name.startswith(("package://", "model://")):
            above = next((p for p in self.base.resolve().parents if p.name == package), self.base)
            candidates = [self.folder / inside, self.folder / rest, above / rest, above.parent / inside]
        else:
            candidates = [self.base / inside]
        result = [c.resolve() for c in candidates]
        held = [c for c in result if c.is_relative_to(self.folder)]
        if not held:
            self.faults.at(line, f"{what}: the mesh {shown(name)} is outside of the folder {self.folder}; pass folder=... with "
                                 "one that holds all files of the robot")
            return None
        here = next((c for c in held if c.is_file()), None)
        if here is None:
            self.faults.at(line, f"{what}: there is no mesh {shown(name)} (looked for {held[0]}); pass folder=..., or "
                                 "visuals=False")
        return here
