// Contacts of one problem, see cones.h, with the memory that it is solved in.
#pragma once

// Sweeps whose changes are combined, see cones.h.
enum { SYMDYN_CONES_DEPTH = 6 };

typedef struct {
    int n_u;                  // speeds
    long n, most;             // contacts, and how many there is room for
    long most_entries;        // room for columns of J of all contacts
    long most_dense;          // rows up to which a matrix is factorized in memory
    int late;                 // 1: that is for the caller, after sweeps that did not get there
    long *first;              // rows of contact i: first[i] to first[i + 1], at most three
    long *entry;              // columns of contact i: entry[i] to entry[i + 1]
    int *speed;               // of a column
    double *along, *answer;   // three to a column: entries of the rows of J, and of (M^-1 J^T)^T; zeros where there is no row
    int *bounded;             // 1: a contact without a normal row, whose impulses are bounded by friction alone, N s
    double *friction;         // mu of a contact
    double *free, *P, *w;     // by row
    double *d_n, *d_t;        // of a contact: diagonal of D = J M^-1 J^T, the larger eigenvalue of its tangents
    double *block;            // of a contact: D of its own rows, 3 x 3
    double *du;               // n_u
    double *kept, *step;      // by row: impulses to go back to, the right side of a Newton step
    double *before, *change;  // by row: impulses before a sweep, what the one before changed
    double *history;          // 2*SYMDYN_CONES_DEPTH*3*most: differences of changes, of swept impulses
    double *lead;             // by row: how far the next sweep starts from the latest one
    double *dense;            // most_dense*most_dense
    int *state;               // of a contact after a solution: its mode, SYMDYN_OPEN, ...
    long n_sweeps, n_newton;  // done so far
    double residual;          // of the latest solution, m/s
} symdyn_cones;
