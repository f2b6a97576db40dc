"""Written files that are committed: compared byte by byte, rewritten only with --update."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from symdyn import systems
from symdyn.pipeline import emit, write_source

REFERENCE = Path(__file__).parents[2] / "generated" / "reference"
FILES = {("pendulum", "c"): {"pendulum.c", "pendulum.h", "main.c"}, ("double_pendulum", "numpy"): {"double_pendulum.py"},
         ("four_bar", "c"): {"four_bar.c", "four_bar.h", "main.c"}, ("four_bar", "numpy"): {"four_bar.py"}}
# Functions that mechanisms with loops have in addition.
AUGMENTED = ("rhs", "C", "C_r", "F_d", "lam", "reactions")


@pytest.mark.parametrize(("name", "backend"), FILES)
def test_same_bytes(name: str, backend: str, derived: Callable[..., Any], update: bool, tmp_path: Path) -> None:
    constrained = name in systems.names(constrained=True)
    source = emit(systems.get(name).augmented(), backend, AUGMENTED) if constrained else emit(derived(name), backend)
    folder = REFERENCE / name
    if update:
        write_source(source, folder)
        return
    assert {path.name for path in folder.iterdir()} == set().union(*[made for (n, _), made in FILES.items() if n == name])
    for made in write_source(source, tmp_path):
        kept = folder / made.name
        assert made.read_bytes() == kept.read_bytes(), (
            f"{kept} is not what is written now; see the difference with `git diff --no-index {kept} {made}`, "
            "and keep it with `pytest --update`")
