// Report of a run.
#ifndef SYMDYN_REPORT_TYPE
#define SYMDYN_REPORT_TYPE

typedef struct {
    int status;                               // SYMDYN_DONE, SYMDYN_STEP_LIMIT, ..., or a failure
    double t, h;                              // present time; length of the step to be tried next
    long n_steps, n_rejected, n_evaluations;  // accepted steps, attempts given up, calls of the right-hand side
    // The latest evaluation that failed. reason: what a function returned, 0: results that are not finite, or a correction too
    // far; bad_index: the first state that is not finite, or the constraint of the largest residual; or -1.
    int reason;
    long bad_index;
    double t_fail;
    double residual;  // of that constraint, m, or of_speeds, m/s
    int of_speeds;
    double reset_gap;                    // by how much a reset that the constraints do not allow is off
    double largest_dq, largest_du;       // largest changes by projections after a step, norms
    double largest_moved, t_moved;       // the largest in tolerances, and when
    long n_corrected, n_corrections;     // steps whose end was moved, calls of the corrections
    long n_jacobians, n_factorizations;  // of implicit methods
    long n_divided, n_rough;             // gauss: steps that were divided; those done again by halves that differ
    double t_rough;                      // the latest of these
} symdyn_report;

#endif
