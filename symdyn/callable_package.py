"""Packages that are called as a function: `symdyn.bench` is one, and so is `symdyn.stress`."""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import Any


def make_callable(package: str, function: str) -> None:
    """Have a package, once it is imported, called as a function.

    function   "module:name", imported when it is called
    """
    where, _, name = function.partition(":")

    class Callable(ModuleType):
        """A package that is called as the function of the same name."""

        def __call__(self, *arguments: Any, **options: Any) -> Any:
            return getattr(importlib.import_module(where), name)(*arguments, **options)

    sys.modules[package].__class__ = Callable
