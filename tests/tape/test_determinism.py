"""Generated code and the order of symbols are the same from run to run, whatever order Python's hashing gives to sets."""

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
import sympy as sp
import symdyn as sd
from symdyn.exact.taken import recorded
from symdyn.pipeline import emit
from tests.backend.test_external_code import equations as with_functions
from tests.mechanisms import kitchen_sink

def show(name, equations, *given, **options):
    for backend in ("c", "numpy"):
        for file, text in emit(equations, backend, *given, **options).files.items():
            print("=====", name, backend, file)
            print(text)

for system in {trees}:
    show(system.name, system.embedding())
show("arm", with_functions("function", "embedding"), ["rhs", "jacobian_x"])
for name in {loops}:
    show(name, sd.systems.get(name).augmented(), ["rhs", "lam"], standalone=False)
print(sd.systems.get("double_pendulum").embedding().explicit("M_tilde", simplify=False))
# Symbols of one name, of which assumptions are all that differs.
for letter in "mkcdl":
    symbols = [sp.Symbol(letter, **kind) for kind in (dict(), dict(positive=True), dict(real=True), dict(negative=True))]
    print([sorted(s.assumptions0.items()) for s in recorded([sum(symbols)])[1].values()])
"""
# Trees and mechanisms with constraints; the second ones differ from the first in size.
FEW = "[kitchen_sink()]", '["four_bar", "rolling_disc"]'
MORE = '[sd.systems.get("double_pendulum"), sd.systems.get("spatial_chain", n=3)]', '["bricard"]'


@pytest.fixture(scope="module", params=[FEW, pytest.param(MORE, marks=pytest.mark.sweep)], ids=["few", "more"])
def texts(request: pytest.FixtureRequest) -> list[str]:
    """Texts of a process with another seed, and of this one."""
    root, (trees, loops) = Path(__file__).parents[2], request.param
    script = SCRIPT.format(trees=trees, loops=loops)
    common = {**os.environ, "PYTHONPATH": str(root), "PYTHONIOENCODING": "utf-8"}
    other = "2" if os.environ.get("PYTHONHASHSEED") == "1" else "1"
    done = subprocess.run([sys.executable, "-c", script], cwd=root, capture_output=True, encoding="utf-8", timeout=300,
                          env={**common, "PYTHONHASHSEED": other})
    assert done.returncode == 0, done.stderr
    with contextlib.redirect_stdout(io.StringIO()) as here:
        exec(script, {})
    return [done.stdout, here.getvalue()]


def test_same_text_for_every_hash_seed(texts: list[str]) -> None:
    first, *others = texts
    for other in others:
        assert other == first, list(difflib.unified_diff(first.splitlines(), other.splitlines(), n=0))[:10]


def test_both_backends_were_emitted(texts: list[str], request: pytest.FixtureRequest) -> None:
    few = "kitchen_sink", "four_bar", "rolling_disc"
    more = "double_pendulum", "spatial_chain_3", "bricard"
    for system in ("arm", *(few if "few" in request.node.callspec.id else more)):
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
