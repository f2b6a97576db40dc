// Functions of the integrator that others call, explained where they are defined. A run is memory of simulation_size bytes, on a
// multiple of 64.
#pragma once

#if SYMDYN_EVENTS
#include "noted_type.h"
#endif
#include "problem.h"
#include "report_type.h"
#include "time_type.h"

SYMDYN_EXPORT long SYMDYN_NAME(simulation_size)(void);
SYMDYN_EXPORT int SYMDYN_NAME(simulation_start)(
    void *memory, const symdyn_problem *problem, const symdyn_time *span, const double *x0, const double *atol);
SYMDYN_EXPORT int SYMDYN_NAME(simulation_go)(
    void *memory, int every, long max_steps, symdyn_time *t, long n, double *x, long *written);
SYMDYN_EXPORT void SYMDYN_NAME(simulation_report)(const void *memory, symdyn_report *report, double *states);
#if SYMDYN_EVENTS
SYMDYN_EXPORT void SYMDYN_NAME(simulation_look)(void *memory, const int *look, double spacing);
SYMDYN_EXPORT void SYMDYN_NAME(simulation_carry)(void *memory, const double *known, int reset);
SYMDYN_EXPORT int SYMDYN_NAME(simulation_reset)(void *memory, const int *fired, double *after);
SYMDYN_EXPORT long SYMDYN_NAME(simulation_events)(void *memory, symdyn_noted *noted, double *states);
#endif
