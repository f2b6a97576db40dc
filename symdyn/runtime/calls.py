"""The two orders of arguments of functions of a state: (t, x, params, inputs), as `rhs` has it, and (q, u, params, t, inputs)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.shown import name_of

if TYPE_CHECKING:
    from symdyn.runtime.module import Module


class Call(NamedTuple):
    """Arguments of a call of a function of a state; None: left out. t is 0 where it is left out."""

    t: Any = None
    x: Any = None
    q: Any = None
    u: Any = None
    ud: Any = None
    params: Any = None
    inputs: Any = None


def ordered(module: Module, function: str, at: Sequence[Any], named: Mapping[str, Any], by_parts: Sequence[str]) -> Call:
    """Arguments by name, from those without a name in one of the two orders.

    at         arguments without a name: (t, x, ...) if the second is a state, else in the order by_parts
    named      those with a name, None: left out
    by_parts   names of the order that begins with q
    Raises ArgumentError for arguments that are given twice, or are too many, and where they fit both orders.
    """
    by_time = ("t", "x", *[n for n in ("ud", "params", "inputs") if n in by_parts])
    order = by_time if _time_and_state(module, function, at, by_parts) else tuple(by_parts)
    forms = f"{function}({', '.join(by_time)}) or {function}({', '.join(by_parts)})"
    if len(at) > len(order):
        raise ArgumentError(f"{module.name}: {function} takes {len(order)} arguments at most, found {len(at)}; call {forms}")
    given = dict(zip(order, at, strict=False))
    twice = [n for n, value in named.items() if value is not None and n in given]
    if twice:
        raise ArgumentError(f"{module.name}: {function} got {', '.join(twice)} twice, with a name and by place; call {forms}")
    call = Call(**{**given, **{n: value for n, value in named.items() if value is not None}})
    if call.x is None and call.q is None:
        raise ArgumentError(f"{module.name}: {function} needs a state; call {forms}")
    if call.x is not None and (call.q is not None or call.u is not None):
        raise ArgumentError(f"{module.name}: {function} got the state x and its parts, too; call {forms}")
    return call


def _time_and_state(module: Module, function: str, at: Sequence[Any], by_parts: Sequence[str]) -> bool:
    """Whether arguments begin with a time (or one for each state) and a state, or rows of states."""
    if len(at) < 2:
        return False
    sizes, states = module.metadata.sizes, at[1]
    if isinstance(states, Mapping):
        fits = bool(states) and {name_of(k) for k in states} <= set(module.metadata.x)
        rows = 1
    else:
        shape: tuple[int, ...] = np.shape(states) if not isinstance(states, str) else ()
        allowed = (sizes.x,) if "u" in by_parts else (sizes.q, sizes.x)
        fits, rows = len(shape) in (1, 2) and shape[-1] in allowed, shape[0] if len(shape) == 2 else 1
    first: tuple[int, ...] | None = np.shape(at[0]) if not isinstance(at[0], (Mapping, str)) else None
    if not fits or first is None or not (first == () or (len(first) == 1 and first[0] == rows and np.ndim(states) == 2)):
        return False
    other = sizes.u if "u" in by_parts else sizes.p
    if sizes.q == 1 and not isinstance(states, Mapping) and np.shape(states)[-1] == other:
        raise ArgumentError(f"{module.name}: {function} may be called with a time and a state here, or with q and "
                            f"{by_parts[1]}, which are as many numbers; name them, such as {function}(t=0, q=...)")
    return True
