"""A fixture of several tests of benchmarks: pictures that take no time."""

import pytest

from symdyn.bench.work import picture


@pytest.fixture()
def drawn(monkeypatch):
    """Pictures that take no time."""
    def draw(result, folder):
        paths = [folder / "work_precision.png", folder / "work_precision.svg"]
        for path in paths:
            path.write_text(result.name)
        return paths

    monkeypatch.setattr(picture, "write_pictures", draw)
