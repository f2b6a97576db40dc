"""Modules on both backends, for all tests of the runtime."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from symdyn.systems import get


@pytest.fixture(params=["c", "numpy"])
def backend(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="session")
def pendulum(compiled: Callable[..., Any]) -> Any:
    return compiled("pendulum", "c")


@pytest.fixture(scope="session")
def fast() -> Any:
    """The pendulum as users have it: without the flags that have tests compile quickly."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("SYMDYN_CC", raising=False)
        return get("pendulum").embedding().compile("c")


@pytest.fixture
def double(compiled: Callable[..., Any], backend: str) -> Any:
    return compiled("double_pendulum", backend)


@pytest.fixture
def oscillator(compiled: Callable[..., Any], backend: str) -> Any:
    return compiled("driven_oscillator", backend)
