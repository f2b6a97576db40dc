"""The measurement of loops: both kinds of code are compared with 40 digits; table, picture, and what cannot be asked."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from symdyn.cli import main
from symdyn.errors import ArgumentError
from symdyn.lab import rolled
from symdyn.runtime.building.compiler import find_compiler

needs_c = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


@needs_c
def test_table_picture_and_json(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("symdyn.timing.loops.TIMING_SECONDS", 1e-5)  # times are not looked at
    assert main(["bench", "rolled", "--only", "cable", "--sizes", "4", "8", "--output", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == rolled.HEADING and [line.split()[1:3] for line in lines[1:5]] == [
        ["4", "loops"], ["4", "straight"], ["8", "loops"], ["8", "straight"]]
    rows = json.loads((tmp_path / "rolled.json").read_text())
    assert rows[2]["statements"] < rows[3]["statements"] == rows[3]["operations"] == rows[2]["operations"]
    # Against 40 digits.
    assert all(0 <= row["error"] < 1e-11 and row["evaluation"] > 0 and row["compile"] > 0 for row in rows)
    assert (tmp_path / "rolled.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(("names", "sizes", "found"), [(["belt"], [4], "belt"), (["cable"], [4, 0], "0")])
def test_what_cannot_be_asked(names: list[str], sizes: list[int], found: str) -> None:
    with pytest.raises(ArgumentError, match=f"cable, legs, and numbers of bodies, 1 or more; found {found}$"):
        rolled.run(names, sizes)
