// Arguments of batches.
#pragma once

// Numbers of several trajectories: entry k of trajectory i is at[i*row + k*entry].
typedef struct {
    const double *at;
    long row, entry;
} symdyn_table;
