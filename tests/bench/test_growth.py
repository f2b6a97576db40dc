"""The measurement of growth: exact counts that grow linearly, orders, crossover, table and picture."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import symdyn as sd
from symdyn.backend.right_side import RightSide
from symdyn.cli import main
from symdyn.functions.tapes import columns_of
from symdyn.lab import growth
from symdyn.lab.growth import Growth
from symdyn.lab.random_tree import random_tree
from symdyn.runtime.building.compiler import find_compiler

needs_c = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


def row(n: int, formulation: str, operations: int) -> Growth:
    return Growth(n, formulation, operations, 0, 0.0, 0, 0.0, operations * 1e-9)


def test_the_recursion_grows_linearly() -> None:
    """Three links (z, y, x) add the same operations wherever they are added."""
    counts = [sd.systems.get("spatial_chain", n=n).recursive().tape("rhs").operations for n in (10, 13, 16, 40, 43)]
    assert counts[1] - counts[0] == counts[2] - counts[1] == counts[4] - counts[3]
    chains = [sd.systems.get("spatial_chain", n=n).recursive().tape("rhs").longest_chain() for n in (10, 13, 16)]
    assert chains[1] - chains[0] == chains[2] - chains[1]


def test_derivatives_grow_quadratically_in_code_that_grows_linearly() -> None:
    made = {n: columns_of(sd.systems.get("spatial_chain", n=n).recursive(), "jacobian_x", RightSide()) for n in (8, 16, 24, 32)}
    one = [c.together(10**9) for c in made.values() if c is not None]  # statements of one direction in q, and of one in u
    assert len(one) == 4 and max(one[2] - one[1], one[3] - one[2]) < 1.02 * (one[1] - one[0])
    operations = [c.operations(growth.LANES) for c in made.values() if c is not None]
    assert operations[3] / operations[1] < 4


def test_order_and_crossover() -> None:
    rows = [row(n, "embedding", n**3) for n in (2, 4, 8, 16)] + [row(n, "recursive", 40 * n) for n in (2, 4, 8, 16, 32)]
    cubic, linear = ([r for r in rows if r.formulation == f] for f in ("embedding", "recursive"))
    assert growth.order(cubic, lambda r: r.operations) == pytest.approx(3)
    assert growth.order(linear, lambda r: r.operations) == pytest.approx(1)
    assert growth.crossover(rows, lambda r: r.operations) == 8
    assert growth.crossover([r for r in rows if r.n < 8], lambda r: r.operations) is None


def test_a_random_tree_is_the_same_for_the_same_seed() -> None:
    one, again, other = (random_tree(12, seed).recursive().tape("rhs").operations for seed in (3, 3, 4))
    assert one == again != other


@needs_c
def test_table_picture_and_json(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("symdyn.timing.loops.TIMING_SECONDS", 1e-5)  # times are not looked at
    assert main(["bench", "growth", "--sizes", "1", "2", "3", "--output", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "operations of recursive grow like n^" in said and said.count("embedding") >= 3
    assert "a random tree of 6 bodies" in said
    assert "of the derivative grow like n^" in said
    kept = json.loads((tmp_path / "growth.json").read_text(encoding="utf-8"))
    assert len(kept["rhs"]) == 7 and [r["n"] for r in kept["jacobian_x"]] == [1, 2, 3]
    assert (tmp_path / "growth.png").stat().st_size > 10_000


def test_sizes_must_be_positive(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "growth", "--sizes", "0"]) != 0
    assert "--sizes takes numbers of bodies, 1 or more; found 0" in capsys.readouterr().err
