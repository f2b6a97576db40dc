"""Plugins of pytest for tests/mutate.py, chosen by its environment: note which functions each test enters, or run chosen tests.

MUTATION_NOTE   the file that gets a line of JSON for each test: its name, its seconds, the functions that it entered
MUTATION_ORDER  the file with the names of the tests to run, in their order
"""

from __future__ import annotations

import builtins
import json
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

ENTERED: set[int] = builtins.__dict__.setdefault("functions_entered", set())


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Note what a test enters, its fixtures included."""
    file = os.environ.get("MUTATION_NOTE")
    ENTERED.clear()
    begun = sum(os.times()[:4])
    result = yield
    if file:
        line = {"test": item.nodeid, "seconds": round(sum(os.times()[:4]) - begun, 3), "entered": sorted(ENTERED)}
        with Path(file).open("ab", buffering=0) as lines:  # each line in one piece: several processes write
            lines.write(json.dumps(line).encode() + b"\n")
    return result


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep the chosen tests, in their order."""
    if file := os.environ.get("MUTATION_ORDER"):
        rank = {name: k for k, name in enumerate(json.loads(Path(file).read_text(encoding="utf-8")))}
        chosen = sorted((item for item in items if item.nodeid in rank), key=lambda item: rank[item.nodeid])
        config.hook.pytest_deselected(items=[item for item in items if item.nodeid not in rank])
        items[:] = chosen
