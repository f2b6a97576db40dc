"""Where in the user's functions, or in generated modules, an exception arose; what is the user's is reported as such."""

from __future__ import annotations

import itertools
import linecache
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType
from typing import Any, NamedTuple

import numpy as np

from symdyn.errors import EvaluationError

# The function of generated modules that calls the texts of users, see numpy/user_functions.py.jinja.
_CALLS = "_called"


class InputRaised(EvaluationError):
    """A function of inputs raised what is its cause, when it was asked for t and the state x (n_x,)."""

    def __init__(self, message: str, t: float, x: np.ndarray) -> None:
        super().__init__(message, t, x)
        self.t, self.x = t, x

    def __str__(self) -> str:
        return str(self.args[0])


def called(function: Callable[..., Any], t: float, x: np.ndarray, what: str, arguments: Sequence[Any]) -> Any:
    """Result of a function of the user, asked at t and x for these arguments; what: how messages call it. Raises InputRaised
    from whatever the function raises."""
    try:
        return function(*arguments)
    except InputRaised:
        raise
    except Exception as error:  # whatever it is, it is the user's
        name = getattr(function, "__name__", "<lambda>")
        message = f"{what}{'' if name == '<lambda>' else f' ({name})'} raised {_said(error)}"
        frames = _frames(error)[1:]
        if frames:
            file = frames[0][0].f_code.co_filename
            line = next(n for frame, n in reversed(frames) if frame.f_code.co_filename == file)
            message += f", in line {line} of {Path(file).name}"
        raise InputRaised(message, t, np.array(x)) from error


class Location(NamedTuple):
    """Where the text of a function raised: how it is called, its name, its line, from 1, and what stands there."""

    signature: str
    name: str
    line: int
    text: str


def location_of(error: BaseException) -> Location | None:
    """Location of an error that the text of a user's function raised in a generated module; None: of anything else."""
    frames = _frames(error)
    for (frame, _), (inner, line) in itertools.pairwise(frames):
        file, code = frame.f_code.co_filename, inner.f_code
        if frame.f_code.co_name == _CALLS and code.co_filename == file:
            return Location(frame.f_locals["signature"], code.co_name, line - code.co_firstlineno + 1,
                            linecache.getline(file, line).strip())
    return None


def raise_by_text(error: BaseException) -> None:
    """Raises EvaluationError from what the text of a user's function raised in a generated module; passes over anything else."""
    location = location_of(error)
    if location is not None:
        message = f"the function {location.signature} raised {_said(error)}, in its line {location.line}: {location.text}"
        raise EvaluationError(message) from error


def in_prologue(error: BaseException) -> bool:
    """Whether it arose in the constants of a generated module, which depend on parameters only."""
    return any(frame.f_code.co_name == "prologue" for frame, _ in _frames(error))


def _said(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}".removesuffix(": ")


def _frames(error: BaseException) -> list[tuple[FrameType, int]]:
    """Frames that an exception went through, the innermost last, with the lines."""
    result, trace = [], error.__traceback__
    while trace is not None:
        result.append((trace.tb_frame, trace.tb_lineno))
        trace = trace.tb_next
    return result
