// Columns of sensitivities behind the state: several at once, a column in each lane.
#pragma once

#include "each.h"

// Columns first, first + 1, ... of n, of n_x numbers each, one after the other: entry by entry, a column in each lane; lanes past
// the end are zero.
static inline void symdyn_take_columns(const double *from, int n_x, int first, int n, symdyn_vector *to) {
    for (int i = 0; i < n_x; i++) {
        double lanes[SYMDYN_WIDTH];
        for (int l = 0; l < SYMDYN_WIDTH; l++) lanes[l] = first + l < n ? from[(first + l) * n_x + i] : 0.0;
        to[i] = *(const symdyn_anywhere *)lanes;
    }
}

// Entries begin, begin + 1, ... of n_to: 1 in the lanes of the columns that are by them, see `by`, and 0 in all others.
static inline void symdyn_take_units(const int *by, int begin, int n_to, int first, int n, symdyn_vector *to) {
    for (int k = begin; k < n_to; k++) to[k] = VECTOR(0.0);
    for (int l = 0; l < SYMDYN_WIDTH && first + l < n; l++)
        if (by[first + l] >= 0) LANE(to[by[first + l]], l) = 1.0;
}

// Puts a column in each lane back where symdyn_take_columns takes them from.
static inline void symdyn_give_columns(const symdyn_vector *from, int n_x, int first, int n, double *to) {
    for (int l = 0; l < SYMDYN_WIDTH && first + l < n; l++)
        for (int i = 0; i < n_x; i++) to[(first + l) * n_x + i] = LANE(from[i], l);
}
