// Arguments and results of many motions in SIMD lanes.
#ifndef SYMDYN_BATCH_TYPE
#define SYMDYN_BATCH_TYPE

#include "report_type.h"
#include "table_type.h"

typedef struct {
    long n, n_out;                       // motions; output times
    const symdyn_table *x, *inputs, *p;  // of every motion: its state at the start, inputs, parameters
    const symdyn_table *lengths;         // with constraints: that residuals are measured by, m
    const symdyn_table *tolerances;      // with sensitivities, in place of atol: absolute tolerances of every motion
    const double *span, *atol, *t_out;   // t0, t_end, rtol, first step, largest step; of every state; output times
    // Inputs over time, the same for all, with pieces and stops as those of a symdyn_problem; n_pieces 0: constants.
    long n_pieces;
    const double *breaks, *pieces;
    long n_stops;
    const double *stops;
    const int *look;          // which events to look for; 0: none
    double event_spacing;     // of samples of their quantities at the most, s; 0: any
    long events_taken_after;  // attempted steps, as a caller of one run takes them
    double *x_out, *states;   // states at the output times; two states of every report
    symdyn_report *reports;
    int *doubts;  // with events, zeros: of every motion the sum of the kinds of its doubts, see symdyn_noted
} symdyn_batch_motions;

#endif
