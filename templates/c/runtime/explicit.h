// Embedded explicit Runge-Kutta pair. Its coefficients are macros: SYMDYN_A_j(k, i) is the sum of products with slopes k of entry
// i for stage j, SYMDYN_C_j(t, h, t_new) its time, SYMDYN_B the slope of the step, SYMDYN_E and SYMDYN_SECOND differences to the
// solutions that the error is taken from, SYMDYN_D_j rows of the dense output; the newest stage comes last: other products are
// done while the right-hand side is still busy.
#pragma once

#include "run.h"

// Stage j: where it is evaluated, then its slope.
#define SYMDYN_STAGE(j)                                                                                                          \
    for (int i = 0; i < SYMDYN_NX; i++) y[i] = x[i] + h * (SYMDYN_A_##j(k, i));                                                  \
    if ((failure = symdyn_eval(run, SYMDYN_C_##j(t, h, t_new), y, k[j]))) return failure;

// The step of length h (with sign) from run->t to t_new: its end and the error relative to the tolerance.
static int symdyn_try(
    symdyn_run *run, double h, double t_new, double *restrict x_new, double *restrict xd_new, double *restrict err) {
    const double t = run->t, *restrict const x = run->x;
    double (*restrict const k)[SYMDYN_NX] = run->method.k, y[SYMDYN_NX], sum = 0.0, sum2 = 0.0;
    int failure;
    (void)xd_new;
    for (int i = 0; i < SYMDYN_NX; i++) k[0][i] = run->xd[i];
    SYMDYN_EACH_STAGE(SYMDYN_STAGE)
#if SYMDYN_SLOPE_AT_END
    for (int i = 0; i < SYMDYN_NX; i++) x_new[i] = x[i] + h * (SYMDYN_B(k, i));
    if ((failure = symdyn_eval(run, t_new, x_new, xd_new))) return failure;
    for (int i = 0; i < SYMDYN_NX; i++) k[SYMDYN_STAGES][i] = xd_new[i];
#endif
    for (int i = 0; i < SYMDYN_NX; i++) {
        const double e = SYMDYN_E(k, i);
#if SYMDYN_SECOND_ERROR
        const double slope = SYMDYN_B(k, i);
        const double e2 = SYMDYN_SECOND(k, i, slope);
        x_new[i] = x[i] + h * slope;
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

#if SYMDYN_CROSSES
// Whether to try another step for one whose error a shorter one would not fix, maybe: where a singular configuration lies in the
// step, what its stages add across the constraints is projected away, and rounding grows with the inverse cube of a stage's
// distance from it. Of several the one whose stages keep away best is taken, by the error before it and after, as err becomes.
static int symdyn_cross(symdyn_run *run, const double *x_new, double *err) {
    enum { ESTIMATES = 1 + SYMDYN_SECOND_ERROR };
    const double raw = *err, h = run->h_try;
    double (*restrict const k)[SYMDYN_NX] = run->method.k, y[1 + ESTIMATES][SYMDYN_NX], sum[2] = {0.0, 0.0};
    run->crossing = 1;
    for (int i = 0; i < SYMDYN_NX; i++) {
        const double e = SYMDYN_E(k, i);
        y[0][i] = x_new[i];
        y[1][i] = x_new[i] - h * e;
#if SYMDYN_SECOND_ERROR
        const double slope = SYMDYN_B(k, i);
        const double e2 = SYMDYN_SECOND(k, i, slope);
        y[2][i] = x_new[i] - h * e2;
#endif
    }
    for (int j = 0; j < 1 + ESTIMATES; j++)
        if (symdyn_correct(run, run->t_new, y[j])) return 0;
    for (int j = 0; j < ESTIMATES; j++) {
        for (int i = 0; i < SYMDYN_NX; i++) y[j + 1][i] -= y[0][i];
        sum[j] = symdyn_square(run, y[j + 1], y[0]);
    }
    sum[1] = sum[0] + 0.01 * sum[1];  // without a second estimate as it is
    *err = sum[1] > 0.0 ? sum[0] / sqrt(sum[1]) : 0.0;
    if (!(*err < 0.01 * raw && run->n_crossing < 16)) return 0;
    const double bad = raw * (*err > 1.0 ? 1e20 : 1.0);
    if (run->n_crossing == 0 || bad < run->bad_crossing) {
        run->bad_crossing = bad;
        run->h_crossing = fabs(h);
    }
    run->n_crossing++;
    run->n_rejected++;
    run->h = run->n_crossing < 16 ? fabs(h) * 1.03 : run->h_crossing;
    return 1;
}
#endif

// The state at s within the latest step, by a step of its own from its start or from its end, and the error of that.
static int symdyn_by_a_step(symdyn_run *run, int from_end, double s, double *x_out, double *err) {
    symdyn_run again = *run;
    double xd[SYMDYN_NX];
    again.t = from_end ? run->t : run->t_old;
    for (int i = 0; i < SYMDYN_NX; i++) again.x[i] = from_end ? run->x[i] : run->x_old[i];
    int failure = symdyn_eval(&again, again.t, again.x, again.xd);
    if (!failure) failure = symdyn_try(&again, s - again.t, s, x_out, xd, err);
    run->n_evaluations = again.n_evaluations;
    return failure ? symdyn_fail(run, failure, again.reason, again.bad_index, again.t_fail, again.x_fail) : 0;
}

// Whether the polynomial of the latest step is off by some ten tolerances, by its defect a quarter into it. Where stability
// limits steps it swings: what is left of stiff motion, which the end damps, grows within the step.
static int symdyn_is_rough(symdyn_run *run) {
    const double theta = 0.25, t = run->t_old + theta * run->h_old;
    double y[SYMDYN_NX], f[SYMDYN_NX], slope[SYMDYN_NX];
    for (int i = 0; i < SYMDYN_NX; i++) {
        double value = run->method.dense[SYMDYN_DENSE - 1][i], rate = 0.0;
        for (int j = SYMDYN_DENSE - 2; j >= 0; j--) {  // by theta, or by 1 - theta, and the polynomials of higher order
            const double factor = j % 2 ? theta : 1.0 - theta;
            rate = factor * rate + (j % 2 ? value : -value);
            value = run->method.dense[j][i] + factor * value;
        }
        y[i] = run->x_old[i] + theta * value;
        slope[i] = (value + theta * rate) / run->h_old;
    }
    if (symdyn_eval(run, t, y, f)) return 1;
    for (int i = 0; i < SYMDYN_NX; i++) f[i] = 0.25 * run->h_old * (f[i] - slope[i]);
    return symdyn_square(run, f, run->x_old) > 100.0;
}

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
static int symdyn_between(symdyn_run *run, double s, double *x_out) {
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
