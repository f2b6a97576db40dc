"""Vectors and dyadics of SymPy's ReferenceFrames, taken over as components where their frame is known."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import sympy as sp

from symdyn.errors import ModelError


def is_sympy_vector(value: Any) -> bool:
    """Whether a value is a vector of sympy.physics.vector; that package, which loads slowly, is not imported for it."""
    return type(value).__module__ == "sympy.physics.vector.vector"


def is_dyadic(value: Any) -> bool:
    """Whether a value is a dyadic of sympy.physics.vector."""
    return type(value).__module__ == "sympy.physics.vector.dyadic"


def is_frame(value: Any) -> bool:
    """Whether a value is a ReferenceFrame of sympy.physics.vector."""
    return type(value).__module__ == "sympy.physics.vector.frame"


def is_point(value: Any) -> bool:
    """Whether a value is a Point of sympy.physics.vector."""
    return type(value).__module__ == "sympy.physics.vector.point"


def new_point(name: str) -> Any:
    """A Point."""
    from sympy.physics.vector import Point

    return Point(name)


def as_point(value: Any, what: str) -> Any:
    """A Point as it is, or None. Raises ModelError for anything else."""
    return _demanded(value, what, is_point, "Point")


def located(point: Any, origin: Any, what: str) -> Any:
    """The vector to a Point from a body's origin. Raises ModelError where no path leads there, or the origin is not known."""
    if origin is None:
        raise ModelError([f"{what} is the SymPy point {point}, and of its body no origin is known here; pass the body itself in "
                          "place of its name, or the components from the body's origin"])
    try:
        return point.pos_from(origin)
    except ValueError:
        raise ModelError([f"{what} is the SymPy point {point}, which is not located from {origin}, the body's origin; locate it "
                          "from body.origin, or pass that origin as origin= to add_body (of the ground to System)"]) from None


def new_frame(name: str) -> Any:
    """A ReferenceFrame."""
    from sympy.physics.vector import ReferenceFrame

    return ReferenceFrame(name)


def as_frame(value: Any, what: str) -> Any:
    """A ReferenceFrame as it is, or None. Raises ModelError for anything else."""
    return _demanded(value, what, is_frame, "ReferenceFrame")


def _demanded(value: Any, what: str, is_one: Callable[[Any], bool], kind: str) -> Any:
    if value is not None and not is_one(value):
        raise ModelError([f"{what} is {value!r}; pass a {kind} of sympy.physics.mechanics"])
    return value


def frames_of(value: Any) -> list[Any]:
    """The ReferenceFrames whose unit vectors a vector or dyadic is written with; none for zero."""
    parts = value.args if is_sympy_vector(value) else [unit.args[0] for _, *units in value.args for unit in units]
    return list(dict.fromkeys(frame for _, frame in parts))


def components(value: Any, frame: Any, what: str) -> sp.Matrix:
    """Components in a frame: (3, 1) of a vector, (3, 3) of a dyadic.

    Raises ModelError, with what to write in place of it, where no frame is known (None, or the name of a body) and for vectors
    in other frames.
    """
    kind = "vector" if is_sympy_vector(value) else "dyadic"
    written = frames_of(value)
    if not written:
        return sp.zeros(3, 1 if is_sympy_vector(value) else 3)
    if written == [frame]:
        return value.to_matrix(frame)
    names = " and ".join(str(f) for f in written)
    one = written[0]
    if isinstance(frame, str):
        itself = "system.ground" if frame == "ground" else "what add_body returned"
        raise ModelError([f"{what} is the SymPy {kind} {value} in the frame {names}, and of {frame!r} only the name is known "
                          f"here, not its frame; pass the body itself, {itself}, in place of its name"])
    if frame is None:
        matrix = f"{kind}.to_matrix({one})"
        raise ModelError([f"{what} is the SymPy {kind} {value} in the frame {names}, and no frame is known here; pass its "
                          f"components, {matrix if kind == 'dyadic' else f'list({matrix})'}; bodies, and the system, take "
                          f"their frames as frame={one}"])
    raise ModelError([f"{what} is the SymPy {kind} {value} in the frame {names}; here the frame {frame} is known: write it in "
                      f"that one, as body.frame and system.frame have it, or pass its components"])
