// A motion with rigid contacts that goes from phase to phase in C, see hybrid.h. All frames read the same t, x, inputs and p.
#pragma once

#include "noted_type.h"

typedef struct {
    // The mechanism. Data of every contact: its first row, their number, whether the first one is a normal one, indices in p of
    // the marks that it is closed, that it sticks, of the sign of its slip, and the events that end its modes, of every kind in
    // turn; -1: there is none.
    int n_q, n_u, n_state, n_x, n_p, n_contacts, n_rows, n_events;  // n_x: with the work of the loads
    const int *first, *rows, *normal, *closed_at, *sticking_at, *sliding_at, *event;
    int shared_at;  // place in p of the softness of rows that depend on each other

    void *open, *closed;  // the code of phases in which all contacts are open, and of all others; none: not made so far
    int (*contacts)(void *frame);
    void *contacts_frame;
    const double *of_contacts;  // see Numbers in symdyn/runtime/integrating/contacts.py
    int (*contacts_prologue)(const double *p, double *c);
    double *contacts_c;
    int n_contacts_c;
    int (*events)(void *frame);  // none: no contact is ever ignored
    void *events_frame;
    const double *of_events;
    int (*events_prologue)(const double *p, double *c);
    double *events_c;
    int n_events_c;
    int (*rate)(void *frame);  // x_dot in the modes of rate_p; none: not made so far
    void *rate_frame;
    const double *of_rate;
    int (*rate_prologue)(const double *p, double *c);
    double *rate_p, *rate_c;
    int n_rate_c;
    double *t_now, *x_now, *p;  // what frames read

    // The run, and the constants of its laws.
    double begin, end, same, rtol, first_step, max_step, spacing;
    const double *atol;
    long most_steps;  // attempted, of one phase, and of one call
    double touching, together, missed, no_speed, noise, dependent, different, kept, energy;
    double shortest_flight, resolved_flight, lowest_flight, resolved_approach, far;

    // Beginnings of slips, see symdyn/runtime/integrating/slip_begins.py.
    double tolerated, rounded, shortest, resolved, guess, longest, grows, larger;
    int guesses;

    // Where it is: before a switch, if it begins or events have fired, else before a phase.
    double t, size;
    double *x;
    int begins, n_fired;
    int *fired;                  // events, places of the module's
    int *mode, *still, *passed;  // of every contact; whether it does not slip; whether it is ignored while open
    int *slipping;               // whether its slip begins, so that its direction is held
    double *sign;                // of its slip, 0: none
    double *left;                // when it opened since nothing pressed it; -infinity: it did not
    int *old_mode, *old_still, *old_passed, *ruled_out, *look, *leaves;
    symdyn_noted *noted;  // of a phase
    double *old_sign, *old_x, *noted_states, *states, *ahead;

    // Results. Output times with states; phases with their begin, end, parameters, modes, and how many output times,
    // events and impacts there are by their end; events and impacts.
    double *times, *out;
    long n_times, n_written;
    long n_phases, most_phases, n_happened, most_happened, n_impacts, most_impacts;
    double *phase_begin, *phase_end, *phase_p;
    int *phase_mode;
    long *phase_written, *phase_happened, *phase_impacts;
    int *happened;
    double *happened_t, *happened_states;  // states before and after it
    double *impact_t, *impact;             // impulses, velocities before and after it
    long n_steps, n_rejected, n_evaluations, n_corrected, n_corrections, n_jacobians, n_factorizations;
    double largest_dq, largest_du, next_step;
} symdyn_hybrid;
