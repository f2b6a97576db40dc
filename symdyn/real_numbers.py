"""Real numbers from what a user gives: arrays of doubles, and nothing that NumPy would turn into some by leaving a part out.

NumPy drops imaginary parts, ignores masks, reads numbers from text and dates, and raises errors of several kinds for numbers
beyond the range of doubles. Every border where numbers come in goes through here.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.shown import shown

# The type of arrays that need no further look.
DOUBLE = np.dtype(float)
# Axes that values of any argument have at most, with one to spare.
MOST_AXES = 4
# Devices, by the protocol DLPack, whose memory is that of the process: the processor, memory that is pinned for CUDA or for ROCm.
HERE = (None, 1, 3, 11)
MASKED = "a masked array, whose hidden entries would count; pass .filled(...) or .compressed()"
TRUTH = "True and False are no numbers; pass 1.0 and 0.0 if these are meant"


class NotReal(ValueError):
    """A value is no array of real numbers; the message says what it is instead, and what to do."""


def real(values: Any) -> np.ndarray:
    """An array of doubles, the array itself if it is one, also of another library that follows DLPack; NaN and infinity pass.

    Raises NotReal for arrays on devices, complex numbers (also with imaginary part zero), masked entries, truth values, text,
    dates, numbers beyond the range of doubles, rows of different lengths, and anything else that has no numbers.
    """
    if type(values) is np.ndarray and values.dtype is DOUBLE:
        return values
    if type(values) is float:
        return np.array(values)
    if isinstance(values, (list, tuple)):
        _check_entries(values)
    try:
        where = _device_of(values)
        if where in HERE:
            array = np.asanyarray(values if where is None or hasattr(values, "__array__") else np.from_dlpack(values))
    except Exception as error:  # rows of different lengths, or whatever __array__ and __len__ of a user's class raise
        raise NotReal(f"no array of numbers ({error})") from None
    if where not in HERE:
        raise NotReal(f"an array on a device of the type {where} of DLPack; copy it into the memory of this process")
    if np.ma.isMaskedArray(array):
        raise NotReal(MASKED)
    array = np.asarray(array)
    if array.dtype.kind in "fiu":
        return array.astype(float) if array.dtype is not DOUBLE else array
    if array.dtype.kind == "b":
        raise NotReal(TRUTH)
    if array.dtype.kind == "c":
        raise NotReal("complex; pass the real part, .real, if that is meant")
    if array.dtype.kind in "SUT":
        raise NotReal("text, which is not read as numbers")
    if array.dtype.kind != "O":
        raise NotReal(f"of the type {array.dtype}, not numbers")
    return np.array([_double(v) for v in array.ravel().tolist()], dtype=float).reshape(array.shape)


def number(value: Any) -> float:
    """One real number as a double; NaN and infinity pass. Raises NotReal as `real`, and for several."""
    if type(value) is float:
        return value
    array = real(value)
    if array.ndim:
        raise NotReal(f"an array of the shape {array.shape}, where one number belongs")
    return float(array)


def length_of(values: Any) -> int | None:
    """Number of entries of a list or array, which are not read; None for what has no length, such as one number."""
    if isinstance(values, type) or not hasattr(values, "__len__") or (hasattr(values, "ndim") and values.ndim == 0):
        return None
    return len(values)


def real_of(values: Any, owner: str, wanted: str) -> np.ndarray:
    """As `real`; raises ArgumentError, with the owner and `wanted` as what must be, such as "x must be numbers"."""
    try:
        return real(values)
    except NotReal as error:
        raise ArgumentError(f"{owner}: {wanted}, found {shown(values)}: {error}") from None


def number_of(value: Any, owner: str, wanted: str) -> float:
    """As `number`; raises ArgumentError, with the owner and `wanted` as what must be, such as "t must be a number"."""
    try:
        return number(value)
    except NotReal as error:
        raise ArgumentError(f"{owner}: {wanted}, found {shown(value)}: {error}") from None


def in_range(values: Any, least: float, reached: bool, below: float) -> Any:
    """Whether a number, or each of an array, is in the range that `range_text` asks for; what is no number is not."""
    return ((values >= least) if reached else (values > least)) & (values < below)


def range_text(least: float, reached: bool, below: float) -> str:
    """Words of a message for a number above `least`, or from it on if it is `reached`, and below another one, which may be
    infinite."""
    if below < math.inf:
        return f"pass a number from {least:g} to below {below:g}"
    return f"pass a number from {least:g} on" if reached else f"pass a number above {least:g}"


def _check_entries(values: Any) -> None:
    """Raises NotReal where a list has masked arrays, or entries of some, in it, whose masks NumPy leaves out, or truth values,
    which it turns into numbers among numbers."""
    rows = [values]
    for _ in range(MOST_AXES):  # a list may be an entry of itself
        entries = [v for row in rows for v in row if type(v) is not float and type(v) is not int]
        if any(np.ma.isMaskedArray(v) for v in entries):
            raise NotReal(MASKED)
        if any(_is_truth(v) for v in entries):
            raise NotReal(TRUTH)
        rows = [v for v in entries if isinstance(v, (list, tuple))]


def _is_truth(value: Any) -> bool:
    """Whether it is True or False, of Python, NumPy or SymPy, which this module does not import, or an array of such."""
    return isinstance(value, (bool, np.bool_)) or getattr(value, "is_Boolean", False) is True \
        or (isinstance(value, np.ndarray) and value.dtype.kind == "b")


def _device_of(values: Any) -> int | None:
    """The type of the device that an array of another library lies on, by the protocol DLPack; None for what has none."""
    if isinstance(values, (np.ndarray, np.generic)) or not hasattr(values, "__dlpack_device__") or isinstance(values, type):
        return None
    return int(values.__dlpack_device__()[0])


def _double(value: Any) -> float:
    """One entry of an array of objects."""
    if value is None or isinstance(value, (str, bytes, complex, np.complexfloating)):
        raise NotReal(f"not all numbers ({shown(value, 40)} is among them)")
    if _is_truth(value):
        raise NotReal(TRUTH)
    try:
        return float(value)
    except OverflowError:
        raise NotReal(f"beyond the range of double precision, 1.8e308 ({shown(value, 40)})") from None
    except Exception:
        raise NotReal(f"not all numbers ({shown(value, 40)} is among them)") from None
