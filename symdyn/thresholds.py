"""Numbers that states, events and contacts are decided by, the same in Python and in generated C."""

from __future__ import annotations

# Singular values of what forces along rows make along them, D = J M^-1 J^T, below this part of the largest, and pivots below this
# part of the entries of the diagonal: rows that depend on each other. RANK in
# symdyn/tape/intrinsics.py is for J itself.
DEPENDENT = 1e-10

# Events closer than this part of the span of the run happen at one time.
AT_ONCE = 1e-14
# So many resets, each within this part of the span after the one before: the motion comes to rest there, or chatters.
CHATTER, MOST_RESETS = 1e-10, 5
