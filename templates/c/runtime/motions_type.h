// Arguments and results of many motions of one mechanism.
#pragma once

#include "report_type.h"
#include "table_type.h"
#include "time_type.h"

typedef struct {
    long n, n_out, max_steps;         // trajectories; output times; attempted steps of one trajectory, at most
    const symdyn_table *given;        // of every state, input and parameter, and of the length that residuals are measured by, m
    const symdyn_time *span, *t_out;  // t0, t_end, rtol, first step, largest step; output times
    const double *atol;               // of every state
    long n_pieces;                    // of inputs over time, as those of a symdyn_problem
    const double *breaks, *pieces;
    long n_stops;
    const double *stops;
    int project;                // as that of a symdyn_problem
    const int *look;            // which events to look for; 0: none
    symdyn_time event_spacing;  // of samples of their quantities at the most, s; 0: any
    long events_taken_after;    // attempted steps, as a caller of one run takes them
    double *x_out, *states;     // states at the output times; two states of every report
    symdyn_report *reports;
    int *doubts;  // of every trajectory the sum of the kinds of its doubts, see symdyn_noted
    int *next;    // the first trajectory that no thread has taken
    // Attempts of a thread after all trajectories have been taken, until it puts its own down; 0: any number. Trajectories put
    // down, and their number; those put down before, which are the n trajectories; 0: they begin.
    long turn;
    void *put;
    int *n_put;
    const void *resumed;
} symdyn_motions;
