"""Generated code is the same text from run to run, whatever order Python's hashing gives to sets."""

from __future__ import annotations

import contextlib
import difflib
import io
import os
import subprocess
import sys
from pathlib import Path

import pytest

import symdyn as sd
from symdyn.pipeline import emit

SCRIPT = """
import symdyn as sd
from symdyn.pipeline import emit
from tests.mechanisms import kitchen_sink
for system in (sd.systems.get("double_pendulum"), sd.systems.get("spatial_chain", n=3), kitchen_sink()):
    equations = system.embedding()
    for backend in ("c", "numpy"):
        for name, text in emit(equations, backend).files.items():
            print("=====", system.name, backend, name)
            print(text)
for name in ("four_bar", "bricard", "rolling_disc"):
    equations = sd.systems.get(name).augmented()
    for backend in ("c", "numpy"):
        for file, text in emit(equations, backend, ["rhs", "lam"], standalone=False).files.items():
            print("=====", name, backend, file)
            print(text)
print(sd.systems.get("double_pendulum").embedding().explicit("M_tilde", simplify=False))
"""


@pytest.fixture(scope="module")
def texts() -> list[str]:
    """Texts of a process with another seed, and of this one."""
    root = Path(__file__).parents[2]
    common = {**os.environ, "PYTHONPATH": str(root), "PYTHONIOENCODING": "utf-8"}
    other = "2" if os.environ.get("PYTHONHASHSEED") == "1" else "1"
    done = subprocess.run([sys.executable, "-c", SCRIPT], cwd=root, capture_output=True, encoding="utf-8", timeout=300,
                          env={**common, "PYTHONHASHSEED": other})
    assert done.returncode == 0, done.stderr
    with contextlib.redirect_stdout(io.StringIO()) as here:
        exec(SCRIPT, {})
    return [done.stdout, here.getvalue()]


def test_same_text_for_every_hash_seed(texts: list[str]) -> None:
    first, *others = texts
    for other in others:
        assert other == first, list(difflib.unified_diff(first.splitlines(), other.splitlines(), n=0))[:10]


def test_both_backends_were_emitted(texts: list[str]) -> None:
    for system in ("double_pendulum", "spatial_chain_3", "kitchen_sink", "four_bar", "bricard"):
        for ending in (".c", ".py"):
            assert any(line.startswith(f"===== {system}") and line.endswith(ending) for line in texts[0].splitlines())


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_files_do_not_depend_on_what_was_recorded_before(backend: str) -> None:
    fresh = sd.systems.get("double_pendulum").embedding()
    used = sd.systems.get("double_pendulum").embedding()
    for name in ("J", "rhs", "energy", "jacobian_x"):
        used.quantity(name)
    assert dict(emit(used, backend, ["k_tilde"]).files) == dict(emit(fresh, backend, ["k_tilde"]).files)
    assert dict(emit(used, backend).files) == dict(emit(fresh, backend).files)
