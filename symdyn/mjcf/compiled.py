"""MuJoCo's compiled model of a document, and where its elements stand in the file."""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from symdyn.errors import MissingExtra, ModelError
from symdyn.mjcf.document import Reader
from symdyn.urdf.values import FileFaults

# Entries of rotation matrices nearer to 0, 1 and -1 are the rounding of these.
_ROUNDING = 4e-16


def library(wanted: str = "reading an MJCF") -> Any:
    """MuJoCo. Raises MissingExtra."""
    try:
        import mujoco
    except ImportError:
        raise MissingExtra(f"{wanted} needs the package mujoco: pip install 'symdyn[mjcf]'") from None
    return mujoco


class Compiled:
    """A compiled model: `m`, its arrays as MuJoCo calls them, and names and lines of its elements."""

    def __init__(self, path: Path, folder: Path | None, faults: FileFaults, given: bytes | None = None) -> None:
        self.mujoco = library()
        self.path, self.faults = path, faults
        reader = Reader(path, folder, faults)
        root = reader.read(given)
        self.expanded = reader.expanded
        if faults or root is None:
            raise ModelError(faults)
        self.title = root.attributes.get("model", "").strip()
        try:
            with warnings.catch_warnings():  # of elements that later versions of the format do without
                warnings.simplefilter("ignore", UserWarning)
                self.spec = self.mujoco.MjSpec.from_string(self.expanded.text)
                self.m = self.spec.compile()
        except (ValueError, RuntimeError, self.mujoco.FatalError) as error:
            raise ModelError([self._rejection(str(error))]) from None
        types = self.mujoco.mjtObj
        self.types = {"body": types.mjOBJ_BODY, "joint": types.mjOBJ_JOINT, "tendon": types.mjOBJ_TENDON,
                      "actuator": types.mjOBJ_ACTUATOR, "equality": types.mjOBJ_EQUALITY, "geom": types.mjOBJ_GEOM,
                      "site": types.mjOBJ_SITE}
        listed = {"body": self.spec.bodies, "joint": self.spec.joints, "tendon": self.spec.tendons, "geom": self.spec.geoms,
                  "actuator": self.spec.actuators, "equality": self.spec.equalities, "site": self.spec.sites}
        self.lines = {kind: {int(e.id): e.info for e in elements} for kind, elements in listed.items()}

    def _rejection(self, message: str) -> str:
        said, _, rest = message.partition("\n")
        result = re.search(r"line (\d+)", rest) or re.search(r"line (\d+)", said)
        name = re.search(r"[Ee]lement (?:name )?'([^']+)'", rest)
        about = f" in {name[1]!r}" if name else ""
        return (f"{self.expanded.where(self.path, int(result[1]) if result else 0)}: MuJoCo rejects the model{about}: "
                f"{said.removeprefix('XML ').removeprefix('Error: ').strip()}")

    def name(self, kind: str, number: int) -> str:
        """The name of an element, KIND_NUMBER for one without."""
        return str(self.mujoco.mj_id2name(self.m, int(self.types[kind]), number) or "") or f"{kind}_{number}"

    def where(self, kind: str, number: int) -> str:
        """FILE:LINE of an element."""
        result = re.search(r"line (\d+)", self.lines[kind].get(number, ""))
        return self.expanded.where(self.path, int(result[1]) if result else 0)

    def fault(self, kind: str, number: int, text: str) -> None:
        """A fault of an element."""
        self.faults.append(f"{self.where(kind, number)}: {kind} {self.name(kind, number)!r} {text}")

    def joint(self, number: int) -> tuple[str, int, int]:
        """Kind (free, ball, slide or hinge) and addresses in positions and speeds of a joint."""
        kind = ("free", "ball", "slide", "hinge")[int(self.m.jnt_type[number])]
        return kind, int(self.m.jnt_qposadr[number]), int(self.m.jnt_dofadr[number])


def rotation(quaternion: np.ndarray) -> np.ndarray:
    """R (3, 3) of a quaternion, w first; what is 0 or 1 to rounding is so exactly."""
    w, x, y, z = np.asarray(quaternion, dtype=float) / np.linalg.norm(quaternion)
    R = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                  [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                  [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
    near = np.round(R)
    return np.where(np.abs(R - near) <= _ROUNDING, near, R)
