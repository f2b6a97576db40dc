"""Measurements, as commands: `symdyn bench`, and its words such as `symdyn bench figures` (see symdyn.cli.measurements). They are
not tests; times depend on the machine.

`symdyn.bench` is a package and, called, the function `symdyn.bench.work.bench`.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any


class _Callable(ModuleType):
    """A package that is called as the function of the same name."""

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        from symdyn.bench.work import bench

        return bench(*arguments, **options)


sys.modules[__name__].__class__ = _Callable
