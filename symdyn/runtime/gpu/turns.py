"""Work on a device in parts: while one is computed, the one before is copied back and the next one is brought."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Protocol, TypeVar


class Slot(Protocol):
    """Memory of the device for one part; rows: of the part that is there, None: none is."""

    rows: range | None


S = TypeVar("S", bound=Slot)


def in_turns(parts: Iterable[range], slots: Sequence[S], begin: Callable[[S, range], None], collect: Callable[[S], None]) -> None:
    """One part after the other; what has been begun is collected, whatever is raised meanwhile."""
    try:
        for k, rows in enumerate(parts):
            slot = slots[k % len(slots)]
            collect(slot)
            begin(slot, rows)
    finally:
        for slot in sorted(slots, key=lambda s: s.rows.start if s.rows else 0):
            collect(slot)


def parts_of(n: int, size: int) -> Iterable[range]:
    """The numbers 0 to n in parts of a size, the last one shorter."""
    return (range(first, min(first + size, n)) for first in range(0, n, size))
