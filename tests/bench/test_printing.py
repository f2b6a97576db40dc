"""The measurement of printing: exact counts, and the bound that no other form is shorter."""

import dataclasses

from symdyn.cli import main
from symdyn.lab import printing


def test_table(capsys):
    assert main(["bench", "printing", "--systems", "cart_pole", "skate"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == printing.HEADING
    assert [line.split()[:2] for line in lines[1:4]] == [["cart_pole", q] for q in ("M_tilde", "k_tilde", "F_tilde")]
    assert "C_r" in "".join(lines[4:]) and "another form is shorter" not in "".join(lines)


def test_a_longer_form_counts_as_missed(monkeypatch, capsys):
    rows = list(printing.printed("pendulum"))
    assert not any(row.longer for row in rows)
    wrong = dataclasses.replace(rows[0], operations=rows[0].operations + 1, others=(None, rows[0].operations))
    monkeypatch.setattr(printing, "printed", lambda name: iter([wrong, dataclasses.replace(rows[1], seconds=0.6)]))
    assert printing.run(["pendulum"]) == 2
    assert "another form is shorter" in capsys.readouterr().out
