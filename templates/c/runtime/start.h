// States within the latest step, and the start of a run.
#pragma once

#include "run.h"

#if SYMDYN_CROSSES
// The state at s within the latest step, by a step of its own from its start or its end, of which only one goes across the
// singular configuration: by that of the smaller error. Across it polynomials swing, and a stage may lie too near.
static int symdyn_within(symdyn_run *run, symdyn_time s, double *x) {
    double y[2][SYMDYN_NX], err[2];
    int failure[2];
    for (int back = 0; back < 2; back++) failure[back] = symdyn_by_a_step(run, back, s, y[back], err + back);
    const int back = failure[0] || (!failure[1] && err[1] < err[0]);
    for (int i = 0; i < SYMDYN_NX; i++) x[i] = y[back][i];
    return failure[back] ? failure[back] : symdyn_correct(run, s, x);
}
#endif

// The state at s within the latest step, on the constraints. Returns 0 or a failure.
static int symdyn_state_at(symdyn_run *run, symdyn_time s, double *x) {
    int failure;
#if SYMDYN_CROSSES
    if (run->crossed && !run->rejected) return symdyn_within(run, s, x);
#endif
    if (!run->dense_ready && run->rejected) return SYMDYN_BAD_OUTPUT_TIME;  // stages are those of an attempt from t
    if ((failure = symdyn_between(run, s, x))) return failure;
#if SYMDYN_PROJECTS
    if (run->problem.project && (failure = symdyn_correct(run, s, x))) return failure;
#endif
#if SYMDYN_CROSSES
    double most = 0.0;
    for (int i = 0; i < SYMDYN_NX; i++)
        most = fmax(most, fabs(x[i] - run->before[i]) / (run->atol[i] + run->rtol * fabs(x[i]) + 1e-300));
    // Near a singular configuration the polynomial is not good enough.
    if (run->problem.project && most > 100.0 && !run->rejected) return symdyn_within(run, s, x);
#endif
    return 0;
}

#if !SYMDYN_OWN_STEP
// Length of the first step (Hairer, Norsett, Wanner, section II.4): by state, derivative, its change over a small Euler step.
static double symdyn_first_step(symdyn_run *run) {
    const double span = fabs(run->t_end - run->t);
    const double d0 = sqrt(symdyn_square(run, run->x, run->x)), d1 = sqrt(symdyn_square(run, run->xd, run->x));
    double y[SYMDYN_NX], yd[SYMDYN_NX];
    const double guess = d0 < 1e-5 || d1 < 1e-5 ? 1e-6 : 0.01 * d0 / d1, h0 = guess <= span ? guess : span;
    for (int i = 0; i < SYMDYN_NX; i++) y[i] = run->x[i] + run->direction * h0 * run->xd[i];
    if (symdyn_eval(run, run->t + run->direction * h0, y, yd)) return h0;  // the step control will find a way round
    for (int i = 0; i < SYMDYN_NX; i++) yd[i] -= run->xd[i];
    const double d2 = sqrt(symdyn_square(run, yd, run->x)) / h0;
    const double h1 =
        d1 <= 1e-15 && d2 <= 1e-15 ? (h0 * 1e-3 > 1e-6 ? h0 * 1e-3 : 1e-6) : symdyn_root(0.01 / (d1 > d2 ? d1 : d2));
    return h1 < 100.0 * h0 ? h1 : 100.0 * h0;
}
#endif

// Go on from (t, x), projected, as at a start. h_first: length of the first step, 0: chosen. Returns 0 or a failure.
static int symdyn_restart(symdyn_run *run, symdyn_time t, const double *x, double h_first) {
    run->t = run->t_old = t;
    run->t_low = 0.0;
    run->root_old = 0.316;
    run->unstored = 1;
    run->dense_ready = run->rejected = 0;
    for (int i = 0; i < SYMDYN_NX; i++) run->x[i] = x[i];
#if SYMDYN_SINGLE
    for (int i = 0; i < SYMDYN_NX; i++) run->x_low[i] = 0.0;
#endif
#if SYMDYN_PROJECTS
    if (run->problem.project && (run->status = symdyn_correct(run, t, run->x))) return run->status;
#endif
    for (int i = 0; i < SYMDYN_NX; i++) run->x_old[i] = run->x[i];
    if (t == run->t_end) return run->status = SYMDYN_DONE;
    if ((run->status = symdyn_eval(run, t, run->x, run->xd))) return run->status;
#if SYMDYN_OWN_STEP
    run->h = h_first;
#else
    run->h = h_first > 0.0 ? h_first : symdyn_first_step(run);
#endif
#if !SYMDYN_EXPLICIT
    if ((run->status = symdyn_begin(run))) return run->status;
#endif
    run->status = SYMDYN_STEP_LIMIT;
    return 0;
}

// Prepare a run, backward where t_end < t0. span: t0, t_end, rtol, length of the first step (0: chosen), longest step (0: any);
// atol: SYMDYN_NX. Returns 0 or a failure.
SYMDYN_EXPORT int SYMDYN_NAME(simulation_start)(
    void *memory, const symdyn_problem *problem, const symdyn_time *span, const double *x0, const double *atol) {
    symdyn_run *const run = (symdyn_run *)memory;
    const symdyn_time t0 = span[0], t_end = span[1];
    const double rtol = (double)span[2], h_first = (double)span[3], h_max = (double)span[4];
    const symdyn_time length = fabs(t_end - t0), far = fabs(t0) > fabs(t_end) ? fabs(t0) : fabs(t_end);
    static const symdyn_run empty = {0};
    int bad = !(length <= symdyn_huge) | !(rtol >= 0.0) | !(h_first >= 0.0) | !(h_max >= 0.0);
    *run = empty;
    run->problem = *problem;
    run->t = run->t_old = t0;
    run->t_end = t_end;
    run->direction = t_end > t0 ? 1.0 : t_end < t0 ? -1.0 : 0.0;
    run->t_slack = 8.0 * symdyn_time_eps * far;
    run->h_floor = symdyn_eps * symdyn_eps * length;
    run->h_max = h_max > 0.0 ? h_max : length;
    run->rtol = rtol;
    run->unstored = 1;
    run->bad_index = -1;
    for (int i = 0; i < SYMDYN_NX; i++) {
        run->atol[i] = atol[i];
        run->x[i] = run->x_old[i] = x0[i];
        bad |= !(fabs(x0[i]) <= symdyn_huge) | !(atol[i] >= 0.0) | !(atol[i] + rtol > 0.0);
    }
    return bad ? (run->status = SYMDYN_BAD_ARGUMENT) : symdyn_restart(run, t0, x0, h_first);
}
