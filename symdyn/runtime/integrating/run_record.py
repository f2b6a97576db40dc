"""Reports of a run of the compiled integrator, with the meanings of its codes: mirrors of the declarations in C."""

from __future__ import annotations

import ctypes
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from symdyn.backend.c_records import codes_of, fields_of

STATUS = SimpleNamespace(**codes_of("runtime/status.h"))
NOTED = SimpleNamespace(**codes_of("runtime/noted_type.h"))


class RunReport(ctypes.Structure):
    """Report of a run; see c/runtime/report_type.h."""

    _fields_ = fields_of("runtime/report_type.h")

    status: int
    t: float
    h: float
    n_steps: int
    n_rejected: int
    n_evaluations: int
    reason: int
    bad_index: int
    t_fail: float
    residual: float
    of_speeds: int
    reset_gap: float
    largest_dq: float
    largest_du: float
    largest_moved: float
    t_moved: float
    n_corrected: int
    n_corrections: int
    n_jacobians: int
    n_factorizations: int
    n_divided: int
    n_rough: int
    t_rough: float


class Noted(ctypes.Structure):
    """An event, or a doubt about events; see c/runtime/noted_type.h."""

    _fields_ = fields_of("runtime/noted_type.h")


class SingleReport(ctypes.Structure):
    """The same from code in single precision."""

    _fields_ = [(name, ctypes.c_float if kind is ctypes.c_double else kind) for name, kind in RunReport._fields_]


class Report(NamedTuple):
    """A report, with the present state (n_x,) and the one where an evaluation failed (n_x,)."""

    of: RunReport
    x: np.ndarray
    x_fail: np.ndarray
