// The way back over steps of an embedded explicit Runge-Kutta pair: exact derivatives of what these steps compute.
// Source: Hairer, Lubich, Wanner, Geometric Numerical Integration, 2nd ed., section VI.9 (the adjoint of a method); Sandu, On the
// properties of Runge-Kutta discrete adjoints (2006).
#pragma once

#include "simulate.h"

// Try at most max_steps steps and keep every accepted one, of n at most: t its start and h its length, x the state at its start
// and, behind the last one, at the end; slopes[SYMDYN_STAGES] of its stages. Returns a status.
SYMDYN_EXPORT int SYMDYN_NAME(simulation_record)(
    void *memory, long max_steps, long n, double *t, double *h, double *x, double *slopes, long *written) {
    enum { WIDTH = SYMDYN_STAGES * SYMDYN_NX };
    symdyn_run *const run = (symdyn_run *)memory;
    *written = 0;
    for (; max_steps > 0 && *written < n && run->status == SYMDYN_STEP_LIMIT; max_steps--) {
        const long before = run->n_steps;
        symdyn_attempt(run);
        if (run->n_steps == before) continue;
        t[*written] = run->t_old;
        h[*written] = run->h_old;
        for (int i = 0; i < SYMDYN_NX; i++) x[*written * SYMDYN_NX + i] = run->x_old[i];
        for (int i = 0; i < WIDTH; i++) slopes[*written * WIDTH + i] = run->method.k[i / SYMDYN_NX][i % SYMDYN_NX];
        ++*written;
    }
    for (int i = 0; i < SYMDYN_NX; i++) x[*written * SYMDYN_NX + i] = run->x[i];
    return run->status;
}

// to += factor v, for vectors of states
static inline void symdyn_add(double factor, const double *restrict v, double *restrict to) {
    if (factor != 0.0)
        for (int i = 0; i < SYMDYN_NX; i++) to[i] += factor * v[i];
}

// Times and states of the stages of n steps, from what was kept of them. A: coefficients of the stages, row by row, c: their
// times.
SYMDYN_EXPORT void SYMDYN_NAME(simulation_stages)(long n, const double *A, const double *c, const double *t, const double *h,
    const double *x, const double *slopes, double *times, double *states) {
    for (long step = 0; step < n; step++)
        for (int j = 0; j < SYMDYN_STAGES; j++) {
            const double *const k = slopes + step * SYMDYN_STAGES * SYMDYN_NX;
            double *const y = states + (step * SYMDYN_STAGES + j) * SYMDYN_NX, sum[SYMDYN_NX] = {0.0};
            times[step * SYMDYN_STAGES + j] = t[step] + c[j] * h[step];
            for (int l = 0; l < j; l++) symdyn_add(A[j * SYMDYN_STAGES + l], k + l * SYMDYN_NX, sum);
            for (int i = 0; i < SYMDYN_NX; i++) y[i] = x[step * SYMDYN_NX + i] + h[step] * sum[i];
        }
}

// Carry the weights of the state at the end of n steps back to their start, in place: weights[SYMDYN_NX], then those of
// parameters and inputs, to which is added. ends: the states at the ends of the steps, where they were projected; b: weights of
// the stages; of_x, of_others: what the weights of x and the others at each stage gain by time; null: nothing. followed: places
// among the others of n_followed inputs that follow the state, whose derivatives by it at each stage are feedback, n_followed
// rows of SYMDYN_NX: their weights become weights of the state. Returns 0 or a reason.
SYMDYN_EXPORT int SYMDYN_NAME(simulation_back)(const symdyn_problem *problem, long n, const double *A, const double *b,
    const double *h, const double *ends, const double *times, const double *states, const double *of_x, const double *of_others,
    long n_followed, const long *followed, const double *feedback, double *weights) {
    enum { WIDTH = SYMDYN_NX + SYMDYN_CARRIED };
    for (long step = n - 1; step >= 0; step--) {
        double gained[SYMDYN_STAGES][SYMDYN_NX], out[WIDTH], along[SYMDYN_NX];
#if SYMDYN_PROJECTS
        if (problem->project) {
            const double *const end = ends + step * SYMDYN_NX, at = times[step * SYMDYN_STAGES] + h[step];
            const int reason = symdyn_corrected_weights_at(problem, at, end, weights, out);
            if (reason) return reason;
            for (int i = 0; i < SYMDYN_NX; i++) weights[i] = out[i];
            for (int i = SYMDYN_NX; i < WIDTH; i++) weights[i] += out[i];
        }
#else
        (void)ends;
#endif
        for (int j = SYMDYN_STAGES - 1; j >= 0; j--) {
            const long stage = step * SYMDYN_STAGES + j;
            for (int i = 0; i < SYMDYN_NX; i++) along[i] = b[j] * weights[i];
            for (int l = j + 1; l < SYMDYN_STAGES; l++) symdyn_add(A[l * SYMDYN_STAGES + j], gained[l], along);
            for (int i = 0; i < SYMDYN_NX; i++) along[i] *= h[step];
            const int reason = symdyn_rhs_weights_at(problem, times[stage], states + stage * SYMDYN_NX, along, out);
            if (reason) return reason;
            if (of_x)
                for (int i = 0; i < SYMDYN_NX; i++) out[i] += h[step] * b[j] * of_x[stage * SYMDYN_NX + i];
            if (of_others)
                for (int i = 0; i < SYMDYN_CARRIED; i++)
                    out[SYMDYN_NX + i] += h[step] * b[j] * of_others[stage * SYMDYN_CARRIED + i];
            for (long k = 0; k < n_followed; k++) {
                const double weight = out[SYMDYN_NX + followed[k]];
                out[SYMDYN_NX + followed[k]] = 0.0;
                symdyn_add(weight, feedback + (stage * n_followed + k) * SYMDYN_NX, out);
            }
            for (int i = 0; i < SYMDYN_NX; i++) gained[j][i] = out[i];
            for (int i = SYMDYN_NX; i < WIDTH; i++) weights[i] += out[i];
        }
        for (int j = 0; j < SYMDYN_STAGES; j++)
            for (int i = 0; i < SYMDYN_NX; i++) weights[i] += gained[j][i];
        for (int i = 0; i < WIDTH; i++)
            if (!(fabs(weights[i]) <= symdyn_huge)) return SYMDYN_NOT_FINITE;
    }
    return 0;
}
