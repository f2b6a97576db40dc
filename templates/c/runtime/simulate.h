// A run from outside: attempts of steps, states at requested times, the report. A run is one block of memory, so that a caller in
// another language needs only its size.
#pragma once

#include "start.h"
#include "steps.h"

// Try one step. Sets run->status if t_end is reached or if there is no shorter step. (On its own it keeps more in registers.)
__attribute__((noinline)) static void symdyn_attempt(symdyn_run *run) {
    double x_new[SYMDYN_NX], xd_new[SYMDYN_NX], err = 0.0;
#if SYMDYN_EVENTS
    if (symdyn_resume(run)) return;
#endif
#if SYMDYN_OWN_STEP
    if ((run->status = symdyn_ahead(run)) < 0) return;
#endif
    symdyn_propose(run);
    int failure = symdyn_try(run, run->h_try, run->t_new, x_new, xd_new, &err);
#if SYMDYN_CROSSES
    if (!failure && err > 100.0 && run->problem.project && symdyn_cross(run, x_new, &err)) return;
#endif
#if SYMDYN_PROJECTS
    if (!failure && err <= 1.0) failure = symdyn_project_end(run, run->t_new, x_new, xd_new);
#endif
#if !SYMDYN_PROJECTS && !SYMDYN_SLOPE_AT_END
    if (!failure && err <= 1.0) failure = symdyn_eval(run, run->t_new, x_new, xd_new);
#endif
#if SYMDYN_OWN_STEP
    const double root = err <= 1.0 ? 1.0 : symdyn_root(err > 1e-8 ? err : 1e-8);
#else
    const double root = symdyn_root(err > 1e-8 ? err : 1e-8);
#endif
    symdyn_judge(run, failure, err, root, x_new, xd_new);
#if SYMDYN_EVENTS
    if (!run->rejected) symdyn_look_for_events(run);
#endif
}

// Write the requested times that are passed by now; returns 0 or a failure.
static int symdyn_serve(symdyn_run *run, const symdyn_time *t_out, long n_out, double *x_out, long *n_written) {
    for (; *n_written < n_out; ++*n_written) {
        const symdyn_time s = t_out[*n_written];
        const symdyn_time ahead = (s - run->t) * run->direction, behind = (run->t_old - s) * run->direction;
        double *restrict const x = x_out + *n_written * SYMDYN_NX;
        if (!((run->direction == 0.0 ? fabs(s - run->t) : ahead) <= (run->t == run->t_end ? run->t_slack : 0.0))) return 0;
        if (behind > run->t_slack) return SYMDYN_BAD_OUTPUT_TIME;
        int failure = 0;
        if (ahead >= 0.0 || behind >= 0.0) {
            for (int i = 0; i < SYMDYN_NX; i++) x[i] = ahead >= 0.0 ? run->x[i] : run->x_old[i];
        } else {
            failure = symdyn_state_at(run, s, x);
        }
        if (failure) return failure == SYMDYN_BAD_OUTPUT_TIME ? failure : (run->status = failure);
    }
    return 0;
}

SYMDYN_EXPORT long SYMDYN_NAME(simulation_size)(void) { return (long)sizeof(symdyn_run); }

// Continue by at most max_steps attempted steps and write the states at the requested times t[*written .. n), sorted in the
// direction of integration, to the rows of x[n][SYMDYN_NX] as they are passed; times beyond t_end never are. With `every`, append
// start and end of every accepted step instead, first of one that STORE_FULL left no room for. Returns a status.
SYMDYN_EXPORT int SYMDYN_NAME(simulation_go)(
    void *memory, int every, long max_steps, symdyn_time *t, long n, double *x, long *written) {
    symdyn_run *const run = (symdyn_run *)memory;
    for (;; max_steps--) {
        const int failure = every ? 0 : symdyn_serve(run, t, n, x, written);
        if (failure) return failure;
        if (every && run->unstored) {
            if (*written >= n) return SYMDYN_STORE_FULL;
            t[*written] = run->t;
            for (int i = 0; i < SYMDYN_NX; i++) x[*written * SYMDYN_NX + i] = run->x[i];
            ++*written;
            run->unstored = 0;
        }
        if (run->status != SYMDYN_STEP_LIMIT || max_steps <= 0) return run->status;
        symdyn_attempt(run);
    }
}

// Report of the run; states (2 SYMDYN_NX): the present one, and the one where an evaluation failed.
SYMDYN_EXPORT void SYMDYN_NAME(simulation_report)(const void *memory, symdyn_report *report, double *states) {
    const symdyn_run *const run = (const symdyn_run *)memory;
    const symdyn_report now = {
        .status = run->status,
        .t = (double)run->t,
        .h = run->h,
        .n_steps = run->n_steps,
        .n_rejected = run->n_rejected,
        .n_evaluations = run->n_evaluations,
        .reason = run->reason,
        .bad_index = run->bad_index,
        .t_fail = run->t_fail,
        .residual = run->residual,
        .of_speeds = run->of_speeds,
        .largest_dq = run->largest_dq,
        .largest_du = run->largest_du,
        .largest_moved = run->largest_moved,
        .t_moved = run->t_moved,
        .n_corrected = run->n_corrected,
        .n_corrections = run->n_corrections,
        .n_jacobians = run->n_jacobians,
        .n_factorizations = run->n_factorizations,
    };
    *report = now;
#if SYMDYN_EVENTS
    report->reset_gap = run->events.reset_gap;
#endif
#if SYMDYN_GAUSS
    report->n_divided = run->method.n_given_up;
    report->n_rough = run->method.n_rough;
    report->t_rough = run->method.t_rough;
#endif
    for (int i = 0; i < SYMDYN_NX; i++) {
        states[i] = run->x[i];
        states[SYMDYN_NX + i] = run->x_fail[i];
    }
}
