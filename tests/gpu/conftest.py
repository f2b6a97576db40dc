"""Device that stands for every GPU in the tests of devices."""

from __future__ import annotations

import gc
from collections.abc import Iterator

import pytest
from host_device import HostDevice

from symdyn.runtime.gpu import device


@pytest.fixture
def host(monkeypatch: pytest.MonkeyPatch) -> Iterator[HostDevice]:
    """A device that computes on this processor. Tests that look for garbage look through their own objects alone: those of all
    tests before them take seconds."""
    made = HostDevice(threads=8)
    monkeypatch.setattr(device, "open_device", lambda number, owner: made)
    gc.freeze()
    yield made
    gc.unfreeze()
