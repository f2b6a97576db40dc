// A run of the integrator: its memory, failures, the right-hand side, norms. Nothing is allocated or global: a run lives in one
// struct, and one that was interrupted continues to the same bits.
#pragma once

#include "problem.h"
#include "report_type.h"
#include "status.h"
#include "time_type.h"

typedef struct {
    symdyn_problem problem;
    symdyn_time t, t_low;          // present time, and what rounding has cut off it: the time is t + t_low
    symdyn_time t_end;             // where the run ends, hit exactly
    double direction;              // sign of t_end - t0 (0 if they are equal)
    symdyn_time t_slack;           // times closer than this to an end count as the end
    symdyn_time h_floor;           // shortest step near t = 0, else 16 ulp of t
    double h, h_max;               // length >= 0 of the step to be tried next; longest step (the last one may be 1 % longer)
    double h_try, h_min;           // the step that is tried: its length with sign, the shortest one,
    symdyn_time t_new, t_new_low;  // its end
    double h_cut;                  // its length, had it not to end at a kink of the inputs ahead or with the run; else 0
    double rtol, atol[SYMDYN_NX];  // tolerated error of a step: atol[i] + rtol*|x[i]| in the root mean square
    double root_old;               // error of the latest accepted step (tolerated: 1) to the 1/SYMDYN_ORDER
    double x[SYMDYN_NX], xd[SYMDYN_NX];  // state at t and its derivative
#if SYMDYN_SINGLE
    double x_low[SYMDYN_NX], x_new_low[SYMDYN_NX];  // what rounding has cut off x, and off the end of the step that is tried
#endif
    symdyn_time t_old;                        // start of the latest accepted step,
    double h_old, x_old[SYMDYN_NX];           // its length, with sign, the state there
    int dense_ready, unstored;                // what is needed within the latest step is prepared; (t, x) is not stored yet
    int rejected, status;                     // the latest attempt was rejected: do not lengthen the step
    long n_steps, n_rejected, n_evaluations;  // accepted steps, attempts given up, calls of the right-hand side
    // The latest evaluation that failed, and the run where status < 0. reason: what a function returned, 0: results not finite,
    // or a correction too far. bad_index: the first state that is not finite, or the constraint of the largest residual; or -1.
    int reason;
    long bad_index;
    double t_fail, x_fail[SYMDYN_NX];
    // Latest projection: norms of the changes of q and of u; where it failed, the largest residual, m, or of_speeds, m/s,
    // and its row, else -1. All projections: the largest changes after a step, steps whose end was moved, calls of the
    // corrections.
    double dq, du, residual, largest_dq, largest_du;
    double moved, largest_moved, t_moved;  // how far the latest end was moved, in tolerances; of all the most, and when
    int worst, of_speeds;
    long n_corrected, n_corrections, n_jacobians, n_factorizations;
    double before[SYMDYN_NX];  // what was projected last
    double x_end[SYMDYN_NX];   // the latest step's end before projection: what is within it ends here
    int end_moved;             // by more than a thousandth of the tolerance
    // Steps tried across a singular configuration; whether the one that is tried, the latest one goes across one.
    int n_crossing, crossing, crossed;
    double bad_crossing, h_crossing;  // the best of those tried
    symdyn_method method;
#if SYMDYN_EVENTS
    symdyn_events events;
#endif
} symdyn_run;

#if SYMDYN_SINGLE
static const double symdyn_eps = 1.1920929e-7, symdyn_huge = 3.4028234e38, symdyn_tiny = 1e-30;
#else
static const double symdyn_eps = 2.220446049250313e-16, symdyn_huge = 1.7976931348623157e308, symdyn_tiny = 1e-300;
#endif
static const symdyn_time symdyn_time_eps = 2.220446049250313e-16;

// Record a failure; returns its status.
static int symdyn_fail(symdyn_run *run, int status, int reason, long bad_index, double t, const double *x) {
    run->reason = reason;
    run->bad_index = bad_index;
    run->t_fail = t;
    for (int i = 0; i < SYMDYN_NX; i++) run->x_fail[i] = x[i];
    return status;
}

// The right-hand side at (t, y) into xd. Returns 0 or the failure. The only call of the field.
static int symdyn_eval(symdyn_run *run, double t, const double *y, double *xd) {
    int bad = 0, first = 0;
    run->n_evaluations++;
    const int reason = symdyn_field(&run->problem, t, y, xd);
    for (int i = 0; i < SYMDYN_NX; i++)  // comparisons with NaN are false
        bad |= !(fabs(y[i]) <= symdyn_huge) | !(fabs(xd[i]) <= symdyn_huge);
    if (!reason && !bad) return 0;
    while (!reason && first < SYMDYN_NX - 1 && fabs(y[first]) <= symdyn_huge && fabs(xd[first]) <= symdyn_huge) first++;
    return symdyn_fail(run, reason ? SYMDYN_FIELD_FAILED : SYMDYN_STATE_NOT_FINITE, reason, reason ? -1 : first, t, y);
}

// One over the tolerated error of state i in a step from run->x to x_new; finite also for x = 0 without atol.
static inline double symdyn_scale(const symdyn_run *run, int i, double x_new) {
    const double size = fabs(run->x[i]) > fabs(x_new) ? fabs(run->x[i]) : fabs(x_new);
    return 1.0 / (run->atol[i] + run->rtol * size + symdyn_tiny);
}

// The mean square of v, 1 where it is the tolerated error of a step to x_new. Entries that are 0, without atol, do not count.
static double symdyn_square(const symdyn_run *run, const double *v, const double *x_new) {
    double sum = 0.0;
    for (int i = 0; i < SYMDYN_NX; i++) {
        const double a = v[i] * symdyn_scale(run, i, x_new[i]);
        sum += run->atol[i] + fabs(run->x[i]) + fabs(x_new[i]) > 0.0 ? a * a : 0.0;
    }
    return sum / SYMDYN_NX;
}

// v^(1/SYMDYN_ORDER)
static inline double symdyn_root(double v) {
#if SYMDYN_ORDER_8
    return sqrt(sqrt(sqrt(v)));
#else
    return pow(v, 1.0 / SYMDYN_ORDER);
#endif
}
