// The iterated augmented Lagrangian. The largest sizes of all calls are SYMDYN_SADDLE_N and SYMDYN_SADDLE_M, with
// SYMDYN_SADDLE_ONE_SIZE those of each.
#pragma once

#include "symdyn_factors.h"

// Whether a pivot of the symmetric A, which is used up, is next to nothing of its entry: nothing holds some direction then.
// The pivot that is the largest part of its entry goes first, so that rounding stays small.
static int symdyn_loose(int n, double A[SYMDYN_SADDLE_N][SYMDYN_SADDLE_N]) {
    double parts[SYMDYN_SADDLE_N];
    int gone[SYMDYN_SADDLE_N] = {0};
    for (int i = 0; i < n; i++) {
        if (A[i][i] <= 0.0) return 1;
        parts[i] = 1.0 / A[i][i];
    }
    for (int step = 0; step < n; step++) {
        int p = -1, near[SYMDYN_SADDLE_N], count = 0;
        for (int i = 0; i < n; i++)
            if (!gone[i] && (p < 0 || A[i][i] * parts[i] > A[p][p] * parts[p])) p = i;
        if (A[p][p] * parts[p] <= SYMDYN_LOOSE) return 1;
        gone[p] = 1;
        for (int i = 0; i < n; i++)
            if (!gone[i] && A[p][i] != 0.0) near[count++] = i;
        for (int i = 0; i < count; i++) {
            double *const row = A[near[i]];
            for (int j = 0; j < count; j++) row[near[j]] -= row[p] * A[p][near[j]] / A[p][p];
        }
    }
    return 0;
}

// x (n) of M x + C^T lam = f, C x = d; M (n x n) symmetric, perhaps singular; the m rows of C perhaps dependent.
// in: e, M lower triangle, C, scales of the rows (m) and columns (n) of C, f, d. Returns 1 if nothing holds some direction.
// (M + a C^T C) x = f - C^T lam + a C^T d, lam += a (C x - d), scaled, with a = M_kk/e^2; each round takes the
// residual again. Bayo, Garcia de Jalon and Serna, Comput. Methods Appl. Mech. Eng. 71 (1988).
SYMDYN_LINKED int symdyn_saddle(int n, int m, const double *in, double *x) {
#if SYMDYN_SADDLE_ONE_SIZE
    n = SYMDYN_SADDLE_N;
    m = SYMDYN_SADDLE_M;
#endif
    const double *const m_in = in + 1, *const c_in = m_in + n * (n + 1) / 2, *const s = c_in + m * n, *const w = s + m;
    const double *const f = w + n, *const d = f + n;
    double M[SYMDYN_SADDLE_N][SYMDYN_SADDLE_N], A[SYMDYN_SADDLE_N][SYMDYN_SADDLE_N], B[SYMDYN_SADDLE_N][SYMDYN_SADDLE_N],
        C[SYMDYN_SADDLE_M][SYMDYN_SADDLE_N], rows[SYMDYN_SADDLE_M] = {0.0}, columns[SYMDYN_SADDLE_N], lighter[SYMDYN_SADDLE_N];
    double r[SYMDYN_SADDLE_N], lam[SYMDYN_SADDLE_M] = {0.0}, largest = 0.0;
    symdyn_span of_M[SYMDYN_SADDLE_N], of_C[SYMDYN_SADDLE_M], envelope[SYMDYN_SADDLE_N];
    int first[SYMDYN_SADDLE_N];
    // Columns are scaled until all masses are equal, rows back by the largest of their columns' factors.
    for (int i = 0; i < n; i++) {
        columns[i] = w[i] * w[i] * m_in[i * (i + 1) / 2 + i];
        largest = columns[i] > largest ? columns[i] : largest;
    }
    largest = largest > 0.0 ? largest : 1.0;
    for (int i = 0; i < n; i++) {
        lighter[i] = columns[i] > SYMDYN_MASSLESS * largest ? sqrt(largest / columns[i]) : 1.0;
        columns[i] = w[i] * lighter[i];
        x[i] = 0.0;
    }
    const double a = largest / (in[0] * in[0]);
    for (int k = 0; k < m; k++) {
        double most = 1.0;
        for (int j = 0; j < n; j++) most = c_in[k * n + j] != 0.0 && lighter[j] > most ? lighter[j] : most;
        rows[k] = s[k] / most;
        for (int j = 0; j < n; j++) C[k][j] = rows[k] * columns[j] * c_in[k * n + j];
        of_C[k] = symdyn_span_of(n, C[k]);
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) {
            M[i][j] = M[j][i] = columns[i] * columns[j] * m_in[i * (i + 1) / 2 + j];
            A[i][j] = 0.0;
        }
    for (int i = 0; i < n; i++) {
        of_M[i] = symdyn_span_of(n, M[i]);
        first[i] = of_M[i].first;
    }
    for (int k = 0; k < m; k++)
        for (int i = of_C[k].first; i < of_C[k].end; i++) {
            first[i] = of_C[k].first < first[i] ? of_C[k].first : first[i];
            for (int j = of_C[k].first; j <= i; j++) A[i][j] += C[k][i] * C[k][j];
        }
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) A[i][j] = B[i][j] = B[j][i] = M[i][j] + a * A[i][j];
    symdyn_envelope(n, first, envelope);
    if (symdyn_loose(n, B) || symdyn_factorize(n, SYMDYN_SADDLE_N, envelope, A[0], 0.0)) return 1;
    for (int round = 0; round < SYMDYN_ROUNDS; round++) {
        for (int i = 0; i < n; i++) {
            const int at = of_M[i].first;
            r[i] = symdyn_less(columns[i] * f[i], of_M[i].end - at, M[i] + at, 1, x + at);
        }
        for (int k = 0; k < m; k++) {
            const int at = of_C[k].first, count = of_C[k].end - at;
            const double gap = a * symdyn_less(rows[k] * d[k], count, C[k] + at, 1, x + at) - lam[k];
            for (int j = at; j < of_C[k].end; j++) r[j] += C[k][j] * gap;
        }
        symdyn_substitute(n, SYMDYN_SADDLE_N, envelope, A[0], r);
        for (int i = 0; i < n; i++) x[i] += r[i];
        for (int k = 0; k < m; k++) {
            const int at = of_C[k].first;
            lam[k] -= a * symdyn_less(rows[k] * d[k], of_C[k].end - at, C[k] + at, 1, x + at);
        }
    }
    const double spoiled = symdyn_spoiled(n, x) + symdyn_spoiled(m, lam);
    for (int i = 0; i < n; i++) x[i] = spoiled == 0.0 ? x[i] * columns[i] : spoiled;
    return 0;
}
