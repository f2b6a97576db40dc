// Events of many trajectories: what they do to the state counts, their times are not kept.
#pragma once

#include "events.h"

// Drop the events so far; doubts: a sum of their kinds, to which others are added.
static void symdyn_drop_events(symdyn_run *run, int *doubts) {
    for (int k = 0; k < run->events.n_noted; k++) *doubts |= run->events.noted[k].kind;
    run->events.n_noted = 0;
    if (run->status == SYMDYN_STORE_FULL) run->status = SYMDYN_STEP_LIMIT;
}
