"""Pinocchio's articulated-body algorithm in C++ on a robot that it has read: its time, and the operations that it does."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator

import numpy as np

from symdyn.bench.pinocchio_casadi import ERROR_SIZE, sources
from symdyn.bench.toolchain import build_cpp, include_flags
from symdyn.errors import SymdynError
from symdyn.lab.peers.program import address
from symdyn.lab.robots.pinocchio_robot import PinocchioRobot

# Rounding times the condition numbers of mass matrices; a wrong model differs by far more.
_AGREEMENT = 1e-7


class PinocchioAba:
    """The compiled algorithm. Raises CompilerNotFound, CompileError, or SymdynError for missing headers."""

    def __init__(self) -> None:
        text = sources("model.hpp", "pinocchio_aba.cpp", "counted_aba.cpp")
        self.library = build_cpp("counted_aba", text, include_flags("pinocchio", "boost", "eigen"), ("pin",))
        self.library.aba_open.restype = ctypes.c_void_p
        self.library.aba_operations.restype = ctypes.c_long

    def run(self, robot: PinocchioRobot, q: np.ndarray, u: np.ndarray) -> Callable[[int], None]:
        """run(n): n evaluations at a state in symdyn's order; the first coordinate of the last joint carries the result on."""
        message = ctypes.create_string_buffer(ERROR_SIZE)
        opened = ctypes.c_void_p(self.library.aba_open(_text(robot), None, ctypes.c_long(0), message,
                                                       ctypes.c_long(ERROR_SIZE)))
        if not opened:
            raise SymdynError(f"Pinocchio could not build the model: {message.value.decode()}")
        at, v, out = robot.q(q), robot.matrix(q) @ u, np.zeros(len(u))
        place = ctypes.c_long(robot.joints[-1][1].idx_q)

        def run(n: int) -> None:
            self.library.aba_loop(opened, ctypes.c_long(n), place, address(at), address(v), address(out))

        run(1)
        wanted = robot.pin.aba(robot.model, robot.data, at, v, np.zeros(len(v)))
        if not np.linalg.norm(out - wanted) <= _AGREEMENT * np.linalg.norm(wanted):
            raise SymdynError(f"the model that was given to C++ is not the robot's: it accelerates by {out}, "
                              f"Pinocchio's by {wanted}")
        return run

    def operations(self, robot: PinocchioRobot, q: np.ndarray, u: np.ndarray) -> int:
        """Operations + - * / sqrt sin cos of one evaluation, as they are done, those with zeros and ones included."""
        message = ctypes.create_string_buffer(ERROR_SIZE)
        at, v = robot.q(q), robot.matrix(q) @ u
        result = self.library.aba_operations(_text(robot), address(at), address(v), message, ctypes.c_long(ERROR_SIZE))
        if result < 0:
            raise SymdynError(f"Pinocchio could not build the model: {message.value.decode()}")
        return int(result)


def _text(robot: PinocchioRobot) -> bytes:
    return "\n".join(_lines(robot)).encode()


def _lines(robot: PinocchioRobot) -> Iterator[str]:
    """The model as model.hpp reads it."""
    model = robot.model
    neutral = robot.pin.neutral(model)
    for k in range(1, model.njoints):
        joint, place, inertia = model.joints[k], model.jointPlacements[k], model.inertias[k]
        data = joint.createData()
        joint.calc(data, neutral[joint.idx_q:joint.idx_q + joint.nq])
        # Pinocchio's subspace has the linear part first; the axis of a joint with several speeds is not looked at.
        column = np.array(data.S).reshape(6, -1)[:, 0]
        axis = column[3:] if column[3:].any() else column[:3]
        kind = joint.shortname().removeprefix("JointModel")
        numbers = [*axis, *np.array(place.rotation).ravel(), *np.array(place.translation)]
        yield " ".join([f"turned {model.parents[k]} {kind}", *[repr(float(x)) for x in numbers]])
        I = np.array(inertia.inertia)
        numbers = [inertia.mass, *inertia.lever, I[0, 0], I[0, 1], I[0, 2], I[1, 1], I[1, 2], I[2, 2]]
        yield " ".join([f"body {k}", *[repr(float(x)) for x in numbers]])
