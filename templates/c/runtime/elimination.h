// Dense systems of a few to some hundred rows.
#pragma once

#include "prelude.h"

static double symdyn_most(const double *v, int n) {
    double most = 0.0;
    for (int i = 0; i < n; i++) most = fmax(most, fabs(v[i]));
    return most;
}

// x of A x = y, (n, n) in rows of `width`, by elimination with the largest pivots; both are overwritten, y by x. Returns 1 where
// rows depend on each other: a pivot is no more than this part of the largest entry.
static int symdyn_solve_rows(long n, long width, double *A, double *y, double dependent) {
    double most = 0.0;
    for (long i = 0; i < n; i++) most = fmax(most, symdyn_most(A + i * width, (int)n));
    for (long k = 0; k < n; k++) {
        long best = k;
        for (long i = k + 1; i < n; i++)
            if (fabs(A[i * width + k]) > fabs(A[best * width + k])) best = i;
        if (!(fabs(A[best * width + k]) > dependent * most)) return 1;
        if (best != k) {
            for (long j = k; j < n; j++) {
                const double kept = A[k * width + j];
                A[k * width + j] = A[best * width + j];
                A[best * width + j] = kept;
            }
            const double kept = y[k];
            y[k] = y[best];
            y[best] = kept;
        }
        for (long i = k + 1; i < n; i++) {
            const double factor = A[i * width + k] / A[k * width + k];
            if (factor == 0.0) continue;
            for (long j = k + 1; j < n; j++) A[i * width + j] -= factor * A[k * width + j];
            y[i] -= factor * y[k];
        }
    }
    for (long i = n - 1; i >= 0; i--) {
        for (long j = i + 1; j < n; j++) y[i] -= A[i * width + j] * y[j];
        y[i] /= A[i * width + i];
    }
    return 0;
}
