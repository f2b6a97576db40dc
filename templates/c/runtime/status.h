// Statuses of a run.
#ifndef SYMDYN_STATUS
#define SYMDYN_STATUS

enum {
    // The end is reached; under way: call again to continue; no room for the next step: call again with room; ended by an event.
    SYMDYN_DONE = 0,
    SYMDYN_STEP_LIMIT = 1,
    SYMDYN_STORE_FULL = 2,
    SYMDYN_STOPPED = 3,
    // Failures are negative, and final but for BAD_OUTPUT_TIME. Even at the smallest step:
    SYMDYN_FIELD_FAILED = -1,       // the right-hand side cannot be evaluated
    SYMDYN_STEP_TOO_SMALL = -2,     // the tolerance is not met
    SYMDYN_STATE_NOT_FINITE = -3,   // NaN or Inf
    SYMDYN_BAD_ARGUMENT = -4,       // start: a time, state, tolerance or step makes no sense
    SYMDYN_BAD_OUTPUT_TIME = -5,    // a requested time lies before the latest step
    SYMDYN_PROJECTION_FAILED = -6,  // even at the smallest step, no way back onto the constraints
    SYMDYN_EVENT_FAILED = -7,       // a quantity of an event is not finite
    SYMDYN_EVENT_AT_ONCE = -8,      // events again and again with hardly any time between
    SYMDYN_NO_SERIES = -9,          // there is a right-hand side but no series of it
    SYMDYN_RESET_REJECTED = -10,    // the constraints do not let an entry be what a reset makes it
    SYMDYN_NO_CONSTANTS = -11,      // batches: the constants that follow from the parameters cannot be computed
    SYMDYN_RESET_NOT_SMOOTH = -12   // what the constraints make of a reset has no derivative
};

#endif
