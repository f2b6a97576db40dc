// A step of an embedded explicit Runge-Kutta pair, and its polynomial.
#pragma once

#include "explicit_stage.h"

#if SYMDYN_SINGLE
// Entry i of the state, moved by a change; what rounding cuts off is kept, so that it does not build up over steps.
static inline double symdyn_moved_entry(symdyn_run *run, int i, double change) {
    const double way = change + run->x_low[i], end = run->x[i] + way, back = end - run->x[i];
    run->x_new_low[i] = (run->x[i] - (end - back)) + (way - back);
    return end;
}
#else
#define symdyn_moved_entry(run, i, change) ((run)->x[i] + (change))
#endif

// The step of length h (with sign) from run->t to t_new: its end and the error relative to the tolerance.
SYMDYN_LINKED int symdyn_try(
    symdyn_run *run, double h, double t_new, double *restrict x_new, double *restrict xd_new, double *restrict err) {
    const double t = run->t, *restrict const x = run->x;
    double (*restrict const k)[SYMDYN_NX] = run->method.k, y[SYMDYN_NX], sum = 0.0, sum2 = 0.0;
    int failure;
    (void)xd_new;
    for (int i = 0; i < SYMDYN_NX; i++) k[0][i] = run->xd[i];
    SYMDYN_EACH_STAGE(SYMDYN_STAGE)
#if SYMDYN_SLOPE_AT_END
    for (int i = 0; i < SYMDYN_NX; i++) x_new[i] = symdyn_moved_entry(run, i, h * (SYMDYN_B(k, i)));
    if ((failure = symdyn_eval(run, t_new, x_new, xd_new))) return failure;
    for (int i = 0; i < SYMDYN_NX; i++) k[SYMDYN_STAGES][i] = xd_new[i];
#endif
    for (int i = 0; i < SYMDYN_NX; i++) {
        const double e = SYMDYN_E(k, i);
#if SYMDYN_SECOND_ERROR
        const double slope = SYMDYN_B(k, i);
        const double e2 = SYMDYN_SECOND(k, i, slope);
        x_new[i] = symdyn_moved_entry(run, i, h * slope);
#endif
        const double scale = symdyn_scale(run, i, x_new[i]);
        sum += (e * scale) * (e * scale);
#if SYMDYN_SECOND_ERROR
        sum2 += (e2 * scale) * (e2 * scale);
#endif
    }
    sum2 = sum + 0.01 * sum2;
    *err = sum2 > 0.0 ? fabs(h) * sum / sqrt(sum2 * SYMDYN_NX) : 0.0;
    return 0;
}

// Across singular configurations, and where the polynomial is not good enough, steps of their own take its place.
SYMDYN_LINKED int symdyn_by_a_step(symdyn_run *run, int from_end, symdyn_time s, double *x_out, double *err);
SYMDYN_LINKED int symdyn_is_rough(symdyn_run *run);

// Row j of the dense output.
#define SYMDYN_DENSE_ROW(j) d[(j) + 3][i] = h * (SYMDYN_D_##j(k, i));

// Prepare what is needed within the latest step.
static int symdyn_prepare_dense(symdyn_run *run) {
    const double h = run->h_old, *restrict const x = run->x_old;
    double (*restrict const k)[SYMDYN_NX] = run->method.k, (*restrict const d)[SYMDYN_NX] = run->method.dense;
#if SYMDYN_SECOND_ERROR
    for (int i = 0; i < SYMDYN_NX; i++) k[SYMDYN_STAGES][i] = run->xd[i];
#if SYMDYN_PROJECTS
    if (run->end_moved) {
        const int failure = symdyn_eval(run, run->t, run->x_end, k[SYMDYN_STAGES]);
        if (failure) return failure;
    }
#endif
#endif
#if SYMDYN_DENSE_STAGES
    const double t = run->t_old;
    double y[SYMDYN_NX];
    int failure;
    SYMDYN_EACH_DENSE_STAGE(SYMDYN_STAGE)
#endif
#if SYMDYN_PROJECTS
    const double *const x_end = run->x_end;
#else
    const double *const x_end = run->x;
#endif
    for (int i = 0; i < SYMDYN_NX; i++) {
        const double dx = x_end[i] - x[i];
        d[0][i] = dx;
        d[1][i] = h * k[0][i] - dx;
        d[2][i] = 2.0 * dx - h * (k[0][i] + k[SYMDYN_STAGES][i]);
        SYMDYN_EACH_DENSE_ROW(SYMDYN_DENSE_ROW)
    }
    run->dense_ready = 1;
    run->method.rough = symdyn_is_rough(run);
    return 0;
}

// The state at s within the latest step.
SYMDYN_LINKED int symdyn_between(symdyn_run *run, symdyn_time s, double *x_out) {
    const double theta = (s - run->t_old) / run->h_old, rest = 1.0 - theta;
    int failure;
    if (!run->dense_ready && (failure = symdyn_prepare_dense(run))) return failure;
    if (run->method.rough) {
        double err;
        return symdyn_by_a_step(run, 0, s, x_out, &err);
    }
    for (int i = 0; i < SYMDYN_NX; i++) {
        double value = run->method.dense[SYMDYN_DENSE - 1][i];
        for (int j = SYMDYN_DENSE - 2; j >= 0; j--) value = run->method.dense[j][i] + (j % 2 ? theta : rest) * value;
        x_out[i] = run->x_old[i] + theta * value;
    }
    return 0;
}
