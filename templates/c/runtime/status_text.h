// Statuses of a run as text.
#ifndef SYMDYN_STATUS_TEXT
#define SYMDYN_STATUS_TEXT

#include "status.h"

static inline const char *symdyn_status_text(int status) {
    switch (status) {
    case SYMDYN_DONE:
        return "the end is reached";
    case SYMDYN_STEP_LIMIT:
        return "the run is under way";
    case SYMDYN_STORE_FULL:
        return "there is no room for the next step";
    case SYMDYN_STOPPED:
        return "an event ended the run";
    case SYMDYN_FIELD_FAILED:
        return "the right-hand side cannot be evaluated";
    case SYMDYN_STEP_TOO_SMALL:
        return "the step became too small for the tolerance";
    case SYMDYN_STATE_NOT_FINITE:
        return "a state is not finite";
    case SYMDYN_BAD_ARGUMENT:
        return "a time, state or tolerance makes no sense";
    case SYMDYN_BAD_OUTPUT_TIME:
        return "the time lies before the latest step";
    case SYMDYN_PROJECTION_FAILED:
        return "there is no way back onto the constraints";
    case SYMDYN_EVENT_FAILED:
        return "a quantity of an event is not finite";
    case SYMDYN_EVENT_AT_ONCE:
        return "events follow each other with hardly any time between";
    case SYMDYN_NO_SERIES:
        return "the right-hand side has no Taylor series";
    case SYMDYN_RESET_REJECTED:
        return "the constraints do not allow what a reset makes of a state";
    case SYMDYN_NO_CONSTANTS:
        return "the constants that follow from the parameters cannot be computed";
    case SYMDYN_RESET_NOT_SMOOTH:
        return "what the constraints make of a reset has no derivative";
    default:
        return "unknown status";
    }
}

#endif
