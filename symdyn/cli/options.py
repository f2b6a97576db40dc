"""Options of a system, such as n=5."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from typing import Any

from symdyn.cli.messages import Stop
from symdyn.cli.values import pairs, value_of


def options_of(arguments: argparse.Namespace) -> dict[str, Any]:
    """What was given as --option."""
    return {name: value_of(text) for name, text in pairs(arguments.option, "--option").items()}


def check_options(name: str, function: Callable[..., Any], options: Mapping[str, Any]) -> None:
    """Raises Stop unless the function takes the options, of the kinds of their defaults, and needs no more."""
    import inspect

    known = inspect.signature(function).parameters
    if any(p.kind is p.VAR_KEYWORD for p in known.values()):
        return
    for key, value in options.items():
        if key not in known:
            takes = ", ".join(f"{p.name}={p.default}" for p in known.values() if p.default is not p.empty)
            raise Stop(f"{name} has no option {key!r}; it has {takes or 'none'}")
        default = known[key].default
        kinds: tuple[type, ...] = (int, float) if type(default) is float else (type(default),)
        if isinstance(default, (bool, int, float, str)) and type(value) not in kinds:
            raise Stop(f"option {key} of {name} must be of the kind {type(default).__name__}, such as {default}; found "
                       f"{value!r}")
    missing = [p.name for p in known.values() if p.default is p.empty and p.kind in (
        p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY) and p.name not in options]
    if missing:
        raise Stop(f"{name} needs --option {' '.join(f'{m}=...' for m in missing)}")
