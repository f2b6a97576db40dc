"""Thresholds that generated C shares with Python, as pairs of a macro and its value; symdyn/thresholds.py explains them."""

from __future__ import annotations

from symdyn import thresholds as limits

Macros = tuple[tuple[str, float], ...]
EVENTS: Macros = (
    ("SYMDYN_AT_ONCE", limits.AT_ONCE), ("SYMDYN_NEAR", limits.NEAR), ("SYMDYN_MOST_RESETS", limits.MOST_RESETS),
    ("SYMDYN_CLOSE", limits.CLOSE), ("SYMDYN_MOST_SECANTS", limits.MOST_SECANTS), ("SYMDYN_MOST_HALVINGS", limits.MOST_HALVINGS))
MOVES: Macros = (
    ("SYMDYN_NOTICED", limits.NOTICED), ("SYMDYN_NOTICED_ROUNDINGS", limits.ROUNDINGS),
    ("SYMDYN_PART_OF_WAY", limits.PART_OF_WAY), ("SYMDYN_PART_OF_SIZE", limits.PART_OF_SIZE))
PROJECTIONS: Macros = (
    ("SYMDYN_PROJECTION_ROUNDS", limits.ROUNDS), ("SYMDYN_SHRINKS", limits.SHRINKS), ("SYMDYN_ROUNDING", limits.LEFT),
    ("SYMDYN_TOO_MUCH", limits.TOO_MUCH_POSITION), ("SYMDYN_TOO_MUCH_OF_SPEEDS", limits.TOO_MUCH_SPEED),
    ("SYMDYN_FAILED_TIMES", limits.FAILED), ("SYMDYN_SLOWEST", limits.SLOWEST), ("SYMDYN_RESOLVED", limits.RESOLVED),
    ("SYMDYN_SOLVED", limits.EXACT))
RESETS: Macros = (("SYMDYN_RESET_KEPT", limits.CLOSED), ("SYMDYN_RESET_HELD", limits.HOLDS))
PIVOTS: Macros = (("SYMDYN_DEPENDENT", limits.DEPENDENT),)
