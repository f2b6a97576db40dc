"""Options of the functions that make systems, such as n=5 of n_link_pendulum: what is wrong with those that are given."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any

from symdyn.shown import shown


def wrong_option(name: str, function: Callable[..., Any], options: Mapping[str, Any]) -> str:
    """Fault of the first option that a function does not take, or not of this kind; empty if all are right.

    name   of the function, as messages name it
    """
    known = inspect.signature(function).parameters
    if any(p.kind is p.VAR_KEYWORD for p in known.values()):
        return ""
    for key, value in options.items():
        if key not in known:
            takes = ", ".join(f"{p.name}={p.default}" for p in known.values() if p.default is not p.empty)
            return f"{name} has no option {shown(key)}; it has {takes or 'none'}"
        default = known[key].default
        kinds: tuple[type, ...] = (int, float) if type(default) is float else (type(default),)
        if isinstance(default, (bool, int, float, str)) and type(value) not in kinds:
            return f"option {key} of {name} must be of the kind {type(default).__name__}, such as {default}; found {shown(value)}"
    return ""


def lacking_options(function: Callable[..., Any], options: Mapping[str, Any]) -> list[str]:
    """Options without a default that are not given."""
    return [p.name for p in inspect.signature(function).parameters.values() if p.default is p.empty and p.kind in (
        p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY) and p.name not in options]
