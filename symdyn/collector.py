"""Python's garbage collector, out of the way of derivations."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

# From how many objects on a derivation is set aside, and how many may be until all are looked through, if it is not the first.
LEAST, MOST = 10_000, 1_000_000


@contextmanager
def collector_paused() -> Iterator[None]:
    """No search for garbage meanwhile: the nodes of a derivation all stay, and to look through them again and again takes as
    long as a long derivation itself."""
    running = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if running:
            _aside.put()
            gc.enable()


class _Aside:
    """Objects that count as old ones without having been looked through since the last search through all.

    Else the next search for young ones would look through all that was made in a pause, which stays.
    """

    def __init__(self) -> None:
        self.objects, self.searches = 0, 0

    def put(self) -> None:
        """Count what was made lately as old, unless too much that may be garbage is old already."""
        made, searches = gc.get_count()[0], gc.get_stats()[-1]["collections"]
        if searches != self.searches:
            self.objects, self.searches = 0, searches
        if made < LEAST or (self.objects and self.objects + made > MOST) or gc.get_freeze_count():
            return
        gc.freeze()
        gc.unfreeze()
        self.objects += made


_aside = _Aside()
