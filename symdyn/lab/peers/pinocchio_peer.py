"""Pinocchio's articulated-body algorithm and its constrained dynamics in C++."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence

import numpy as np

from symdyn.bench.pinocchio_casadi import ERROR_SIZE, sources
from symdyn.bench.toolchain import build_cpp, include_flags, package_folder
from symdyn.errors import SymdynError
from symdyn.lab.peers.description import Description
from symdyn.lab.peers.program import Program, State, address, unsorted, unsorted_derivatives


class PinocchioPeer:
    """The compiled algorithm. Raises MissingExtra, CompilerNotFound or CompileError, whose messages name what to install."""

    def __init__(self) -> None:
        self.library = _library("pinocchio_aba")

    def program(self, description: Description, state: State) -> Program:
        """The algorithm on a model in double precision, at a state."""
        opened = _opened(self.library, description)
        q, u = state.q[list(description.q_order)], state.u[list(description.u_order)]
        out, fed = np.zeros(len(u)), description.q_order.index(state.fed)

        def run(n: int) -> None:
            self.library.aba_loop(opened, ctypes.c_long(n), ctypes.c_long(fed), address(q), address(u), address(out))

        return Program("pinocchio", run, lambda: unsorted(out, description.u_order))


class PinocchioDerivativesPeer:
    """The compiled derivatives of the algorithm (J. Carpentier and N. Mansard 2018). Raises as PinocchioPeer does."""

    def __init__(self) -> None:
        self.library = _library("pinocchio_aba", "pinocchio_aba_derivatives")

    def derivatives_program(self, description: Description, state: State) -> Program:
        """The derivatives by q and u on a model in double precision, at a state."""
        opened = _opened(self.library, description)
        q, u = state.q[list(description.q_order)], state.u[list(description.u_order)]
        out, fed = np.zeros((len(u), 2 * len(u))), description.q_order.index(state.fed)

        def run(n: int) -> None:
            self.library.aba_derivatives_loop(opened, ctypes.c_long(n), ctypes.c_long(fed), address(q), address(u), address(out))

        return Program("pinocchio", run, lambda: unsorted_derivatives(out, description))


def _library(*names: str) -> ctypes.CDLL:
    """The library of sources; its name is that of the last."""
    package_folder("pinocchio")
    text = sources("model.hpp", *[f"{name}.cpp" for name in names])
    library = build_cpp(names[-1], text, include_flags("pinocchio", "boost", "eigen"), ("pin", "casadi"))
    library.aba_open.restype = ctypes.c_void_p
    return library


def _opened(library: ctypes.CDLL, description: Description) -> ctypes.c_void_p:
    """A model in a library."""
    message = ctypes.create_string_buffer(ERROR_SIZE)
    values = description.values
    opened = ctypes.c_void_p(library.aba_open(description.text.encode(), address(values), ctypes.c_long(len(values)),
                                              message, ctypes.c_long(ERROR_SIZE)))
    if not opened:
        raise SymdynError(f"Pinocchio could not build the model: {message.value.decode()}")
    return opened


class PinocchioLoopPeer:
    """The compiled constrained dynamics, for one loop closed at a point of the ground. Raises as PinocchioPeer does."""

    def __init__(self) -> None:
        package_folder("pinocchio")
        text = sources("model.hpp", "pinocchio_loop.cpp")
        self.library = build_cpp("pinocchio_loop", text, include_flags("pinocchio", "boost", "eigen"), ("pin", "casadi"))
        self.library.loop_open.restype = ctypes.c_void_p

    def program(self, description: Description, state: State, body: int, point: Sequence[float],
                   ground: Sequence[float]) -> Program:
        """A planar mechanism whose `point` of a body, number of the joint that moves it, is held at `ground`."""
        message = ctypes.create_string_buffer(ERROR_SIZE)
        values, places = description.values, np.array([*point, *ground], dtype=float)
        opened = ctypes.c_void_p(self.library.loop_open(
            description.text.encode(), address(values), ctypes.c_long(len(values)), ctypes.c_long(body), address(places[:3]),
            address(places[3:]), message, ctypes.c_long(ERROR_SIZE)))
        if not opened:
            raise SymdynError(f"Pinocchio could not build the model: {message.value.decode()}")
        q, u = state.q[list(description.q_order)], state.u[list(description.u_order)]
        out, force, fed = np.zeros(len(u)), np.zeros(3), description.q_order.index(state.fed)

        def run(n: int) -> None:
            self.library.loop_loop(opened, ctypes.c_long(n), ctypes.c_long(fed), address(q), address(u), address(out),
                                   address(force))

        # The force on the body is -C_r^T lam.
        return Program("pinocchio", run, lambda: unsorted(out, description.u_order), lambda: -force[:2])
