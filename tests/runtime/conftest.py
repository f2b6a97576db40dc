"""Modules on both backends, for all tests of the runtime."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest


@pytest.fixture(params=["c", "numpy"])
def backend(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def double(compiled: Callable[..., Any], backend: str) -> Any:
    return compiled("double_pendulum", backend)


@pytest.fixture
def oscillator(compiled: Callable[..., Any], backend: str) -> Any:
    return compiled("driven_oscillator", backend)
