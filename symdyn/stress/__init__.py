"""Stress tests of numerical stability: of every check a figure, a bound with its reason, and a verdict.

`symdyn.stress` is a package and, called, the function `symdyn.stress.run.stress`.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any


class _Callable(ModuleType):
    """A package that is called as the function of the same name."""

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        from symdyn.stress.run import stress

        return stress(*arguments, **options)


sys.modules[__name__].__class__ = _Callable
