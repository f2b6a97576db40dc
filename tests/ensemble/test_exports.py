"""Parquet tables and Zarr folders of ensembles, read by other programs, in groups of rows."""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest

import symdyn as sd
from symdyn.ensembles import exports
from symdyn.errors import ArgumentError, MissingExtra
from symdyn.runtime.building.recall import recall

OUTCOMES = ["end q1", "trace q2", "grad end q1"]


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """The last of 40 members fails."""
    lengths = np.linspace(0.5, 1.5, 40)
    lengths[-1] = np.nan
    return sd.ensemble(recall("double_pendulum", {}), {"l1": lengths, "q1": np.linspace(-1, 1, 40)}, np.linspace(0, 0.2, 5),
                       OUTCOMES, path=tmp_path_factory.mktemp("exports") / "a", formats=["parquet", "zarr"])


def test_a_table_has_what_the_result_has(found):
    pd = pytest.importorskip("pandas")
    table = pd.read_parquet(found.path / "ensemble.parquet")
    assert list(table.columns) == ["l1", "q1", *OUTCOMES, "failed"] and len(table) == 40
    for name in ("l1", "q1", "end q1"):
        assert np.array_equal(table[name], found[name], equal_nan=True)
    for name in OUTCOMES[1:]:
        assert np.array_equal(np.vstack(table[name]), found[name], equal_nan=True)
    assert list(np.flatnonzero(table["failed"])) == [39]
    pq = pytest.importorskip("pyarrow.parquet")
    about = json.loads(pq.read_schema(found.path / "ensemble.parquet").metadata[b"symdyn"])
    assert about["t"] == found.t.tolist() and about["shapes"]["trace q2"] == [5] and about["system"] == "double_pendulum"


def test_xarray_opens_the_folder_of_arrays(found):
    xr, _ = pytest.importorskip("xarray"), pytest.importorskip("zarr")
    data = xr.open_zarr(found.path / "ensemble.zarr", consolidated=False)
    assert data["trace q2"].dims == ("member", "t") and data.sizes["member"] == 40
    for name in ("samples", *OUTCOMES):
        assert np.array_equal(data[name].values, getattr(found, name) if name == "samples" else found[name], equal_nan=True)
    assert data["failed"].values.sum() == 1 and np.array_equal(data["t"].values, found.t)
    assert data.attrs["names"] == ["l1", "q1"]


def test_rows_are_written_in_groups(found, tmp_path, monkeypatch):
    pq, zarr = pytest.importorskip("pyarrow.parquet"), pytest.importorskip("zarr")
    monkeypatch.setattr(exports, "GROUP", 12 * (8 * 10 + 1))
    file = pq.ParquetFile(found.to_parquet(tmp_path / "a.parquet"))
    assert [file.metadata.row_group(k).num_rows for k in range(file.num_row_groups)] == [12, 12, 12, 4]
    assert np.array_equal(file.read().column("end q1").to_numpy(), found["end q1"], equal_nan=True)
    array = zarr.open_group(found.to_zarr(tmp_path / "a.zarr"))["trace q2"]
    assert array.chunks == (12, 5) and np.array_equal(array[:], found["trace q2"], equal_nan=True)


def test_a_folder_that_is_there_is_replaced_and_nothing_half_written_stays(found, tmp_path, monkeypatch):
    zarr = pytest.importorskip("zarr")
    path = found.to_zarr(tmp_path / "a.zarr")
    assert found.to_zarr(path) == path and zarr.open_group(path)["end q1"].shape == (40,)

    def fails(*arguments):
        raise OSError("no space")

    monkeypatch.setattr(exports, "pieces", fails)
    for write in (found.to_zarr, found.to_parquet):
        with pytest.raises(OSError, match="no space"):
            write(tmp_path / "b")
    assert [p.name for p in tmp_path.iterdir()] == ["a.zarr"]


def test_formats_are_made_up_for_when_a_run_is_resumed(tmp_path):
    pytest.importorskip("pyarrow")
    asked = recall("double_pendulum", {}), {"q1": [0.1, 0.2]}, (0, 0.1)
    sd.ensemble(*asked, path=tmp_path)
    assert not (tmp_path / "ensemble.parquet").exists()
    assert sd.ensemble(*asked, path=tmp_path, resume=True, formats="parquet").n_resumed == 2
    assert (tmp_path / "ensemble.parquet").is_file()


def test_formats_that_cannot_be_written(found, monkeypatch):
    asked = recall("double_pendulum", {}), {"q1": [0.1, 0.2]}, (0, 0.1)
    for formats in ("hdf5", ["hdf5"], 3):
        with pytest.raises(ArgumentError, match=r"formats: there is no .*(hdf5|3).*; there are parquet, zarr"):
            sd.ensemble(*asked, formats=formats)
    clash = sd.ensemble(*asked, {"q1": "end q1"})
    with pytest.raises(ArgumentError, match=r"q1: sampled, and the label of an outcome too, .*; give the outcome another label"):
        clash.to_parquet()
    for package, extra, write in (("pyarrow", "parquet", found.to_parquet), ("zarr", "zarr", found.to_zarr)):
        monkeypatch.setitem(sys.modules, package, None)
        with pytest.raises(MissingExtra, match=rf"needs the package {package}: pip install 'symdyn\[{extra}\]'"):
            write()
        with pytest.raises(MissingExtra, match=package):
            sd.ensemble(*asked, formats=extra)
