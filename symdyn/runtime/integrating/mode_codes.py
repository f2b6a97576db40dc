"""Modes of contacts, and events that end them, in the order of their numbers in C, which count from 0."""

from __future__ import annotations

from symdyn.backend.c_records import codes_of
from symdyn.runtime.contact_laws import SLIDING, STICKING


def _in_order(file: str) -> tuple[str, ...]:
    codes = codes_of(file)
    return tuple(name.lower() for name in sorted(codes, key=codes.__getitem__))


MODES, KINDS = _in_order("runtime/modes.h"), _in_order("runtime/mode_events.h")
STICKING_CODE, SLIDING_CODE = MODES.index(STICKING), MODES.index(SLIDING)
