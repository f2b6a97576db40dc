// Rows of states with a state in each lane.
#pragma once

#include "vectors.h"

// n numbers of as many rows as there are lanes, a row in each lane; stride: from row to row, 0: one row for all.
static inline void symdyn_take_rows(const double *from, long stride, int n, symdyn_vector *to) {
    for (int k = 0; k < n; k++)
        for (int l = 0; l < SYMDYN_WIDTH; l++) LANE(to[k], l) = from[l * stride + k];
}

// Puts n numbers of every lane into rows, one after the other, unless a lane has a fault or a result is not finite. Returns 0
// then.
static inline int symdyn_give_rows(const symdyn_vector *from, symdyn_lanes fault, int n, double *to) {
    symdyn_vector rest = VECTOR(0.0);  // not a number where a result is not finite
    long long any = 0;
    for (int k = 0; k < n; k++) rest += from[k] * 0.0;
    fault |= NOT_ZERO(rest);
    for (int l = 0; l < SYMDYN_WIDTH; l++) any |= LANE(fault, l);
    if (any) return 0;
    for (int l = 0; l < SYMDYN_WIDTH; l++)
        for (int k = 0; k < n; k++) to[l * n + k] = LANE(from[k], l);
    return 1;
}
