"""The garbage collector while and after equations are derived.

Searches through all objects take seconds in a process that has run other tests, and what these keep changes the counts: each
check has a process of its own.
"""

from __future__ import annotations

import functools
import gc
import weakref
from collections.abc import Callable
from unittest import mock

import pytest

from symdyn import collector
from symdyn.collector import collector_paused
from tests.running import passes_apart


class Ring:
    """An object that only a search for garbage frees."""

    def __init__(self) -> None:
        self.me = self


def with_small_numbers(check: Callable[[], None]) -> None:
    with mock.patch.object(collector, "LEAST", 500), mock.patch.object(collector, "MOST", 2000):
        gc.collect()
        gc.set_threshold(200_000, 20, 50)  # no search by itself during a check
        assert gc.isenabled()
        check()


def is_young(thing: object) -> bool:
    return any(thing is other for other in gc.get_objects(generation=0))


def nothing_is_searched_meanwhile() -> None:
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


def what_stays_is_not_looked_through_again() -> None:
    with collector_paused():
        kept = [Ring() for _ in range(1000)]
        assert is_young(kept[0])
    assert not is_young(kept[0]) and gc.get_freeze_count() == 0


def garbage_of_many_pauses_is_found() -> None:
    """The garbage set aside without having been looked through has a limit; searches through all begin to count again."""
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


def what_a_program_has_frozen_stays_so() -> None:
    gc.freeze()
    try:
        frozen = gc.get_freeze_count()
        with collector_paused():
            kept = [Ring() for _ in range(1000)]
        assert kept and 0 < gc.get_freeze_count() <= frozen  # some of it may have gone meanwhile
    finally:
        gc.unfreeze()


def none_holds() -> None:
    raise AssertionError("expected")


CHECKS = (nothing_is_searched_meanwhile, what_stays_is_not_looked_through_again, garbage_of_many_pauses_is_found,
          what_a_program_has_frozen_stays_so)


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_collector(check: Callable[[], None]) -> None:
    assert passes_apart(functools.partial(with_small_numbers, check))


def test_what_does_not_hold_is_found() -> None:
    assert not passes_apart(none_holds)
