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

import symdyn.runtime
import symdyn.statics
from symdyn.pipeline import emit, write_source
from symdyn.runtime.building.compiler import find_compiler

ROOT = Path(__file__).parents[2]
SYMBOLIC = {"sympy", "mpmath", "jinja2"}
HEAVY = SYMBOLIC | {"numpy", "scipy", "matplotlib", "tqdm"}
RUNTIME = [f"{package.__name__}.{m.name}" for package in (symdyn.runtime, symdyn.statics)
           for m in pkgutil.iter_modules(package.__path__)]


LISTED = "\nimport sys\nprint('packages:', *{name.partition('.')[0] for name in sys.modules})\n"


def imported(folder: Path, *programs: str) -> list[set[str]]:
    """Top-level packages in the memory of a process after each of the programs that it ran one after the other."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    program = "".join(one + LISTED for one in programs)
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=folder, env=environment)
    assert done.returncode == 0, done.stderr
    lists = [set(line.split()[1:]) for line in done.stdout.splitlines() if line.startswith("packages: ")]
    assert len(lists) == len(programs) and all("sys" in one for one in lists)
    return lists


def test_import_symdyn_costs_next_to_nothing(tmp_path: Path) -> None:
    for packages in imported(tmp_path, "import symdyn; symdyn.__version__; dir(symdyn)", "symdyn.SymdynError, symdyn.ModelError",
                             "symdyn.systems.names()", "import symdyn.runtime.building.compiler, symdyn.runtime.building.cache"):
        assert not HEAVY & packages


def test_names_come_when_they_are_used(tmp_path: Path) -> None:
    symbols, equations = imported(tmp_path, "import symdyn as sd; sd.coordinates('q')", "sd.systems.pendulum().embedding()")
    assert "sympy" in symbols and "scipy" not in equations


def test_every_runtime_module_without_sympy(tmp_path: Path) -> None:
    numeric = [name for name in RUNTIME if not name.endswith("pictures")]
    programs = ["\n".join(f"import {name}" for name in names) for names in (numeric, RUNTIME)]
    without_pictures, packages = imported(tmp_path, *programs)
    assert not (HEAVY - {"numpy", "scipy"}) & without_pictures and not SYMBOLIC & packages


def test_generated_module_imports_numpy_only(derived: Callable[..., Any], tmp_path: Path) -> None:
    write_source(emit(derived("kitchen_sink"), "numpy"), tmp_path)
    (packages,) = imported(tmp_path, "import kitchen_sink\nassert kitchen_sink.selftest() == 0")
    assert "numpy" in packages and not (HEAVY - {"numpy"}) & packages and "symdyn" not in packages


PROGRAM = """
import json
from pathlib import Path
from symdyn.backend.metadata import Metadata, ModuleMetadata
from symdyn.runtime.module import Module
from symdyn.runtime.building.library import CLibrary, PythonLibrary
from symdyn.runtime.building.compiler import find_compiler
def simulates(backend):
    folder = Path(backend)
    metadata = ModuleMetadata.of_plain(json.loads(Path(folder, "metadata.json").read_text()))
    def provide(what):
        name = what if isinstance(what, str) else "rhs"
        if backend == "numpy":
            return PythonLibrary.from_file(Path(folder, name + ".py"))
        return CLibrary(Path(folder, name + ".c").read_text(),
                        Metadata.of_plain(json.loads(Path(folder, name + ".json").read_text())), find_compiler())
    module = Module(metadata, provide, backend)
    solution = module.simulate((0, 1), method="Radau")
    assert solution.success and module.simulate((0, 1)).success and abs(solution.energy_error()) < 1e-5
"""


def test_simulation_without_sympy(derived: Callable[..., Any], tmp_path: Path) -> None:
    """Source and record are all that the runtime needs."""
    functions, backends = ["rhs", "jacobian_x", "energy"], ["numpy", *["c"][:find_compiler() is not None]]
    for backend in backends:
        folder = tmp_path / backend
        folder.mkdir()
        for name in functions:
            source = emit(derived("double_pendulum"), backend, [name], standalone=False)
            (folder / f"{name}.{'c' if backend == 'c' else 'py'}").write_text(next(iter(source.files.values())))
            (folder / f"{name}.json").write_text(json.dumps(source.metadata.as_plain()))
        record = {**source.metadata.as_plain(), "functions": functions, "duration": 1.0, "conservative": True}
        (folder / "metadata.json").write_text(json.dumps(record))
    for packages in imported(tmp_path, PROGRAM, *(f"simulates({backend!r})" for backend in backends))[1:]:
        assert "scipy" in packages and not SYMBOLIC & packages and not {"matplotlib", "tqdm"} & packages
