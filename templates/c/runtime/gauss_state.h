// Memory of Gauss collocation in a run.
#pragma once

typedef struct {
    double L[SYMDYN_STAGES][SYMDYN_NX], h_L;    // slopes of the latest step times h and the weights; h, 0: there are none
    double low[SYMDYN_NX], low_new[SYMDYN_NX];  // what rounding has cut off the start and the end of the step
    double t_first, h_whole;                    // where the constant steps began, their length
    long n_whole, n_given_up, fixed;            // how many of them were begun, were given up; whether their length was requested
    double from, ratio, E[SYMDYN_STAGES][SYMDYN_STAGES];  // what the latest extrapolation of slopes was for, its matrix
    long n_halved, n_rough;                               // steps that were done again by halves; whose ends differ
    double t_rough;                                       // the latest of these, or of those given up
} symdyn_method;
