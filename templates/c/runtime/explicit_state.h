// Memory of an embedded explicit Runge-Kutta pair in a run.
#pragma once

typedef struct {
    double k[SYMDYN_SLOPES][SYMDYN_NX];     // stages of the latest step; k[SYMDYN_STAGES] at its end
    double dense[SYMDYN_DENSE][SYMDYN_NX];  // polynomial of the latest step, if dense_ready
    int rough;                              // whether it is not good enough
} symdyn_method;
