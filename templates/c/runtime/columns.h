// Jacobians by derivatives along directions, a direction in each lane.
#pragma once

#include "each.h"

// Directions along the entries first, first + 1, ... of n, one in each lane; those past the end are zero. Whole vectors are
// stored: a load of a vector would wait for lanes that are stored one by one.
static inline void symdyn_directions(int first, int n, symdyn_vector *change) {
    static const double window[2 * SYMDYN_WIDTH - 1] = {[SYMDYN_WIDTH - 1] = 1.0};
    for (int k = 0; k < n; k++)
        if (k >= first && k < first + SYMDYN_WIDTH)
            change[k] = *(const symdyn_anywhere *)(window + SYMDYN_WIDTH - 1 - (k - first));
        else
            change[k] = VECTOR(0.0);
}

// Puts the derivatives of n_rows entries into the columns first, first + 1, ... of a matrix with `columns` columns, as many as
// there are lanes, at most n > 0.
static inline void symdyn_put_columns(const symdyn_vector *derivatives, int n_rows, int columns, int first, int n, double *out) {
    (void)n;
    for (int i = 0; i < n_rows; i++) {
        double *row = out + i * columns + first;
#if SYMDYN_WIDTH > 1
        if (n < SYMDYN_WIDTH) {
            __builtin_memcpy(row, derivatives + i, (unsigned long)n * sizeof(double));
            continue;
        }
#endif
        *(symdyn_anywhere *)row = derivatives[i];
    }
}
