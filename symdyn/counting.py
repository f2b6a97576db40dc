"""Numbers with their nouns, for what is printed."""

from __future__ import annotations


def counted(n: int, one: str, many: str = "") -> str:
    """A number with its noun; `many` where the plural is not `one` with an s."""
    return f"{n} {one if n == 1 else many or one + 's'}"
