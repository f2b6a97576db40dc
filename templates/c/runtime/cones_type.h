// Contacts of one problem, see cones.h, with the memory that it is solved in.
#pragma once

typedef struct {
    int n_u;                       // speeds
    long n, most;                  // contacts, and how many there is room for
    long most_entries;             // room for nonzero entries of J
    long most_dense;               // rows up to which a matrix is factorized in memory
    long *first;                   // rows of contact i: first[i] to first[i + 1]
    long *entry;                   // entries of row r: entry[r] to entry[r + 1]
    long *speed;                   // of an entry
    double *along, *answer;        // entries of J and of (M^-1 J^T)^T
    int *bounded;                  // 1: a contact without a normal row, whose impulses are bounded by friction alone, N s
    double *friction;              // mu of a contact
    double *free, *P, *w;          // by row
    double *d_n, *d_t;             // of a contact: diagonal of D = J M^-1 J^T, the larger eigenvalue of its tangents
    double *block;                 // of a contact: D of its own rows, 3 x 3
    double *du;                    // n_u
    double *kept, *step, *before;  // by row: impulses to go back to, a direction, impulses before a sweep
    double *dense;                 // most_dense*most_dense
    long *active;                  // rows of a Newton step
    int *state;                    // of a contact after a solution: 0 open, 1 sticking, 2 sliding
    long n_sweeps, n_newton;       // done so far
    double residual;               // of the latest solution, m/s
} symdyn_cones;
