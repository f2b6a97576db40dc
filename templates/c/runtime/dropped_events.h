// Events of many trajectories: what they do to the state counts, their times are not kept.
#pragma once

#include "events.h"

// Doubts of a trajectory: zeros of a quantity are not resolved; it is not proved that they all are.
enum { SYMDYN_UNRESOLVED = 1, SYMDYN_UNPROVED = 2 };

// Drop the events so far; doubts: what is added to it.
static void symdyn_drop_events(symdyn_run *run, int *doubts) {
    for (int k = 0; k < run->events.n_noted; k++) {
        const int which = (int)run->events.noted[SYMDYN_NOTE * k];
        if (which < 0) *doubts |= which >= -SYMDYN_N_EVENTS ? SYMDYN_UNRESOLVED : SYMDYN_UNPROVED;
    }
    run->events.n_noted = 0;
    if (run->status == SYMDYN_STORE_FULL) run->status = SYMDYN_STEP_LIMIT;
}
