// A mechanism as time stepping with contacts takes it: functions of the generated code, each with the frame that it reads and
// writes, and memory. All frames read the same t, x and inputs.
#pragma once

typedef struct {
    int n_q, n_u, n_x, n_in, n_c, n_units;  // n_x: with what is integrated besides the state; constraints, unit vectors
    long n_given, n_rows;                   // contacts with a name of their own, and their rows
    const long *given_first;                // rows of these: given_first[i] to given_first[i + 1]
    const int *given_kind;                  // SYMDYN_PLACED, SYMDYN_SPEED or SYMDYN_BOUNDED
    const long *unit_first, *unit_index;    // coordinates that form unit vectors

    int (*field)(void *frame);  // x_dot with all contacts open
    void *field_frame;
    const double *xd;
    int (*gaps)(void *frame);  // gap, static and kinetic friction, restitution of every contact; relative velocities
    void *gaps_frame;
    const double *gap;
    int (*directions)(void *frame);  // J, M^-1 J^T
    void *directions_frame;
    const double *direction;
    int (*position)(void *frame);  // residuals of constraints, the change of q that makes them zero
    void *position_frame;
    const double *position_change;
    int (*velocity)(void *frame);
    void *velocity_frame;
    const double *velocity_change;
    int (*spheres)(void *frame);  // see many.h
    void *spheres_frame;
    const double *sphere;
    int (*function)(double t, const double *x, double *inputs);  // none: inputs are constant
    double *t, *x, *inputs;                                      // what frames read

    // Groups of spheres that touch each other and planes, see many.h.
    int n_groups, n_bodies, n_planes, n_speeds, planar;  // speeds of each of these bodies
    const long *group_of, *plane_group;                  // of each body, of each plane
    const long *speed_of;                                // n_bodies*n_speeds: places of their speeds
    long *cell, *next, *table;                           // n_bodies each, n_table
    long n_table;
    double *was;        // n_bodies*3: centres at the begin of the step
    double *given_was;  // n_given*2: gaps of contacts with a name, and their rates, at the begin of the step
    int passed;         // whether a pair passed through each other, and which; or a contact with a name, and -1
    long passed_a, passed_b;
    double passed_at;

    double tolerance, depth, length;  // of velocities, m/s, of gaps, m; the length of the mechanism, m
    long most_sweeps;                 // of one contact problem
    long rough_sweeps;                // of one to which contacts were just added; 0: as many as of the others
    long step_updates, updates_left;  // contacts of all sweeps in a step, after which its rounds end
    double accepted;                  // change of the last round with contacts, by the size of the state
    int most_rounds;                  // since contacts were added
    double *work;                     // 8*n_x + n_rows + 16*n_given
    double *response;                 // n_bodies*6*n_speeds: M^-1 B^T

    // Contacts of the latest step: places of both bodies, or of the contact and -1; planes come after the bodies.
    long *a, *b, *was_a, *was_b, *sum_a, *sum_b, *old_a, *old_b, *old_from, n_old;
    int *old_state, *broken;
    double *P_old, *basis, *incoming;
    double *P_guess;  // impulses of the pass before, at was_at of each contact; -1: it is new
    long *was_at;
    long n_found;        // contacts of the latest step
    double *at_end;      // n*4: gap, then relative velocities at its end
    double missed;       // by how much the laws are missed at the end of the latest step, m/s
    double worst_depth;  // of all steps so far
    long n_steps, n_rounds, n_evaluations;
    int reason;
} symdyn_moreau;
