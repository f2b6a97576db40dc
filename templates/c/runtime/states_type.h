// States whose right-hand sides are computed, and where these go.
#pragma once

#include "table_type.h"

typedef struct {
    long n;
    const symdyn_table *given;  // times, states, inputs, parameters
    const double *constants;    // that follow from parameters which are the same for all; 0: each state has its own
    int failed;                 // what the prologue returned for these
    double *out;
    long out_row, out_entry;  // from state to state, from entry to entry
    int *codes;               // of each state what the function `reason` explains
} symdyn_state_rows;
