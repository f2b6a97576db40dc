"""The loaded code of a module, function by function, made from its equations where it is needed."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from symdyn.backend.metadata import Metadata
from symdyn.backend.right_side import RightSide, key_of
from symdyn.backend.source import Source
from symdyn.emission import emit, write_source
from symdyn.errors import SymdynError
from symdyn.formulation.equations import Equations
from symdyn.functions import groups
from symdyn.functions.tapes import all_columns_of
from symdyn.runtime.building.compiler import plain, require_compiler
from symdyn.runtime.building.library import Unit, loaded


class Libraries:
    """The libraries of a module, each made when it is first requested; pickled with the text of those that were made.

    again       derives the equations; None: only those that were made can be had elsewhere
    equations   None where they were not needed so far
    """

    def __init__(self, again: Callable[[], Equations] | None, backend: str, templates: str | os.PathLike | None,
                 specialize: Mapping[Any, float] | None, fallback: str, equations: Equations | None = None) -> None:
        self.again, self.backend, self.templates, self.specialize, self.fallback = again, backend, templates, specialize, fallback
        self._equations = equations
        self._made: dict[str, tuple[str, Metadata]] = {}

    @property
    def equations(self) -> Equations:
        if self._equations is None:
            if self.again is None:
                raise SymdynError("a function of this copy of a module is needed that was not used before it was copied, and its "
                                  "equations cannot be derived here; call the function once before the module is pickled")
            self._equations = self.again()
        return self._equations

    def __reduce__(self) -> tuple[Any, ...]:
        return _libraries, (self.again, self.backend, self.templates, self.specialize, self.fallback,
                        {key: (text, metadata.as_plain()) for key, (text, metadata) in self._made.items()})

    @cached_property
    def rhs(self) -> Source:
        return self._source(RightSide())

    def _source(self, what: str | RightSide) -> Source:
        if isinstance(what, RightSide):
            names = groups.of_right_side(self.equations, what)
            return emit(self.equations, self.backend, names, self.templates, standalone=False, specialize=self.specialize,
                        work=what.work, baumgarte=what.baumgarte, method=what.method)
        names = groups.with_function(self.equations, what)
        return emit(self.equations, self.backend, names, self.templates, standalone=False, specialize=self.specialize,
                    batch=what == groups.BATCH)

    def __call__(self, what: str | RightSide) -> Unit:
        """The library for a right-hand side, or that holds a function."""
        key = self._holder(what)
        if key not in self._made:
            source = self.rhs if what == RightSide() else self._source(what)
            self._made[key] = next(iter(source.files.values())), source.metadata
        text, metadata = self._made[key]
        compiler = require_compiler() if self.backend == "c" else None
        if compiler is not None and isinstance(what, str) and groups.seldom_called(what):
            compiler = plain(compiler)
        return loaded(text, metadata, compiler)

    def _holder(self, what: str | RightSide) -> str:
        """The key of what was made with a function; other right-hand sides than the plain one have a "rhs" of their own."""
        plain_side = key_of(RightSide())
        with_it = (key for key, (_, metadata) in self._made.items()
                   if what in metadata.shapes and (key == plain_side or not key.startswith("{")) and key != groups.BATCH)
        return next(with_it, key_of(what)) if isinstance(what, str) else key_of(what)

    def structure(self, name: str) -> np.ndarray | None:
        """Where a matrix of derivatives may differ from zero; None for other functions and for what has no columns."""
        columns = all_columns_of(self.equations, name, RightSide())
        return None if columns is None else columns.structure().reshape(*columns.shape, columns.n)

    def write(self, folder: Path) -> list[Path]:
        return write_source(emit(self.equations, self.backend, templates=self.templates, specialize=self.specialize), folder)

    def report(self) -> Any:
        from symdyn.report.text import report

        return report(self.equations, self.backend, self.fallback)


def _libraries(again: Callable[[], Equations] | None, backend: str, templates: Any, specialize: Any, fallback: str,
           made: Mapping[str, tuple[str, Mapping[str, Any]]]) -> Libraries:
    libraries = Libraries(again, backend, templates, specialize, fallback)
    libraries._made = {key: (text, Metadata.of_plain(metadata)) for key, (text, metadata) in made.items()}
    return libraries
