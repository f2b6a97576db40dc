"""`symdyn demo`: the main job on a real mechanism, stage by stage."""

from __future__ import annotations

import argparse
import time as clock
from typing import TYPE_CHECKING

from symdyn.cli.find import find_system
from symdyn.cli.generate import write_files
from symdyn.cli.messages import STOPPED
from symdyn.cli.save import save
from symdyn.cli.summary import summarize

if TYPE_CHECKING:
    from symdyn.runtime.module import Module


def demo(arguments: argparse.Namespace) -> int:
    """The main job on a real mechanism, stage by stage."""
    begun = clock.perf_counter()
    print("The PUMA 560 falls freely under gravity: six joints in space, no motors.")
    with _Stage("derive"):
        equations = find_system("puma560", {}).equations()
        rhs = equations.tape("rhs")
        print(f"  {len(equations.symbols.coordinates)} coordinates; accelerations take {rhs.operations} operations "
              f"({equations.formulation})")
    with _Stage("generate"):
        folder = write_files(equations, ["c", "numpy"], arguments.output)
    with _Stage("compile"):
        module = equations.compile()
        module.library("rhs")
        print(f"  {_loaded(module)}")
    with _Stage("simulate"):
        solution = module.simulate()
        summarize(solution)
    with _Stage("save and draw"):
        save(solution, folder, picture=True, film=False)
    print(f"all of it: {clock.perf_counter() - begun:.2f} s")
    return 0 if solution.success else STOPPED


def _loaded(module: Module) -> str:
    """Words for what the module runs on."""
    from symdyn.runtime.building.compiler import find_compiler

    compiler = find_compiler() if module.backend == "c" else None
    if compiler is None:
        return f"NumPy. {module.fallback}"
    return f"C, by {compiler.version}; a library that was built before is used again"


class _Stage:
    """Prints the name of a stage before it, and its time after it."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __enter__(self) -> None:
        print(f"{self.name}", flush=True)
        self.begun = clock.perf_counter()

    def __exit__(self, kind: type[BaseException] | None, *rest: object) -> None:
        if kind is None:
            print(f"  {clock.perf_counter() - self.begun:.2f} s", flush=True)
