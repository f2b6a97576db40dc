// Integration of many trajectories, each with its own steps, by one thread each: a kernel in CUDA C; in C one thread integrates
// them all. A thread that is through takes the next trajectory, so that none waits for the longest motion of its warp; when there
// is none left, those under way are put down after a while, and the next launch goes on with them, side by side in as few warps.
#pragma once

#include "kernel.h"
#include "motions_type.h"
#include "simulate.h"
#if SYMDYN_EVENTS
#include "dropped_events.h"
#endif

enum { SYMDYN_NUMBERS = SYMDYN_NP + SYMDYN_NC + SYMDYN_NIN + !(SYMDYN_NP + SYMDYN_NC + SYMDYN_NIN) };

// A trajectory under way: what the thread that puts it down leaves to another one.
typedef struct {
    symdyn_run run;
    double numbers[SYMDYN_NUMBERS];  // parameters, constants and inputs, one after the other
    long i, written, left;           // its number, < 0: there is none; output times that were written; attempts that are left
    int doubts;
} symdyn_motion;

SYMDYN_KERNEL void SYMDYN_NAME(motions)(symdyn_motions motions);
SYMDYN_KERNEL void SYMDYN_NAME(motion_size)(symdyn_motions motions);

// A number that no other thread gets, counted up from 0.
static int symdyn_next_number(int *next) {
#if defined(__CUDACC__)
    return atomicAdd(next, 1);
#else
    return (*next)++;
#endif
}

// Begin trajectory i.
static void symdyn_begin_motion(const symdyn_motions *motions, long i, symdyn_motion *own) {
    double *const numbers = own->numbers;
    symdyn_run *const run = &own->run;
    own->i = i;
    own->written = 0;
    own->left = motions->max_steps;
    own->doubts = 0;
    const symdyn_table *const x = motions->given, *const inputs = x + SYMDYN_NX, *const p = inputs + SYMDYN_NIN;
    double *const c = numbers + SYMDYN_NP, *const u = c + SYMDYN_NC, x0[SYMDYN_NX];
    for (int k = 0; k < SYMDYN_NX; k++) x0[k] = x[k].at[i * x[k].row];
    for (int k = 0; k < SYMDYN_NIN; k++) u[k] = inputs[k].at[i * inputs[k].row];
    for (int k = 0; k < SYMDYN_NP; k++) numbers[k] = p[k].at[i * p[k].row];
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
        .length = p[SYMDYN_NP].at[i * p[SYMDYN_NP].row],
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

// Take the next trajectory; returns whether there is one.
static int symdyn_take_motion(const symdyn_motions *motions, symdyn_motion *own) {
    const int next = symdyn_next_number(motions->next);
    if (next >= motions->n) return 0;
    if (!motions->resumed) {
        symdyn_begin_motion(motions, next, own);
        return 1;
    }
    *own = ((const symdyn_motion *)motions->resumed)[next];
    own->run.problem.p = own->numbers;
    own->run.problem.c = own->numbers + SYMDYN_NP;
    own->run.problem.inputs = own->numbers + SYMDYN_NP + SYMDYN_NC;
    return 1;
}

// Write what has become of a trajectory.
static void symdyn_end_motion(const symdyn_motions *motions, symdyn_motion *own) {
    double *const x = motions->x_out + own->i * motions->n_out * SYMDYN_NX;
    motions->doubts[own->i] = own->doubts;
#if SYMDYN_EVENTS
    if (own->run.status == SYMDYN_STOPPED && motions->n_out == 1)  // where the end alone is kept, that is where it ended
        for (; own->written < 1; own->written++)
            for (int k = 0; k < SYMDYN_NX; k++) x[k] = own->run.x[k];
#endif
    for (; own->written < motions->n_out; own->written++)  // what was not reached
        for (int k = 0; k < SYMDYN_NX; k++) x[own->written * SYMDYN_NX + k] = 0.0 / 0.0;
    SYMDYN_NAME(simulation_report)(&own->run, motions->reports + own->i, motions->states + own->i * 2 * SYMDYN_NX);
    own->i = -1;
}

// An attempt of a step, with what comes before and after, so that threads of a warp attempt their steps together wherever their
// trajectories are. Returns whether the thread goes on. turn: attempts until it puts its trajectory down.
static int symdyn_advance(const symdyn_motions *motions, symdyn_motion *own, long *turn) {
    if (own->i < 0 && !symdyn_take_motion(motions, own)) return 0;
    symdyn_run *const run = &own->run;
    const int failure = run->status < 0
        ? 0
        : symdyn_serve(run, motions->t_out, motions->n_out, motions->x_out + own->i * motions->n_out * SYMDYN_NX, &own->written);
    if (failure) run->status = failure;
#if SYMDYN_EVENTS
    if (run->status != SYMDYN_STEP_LIMIT || (motions->max_steps - own->left) % motions->events_taken_after == 0)
        symdyn_drop_events(run, &own->doubts);
#endif
    if (run->status != SYMDYN_STEP_LIMIT || own->left == 0) {
        symdyn_end_motion(motions, own);
        return 1;
    }
    own->left--;
    symdyn_attempt(run);
    if (!motions->turn || *(const volatile int *)motions->next < motions->n) return 1;
    if (--*turn > 0 || run->status != SYMDYN_STEP_LIMIT) return 1;
    ((symdyn_motion *)motions->put)[symdyn_next_number(motions->n_put)] = *own;
    return 0;
}

SYMDYN_KERNEL void SYMDYN_NAME(motions)(symdyn_motions motions) {
    symdyn_motion own;
    long turn = motions.turn;
    own.i = -1;
    while (symdyn_advance(&motions, &own, &turn)) continue;
}

// Bytes of a trajectory that is put down, into n_put.
SYMDYN_KERNEL void SYMDYN_NAME(motion_size)(symdyn_motions motions) { *motions.n_put = (int)sizeof(symdyn_motion); }
