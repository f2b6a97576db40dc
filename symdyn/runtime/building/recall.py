"""Keeps what was generated for mechanisms of the catalogue, so that the next run needs neither derivation nor SymPy.

A record is a file in the cache folder, a digest and JSON: the metadata of a module, and for every function that was used the
source and the metadata of its library. It holds as long as it is undamaged and no file of symdyn changes; what it lacks is
derived and added.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import sys
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import symdyn
from symdyn.backend.metadata import ModuleMetadata
from symdyn.backend.right_side import RightSide
from symdyn.runtime.building import cache
from symdyn.runtime.building.compiler import find_compiler, no_compiler_reason, require_compiler
from symdyn.runtime.building.library import Library
from symdyn.runtime.building.stored import read_sealed, write_sealed
from symdyn.runtime.building.texts import Texts
from symdyn.runtime.module import Module


def recall(name: str, options: Mapping[str, Any], backend: str | None = None, formulation: str = "auto",
           coordinates: str = "relative") -> Module:
    """The module of a system of the catalogue, from what is remembered of it as far as that goes.

    backend       "c", "numpy", or None: C if a compiler is found, else NumPy, and `module.fallback` says why
    formulation   "auto", "embedding", "recursive" or "augmented"; coordinates: of the last, "relative" or "absolute"
    Raises what deriving and compiling the system raises.
    """
    compiler = require_compiler() if backend == "c" else find_compiler() if backend is None else None
    chosen = backend or ("c" if compiler else "numpy")
    memory = _Memory(name, options, chosen, formulation, coordinates)
    fallback = no_compiler_reason() if backend is None and compiler is None else ""
    return Module(memory.metadata, memory.library, chosen, fallback, lambda folder: memory.derived.write(folder),
                  lambda: memory.derived.report())


class _Memory:
    """The record of one system in one formulation with one backend."""

    def __init__(self, name: str, options: Mapping[str, Any], backend: str, formulation: str, coordinates: str) -> None:
        self.name, self.options, self.backend = name, dict(options), backend
        self.formulation, self.coordinates = formulation, coordinates
        about = name, sorted(self.options.items()), backend, formulation, coordinates
        own = hashlib.sha256(repr(about).encode()).hexdigest()[:16]
        self.path = cache.cache_dir() / f"{name}-{own}.json"
        self.state = _state_of_symdyn()
        result = self._read()
        self.metadata = ModuleMetadata.of_plain(result["metadata"]) if result else self.derived.metadata
        self.texts = Texts(backend, result["units"] if result else None)

    @cached_property
    def derived(self) -> Module:
        """The module made from the description."""
        from symdyn import systems
        from symdyn.choice import formulated
        from symdyn.pipeline import compile_equations

        return compile_equations(formulated(systems.get(self.name, **self.options), self.formulation,
                                            coordinates=self.coordinates), self.backend)

    def library(self, what: str | RightSide) -> Library:
        """A library from the record, else a derived one, which is put into it."""
        if what in self.texts:
            return self.texts.load(what)
        library: Any = self.derived.library(what)
        self.texts.add(what, library.source, library.metadata)
        self._write()
        return library  # type: ignore[no-any-return]

    def _read(self) -> dict[str, Any] | None:
        try:
            record = json.loads(read_sealed(self.path) or b"")
            result = record["state"] == self.state and isinstance(record["units"], dict) and record["metadata"]["name"]
        except (OSError, ValueError, KeyError, TypeError):
            return None
        return record if result else None

    def _write(self) -> None:
        """A reader sees a complete record; if the disk is full there is none, and the next run derives again."""
        with contextlib.suppress(OSError):
            record = {"state": self.state, "metadata": self.metadata.as_plain(), "units": self.texts.as_plain()}
            write_sealed(self.path, json.dumps(record).encode())


def _state_of_symdyn() -> str:
    """Changes whenever a file that shapes generated code may have changed."""
    package = Path(symdyn.__file__).parent
    # In a checkout the templates lie next to the package, in an installation inside it.
    folders = [package] if (package / "templates").is_dir() else [package, package.parent / "templates"]
    endings = ("*.py", "*.jinja", "*.toml", "*.h", "*.c")
    files = sorted(p for folder in folders for ending in endings for p in folder.rglob(ending))
    seen = [(str(p), result.st_size, result.st_mtime_ns) for p in files for result in [p.stat()]]
    return hashlib.sha256(repr((symdyn.__version__, sys.version, seen)).encode()).hexdigest()
