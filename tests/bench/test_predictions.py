"""`symdyn bench predictions`, of few motions: bytes are those that were predicted, and merging takes no memory of the rows."""

from __future__ import annotations

import contextlib
import io
import json
import re

import pytest

from symdyn.errors import SymdynError
from symdyn.lab import predictions
from tests.helpers import swept


def here(function, *arguments):
    """The result of predictions.apart, of this process."""
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        getattr(predictions, function)(*arguments)
    return json.loads(printed.getvalue().splitlines()[-1])


@pytest.mark.parametrize(("names", "apart"), swept([
    ("traces", here), ("traces", predictions.apart), ("short loop traces", predictions.apart)], ("traces", here)))
def test_predictions_next_to_sweeps(names, apart, capsys, monkeypatch):
    pytest.importorskip("pyarrow")
    pytest.importorskip("zarr")
    monkeypatch.setattr(predictions, "SWEEPS", {name: predictions.SWEEPS[name] for name in names.split()})
    monkeypatch.setattr(predictions, "apart", apart)
    assert predictions.run(rows=100_000, part=0.01) == 0
    said = capsys.readouterr().out.splitlines()
    rows = [line.split("|") for line in said if line.startswith(("short", "loop", "traces"))]
    counts = {"short": 1000, "loop": 64, "traces": 81}
    assert [int(row[0].split()[1]) for row in rows] == [counts[name] for name in names.split()]
    for row in rows:
        expected, found = map(float, row[3].split())
        assert expected == pytest.approx(found, rel=0.2, abs=0.11)  # MB, to one digit
        assert all(float(x) > 0 for x in row[1].split()) and all(float(x) > 10 for x in row[4].split())
    merged = [re.findall(r"npz \S+ s and (\d+) MB more", line) for line in said if "rows of five numbers" in line]
    assert len(merged) == 2 and all(int(found[0]) < 20 for found in merged)


def test_a_sweep_that_fails_is_an_error(tmp_path, capfd):
    (tmp_path / "a.toml").write_text('system = "double_pendulm"\n[initial]\nq1 = [1, 2]\n')
    with pytest.raises(SymdynError, match=r"the sweep a.toml ended with status \d+; what it printed is above"):
        predictions.taken(tmp_path / "a.toml", 1, tmp_path / "out")
    with pytest.raises(SymdynError, match="nothing ended with status 1; what it printed is above"):
        predictions.apart("nothing")
    capfd.readouterr()
