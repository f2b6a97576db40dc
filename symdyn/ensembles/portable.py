"""A module in a form that other processes and machines take: its names and the text that was generated for it, and nothing that
could be derived there."""

from __future__ import annotations

import functools
import hashlib
import json
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.backend.metadata import ModuleMetadata
from symdyn.backend.packed import LEAST_STATES, Pattern
from symdyn.backend.right_side import METHOD, RightSide
from symdyn.errors import SymdynError
from symdyn.runtime.building.library import Library
from symdyn.runtime.building.texts import Texts
from symdyn.runtime.integrating.methods import is_compiled
from symdyn.runtime.module import Module


class NotSent(SymdynError):
    """A function is not among those that came along."""


def of_contacts(module: Module, options: Mapping[str, Any]) -> list[str | RightSide]:
    """Functions that members with rigid contacts call, whichever modes they come to; options: of `simulate`."""
    contacts, method = module.metadata.contacts, options.get("method", METHOD)
    if not contacts:
        return []
    functions: list[str | RightSide] = ["rhs", "contacts", "events"]
    if module.backend != "c" or not isinstance(method, str) or not is_compiled(method):
        return functions
    columns = tuple("" if name.endswith("(0)") else name for name in options.get("sensitivities", ()))
    methods = [method, *["radau"] * any(contact.rows == 3 for contact in contacts)]
    return functions + [RightSide(method=one, sensitivities=by, open_contacts=parted)
                        for one in dict.fromkeys(methods) for by in dict.fromkeys([columns, ()]) for parted in (False, True)]


@dataclass(frozen=True)
class _Provider:
    """Provider of a module's libraries, and of the indices of the entries of its derivative by x."""

    library: Callable[[str | RightSide], Library]
    given: Callable[[], Pattern | None]

    def __call__(self, what: str | RightSide) -> Library:
        return self.library(what)

    @property
    def pattern(self) -> Pattern | None:
        return self.given()


class PortableModule:
    """A module that can be pickled.

    module      here the module itself; where it was sent to, one made of the text, compiled there once into the cache there
    functions   what is sent along with all that was used here already
    """

    def __init__(self, module: Module, functions: Sequence[str | RightSide]) -> None:
        self._texts = Texts(module.backend)
        self._given = module
        self._functions = tuple(functions)
        self.module = Module(module.metadata, _Provider(self._provide, module.jacobian_indices), module.backend, module.fallback)
        self.at_home = True

    def _provide(self, what: str | RightSide) -> Library:
        library: Any = self._given.library(what)
        self._texts.add(what, library.source, library.metadata)
        return library  # type: ignore[no-any-return]

    def key(self) -> str:
        """Changes with what is computed."""
        self.module.library("rhs")
        return hashlib.sha256(self._texts.source(RightSide()).encode()).hexdigest()

    @functools.cached_property
    def _packed(self) -> bytes:
        for name in self._functions:
            self.module.library(name)
        record = {"metadata": self.module.metadata.as_plain(), "units": self._texts.as_plain(), "pattern": self._pattern()}
        return zlib.compress(json.dumps(record).encode())

    def _pattern(self) -> list[Any] | None:
        """Indices of the entries of the derivative, for many states with few of them."""
        if self.module.metadata.sizes.x < LEAST_STATES:
            return None
        there = self.module.jacobian_indices()
        if there is None or not (there.sparse or there.band.pays):
            return None
        return [there.n, there.rows.tolist(), there.columns.tolist(), there.n_q]

    def __reduce__(self) -> tuple[Any, ...]:
        return _Arrived, (self.module.backend, self._packed)


class _Arrived:
    """A portable module where it was sent to."""

    at_home = False

    def __init__(self, backend: str, packed: bytes) -> None:
        self._sent = backend, packed
        self.module = _module(backend, packed)

    def __reduce__(self) -> tuple[Any, ...]:
        return _Arrived, self._sent


@functools.lru_cache(maxsize=4)
def _module(backend: str, packed: bytes) -> Module:
    """Loaded once in a process, however many chunks it computes."""
    record = json.loads(zlib.decompress(packed))
    metadata, texts = ModuleMetadata.of_plain(record["metadata"]), Texts(backend, record["units"])

    def provide(what: str | RightSide) -> Library:
        if what not in texts:
            label = what if isinstance(what, str) else what.label
            raise NotSent(f"{metadata.name}: {label} was not sent along; it was not used by the samples that were tried in "
                          "advance. Name it in `functions`")
        return texts.load(what)

    sent = record["pattern"]
    there = None if sent is None else Pattern(sent[0], np.array(sent[1]), np.array(sent[2]), sent[3])
    return Module(metadata, _Provider(provide, lambda: there), backend)
