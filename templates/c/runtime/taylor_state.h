// Memory of Taylor series in a run.
#pragma once

typedef struct {
    int order, ready, skipped;  // skipped: places of the rows before a cache line begins
    double constants[SYMDYN_SERIES_NC];
    // If ready: derivative and what the orders need, and where.
    double start[SYMDYN_NX + SYMDYN_SERIES_START], t_start, x_start[SYMDYN_NX];
    double unit;  // of time, a power of two near the length of the step
    // Coefficients of the latest step in this unit; order 0: what rounding has cut off the state; the same at the step's end.
    double series[SYMDYN_ORDERS + 1][SYMDYN_NX], low_new[SYMDYN_NX];
    double h_before;                              // length of the latest step, at first 0
    double rows[SYMDYN_ORDERS * SYMDYN_ROW + 8];  // by orders: left factors of the sums, right ones, derivative
} symdyn_method;
