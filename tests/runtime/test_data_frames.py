"""Motions as tables of pandas and data sets of xarray."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
import pytest

import symdyn as sd
from symdyn.runtime.solutions.solution import Solution


def motion() -> Solution:
    """Motion of a pendulum with a point and a number as outputs."""
    system = sd.systems.pendulum()
    body = system.bodies[0]
    system.add_output("tip", sd.position(body))
    system.add_output("square", system.embedding().symbols.coordinates[0] ** 2)
    return system.embedding().compile(backend="numpy").simulate((0, 0.2))


def test_columns_are_those_of_a_csv_file() -> None:
    titles, columns = motion().columns()
    assert titles[:3] == ["t", "q1", "q1_dot"] and {"tip_1", "tip_2", "square"} <= set(titles)
    assert all(column.shape == columns[0].shape for column in columns)


def test_a_table_of_pandas() -> None:
    pytest.importorskip("pandas")
    solution = motion()
    frame = solution.to_pandas()
    assert frame.index.name == "t" and frame.attrs["units"]["t"] == "s" and frame.attrs["name"] == solution.module.name
    np.testing.assert_array_equal(frame["q1"].to_numpy(), solution["q1"])
    np.testing.assert_array_equal(frame["tip_2"].to_numpy(), solution["tip"].reshape(len(solution.t), -1)[:, 1])
    assert frame.attrs["units"]["q1"] == solution.module.metadata.units["q1"]


def test_a_data_set_of_xarray() -> None:
    pytest.importorskip("xarray")
    solution = motion()
    data = solution.to_xarray()
    assert data["q1"].dims == ("t",) and data["tip"].shape == solution["tip"].shape and "tip_1" not in data
    assert data["q1"].attrs["units"] == solution.module.metadata.units["q1"] and data["t"].attrs["units"] == "s"
    np.testing.assert_array_equal(data["square"].values, solution["square"].reshape(-1))


@pytest.mark.parametrize("name", ["pandas", "xarray"])
def test_what_is_not_installed(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(sd.MissingExtra, match=rf"to_{name} needs {name} .*pip install 'symdyn\[data\]'"):
        getattr(motion(), f"to_{name}")()


def test_the_page() -> None:
    """The example of the documentation runs."""
    pytest.importorskip("pandas"), pytest.importorskip("xarray")
    page = Path(__file__).parent.parent.parent / "docs" / "numbers.md"
    exec(next(b for b in re.findall(r"```py\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL) if "to_xarray" in b), {})
