"""The garbage collector while and after equations are derived."""

from __future__ import annotations

import gc
import weakref
from collections.abc import Iterator

import pytest

from symdyn import collector
from symdyn.collector import collector_paused


class Ring:
    """An object that only a search for garbage frees."""

    def __init__(self) -> None:
        self.me = self


@pytest.fixture(autouse=True)
def as_after_a_search(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(collector, "LEAST", 500)
    monkeypatch.setattr(collector, "MOST", 2000)
    gc.collect()
    assert gc.isenabled()
    yield
    gc.collect()


def is_young(thing: object) -> bool:
    return any(thing is other for other in gc.get_objects(generation=0))


def test_nothing_is_searched_meanwhile() -> None:
    with collector_paused():
        assert not gc.isenabled()
        with collector_paused():
            pass
        assert not gc.isenabled()
    assert gc.isenabled()
    gc.disable()
    with collector_paused():
        pass
    assert not gc.isenabled()
    gc.enable()


def test_what_stays_is_not_looked_through_again() -> None:
    with collector_paused():
        kept = [Ring() for _ in range(1000)]
        assert is_young(kept[0])
    assert not is_young(kept[0]) and gc.get_freeze_count() == 0


def test_garbage_of_many_pauses_is_found() -> None:
    """What is set aside without having been looked through has a limit; searches through all begin to count again."""
    aside = []
    for _ in range(5):
        with collector_paused():
            kept = [Ring() for _ in range(1000)]
            last = weakref.ref(kept[-1])
        aside.append(not is_young(kept[-1]))
        del kept
        gc.collect(0)
        assert (last() is not None) is aside[-1]
    assert aside[0] and not aside[-1]
    gc.collect()
    assert last() is None
    with collector_paused():
        kept = [Ring() for _ in range(1000)]
    assert not is_young(kept[0])


def test_what_a_program_has_frozen_stays_so() -> None:
    gc.freeze()
    try:
        frozen = gc.get_freeze_count()
        with collector_paused():
            kept = [Ring() for _ in range(1000)]
        assert gc.get_freeze_count() == frozen and kept
    finally:
        gc.unfreeze()
