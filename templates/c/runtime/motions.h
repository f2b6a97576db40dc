// Integration of many trajectories, each with its own steps, by one thread each: a kernel in CUDA C; in C one thread integrates
// them all. A thread that is through takes the next trajectory, so that none waits for the longest motion of its warp.
#pragma once

#include "kernel.h"
#include "motions_type.h"
#include "simulate.h"
#if SYMDYN_EVENTS
#include "dropped_events.h"
#endif

enum { SYMDYN_NUMBERS = SYMDYN_NP + SYMDYN_NC + SYMDYN_NIN + !(SYMDYN_NP + SYMDYN_NC + SYMDYN_NIN) };

SYMDYN_KERNEL void SYMDYN_NAME(motions)(symdyn_motions motions);

// The number of a trajectory that no other thread takes.
static int symdyn_next_motion(int *next) {
#if defined(__CUDACC__)
    return atomicAdd(next, 1);
#else
    return (*next)++;
#endif
}

// Begin trajectory i. numbers: its parameters, constants and inputs, one after the other, which have to stay.
static void symdyn_begin_motion(const symdyn_motions *motions, long i, double *numbers, symdyn_run *run) {
    const symdyn_table x = motions->given[0], inputs = motions->given[1], p = motions->given[2], length = motions->given[3];
    double *const c = numbers + SYMDYN_NP, *const u = c + SYMDYN_NC, x0[SYMDYN_NX];
    for (int k = 0; k < SYMDYN_NX; k++) x0[k] = x.at[i * x.row + k * x.entry];
    for (int k = 0; k < SYMDYN_NIN; k++) u[k] = inputs.at[i * inputs.row + k * inputs.entry];
    for (int k = 0; k < SYMDYN_NP; k++) numbers[k] = p.at[i * p.row + k * p.entry];
    const int code = SYMDYN_NAME(prologue)(numbers, c);
    const symdyn_problem problem = {
        .p = numbers,
        .c = c,
        .inputs = u,
        .n_pieces = motions->n_pieces,
        .breaks = motions->breaks,
        .pieces = motions->pieces,
        .n_stops = motions->n_stops,
        .stops = motions->stops,
        .project = motions->project,
        .length = length.at[i * length.row],
    };
    SYMDYN_NAME(simulation_start)(run, &problem, motions->span, x0, motions->atol);
#if SYMDYN_EVENTS
    if (motions->look) SYMDYN_NAME(simulation_look)(run, motions->look, motions->event_spacing);
#endif
    if (code || !symdyn_all_finite(c, SYMDYN_NC)) {
        run->status = SYMDYN_NO_CONSTANTS;
        run->reason = code ? code : SYMDYN_NOT_FINITE;
    }
}

// One loop for all that a thread does, so that the threads of a warp attempt their steps together wherever their motions are.
SYMDYN_KERNEL void SYMDYN_NAME(motions)(symdyn_motions motions) {
    symdyn_run run;
    double numbers[SYMDYN_NUMBERS];
    long i = -1, written = 0, left = 0;
    int doubts = 0;
    for (;;) {
        if (i < 0) {
            i = symdyn_next_motion(motions.next);
            if (i >= motions.n) return;
            symdyn_begin_motion(&motions, i, numbers, &run);
            written = 0;
            left = motions.max_steps;
            doubts = 0;
        }
        const int failure = run.status < 0
            ? 0
            : symdyn_serve(&run, motions.t_out, motions.n_out, motions.x_out + i * motions.n_out * SYMDYN_NX, &written);
        if (failure) run.status = failure;
#if SYMDYN_EVENTS
        if (run.status != SYMDYN_STEP_LIMIT || (motions.max_steps - left) % motions.events_taken_after == 0)
            symdyn_drop_events(&run, &doubts);
#endif
        if (run.status == SYMDYN_STEP_LIMIT && left > 0) {
            left--;
            symdyn_attempt(&run);
        } else {
            motions.doubts[i] = doubts;
#if SYMDYN_EVENTS
            if (run.status == SYMDYN_STOPPED && motions.n_out == 1)  // where the end alone is kept, that is where it ended
                for (; written < 1; written++)
                    for (int k = 0; k < SYMDYN_NX; k++) motions.x_out[i * SYMDYN_NX + k] = run.x[k];
#endif
            for (; written < motions.n_out; written++)  // what was not reached
                for (int k = 0; k < SYMDYN_NX; k++) motions.x_out[(i * motions.n_out + written) * SYMDYN_NX + k] = 0.0 / 0.0;
            SYMDYN_NAME(simulation_report)(&run, motions.reports + i, motions.states + i * 2 * SYMDYN_NX);
            i = -1;
        }
    }
}
