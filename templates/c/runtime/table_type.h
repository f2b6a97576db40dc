// Arguments of batches.
#ifndef SYMDYN_TABLE_TYPE
#define SYMDYN_TABLE_TYPE

// Numbers of several trajectories: entry k of trajectory i is at[i*row + k*entry].
typedef struct {
    const double *at;
    long row, entry;
} symdyn_table;

#endif
