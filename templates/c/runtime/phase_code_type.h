// Generated code that integrates phases of a motion, with the memory of its run; see start.h, simulate.h and events.h. p and c
// are the parameters and constants of its problem.
#pragma once

typedef struct {
    int (*prologue)(const double *p, double *c);
    int (*start)(void *memory, const void *problem, const double *span, const double *x0, const double *atol);
    int (*go)(void *memory, int every, long max_steps, double *t, long n, double *x, long *written);
    void (*look)(void *memory, const int *look, double spacing);
    long (*take)(void *memory, void *noted, double *states);
    void (*report)(const void *memory, void *report, double *states);
    void *memory, *problem;
    double *p, *c;
    int n_constants;
} symdyn_phase_code;
