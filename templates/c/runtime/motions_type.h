// What many motions of one mechanism are computed from, and written to.
#pragma once

#include "report_type.h"
#include "table_type.h"

typedef struct {
    long n, n_out, max_steps;           // trajectories; output times; attempted steps of one trajectory, at most
    const symdyn_table *given;          // states, inputs, parameters, lengths that residuals are measured by, m
    const double *span, *atol, *t_out;  // t0, t_end, rtol, first step, largest step; of every state; output times
    long n_pieces;                      // of inputs over time, see problem_type.h
    const double *breaks, *pieces;
    long n_stops;
    const double *stops;
    int project;             // see problem_type.h
    double *x_out, *states;  // states at the output times; two states of every report
    symdyn_report *reports;
    int *next;  // the first trajectory that no thread has taken
} symdyn_motions;
