// The problem of a run, and its inputs at a time.
#pragma once

#include "prelude.h"
#include "problem_type.h"

enum { SYMDYN_INPUT_STOPPED = 100000 };

#if SYMDYN_HAS_INPUTS
// Inputs at (t, x), out: SYMDYN_NIN. Returns 0 or INPUT_STOPPED.
static inline int symdyn_inputs_at(const symdyn_problem *problem, double t, const double *x, double *out) {
    const double *at = problem->breaks;
    long low = 0, high = problem->n_pieces;
#if !SYMDYN_THREADS
    if (problem->function) return problem->function(t, x, out) ? SYMDYN_INPUT_STOPPED : 0;
#endif
    if (high == 0) {
        for (int k = 0; k < SYMDYN_NIN; k++) out[k] = problem->inputs[k];
        return 0;
    }
    const double inside = t <= at[0] ? at[0] : t >= at[high] ? at[high] : t;
    while (high - low > 1) {
        const long middle = low + (high - low) / 2;
        if (at[middle] <= inside)
            low = middle;
        else
            high = middle;
    }
    const double d = inside - at[low], *c = problem->pieces + 4 * SYMDYN_NIN * low;
    for (int k = 0; k < SYMDYN_NIN; k++) out[k] = c[4 * k] + d * (c[4 * k + 1] + d * (c[4 * k + 2] + d * c[4 * k + 3]));
    return 0;
}
#endif
