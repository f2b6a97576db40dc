// Control of the steps: the length of the next one, and what becomes of one that was tried.
#pragma once

#include "run.h"

// Where the next step has to end at the latest: at a kink of the inputs ahead, or with the run.
static symdyn_time symdyn_next_stop(const symdyn_run *run) {
#if SYMDYN_HAS_INPUTS
    const symdyn_problem *const problem = &run->problem;
    const symdyn_time here = run->t + run->direction * run->t_slack;
    long low = 0, high = problem->n_stops;
    while (low < high) {
        const long middle = low + (high - low) / 2;
        if (run->direction > 0.0 ? problem->stops[middle] <= here : problem->stops[middle] < here)
            low = middle + 1;
        else
            high = middle;
    }
    const long next = run->direction > 0.0 ? low : low - 1;
    if (next >= 0 && next < problem->n_stops && (run->t_end - problem->stops[next]) * run->direction > run->t_slack)
        return problem->stops[next];
#endif
    return run->t_end;
}

// The step to be tried next.
static void symdyn_propose(symdyn_run *run) {
    const symdyn_time bound = symdyn_next_stop(run);
    const double rest = fabs((bound - run->t) - run->t_low), least = 16.0 * symdyn_eps * fabs(run->t);
    double h = run->h < run->h_max ? run->h : run->h_max;
    run->h_min = least > run->h_floor ? least : run->h_floor;
    h = h > run->h_min ? h : run->h_min;
    const int last = 1.01 * h >= rest;
    run->h_try = run->direction * (last ? rest : 2.0 * h > rest ? 0.5 * rest : h);  // two equal steps, not a whole one and a bit
    run->t_new = bound;
    run->t_new_low = 0.0;
    run->crossing = 0;
#if SYMDYN_HAS_INPUTS
    run->h_cut = h > fabs(run->h_try) ? h : 0.0;
#endif
    if (last) return;
    const symdyn_time way = run->h_try + run->t_low;  // two-sum: the rounding error of t does not build up
    run->t_new = run->t + way;
    const symdyn_time back = run->t_new - run->t;
    run->t_new_low = (run->t - (run->t_new - back)) + (way - back);
}

// Accept or reject a step, by its error and the root of that, or failure: accepted, it moves (t, x) on; else the next is shorter.
static void symdyn_judge(symdyn_run *run, int failure, double err, double root, const double *x_new, const double *xd_new) {
    const double h = fabs(run->h_try);
    double grow;
    if (failure || !(err <= 1.0)) {
        run->n_rejected++;
        run->rejected = 1;
        if (h <= run->h_min) run->status = failure ? failure : SYMDYN_STEP_TOO_SMALL;
        grow = failure || !(err <= symdyn_huge) ? 0.5 : 0.85 / root;
        run->h = h * (grow > 0.2 ? grow : 0.2);
        return;
    }
#if !SYMDYN_OWN_STEP
    // PI control (Hairer and Wanner, volume II, section IV.2) for the order n: h*0.85*err^(-1/n)*err_old^(1/(4 n)). Measured for
    // order 8 against h*0.9*err^(-1/8), at equal error: 7 % fewer evaluations for double pendulums, 1 % more for Kepler orbits.
    grow = 0.85 / root * sqrt(sqrt(run->root_old));
    grow = grow > 6.0 ? 6.0 : grow > 0.333 ? grow : 0.333;
#if SYMDYN_BANDED
    // While the Jacobian stays, a step that would hardly be longer keeps its length, and with it the factors (Hairer and Wanner,
    // volume II, section IV.8). Measured: 1.2 times as fast for cables, 1.6 times for nets, whose factors take longer.
    if (run->method.theta <= 0.01 && grow >= 1.0 && grow <= 1.2) grow = 1.0;
#endif
    run->h = h * (run->rejected && grow > 1.0 ? 1.0 : grow);
#if SYMDYN_HAS_INPUTS
    if (!run->rejected && run->h < run->h_cut) run->h = run->h_cut;
#endif
    run->root_old = root > 0.316 ? root : 0.316;
#endif
    run->t_old = run->t;
    run->h_old = run->h_try;
    run->t = run->t_new;
    run->t_low = run->t_new_low;
    for (int i = 0; i < SYMDYN_NX; i++) {
        run->x_old[i] = run->x[i];
        run->x[i] = x_new[i];
        run->xd[i] = xd_new[i];
#if SYMDYN_SINGLE
        run->x_low[i] = run->x_new_low[i];
#endif
    }
    run->n_steps++;
    run->unstored = 1;
    run->rejected = run->dense_ready = 0;
    run->crossed = run->crossing;
    run->n_crossing = 0;
    if (run->t == run->t_end) run->status = SYMDYN_DONE;
}
