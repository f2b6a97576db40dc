"""The lecture "Topics in ship design automation" (K.-Y. Lee, Seoul National University, 2010), formula by formula.

Every module holds cases of one part of a chapter: what the slides print, typed from them, compared with what symdyn derives.
Lines are those of the transcribed notes.
"""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache

from symdyn.comparison.case import Case


@cache
def cases() -> tuple[Case, ...]:
    """All cases, in the order of the lecture. Nothing is derived before a case is compared."""
    modules = [importlib.import_module(f"{__name__}.{m.name}") for m in pkgutil.iter_modules(__path__)
               if m.name.startswith("chapter_")]
    result = [case for module in modules for case in module.CASES]
    return tuple(sorted(result, key=lambda c: (c.slide.line or 0) if c.slide else 0))


def names() -> list[str]:
    """Names of all cases.

    >>> "pendulum-embedding" in sd.lecture.names()
    True
    """
    return [case.name for case in cases()]
