"""Mechanism that a name stands for, for commands that test one: of the catalogue, with an option in parentheses or
not, of the list of `symdyn bench --all`, or of a user's file."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from symdyn.cli.messages import Stop
from symdyn.errors import ArgumentError

if TYPE_CHECKING:
    from symdyn.bench.work.system_under_test import SystemUnderTest
    from symdyn.model.system import System


def is_file(name: str) -> bool:
    """Whether a name stands for a user's file; a file that is called as a mechanism does not take its place."""
    from symdyn.bench.work.cases import known

    return name.endswith((".py", ".toml")) or (name not in known() and Path(name).is_file())


def find_mechanism(name: str, options: Mapping[str, Any]) -> System:
    """The system of a name. Raises Stop for one that there is not, or with other options; what makes it raises what it does."""
    from symdyn.bench.work.cases import named
    from symdyn.cli import userfile

    if is_file(name):
        return userfile.from_file(Path(name), options)
    with _rejected():
        case = named(name, options)
    return case.maker()(**case.options)


def find_system_under_test(name: str, options: Mapping[str, Any], end: float | None = None) -> SystemUnderTest:
    """System that `symdyn bench` measures: in angles and in parameters if its maker has an option `orientation`.

    end   s, default: the system's duration
    Raises Stop as find_mechanism.
    """
    from symdyn.bench.work.cases import from_maker, named_case, title
    from symdyn.cli import userfile

    if is_file(name):
        return from_maker(title(Path(name).stem, options), userfile.maker(Path(name)), end, options)
    with _rejected():
        return named_case(name, end, options)


def title_of(name: str, options: Mapping[str, Any]) -> str:
    """Title by which files of a mechanism are named."""
    from symdyn.bench.work.cases import title

    return title(Path(name).stem if is_file(name) else name, options)


@contextlib.contextmanager
def _rejected() -> Iterator[None]:
    """A name or an option that there is not becomes a Stop, which says what the command line takes besides."""
    from symdyn.bench.work.cases import Unknown

    try:
        yield
    except Unknown as error:
        raise Stop(f"{error}; the path of a Python file that defines system(), or of a TOML data file, is taken too") from None
    except ArgumentError as error:
        raise Stop(str(error)) from None
