"""CMake packages for firmware and C++: float or double, no heap, no globals, steps of bounded time."""

from __future__ import annotations

import re
import subprocess
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import symdyn
from symdyn.arguments import some
from symdyn.backend.metadata import Sizes
from symdyn.backend.right_side import RightSide
from symdyn.backend.source import CORRECTIONS, render, template_environment
from symdyn.collector import collector_paused
from symdyn.emission import FIRMWARE, check_no_events, write_source
from symdyn.folders import templates_folder
from symdyn.formulation.equations import Equations
from symdyn.functions.content import content_of
from symdyn.functions.tapes import has_function
from symdyn.kinds import flag
from symdyn.named_records import NamedRecords
from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.paths import as_path, writing

# Copies of a function that a compiler specializes have its name and a suffix.
_USAGE = re.compile(r":(\w+)(?:\.[\w.]+)?\t(\d+)\t")
_CALL = re.compile(r"^(?:static )?(?:inline )?(?:int|double|void|const char \*|symdyn_real) ?\*?(\w+)\(.*\{$")


@dataclass(frozen=True)
class Package:
    """The package: its name, how its equations were derived, the version of symdyn, whether it calls numeric algorithms."""

    name: str
    formulation: str
    version: str
    sizes: Sizes
    intrinsics: bool


@dataclass(frozen=True)
class Stack:
    """Bytes of stack by function as a compiler states them; deepest: of the deepest chain of calls."""

    compiler: str
    functions: tuple[tuple[str, int], ...]
    deepest: int


@dataclass(frozen=True)
class PackageContext(NamedRecords):
    """The names that the page of a package gets, listed in templates/README.md; stack: none without gcc."""

    package: Package
    stack: Stack | None


def write_cmake(equations: Equations, path: Any, jacobian: bool = False,
                specialize: Mapping[Any, float] | None = None) -> list[Path]:
    """See Equations.to_cmake."""
    folder = as_path(path, "of the CMake package", "generated/arm")
    with_jacobian = flag(jacobian, f"{equations.name}: jacobian")
    check_no_events(equations)
    whole = equations.again() if equations.again is not None else equations
    bound = some(specialize, [p.name for p in whole.symbols.parameters], "specialize", whole.name)
    names = ["rhs", *(CORRECTIONS if whole.constraints else ()), *(n for n in ("outputs", "energy") if has_function(whole, n))]
    if with_jacobian:
        names += ["jacobian_x", *(["jacobian_inputs"] if whole.symbols.inputs else [])]
    with collector_paused():
        right_side = RightSide(integrated=False)
        source = render(content_of(whole, names, True, bound, right_side), FIRMWARE, right_side=right_side)
    metadata = source.metadata
    with writing(folder):
        written = write_source(source, folder)
        stacks, compiler = stack_of(folder, metadata.name)
        chain = deepest(folder / "src" / f"{metadata.name}.c", stacks) if stacks else 0
        context = PackageContext(
            Package(metadata.name, metadata.formulation, symdyn.__version__, metadata.sizes, bool(source.program.intrinsics)),
            Stack(compiler, tuple(sorted(stacks.items())), chain) if stacks else None)
        text = template_environment(templates_folder() / FIRMWARE).get_template("README.md.jinja").render(context.names())
        written.append(folder / "README.md")
        written[-1].write_text(text, encoding="utf-8")
    return written


def stack_of(folder: Path, name: str, command: tuple[str, ...] | None = None) -> tuple[dict[str, int], str]:
    """Bytes of stack of every function by gcc's -fstack-usage, and which gcc; nothing without gcc.

    command   the compiler with its options; default: the one of this machine
    """
    result = find_compiler()
    if command is None and (result is None or result.kind != "gcc"):
        return {}, ""
    used = command if command is not None or result is None else result.command
    assert used is not None
    with tempfile.TemporaryDirectory(prefix="stack-") as scratch:
        done = subprocess.run([*used, "-std=c99", "-O2", "-ffp-contract=off", "-fno-inline", "-fstack-usage", "-I",
                               str(folder / "include"), "-c", str(folder / "src" / f"{name}.c"), "-o", f"{scratch}/{name}.o"],
                              capture_output=True, text=True)
        usage = Path(scratch) / f"{name}.su"
        if done.returncode or not usage.is_file():
            return {}, ""
        version = subprocess.run([used[0], "--version"], capture_output=True, text=True).stdout.splitlines()[0]
        stacks: dict[str, int] = {}
        for function, n in _USAGE.findall(usage.read_text()):
            stacks[function] = max(int(n), stacks.get(function, 0))
        return stacks, version


def deepest(path: Path, stacks: Mapping[str, int]) -> int:
    """Bytes of stack of the deepest chain of calls among the functions of a file; none of them calls itself."""
    calls: dict[str, set[str]] = {}
    inside = ""
    for line in path.read_text(encoding="utf-8").splitlines():
        head = _CALL.match(line)
        if head:
            inside = head[1]
        elif inside and line == "}":
            inside = ""
        elif inside:
            calls.setdefault(inside, set()).update(f for f in re.findall(r"(\w+)\(", line) if f in stacks and f != inside)

    def below(function: str) -> int:
        return stacks.get(function, 0) + max((below(f) for f in calls.get(function, ())), default=0)

    return max(below(f) for f in stacks)
