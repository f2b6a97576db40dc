"""`symdyn bench robots`: a table, and the report where there is none."""

from __future__ import annotations

import pytest

from symdyn.cli import main
from symdyn.errors import MissingExtra
from symdyn.lab.robots import collection

pytest.importorskip("pinocchio", reason="Pinocchio is not installed; run: pip install pin")
pytest.importorskip("defusedxml", reason="defusedxml is not installed; run: pip install 'symdyn[robots]'")


def test_a_row(capsys: pytest.CaptureFixture[str]) -> None:
    try:
        collection.folder()
    except MissingExtra as error:
        pytest.skip(str(error))
    assert main(["bench", "robots", "--only", "double_pend*_simple", "--no-times", "--states", "2"]) == 0
    heading, row, *rest = capsys.readouterr().out.splitlines()
    found = dict(zip(heading.split()[:3], row.split(), strict=False))
    assert found == {"robot": "double_pendulum_simple", "n_u": "2", "links": "4"}
    words = row.split()
    assert words[8:12] == ["-"] * 4 and all(0 <= float(word) < 1e-14 for word in words[12:18])
    assert rest[0] == "1 robots, 2 random states each; 0 differ by more than 1e-12 or failed."


def test_what_is_not_there(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    assert main(["bench", "robots", "--only", "nobody"]) == 2
    assert "no robot is named nobody; there are double_pendulum, " in capsys.readouterr().err
    assert main(["bench", "robots", "--states", "0"]) == 2
    assert "0 states were asked for; pass 1 or more" in capsys.readouterr().err
    monkeypatch.setattr(collection, "_SHARED", collection._SHARED / "none")
    assert main(["bench", "robots", "--only", "panda"]) == 1
    assert "the robots are not installed; run: pip install example-robot-data" in capsys.readouterr().err
