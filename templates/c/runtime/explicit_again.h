// Where the polynomial of an embedded explicit Runge-Kutta pair is not good enough, and steps across singular configurations.
#pragma once

#include "explicit_stage.h"

#if SYMDYN_CROSSES
// Whether to try another step for one whose error a shorter one would not fix, maybe: where a singular configuration lies in the
// step, what its stages add across the constraints is projected away, and rounding grows with the inverse cube of a stage's
// distance from it. The best of several is the one whose stages keep away most, by the error before it and after, as err becomes.
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
SYMDYN_LINKED int symdyn_by_a_step(symdyn_run *run, int from_end, symdyn_time s, double *x_out, double *err) {
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
SYMDYN_LINKED int symdyn_is_rough(symdyn_run *run) {
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
