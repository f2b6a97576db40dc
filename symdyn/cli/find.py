"""Object of a command: a system, its equations or its module."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from symdyn.cli.messages import Stop
from symdyn.cli.options import check_options, options_of
from symdyn.cli.userfile import from_file
from symdyn.errors import SymdynError

if TYPE_CHECKING:
    from symdyn.formulation.printed.independent_speeds import MotionEquations
    from symdyn.model.system import System
    from symdyn.runtime.module import Module


def find_system(name: str, options: Mapping[str, Any]) -> System:
    """The system of the catalogue, or of a Python file."""
    from symdyn import systems

    if name in systems.names():
        check_options(name, getattr(systems, name), options)
        return systems.get(name, **options)
    if name.endswith((".py", ".toml")) or Path(name).is_file():
        return from_file(Path(name), options)
    try:
        return systems.get(name)
    except SymdynError as error:
        raise Stop(f"{error}; the path of a Python file that defines system(), or of a TOML data file, is taken too") from None


def find_equations(arguments: argparse.Namespace,
                   find: Callable[[str, Mapping[str, Any]], System] = find_system) -> MotionEquations:
    """The equations of the system with its options, in the formulation that was requested; where none is named, the embedding,
    for closed loops and constraints the augmented one.

    find   gives the system of a name and options
    """
    from symdyn.choice import formulated

    system = find(arguments.system, options_of(arguments))
    tied = system.loops or system.constraints or arguments.coordinates != "relative"
    formulation = arguments.formulation or ("augmented" if tied else "embedding")
    return formulated(system, formulation, getattr(arguments, "tune", False), arguments.coordinates)


def find_module(arguments: argparse.Namespace) -> Module:
    """The numeric module of the command line's system with its options; see `module_of`."""
    return module_of(arguments.system, options_of(arguments), arguments.backend, arguments.formulation, arguments.coordinates)


def module_of(name: str, options: Mapping[str, Any], backend: str | None, formulation: str, coordinates: str) -> Module:
    """The numeric module of a system with options; one of the catalogue is remembered from run to run.

    name   of the catalogue, or the path of a Python file, which is run: it must come from the user, not from a data file
    """
    if not is_of_catalogue(name):
        from symdyn.choice import formulated

        system = find_system(name, options)
        return formulated(system, formulation, coordinates=coordinates).compile(backend)  # type: ignore[no-any-return]
    from symdyn import systems
    from symdyn.runtime.building.recall import recall

    if options:
        check_options(name, getattr(systems, name), options)
    return recall(name, options, backend, formulation, coordinates)


def is_of_catalogue(name: str) -> bool:
    """Whether the catalogue has a system of this name."""
    from symdyn import systems

    return name in systems.names()
