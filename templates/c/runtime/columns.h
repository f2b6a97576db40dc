// Jacobians by derivatives along directions, a direction in each lane.
#pragma once

#include "vector_type.h"

// a*b + c of numbers and vectors.
#define MADD_EACH(a, b, c) symdyn_each_madd(VECTOR(a), VECTOR(b), VECTOR(c))

// Directions along the entries first, first + 1, ... of n, one in each lane; those past the end are zero.
static inline void symdyn_directions(int first, int n, symdyn_vector *change) {
    for (int k = 0; k < n; k++) change[k] = VECTOR(0.0);
    for (int l = 0; l < SYMDYN_WIDTH && first + l < n; l++) LANE(change[first + l], l) = 1.0;
}

// Puts the derivatives of n_rows entries into the columns first, first + 1, ... of a matrix with `columns` columns, as many as
// there are lanes, at most n.
static inline void symdyn_put_columns(const symdyn_vector *derivatives, int n_rows, int columns, int first, int n, double *out) {
    for (int i = 0; i < n_rows; i++) {
        double *row = out + i * columns + first;
        if (n >= SYMDYN_WIDTH)
            *(symdyn_anywhere *)row = derivatives[i];
        else
            for (int l = 0; l < n; l++) row[l] = LANE(derivatives[i], l);
    }
}
