// Systems of linear equations whose matrix has a band, real or complex, by elimination with exchanges of rows.
// Source: Golub, Van Loan, Matrix Computations, 4th ed., section 4.3.5; LAPACK, dgbtf2: where exchanges put further diagonals.
#pragma once

#include "complex_numbers.h"
#include "prelude.h"

// Numbers of a band of n rows, with `lower` and `upper` diagonals below and above the main one: column by column, each from row
// j - upper - lower, where exchanges may reach, to row j + lower.
#define SYMDYN_BAND_HEIGHT(lower, upper) (2 * (lower) + (upper) + 1)
// The entry of row i and column j, where columns begin at a.
#define SYMDYN_BAND_AT(lower, upper, i, j) ((j) * SYMDYN_BAND_HEIGHT(lower, upper) + (lower) + (upper) + (i) - (j))

// Factorize A + i B, or A where B is 0. The next row is the one whose entry is the largest part of the row's scale, one over its
// largest entry: units are not compared with each other; n + lower numbers, which are used up, zeros at the end. Inverses on the
// diagonal. Returns 1 if the matrix is singular.
static inline __attribute__((always_inline)) int symdyn_band_eliminate(
    int n, int lower, int upper, double *restrict A, double *restrict B, double *restrict scale, int *restrict order) {
    const int row = SYMDYN_BAND_HEIGHT(lower, upper) - 1;  // from an entry to the next one in its row
    for (int k = 0, reach = 0; k < n; k++) {
        double *const a = A + SYMDYN_BAND_AT(lower, upper, k, k), *const b = B ? B + SYMDYN_BAND_AT(lower, upper, k, k) : 0;
        double most = 0.0;
        order[k] = k;
        for (int i = 0; i <= lower; i++) {
            const double size = (fabs(a[i]) + (B ? fabs(b[i]) : 0.0)) * scale[k + i];
            if (size > most) {
                most = size;
                order[k] = k + i;
            }
        }
        if (!(most > 0.0)) return 1;
        const int down = order[k] - k, end = order[k] + upper < n ? order[k] + upper : n - 1;
        reach = end > reach ? end : reach;
        if (down > 0) {
            scale[order[k]] = scale[k];
            for (int j = 0; j <= (reach - k) * row; j += row) {
                const double p = a[j], q = B ? b[j] : 0.0;
                a[j] = a[j + down];
                a[j + down] = p;
                if (B) {
                    b[j] = b[j + down];
                    b[j + down] = q;
                }
            }
        }
        if (B) {
            symdyn_invert(a, b);
        } else {
            a[0] = 1.0 / a[0];
        }
        for (int i = 1; i <= lower; i++) {
            const double p = a[i];
            a[i] = B ? p * a[0] - b[i] * b[0] : p * a[0];
            if (B) b[i] = p * b[0] + b[i] * a[0];
        }
        for (int j = 1; j <= reach - k; j++) {
            double *restrict const c = a + j * row, *restrict const d = B ? b + j * row : 0;
            const double p = c[0], q = B ? d[0] : 0.0;
            if (p == 0.0 && q == 0.0) continue;
            for (int i = 1; i <= lower; i++) {
                c[i] -= B ? p * a[i] - q * b[i] : p * a[i];
                if (B) d[i] -= p * b[i] + q * a[i];
            }
        }
    }
    return 0;
}

// Solve (A + i B) w = x + i y, or A w = x where B is 0, in place, by these factors. Loops are of one length: lower + upper
// numbers before x and y, and lower ones behind them, are met by zeros of the band and keep their values, which must be finite.
static inline __attribute__((always_inline)) void symdyn_band_substitute(int n, int lower, int upper, const double *restrict A,
    const double *restrict B, const int *restrict order, double *restrict x, double *restrict y) {
    for (int k = 0; k < n; k++) {
        const double *const a = A + SYMDYN_BAND_AT(lower, upper, k, k), *const b = B ? B + SYMDYN_BAND_AT(lower, upper, k, k) : 0;
        const double p = x[order[k]], q = B ? y[order[k]] : 0.0;
        x[order[k]] = x[k];
        x[k] = p;
        if (B) {
            y[order[k]] = y[k];
            y[k] = q;
        }
        for (int i = 1; i <= lower; i++) {
            x[k + i] -= B ? p * a[i] - q * b[i] : p * a[i];
            if (B) y[k + i] -= p * b[i] + q * a[i];
        }
    }
    for (int k = n - 1; k >= 0; k--) {
        const double *const a = A + SYMDYN_BAND_AT(lower, upper, k, k), *const b = B ? B + SYMDYN_BAND_AT(lower, upper, k, k) : 0;
        const double p = B ? x[k] * a[0] - y[k] * b[0] : x[k] * a[0], q = B ? x[k] * b[0] + y[k] * a[0] : 0.0;
        x[k] = p;
        if (B) y[k] = q;
        for (int i = 1; i <= lower + upper; i++) {
            x[k - i] -= B ? p * a[-i] - q * b[-i] : p * a[-i];
            if (B) y[k - i] -= p * b[-i] + q * a[-i];
        }
    }
}
