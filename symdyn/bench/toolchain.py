"""Finds what the peers are built from, and builds them; a library that was built before is taken from the cache."""

from __future__ import annotations

import ctypes
import importlib.metadata
import importlib.util
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from symdyn.errors import CompilerNotFound, MissingExtra, SymdynError
from symdyn.runtime.building import cache
from symdyn.runtime.building.compiler import Compiler, require_compiler

# As Pinocchio's own build sets them: its variants have more members than Boost takes by default.
_DEFINES = ("-DBOOST_MPL_LIMIT_LIST_SIZE=30", "-DBOOST_MPL_LIMIT_VECTOR_SIZE=30", "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
            "-DBOOST_FUSION_INVOKE_MAX_ARITY=12", "-DNDEBUG")
_HEADERS = {"pinocchio": "pinocchio/multibody.hpp", "boost": "boost/variant.hpp", "eigen": "Eigen/Core",
            "casadi": "casadi/casadi.hpp"}


def package_folder(name: str) -> Path:
    """The folder of an installed Python package, which is not imported. Raises MissingExtra."""
    folder = _installed(name)
    if folder is None:
        raise MissingExtra(f"the Python package {name} is not installed; run: pip install 'symdyn[peers]'")
    return folder


def _installed(name: str) -> Path | None:
    spec = importlib.util.find_spec(name)
    return Path(spec.origin).parent if spec is not None and spec.origin is not None else None


def version(distribution: str) -> str:
    """The version of an installed distribution."""
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return "unknown"


def include_flags(*needed: str) -> list[str]:
    """Options for the headers of pinocchio, boost, eigen, casadi. Raises SymdynError that names a missing one."""
    folders: list[Path] = []
    for what in needed:
        result = next((f for f in _include_folders() if (f / _HEADERS[what]).is_file()), None)
        if result is None:
            raise SymdynError(f"the C++ header {_HEADERS[what]} was found neither next to the Python packages pinocchio and "
                              "casadi, whose wheels bring it (pip install 'symdyn[peers]'), nor in the system; install the "
                              f"headers of {what}")
        folders.append(result)
    return [f"-isystem{folder}" for folder in dict.fromkeys(folders)]


def _include_folders() -> tuple[Path, ...]:
    """Where headers may be: in a wheel, in the prefix that a package is installed in, in the system."""
    folders = [folder for folder in map(_installed, ("pinocchio", "casadi")) if folder is not None]
    roots = [root for folder in folders for root in (folder, *folder.parents[:6])]
    roots += [Path("/usr/local"), Path("/usr")]
    return tuple(f for root in dict.fromkeys(roots) for f in (root / "include", root / "include" / "eigen3") if f.is_dir())


def c_compiler() -> Compiler:
    """gcc or clang as CasADi's users call it: fused multiply-add where the compiler likes. Raises CompilerNotFound."""
    compiler = require_compiler()
    if compiler.kind not in ("gcc", "clang"):
        raise CompilerNotFound(f"CasADi's C code needs the math library's headers and gcc or clang, found {compiler.version}; "
                               "install gcc")
    return Compiler((*compiler.command, "-std=gnu11", "-ffp-contract=fast"), compiler.kind, compiler.version)


def cpp_compiler(options: Sequence[str]) -> Compiler:
    """A C++ compiler with options: $CXX, else c++, g++ or clang++. Raises CompilerNotFound."""
    asked = os.environ.get("CXX")
    names = [asked] if asked else ["c++", "g++", "clang++"]
    program = next((path for path in map(shutil.which, names) if path), None)
    if program is None:
        raise CompilerNotFound(f"no C++ compiler was found, tried {', '.join(names)}; install g++, or set CXX")
    done = subprocess.run([program, "--version"], capture_output=True, text=True, errors="replace")
    first = next(iter(done.stdout.splitlines()), "unknown version")
    return Compiler((program, "-std=c++17", "-ffp-contract=fast", "-x", "c++", *options), "gcc", first)


def build_cpp(stem: str, text: str, options: Sequence[str], built_from: Sequence[str]) -> ctypes.CDLL:
    """The library of a C++ source, built if it is not in the cache.

    built_from   distributions whose version belongs to the key of the cache
    Raises CompilerNotFound, CompileError.
    """
    versions = ", ".join(f"{name} {version(name)}" for name in built_from)
    source = f"// {versions}\n{text}"
    compiler = cpp_compiler([*_DEFINES, *options])
    if not cache.is_built(source, stem, compiler):
        print(f"building {stem} with {versions}, once; this takes a minute or more", file=sys.stderr, flush=True)
    return cache.load(source, stem, compiler)
