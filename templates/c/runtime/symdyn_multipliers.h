// Multipliers of least norm. The largest sizes of all calls are SYMDYN_MULTIPLIERS_N and SYMDYN_MULTIPLIERS_M, with
// SYMDYN_MULTIPLIERS_ONE_SIZE those of each.
#pragma once

#include "symdyn_factors.h"

// lam (m) of C^T lam = g of least norm after scaling; the rows of C (m x n) perhaps dependent.
// in: C, scales of its rows (m) and columns (n), g. Iterated: lam += (C C^T + e^2)^-1 C (g - C^T lam), e = SYMDYN_SMOOTHED.
SYMDYN_LINKED int symdyn_multipliers(int n, int m, const double *in, double *lam) {
#if SYMDYN_MULTIPLIERS_ONE_SIZE
    n = SYMDYN_MULTIPLIERS_N;
    m = SYMDYN_MULTIPLIERS_M;
#endif
    const double *const rows = in + m * n, *const columns = rows + m, *const g = columns + n;
    const double smoothed = SYMDYN_SMOOTHED * SYMDYN_SMOOTHED;
    double A[SYMDYN_MULTIPLIERS_M][SYMDYN_MULTIPLIERS_M], C[SYMDYN_MULTIPLIERS_M][SYMDYN_MULTIPLIERS_N],
        r[SYMDYN_MULTIPLIERS_M] = {0.0};
    symdyn_span span[SYMDYN_MULTIPLIERS_M], envelope[SYMDYN_MULTIPLIERS_M];
    int nearest[SYMDYN_MULTIPLIERS_M];
    for (int k = 0; k < m; k++) {
        lam[k] = 0.0;
        for (int j = 0; j < n; j++) C[k][j] = rows[k] * columns[j] * in[k * n + j];
        span[k] = symdyn_span_of(n, C[k]);
    }
    for (int i = 0; i < m; i++) {
        nearest[i] = i;
        for (int j = 0; j <= i; j++) {
            const int begin = span[i].first > span[j].first ? span[i].first : span[j].first;
            const int end = span[i].end < span[j].end ? span[i].end : span[j].end;
            A[i][j] = i == j ? smoothed : 0.0;
            for (int k = begin; k < end; k++) A[i][j] += C[i][k] * C[j][k];
            if (begin < end && j < nearest[i]) nearest[i] = j;
        }
    }
    symdyn_envelope(m, nearest, envelope);
    if (symdyn_factorize(m, SYMDYN_MULTIPLIERS_M, envelope, A[0], 0.0)) return 1;
    // Later rounds leave in r what rounding has made of lam outside the range of C; it is taken off.
    for (int round = 0; round < (1 + SYMDYN_CLEANINGS) * SYMDYN_ROUNDS; round++) {
        const int cleans = round >= SYMDYN_ROUNDS, first = round % SYMDYN_ROUNDS == 0,
                  last = round % SYMDYN_ROUNDS == SYMDYN_ROUNDS - 1;
        for (int k = 0; k < m; k++) r[k] = cleans ? smoothed * (first ? lam[k] : r[k]) : 0.0;
        for (int j = 0; j < n && !cleans; j++) {
            const double rest = symdyn_less(columns[j] * g[j], m, &C[0][j], SYMDYN_MULTIPLIERS_N, lam);
            for (int k = 0; k < m; k++) r[k] += C[k][j] * rest;
        }
        symdyn_substitute(m, SYMDYN_MULTIPLIERS_M, envelope, A[0], r);
        for (int k = 0; k < m; k++) lam[k] += !cleans ? r[k] : last ? -r[k] : 0.0;
    }
    const double spoiled = symdyn_spoiled(m, lam);
    for (int k = 0; k < m; k++) lam[k] = spoiled == 0.0 ? lam[k] * rows[k] : spoiled;
    return 0;
}
