"""Numbers that states, events and contacts are decided by, the same in Python and in generated C.

Residuals of positions count by the mechanism's length, of speeds by the largest speed as a velocity.
"""

from __future__ import annotations

# Singular values of what forces along rows make along them, D = J M^-1 J^T, below this part of the largest, and pivots below this
# part of the entries of the diagonal: rows that depend on each other. RANK in symdyn/tape/intrinsics.py is for J itself.
DEPENDENT = 1e-10

# Projections. Residuals that rounding leaves of positions and speeds, and from which on a projection has failed.
LEFT, TOO_MUCH_POSITION, TOO_MUCH_SPEED = 1e-13, 1e-9, 1e-8
# Coordinates are known to eps |q| only, |q| the largest of them in m (angles times the length): of positions rounding leaves this
# part of |q| by the length where that is more, and a failure is more than so many times that. Within 100 lengths it is not felt.
RESOLVED, FAILED = 9e-16, 4.0
# Residuals of positions that are not corrected, and speeds that residuals are measured by at the least, 1/s, by the length.
EXACT, SLOWEST = 4e-16, 1e-5
# Corrections are repeated so often at the most, as long as each leaves less than this part of what was left.
ROUNDS, SHRINKS = 12, 0.7
# A step whose end is projected: what it may change, as a part of the way of the step, and of the coordinates and the length. More
# is no correction but a jump, to another branch maybe.
PART_OF_WAY, PART_OF_SIZE = 0.5, 1e-6
# Changes that count, as a part of the tolerance, and in roundings of the largest entry.
NOTICED, ROUNDINGS = 1e-3, 16.0

# Resets on constraints. Entries that would take others so many times as far are held by the constraints; gaps that are closed.
HOLDS, CLOSED = 1e6, 1e-15
# Coordinates that a reset moves by more than this part of their size come onto the constraints on a way of their own. Parts of a
# derivative that count as none: of coordinates that may be free; of what is held, by that of all coordinates or speeds, and by
# all that changes anywhere.
OFF, FREE, GAP, GAP_OF_ALL = 1e-9, 1e-8, 1e-6, 1e-10

# Events closer than this part of the span of the run happen at one time.
AT_ONCE = 1e-14
# So many resets, each within so many of these times after the one before: the motion comes to rest there, or chatters.
NEAR, MOST_RESETS = 1e4, 5
# Zeros of events: two ends as close as so many roundings of the time are one; secants, after which ends are halved.
CLOSE, MOST_SECANTS, MOST_HALVINGS = 4.0, 100, 100

# Flights of rigid contacts shorter than so many roundings of the time are not followed.
FLIGHT = 1e4
# Contacts that close are hit only where their approach is faster than so many roundings of the speed that accelerations make in
# the run.
APPROACH = 1.0

# No step begins while so many events wait; each step may add some, see `most_events`.
WAITING = 64


def most_events(n: int) -> int:
    """Number of events of n kinds that may wait: at the next time after WAITING - 1 all kinds may happen, and once in a run
    each kind is noted as not resolved and as not proved, and one as depending on the order."""
    return WAITING + 3 * n
