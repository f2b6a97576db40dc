"""`symdyn bench sympy`: a table of examples that are taken over."""

from __future__ import annotations

import pytest

from symdyn.cli import main


def test_rows_have_agreement_operations_and_times(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "sympy", "--only", "mass_spring", "chaos"]) == 0
    rows = capsys.readouterr().out.splitlines()
    assert [row.split()[0] for row in rows] == ["example", "mass_spring_damper", "chaos_pendulum"]
    assert float(rows[1].split()[-1]) < 1e-12 and " ns" in rows[1] and " us" in rows[1]
