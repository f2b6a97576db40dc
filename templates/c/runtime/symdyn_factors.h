// Factors of symmetric matrices: shared by symdyn_saddle.h and symdyn_multipliers.h.
#pragma once

#include "prelude.h"

// start - a_0 x_0 - ... - a_(n - 1) x_(n - 1), where the a are `step` numbers apart.
static inline double symdyn_less(double start, int n, const double *a, int step, const double *x) {
    for (int i = 0; i < n; i++) start -= a[i * step] * x[i];
    return start;
}

// A = L D L^T in place, by lower triangles (n x n, rows `row` apart). Returns 1 if a pivot is no more than `least` of its entry.
static int symdyn_factorize(int n, int row, double *A, double least) {
    for (int j = 0; j < n; j++) {
        const double entry = A[j * row + j];
        for (int k = 0; k < j; k++) {
            const double v = A[j * row + k] * A[k * row + k];
            for (int i = j; i < n; i++) A[i * row + j] -= A[i * row + k] * v;
        }
        if (!(A[j * row + j] > least * entry && A[j * row + j] > 0.0)) return 1;
        for (int i = j + 1; i < n; i++) A[i * row + j] /= A[j * row + j];
    }
    return 0;
}

// r becomes A^-1 r by these factors.
static void symdyn_substitute(int n, int row, const double *A, double *r) {
    for (int i = 0; i < n; i++) r[i] = symdyn_less(r[i], i, A + i * row, 1, r);
    for (int i = n - 1; i >= 0; i--) r[i] = symdyn_less(r[i] / A[i * row + i], n - 1 - i, A + (i + 1) * row + i, row, r + i + 1);
}
