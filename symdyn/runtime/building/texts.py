"""Texts generated for a module, which modules, copies of them, workers of ensembles and the cache share."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from symdyn.backend.metadata import Metadata
from symdyn.backend.right_side import RightSide, key_of
from symdyn.functions.table import BATCH, seldom_called
from symdyn.runtime.building.compiler import plain, require_compiler
from symdyn.runtime.building.library import DeviceText, Library, loaded


class Texts:
    """Texts by what they were generated for, each with the record of its functions; loaded where they are needed."""

    def __init__(self, backend: str, known: Mapping[str, Mapping[str, Any]] | None = None) -> None:
        """known: what `as_plain` gave."""
        self.backend = backend
        self._made = {key: (made["source"], Metadata.of_plain(made["metadata"])) for key, made in (known or {}).items()}

    def __reduce__(self) -> tuple[Any, ...]:
        return Texts, (self.backend, self.as_plain())

    def __contains__(self, what: str | RightSide) -> bool:
        return self._key(what) in self._made

    def add(self, what: str | RightSide, source: str, metadata: Metadata) -> None:
        """Keep what was generated for a right-hand side, or to get a function."""
        self._made[key_of(what)] = source, metadata

    def source(self, what: str | RightSide) -> str:
        """The text that has it."""
        return self._made[self._key(what)][0]

    def load(self, what: str | RightSide) -> Library:
        """The library that has it. Raises KeyError where no text does, and what compiling raises."""
        text, metadata = self._made[self._key(what)]
        if isinstance(what, RightSide) and what.threads:
            return DeviceText(text, metadata)
        compiler = require_compiler() if self.backend == "c" else None
        if compiler is not None and isinstance(what, str) and seldom_called(what):
            compiler = plain(compiler)
        return loaded(text, metadata, compiler)

    def as_plain(self) -> dict[str, dict[str, Any]]:
        """Plain data for JSON and pickle."""
        return {key: {"source": text, "metadata": metadata.as_plain()} for key, (text, metadata) in self._made.items()}

    def _key(self, what: str | RightSide) -> str:
        """Key of the text with a function; other right-hand sides than the plain one have a "rhs" of their own."""
        plain_side = key_of(RightSide())
        with_it = (key for key, (_, metadata) in self._made.items()
                   if what in metadata.shapes and (key == plain_side or not key.startswith("{")) and key != BATCH)
        return next(with_it, key_of(what)) if isinstance(what, str) else key_of(what)
