"""A module in a form that other processes and machines take: its names and the text that was generated for it."""

from __future__ import annotations

import functools
import hashlib
import json
import zlib
from collections.abc import Sequence
from typing import Any

from symdyn.backend.metadata import Metadata, ModuleMetadata
from symdyn.backend.right_side import RightSide, key_of
from symdyn.errors import SymdynError
from symdyn.runtime.building.compiler import require_compiler
from symdyn.runtime.building.library import Unit, loaded
from symdyn.runtime.module import Module


class NotSent(SymdynError):
    """A function is not among those that came along."""


class PortableModule:
    """A module that can be pickled.

    module      here the module itself; where it was sent to, one made of the text, compiled there once into the cache there
    functions   what is sent along with all that was used here already
    """

    def __init__(self, module: Module, functions: Sequence[str]) -> None:
        self._units: dict[str, dict[str, Any]] = {}
        self._given = module
        self._functions = tuple(functions)
        self.module = Module(module.metadata, self._provide, module.backend, module.fallback)
        self.at_home = True

    def _provide(self, what: str | RightSide) -> Unit:
        unit: Any = self._given.unit(what)
        self._units[key_of(what)] = {"source": unit.source, "metadata": unit.metadata.as_plain()}
        return unit  # type: ignore[no-any-return]

    def key(self) -> str:
        """Changes with what is computed."""
        self.module.unit("rhs")
        return hashlib.sha256(self._units[key_of(RightSide())]["source"].encode()).hexdigest()

    @functools.cached_property
    def _packed(self) -> bytes:
        for name in self._functions:
            self.module.unit(name)
        record = {"metadata": self.module.metadata.as_plain(), "units": self._units}
        return zlib.compress(json.dumps(record).encode())

    def __reduce__(self) -> tuple[Any, ...]:
        return _unpacked, (self.module.backend, self._packed)


class _Arrived:
    """A portable module where it was sent to."""

    at_home = False

    def __init__(self, backend: str, packed: bytes) -> None:
        self._sent = backend, packed
        self.module = _module(backend, packed)

    def __reduce__(self) -> tuple[Any, ...]:
        return _unpacked, self._sent


def _unpacked(backend: str, packed: bytes) -> _Arrived:
    return _Arrived(backend, packed)


@functools.lru_cache(maxsize=4)
def _module(backend: str, packed: bytes) -> Module:
    """Loaded once in a process, however many chunks it computes."""
    record = json.loads(zlib.decompress(packed))
    units = record["units"]

    def provide(what: str | RightSide) -> Unit:
        there = key_of(what)
        if there not in units and isinstance(what, str):
            there = next((key for key, u in units.items() if what in u["metadata"]["shapes"]), there)
        if there not in units:
            label = what if isinstance(what, str) else what.label
            raise NotSent(f"{metadata.name}: {label} was not sent along; it was not used by the samples that were tried in "
                          "advance. Name it in `functions`")
        compiler = require_compiler() if backend == "c" else None
        return loaded(units[there]["source"], Metadata.of_plain(units[there]["metadata"]), compiler)

    metadata = ModuleMetadata.of_plain(record["metadata"])
    return Module(metadata, provide, backend)
