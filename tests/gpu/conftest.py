"""What stands for every GPU in the tests of devices."""

from __future__ import annotations

import pytest
from host_device import HostDevice

from symdyn.runtime.gpu import device


@pytest.fixture
def host(monkeypatch: pytest.MonkeyPatch) -> HostDevice:
    """A device that computes on this processor."""
    made = HostDevice(threads=8)
    monkeypatch.setattr(device, "open_device", lambda number, owner: made)
    return made
