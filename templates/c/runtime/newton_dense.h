// The matrices of Newton's iteration with all entries, stored by columns.
#pragma once

#include "complex_numbers.h"
#include "run.h"

// Factorize A + i B with exchanges among the rows of coordinates, then among the others: entries stay zero where q_dot = u, and
// units are not compared with each other. Inverses on the diagonal. Returns 1 if it is singular.
static int symdyn_newton_factorize(double *A, double *B, int *order) {
    for (int k = 0; k < SYMDYN_STATE; k++) {
        double *const a = A + k * SYMDYN_STATE, *const b = B + k * SYMDYN_STATE, most = 0.0;
        for (int i = k; i < (k < SYMDYN_NQ ? SYMDYN_NQ : SYMDYN_STATE); i++) {
            if (fabs(a[i]) + fabs(b[i]) > most) {
                most = fabs(a[i]) + fabs(b[i]);
                order[k] = i;
            }
        }
        if (!(most > 0.0)) return 1;
        for (int from = k, to = order[k]; from < SYMDYN_STATE * SYMDYN_STATE; from += SYMDYN_STATE, to += SYMDYN_STATE) {
            const double p = A[from], q = B[from];
            A[from] = A[to];
            B[from] = B[to];
            A[to] = p;
            B[to] = q;
        }
        symdyn_invert(a + k, b + k);
        for (int i = k + 1; i < SYMDYN_STATE; i++) {
            const double p = a[i];
            a[i] = p * a[k] - b[i] * b[k];
            b[i] = p * b[k] + b[i] * a[k];
        }
        for (int j = k + 1; j < SYMDYN_STATE; j++) {
            double *restrict const c = A + j * SYMDYN_STATE, *restrict const d = B + j * SYMDYN_STATE;
            const double p = c[k], q = d[k];
            if (p != 0.0 || q != 0.0) {
                for (int i = k + 1; i < SYMDYN_STATE; i++) {
                    c[i] -= p * a[i] - q * b[i];
                    d[i] -= p * b[i] + q * a[i];
                }
            }
        }
    }
    return 0;
}

// The matrix of a root for steps of length h, factorized. Returns 1 if it is singular.
static int symdyn_newton_matrix(symdyn_method *method, double h, int root) {
    double *const re = method->re[root], *const im = method->im[root];
    for (int i = 0; i < SYMDYN_STATE; i++)
        for (int j = 0; j < SYMDYN_STATE; j++) re[j * SYMDYN_STATE + i] = -method->jacobian[i * SYMDYN_STATE + j];
    for (int i = 0; i < SYMDYN_STATE * SYMDYN_STATE; i++) im[i] = 0.0;
    for (int i = 0; i < SYMDYN_STATE; i++) {
        re[i * (SYMDYN_STATE + 1)] += symdyn_roots[root][0] / h;
        im[i * (SYMDYN_STATE + 1)] = symdyn_roots[root][1] / h;
    }
    return symdyn_newton_factorize(re, im, method->order[root]);
}

// Solve (A + i B) w = x + i y, in place, by the factors of a root: for the state, and for every column of sensitivities.
static void symdyn_newton_solve(const symdyn_method *method, int root, double *restrict x, double *restrict y) {
    const double *const A = method->re[root], *const B = method->im[root];
    const int *const order = method->order[root];
    for (int first = 0; first < SYMDYN_NX; first += SYMDYN_STATE, x += SYMDYN_STATE, y += SYMDYN_STATE) {
        for (int k = 0; k < SYMDYN_STATE; k++) {
            const double p = x[order[k]], q = y[order[k]];
            x[order[k]] = x[k];
            y[order[k]] = y[k];
            x[k] = p;
            y[k] = q;
        }
        for (int step = 0; step < 2 * SYMDYN_STATE; step++) {  // forth by columns of L, back by those of U
            const int back = step >= SYMDYN_STATE, k = back ? (2 * SYMDYN_STATE - 1) - step : step;
            const double *const a = A + k * SYMDYN_STATE, *const b = B + k * SYMDYN_STATE;
            const double p = back ? x[k] * a[k] - y[k] * b[k] : x[k], q = back ? x[k] * b[k] + y[k] * a[k] : y[k];
            x[k] = p;
            y[k] = q;
            for (int i = back ? 0 : k + 1; i < (back ? k : SYMDYN_STATE); i++) {
                x[i] -= p * a[i] - q * b[i];
                y[i] -= p * b[i] + q * a[i];
            }
        }
    }
}
