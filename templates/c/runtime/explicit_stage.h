// Embedded explicit Runge-Kutta pair. Its coefficients are macros: SYMDYN_A_j(k, i) is the sum of products with slopes k of entry
// i for stage j, SYMDYN_C_j(t, h, t_new) its time, SYMDYN_B the slope of the step, SYMDYN_E and SYMDYN_SECOND differences to the
// solutions that the error is taken from, SYMDYN_D_j rows of the dense output; the newest stage comes last: other products are
// done while the right-hand side is still busy.
#pragma once

#include "run.h"

// Stage j: where it is evaluated, then its slope.
#define SYMDYN_STAGE(j)                                                                                                          \
    for (int i = 0; i < SYMDYN_NX; i++) y[i] = x[i] + h * (SYMDYN_A_##j(k, i));                                                  \
    if ((failure = symdyn_eval(run, SYMDYN_C_##j(t, h, t_new), y, k[j]))) return failure;
