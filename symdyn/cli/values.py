"""Arguments of the form name=value."""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterable
from pathlib import Path

from symdyn.cli.messages import Stop

# Whole numbers of the command line are below this one.
LARGEST = 1e18


def pairs(items: Iterable[str], what: str) -> dict[str, str]:
    """name -> text from name=text."""
    result: dict[str, str] = {}
    for item in items:
        name, sign, text = item.partition("=")
        if not (name and sign and text):
            raise Stop(f"{what} {item!r}: write name=value")
        if name in result:
            raise Stop(f"{what} {name} is given twice: {result[name]} and {text}")
        result[name] = text
    return result


def numbers(items: Iterable[str], what: str) -> dict[str, float] | None:
    """name -> number from name=number; None if there are none."""
    result = {}
    for name, text in pairs(items, what).items():
        try:
            result[name] = float(text)
        except ValueError:
            raise Stop(f"{what} {name}={text}: {text!r} is not a number") from None
    return result or None


def whole(text: str) -> int:
    """A whole number from 1 on, also as 1e9."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 1 <= value < LARGEST or value != int(value):
        raise argparse.ArgumentTypeError(f"must be a whole number from 1 on, below {LARGEST:g}, such as 64 or 1e9, found "
                                         f"{text!r}")
    return int(value)


def stabilization(text: str) -> str | tuple[str, float]:
    """projection, baumgarte or none; of baumgarte=GAIN the pair."""
    way, sign, gain = text.partition("=")
    if way not in ("projection", "baumgarte", "none") or (sign and way != "baumgarte"):
        raise argparse.ArgumentTypeError(f"invalid choice: {text!r} (choose from projection, baumgarte, baumgarte=GAIN, none)")
    if not sign:
        return way
    try:
        return way, float(gain)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: {gain!r} is not a number; write baumgarte=GAIN, 1/s") from None


def path(text: str) -> Path:
    """The path of a file or folder."""
    if "\0" in text or not text:
        raise argparse.ArgumentTypeError(f"{text!r} is no path; give that of a file or folder")
    return Path(text)


def value_of(text: str) -> bool | int | float | str:
    """Value that an option's text stands for."""
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    if re.fullmatch(r"[+-]?\d+", text):
        return int(text)
    if re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", text):
        return float(text)
    return text
