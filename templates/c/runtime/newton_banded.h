// The matrices of Newton's iteration in an order in which they have a narrow band. The first states of
// symdyn_sequence are coordinates whose rate is a multiple of one other state, which their rows eliminate; states of the band
// come next, then those that nothing depends on. The derivative of state i has its entries from symdyn_first[i] to
// symdyn_first[i + 1], their columns places in this order.
#pragma once

#include "band.h"
#include "run.h"

// The matrix of a root for steps of length h, factorized. Returns 1 if it is singular.
static int symdyn_newton_matrix(symdyn_method *method, double h, int root) {
    double *const re = method->re[root], *const im = method->im[root], *const over = method->over[root];
    double scale[SYMDYN_BAND + SYMDYN_LOWER];
    const double *const jacobian = method->jacobian, p = symdyn_roots[root][0] / h, q = symdyn_roots[root][1] / h;
    over[0] = p / (p * p + q * q);
    over[1] = -q / (p * p + q * q);
    for (int i = 0; i < SYMDYN_FACTORS; i++) re[i] = 0.0;
    for (int i = 0; root > 0 && i < SYMDYN_FACTORS; i++) im[i] = 0.0;
    for (int k = 0; k < SYMDYN_BAND; k++) {
        const int i = symdyn_sequence[SYMDYN_REDUCED + k];
        double most = fabs(p) + fabs(q);
        re[SYMDYN_BAND_AT(SYMDYN_LOWER, SYMDYN_UPPER, k, k)] = p;
        if (root > 0) im[SYMDYN_BAND_AT(SYMDYN_LOWER, SYMDYN_UPPER, k, k)] = q;
        for (int e = symdyn_first[i]; e < symdyn_first[i + 1]; e++) {
            int place = symdyn_column[e] - SYMDYN_REDUCED;
            double u = jacobian[e], v = 0.0;
            if (place < 0) {
                const int rate = symdyn_first[symdyn_sequence[symdyn_column[e]]];
                place = symdyn_column[rate] - SYMDYN_REDUCED;
                u *= jacobian[rate];
                v = u * over[1];
                u *= over[0];
            }
            re[SYMDYN_BAND_AT(SYMDYN_LOWER, SYMDYN_UPPER, k, place)] -= u;
            if (root > 0) im[SYMDYN_BAND_AT(SYMDYN_LOWER, SYMDYN_UPPER, k, place)] -= v;
            const double size = fabs(u) + fabs(v);
            most = size > most ? size : most;
        }
        scale[k] = 1.0 / most;
    }
    for (int i = 0; i < SYMDYN_LOWER; i++) scale[SYMDYN_BAND + i] = 0.0;
    return root > 0 ? symdyn_band_eliminate(SYMDYN_BAND, SYMDYN_LOWER, SYMDYN_UPPER, re, im, scale, method->order[root])
                    : symdyn_band_eliminate(SYMDYN_BAND, SYMDYN_LOWER, SYMDYN_UPPER, re, 0, scale, method->order[root]);
}

// The row of state i times the entries before the place `end` of u + i v, or of u where v is 0.
static inline void symdyn_newton_row(
    const double *restrict jacobian, int i, int end, const double *u, const double *v, double *p, double *q) {
    double a = 0.0, b = 0.0;
    for (int e = symdyn_first[i]; e < symdyn_first[i + 1]; e++) {
        const int k = symdyn_column[e];
        if (k >= end) continue;
        a += jacobian[e] * u[k];
        if (v) b += jacobian[e] * v[k];
    }
    *p = a;
    *q = b;
}

// Solve (A + i B) w = x + i y, or A w = x where y is 0, in place, by the factors of a root.
static inline __attribute__((always_inline)) void symdyn_newton_substitute(
    const symdyn_method *method, int root, double *restrict x, double *restrict y) {
    enum { END = SYMDYN_REDUCED + SYMDYN_BAND, BEFORE = SYMDYN_LOWER + SYMDYN_UPPER, LENGTH = SYMDYN_STATE + SYMDYN_LOWER };
    const double *const jacobian = method->jacobian, s = method->over[root][0], t = method->over[root][1];
    double re[BEFORE + LENGTH], im[BEFORE + LENGTH], *const u = re + BEFORE, *const v = y ? im + BEFORE : 0, p, q;
    for (int k = 0; k < BEFORE + LENGTH; k++) re[k] = im[k] = 0.0;
    for (int k = 0; k < SYMDYN_REDUCED; k++) {
        const int i = symdyn_sequence[k];
        u[k] = y ? s * x[i] - t * y[i] : s * x[i];
        if (y) v[k] = s * y[i] + t * x[i];
    }
    for (int k = SYMDYN_REDUCED; k < END; k++) {
        const int i = symdyn_sequence[k];
        symdyn_newton_row(jacobian, i, SYMDYN_REDUCED, u, v, &p, &q);
        u[k] = x[i] + p;
        if (y) v[k] = y[i] + q;
    }
    symdyn_band_substitute(SYMDYN_BAND, SYMDYN_LOWER, SYMDYN_UPPER, method->re[root], y ? method->im[root] : 0,
        method->order[root], u + SYMDYN_REDUCED, y ? v + SYMDYN_REDUCED : 0);
    for (int k = 0; k < SYMDYN_REDUCED; k++) {
        const int e = symdyn_first[symdyn_sequence[k]], j = symdyn_column[e];
        p = jacobian[e] * u[j];
        q = y ? jacobian[e] * v[j] : 0.0;
        u[k] += y ? s * p - t * q : s * p;
        if (y) v[k] += s * q + t * p;
    }
    for (int k = END; k < SYMDYN_STATE; k++) {
        const int i = symdyn_sequence[k];
        symdyn_newton_row(jacobian, i, k, u, v, &p, &q);
        p += x[i];
        q += y ? y[i] : 0.0;
        u[k] = y ? s * p - t * q : s * p;
        if (y) v[k] = s * q + t * p;
    }
    for (int k = 0; k < SYMDYN_STATE; k++) {
        x[symdyn_sequence[k]] = u[k];
        if (y) y[symdyn_sequence[k]] = v[k];
    }
}

// The same for the state, and for every column of sensitivities. B and y are zero for the first root.
static void symdyn_newton_solve(const symdyn_method *method, int root, double *restrict x, double *restrict y) {
    for (int first = 0; first < SYMDYN_NX; first += SYMDYN_STATE) {
        if (root > 0)
            symdyn_newton_substitute(method, root, x + first, y + first);
        else
            symdyn_newton_substitute(method, root, x + first, 0);
    }
}
