"""Options of a system, such as n=5."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from typing import Any

from symdyn.cli.messages import Stop
from symdyn.cli.values import pairs, value_of


def options_of(arguments: argparse.Namespace) -> dict[str, Any]:
    """Options given as --option."""
    return {name: value_of(text) for name, text in pairs(arguments.option, "--option").items()}


def check_options(name: str, function: Callable[..., Any], options: Mapping[str, Any]) -> None:
    """Raises Stop unless the function takes the options, of the kinds of their defaults, and needs no more."""
    from symdyn.options import lacking_options, wrong_option

    wrong = wrong_option(name, function, options)
    if wrong:
        raise Stop(wrong)
    missing = lacking_options(function, options)
    if missing:
        raise Stop(f"{name} needs --option {' '.join(f'{m}=...' for m in missing)}")
