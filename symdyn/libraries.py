"""The loaded code of a module, function by function, made from its equations where it is needed."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.backend.packed import Pattern
from symdyn.backend.right_side import RightSide
from symdyn.backend.source import Source
from symdyn.emission import emit, emit_with, write_source
from symdyn.errors import SymdynError
from symdyn.formulation.equations import Equations
from symdyn.functions import groups
from symdyn.functions.packed import pattern as pattern_of
from symdyn.functions.table import BATCH
from symdyn.functions.tapes import all_columns_of
from symdyn.runtime.building.library import Library
from symdyn.runtime.building.texts import Texts
from symdyn.tape.jumps import breaks
from symdyn.tape.tape import Tape

if TYPE_CHECKING:
    from symdyn.given import Rolling


class Libraries:
    """The libraries of a module, each made when it is first requested; pickled with the text of those that were made.

    again       derives the equations; None: only those that were made can be had elsewhere
    rolled      whether statements that are repeated become loops, as for `emit`
    equations   None where they were not needed so far; texts: what was generated already; pattern: as below, where it is known
    """

    def __init__(self, again: Callable[[], Equations] | None, backend: str, templates: str | os.PathLike | None,
                 specialize: Mapping[Any, float] | None, fallback: str, equations: Equations | None = None,
                 texts: Texts | None = None, rolled: Rolling = "auto", pattern: Pattern | None = None) -> None:
        self.rolled = rolled
        if pattern is not None:
            self.pattern = pattern
        self.again, self.backend, self.templates, self.specialize, self.fallback = again, backend, templates, specialize, fallback
        self._equations = equations
        self.texts = texts or Texts(backend)

    @property
    def equations(self) -> Equations:
        if self._equations is None:
            if self.again is None:
                raise SymdynError("a function of this copy of a module is needed that was not used before it was copied, and its "
                                  "equations cannot be derived here; call the function once before the module is pickled")
            self._equations = self.again()
        return self._equations

    def __reduce__(self) -> tuple[Any, ...]:
        return Libraries, (self.again, self.backend, self.templates, self.specialize, self.fallback, None, self.texts,
                           self.rolled, self.__dict__.get("pattern"))

    @cached_property
    def rhs(self) -> Source:
        return self._source(RightSide())

    def _source(self, what: str | RightSide) -> Source:
        if isinstance(what, RightSide):
            names, right_side = groups.of_right_side(self.equations, what), what
        else:
            names, right_side = groups.with_function(self.equations, what), RightSide(lanes=what == BATCH)
        return emit_with(self.equations, self.backend, names, right_side, self.templates, False, self.specialize,
                         rolled=self.rolled)

    def __call__(self, what: str | RightSide) -> Library:
        """The library for a right-hand side, or that holds a function."""
        if what not in self.texts:
            source = self.rhs if what == RightSide() else self._source(what)
            self.texts.add(what, next(iter(source.files.values())), source.metadata)
        return self.texts.load(what)

    def structure(self, name: str) -> np.ndarray | None:
        """Where a matrix of derivatives may differ from zero; None for other functions and for what has no columns."""
        columns = all_columns_of(self.equations, name, RightSide())
        return None if columns is None else columns.structure().reshape(*columns.shape, columns.n)

    @cached_property
    def pattern(self) -> Pattern | None:
        """Where the derivative of x_dot by x may differ from zero; None where that is unknown."""
        return None if self._equations is None and self.again is None else pattern_of(self.equations)

    @cached_property
    def breaks(self) -> Tape | None:
        """Quantities that pass zero where the right-hand side has a kink or a jump, as `surfaces`; None where it has none."""
        recorder = self.equations.recorder
        result = breaks(recorder, self.equations.quantity("rhs").tolist())
        return Tape.of(recorder, surfaces=np.array(result, dtype=object)) if result else None

    def base_names(self) -> tuple[str, ...]:
        """Names of the base parameters of the mechanism."""
        return self.equations.base_parameters().names

    def write(self, folder: Path) -> list[Path]:
        return write_source(emit(self.equations, self.backend, templates=self.templates, specialize=self.specialize,
                                 rolled=self.rolled), folder)

    def report(self) -> Any:
        from symdyn.report.text import report

        return report(self.equations, self.backend, self.fallback, self.rhs)
