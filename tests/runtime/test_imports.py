"""Time of imports: nothing heavy by `import symdyn`, no SymPy by generated code and what runs it."""

from __future__ import annotations

import json
import os
import pkgutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import symdyn.runtime
import symdyn.statics
from symdyn.pipeline import emit, write_source
from symdyn.runtime.building.compiler import find_compiler

ROOT = Path(__file__).parents[2]
SYMBOLIC = {"sympy", "mpmath", "jinja2"}
HEAVY = SYMBOLIC | {"numpy", "scipy", "matplotlib", "tqdm"}
RUNTIME = [f"{package.__name__}.{m.name}" for package in (symdyn.runtime, symdyn.statics)
           for m in pkgutil.iter_modules(package.__path__)]


def imported(program: str, folder: Path) -> set[str]:
    """Top-level packages in the memory of a process that ran a program."""
    program += "\nimport sys\nprint('packages:', *{name.partition('.')[0] for name in sys.modules})"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=folder, env=environment)
    assert done.returncode == 0, done.stderr
    return set(done.stdout.partition("packages: ")[2].split())


def test_import_symdyn_costs_next_to_nothing(tmp_path: Path) -> None:
    assert not HEAVY & imported("import symdyn; symdyn.__version__; dir(symdyn)", tmp_path)
    assert not HEAVY & imported("import symdyn; symdyn.SymdynError, symdyn.ModelError", tmp_path)
    assert not HEAVY & imported("import symdyn; symdyn.systems.names()", tmp_path)
    assert not HEAVY & imported("import symdyn.runtime.building.compiler, symdyn.runtime.building.cache", tmp_path)


def test_names_come_when_they_are_used(tmp_path: Path) -> None:
    assert "sympy" in imported("import symdyn as sd; sd.coordinates('q')", tmp_path)
    assert "scipy" not in imported("import symdyn as sd; sd.systems.pendulum().embedding()", tmp_path)


def test_every_runtime_module_without_sympy(tmp_path: Path) -> None:
    assert not SYMBOLIC & imported("\n".join(f"import {name}" for name in RUNTIME), tmp_path)
    numeric = [name for name in RUNTIME if not name.endswith("pictures")]
    assert not (HEAVY - {"numpy", "scipy"}) & imported("\n".join(f"import {name}" for name in numeric), tmp_path)


def test_generated_module_imports_numpy_only(derived: Callable[..., Any], tmp_path: Path) -> None:
    write_source(emit(derived("kitchen_sink"), "numpy"), tmp_path)
    packages = imported("import kitchen_sink\nassert kitchen_sink.selftest() == 0", tmp_path)
    assert "numpy" in packages and not (HEAVY - {"numpy"}) & packages and "symdyn" not in packages


PROGRAM = """
import json, sys
from pathlib import Path
from symdyn.backend.metadata import Metadata, ModuleMetadata
from symdyn.runtime.module import Module
from symdyn.runtime.building.library import CLibrary, PythonLibrary
from symdyn.runtime.building.compiler import find_compiler
metadata = ModuleMetadata.of_plain(json.loads(Path("metadata.json").read_text()))
def provide(what):
    name = what if isinstance(what, str) else "rhs"
    if {backend!r} == "numpy":
        return PythonLibrary.from_file(Path(name + ".py"))
    return CLibrary(Path(name + ".c").read_text(), Metadata.of_plain(json.loads(Path(name + ".json").read_text())),
                 find_compiler())
module = Module(metadata, provide, {backend!r})
solution = module.simulate((0, 1), method="Radau")
assert solution.success and module.simulate((0, 1)).success and abs(solution.energy_error()) < 1e-5
"""


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_simulation_without_sympy(backend: str, derived: Callable[..., Any], tmp_path: Path) -> None:
    """Source and record are all that the runtime needs."""
    if backend == "c" and find_compiler() is None:
        pytest.skip("no C compiler here")
    functions = ["rhs", "jacobian_x", "energy"]
    for name in functions:
        source = emit(derived("double_pendulum"), backend, [name], standalone=False)
        (tmp_path / f"{name}.{'c' if backend == 'c' else 'py'}").write_text(next(iter(source.files.values())))
        (tmp_path / f"{name}.json").write_text(json.dumps(source.metadata.as_plain()))
    record = {**source.metadata.as_plain(), "functions": functions, "duration": 1.0, "conservative": True}
    (tmp_path / "metadata.json").write_text(json.dumps(record))
    packages = imported(PROGRAM.format(backend=backend), tmp_path)
    assert "scipy" in packages and not SYMBOLIC & packages and not {"matplotlib", "tqdm"} & packages
