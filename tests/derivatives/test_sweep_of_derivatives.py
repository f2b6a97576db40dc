"""The sweep of derivatives over random mechanisms and the catalogue: `python -m symdyn.lab.derivatives`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from symdyn.lab import derivatives
from symdyn.lab.derivatives import Result, catalogue_result, main, random_result, summary
from symdyn.runtime.module import Module
from tests.helpers import swept


@pytest.mark.parametrize("number", [*swept([1, 3]), 6])  # a loop, Euler parameters, redundant constraints
def test_random_mechanisms(number: int) -> None:
    found = random_result(number, 0)
    assert found.passed, str(found)
    assert {"rhs by x", "inverse_dynamics by ud"} <= found.errors.keys()
    # Multipliers of redundant constraints have no derivatives.
    assert "lam by x" in found.errors or number != 1
    assert "lam by x" not in found.errors or number != 6


@pytest.mark.parametrize("name", ["pendulum", "four_bar"])
def test_catalogue(name: str) -> None:
    found = catalogue_result(name)
    assert found.passed, str(found)
    assert found.worst[1] < derivatives.BOUND


def test_wrong_derivatives_fail(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    right = Module.jacobian

    def wrong(self: Module, *arguments: Any, **named: Any) -> Any:
        found = right(self, *arguments, **named)
        return found._replace(x=found.x * (1 + 1e-9)) if found.x is not None else found

    monkeypatch.setattr(Module, "jacobian", wrong)
    assert main(["--names", "pendulum"]) == 1
    printed = capsys.readouterr().out
    assert "FAILED" in printed and "1 mechanisms, 1 fail" in printed


def test_errors_at_rest_count_by_the_terms_that_cancel() -> None:
    """Forces that hold each other: x_dot is a rounding error of theirs, and so is its derivative by the time."""
    assert random_result(861, 0).passed
    # f = a - b at a = b: its value vanishes, what it adds does not.
    size = derivatives.size_of_terms(np.zeros(1), [(np.array([[1.0, -1.0]]), np.array([3.0, 3.0]))])
    assert size == 6.0
    # A function that no number contributes to counts by its value.
    assert derivatives.size_of_terms(np.array([3.0, 4.0]), [(np.zeros((2, 1)), np.ones(1))]) == 5.0


def test_verdicts() -> None:
    one = Result("one", {"rhs by x": 1e-15, "lam by x": 9e-14}, 10.0, True, 0.1)
    assert one.passed and one.worst == ("lam by x", 9e-14)
    assert not replace(one, errors={"lam by x": 2e-13}).passed and not replace(one, same_bits=False).passed
    failed = replace(one, errors={"rhs by x": np.nan})
    assert not failed.passed and "FAILED" in str(failed) and "2 mechanisms, 1 fail" in summary([one, failed])
    assert "ROWS DIFFER  KeyError" in str(replace(one, same_bits=False, fault="KeyError"))


def test_a_run_goes_on_where_it_was_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                            capsys: pytest.CaptureFixture[str]) -> None:
    computed = []

    def measured(number: int, seed: int) -> Result:
        computed.append(number)
        return Result(f"{number} of {seed}", {"rhs by x": number * 1e-17}, 1.0, True, 0.1)

    monkeypatch.setattr(derivatives, "random_result", measured)
    file = tmp_path / "kept.jsonl"
    line = ["--count", "3", "--keep", str(file)]
    assert main([*line, "--seconds", "0"]) == 0
    assert computed == [0] and "1 mechanisms, 0 fail" in capsys.readouterr().out
    with file.open("a", encoding="utf-8") as end:
        end.write('{"seed": 0, "co')  # of a run that was killed while it wrote
    main(line)
    main([*line, "--quiet"])
    assert computed == [0, 1, 2]
    assert "rhs by x                   2.0e-17 at most, in 3\n3 mechanisms, 0 fail" in capsys.readouterr().out
    main([*line, "--seed", "1", "--seconds", "0"])
    assert computed == [0, 1, 2, 0]  # of other random numbers
    with pytest.raises(SystemExit):
        main(["--catalogue", "--keep", str(file)])
    assert "leave out --catalogue" in capsys.readouterr().err
