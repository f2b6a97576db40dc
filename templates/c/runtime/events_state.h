// Memory of the search for events in a run.
#pragma once

#include "noted_type.h"

#if SYMDYN_NOTES < SYMDYN_WAITING + 3 * SYMDYN_N_EVENTS
#error "noted has no room for the events of a step that begins with SYMDYN_WAITING - 1 of them"
#endif

typedef struct {
    int looking, look[SYMDYN_N_EVENTS];                   // whether for any, for which
    double side[SYMDYN_N_EVENTS], left[SYMDYN_N_EVENTS];  // sign of each quantity; what is left of those that vanished last
    double now[SYMDYN_N_EVENTS];                          // values at the start of what is searched next
    int leaving[SYMDYN_N_EVENTS];             // of what is zero: the side that counts as an event where it goes there; or 0
    int fired[SYMDYN_N_EVENTS], at_once;      // at the latest time; resets with hardly any time between
    int kept;                                 // the sides are those at the end of another run, whose state this one begins with
    int begun, pending, resetting;            // the sides are known; a state waits to be gone on from, with a reset
    int divisions, proofs;                    // of the latest step: for samples, for proofs
    int unresolved[SYMDYN_N_EVENTS], coarse;  // quantities that vary too quickly, whether there are any
    int unproved[SYMDYN_N_EVENTS];            // of which it is not proved that the samples show all zeros
#if SYMDYN_HAS_BOUNDS
    double safe[2 * SYMDYN_LEAVES];  // ranges of what the quantities depend on, in which none that is looked for vanishes
    int widened, stale;              // by powers of two; values at the start of what is searched next are of an earlier time
    int ranged, n_limited, limited[SYMDYN_LEAVES];  // whether these ranges are known; leaves whose ranges have ends
    long n_widened;                                 // how often they were found to be wide
    int waits, wait;                                // steps in which none are looked for, since there were none
#endif
    double spacing;              // of samples at the most, s; 0: any
    double t, after[SYMDYN_NX];  // of the latest reset; the state after it
    double reset_gap;            // by how much a reset that was rejected is off
#if SYMDYN_SENSITIVE
    int entangled;  // columns depended on the order of events at one time
#endif
#if SYMDYN_SENSITIVE && SYMDYN_KEEPS_RESETS
    // Result of the latest reset under the constraints: jumps of the speeds, impulses along entries that are held; whether the
    // coordinates that were wanted were off the constraints; the requested entries.
    double made[SYMDYN_NU + SYMDYN_HELD];
    int off_constraints, asked[SYMDYN_HELD];
#endif
    int n_noted;
    symdyn_noted noted[SYMDYN_NOTES];                   // until they are taken
    double noted_states[SYMDYN_NOTES * 2 * SYMDYN_NX];  // before and after each of these
} symdyn_events;
