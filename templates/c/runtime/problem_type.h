// Arguments of the right-hand side in addition to t and x.
#ifndef SYMDYN_PROBLEM_TYPE
#define SYMDYN_PROBLEM_TYPE

// Inputs come from the first of these that is there: a function (returns 0, or not to stop the run), a table over time (piecewise
// cubic, its ends held), constants.
typedef struct {
    const double *p, *c, *inputs;
    long n_pieces;                  // of the table, from breaks[k] to breaks[k + 1],
    const double *breaks, *pieces;  // with, for every input, factors of 1, d, d^2 and d^3, d = t - breaks[k]
    long n_stops;                   // times, increasing, at which inputs may have kinks: steps end there
    const double *stops;
    int (*function)(double t, const double *x, double *inputs);
    int project;    // whether states are kept on what holds for them after every step
    double length;  // that residuals are measured by, m
} symdyn_problem;

#endif
