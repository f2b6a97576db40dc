// Right-hand sides of many states, a thread each: kernels in CUDA C; in C one thread computes them all. The model gives
// symdyn_one, the right-hand side of one state.
#pragma once

#include "kernel.h"
#include "prelude.h"
#include "states_type.h"

SYMDYN_KERNEL void SYMDYN_NAME(constants)(symdyn_state_rows rows);
SYMDYN_KERNEL void SYMDYN_NAME(states)(symdyn_state_rows rows);

#if defined(__CUDACC__)
#define SYMDYN_FIRST ((long)blockIdx.x * blockDim.x + threadIdx.x)
#define SYMDYN_EVERY ((long)gridDim.x * blockDim.x)
#else
#define SYMDYN_FIRST 0
#define SYMDYN_EVERY 1
#endif

// Constants that follow from one set of parameters, which out is to have. Returns what the prologue does.
static int symdyn_constants_of(const double *p, double *out) {
    const int code = SYMDYN_NAME(prologue)(p, out);
    return code ? code : symdyn_all_finite(out, SYMDYN_NC) ? 0 : SYMDYN_NOT_FINITE;
}

// Constants of n sets of parameters, given as those of the states; out: constants, codes: those of the function `reason`.
SYMDYN_KERNEL void SYMDYN_NAME(constants)(symdyn_state_rows rows) {
    const symdyn_table parameters = rows.given[3];
    for (long i = SYMDYN_FIRST; i < rows.n; i += SYMDYN_EVERY) {
        double p[SYMDYN_NP + !SYMDYN_NP], c[SYMDYN_NC + !SYMDYN_NC];
        for (int k = 0; k < SYMDYN_NP; k++) p[k] = parameters.at[i * parameters.row + k * parameters.entry];
        rows.codes[i] = symdyn_constants_of(p, c);
        for (int k = 0; k < SYMDYN_NC; k++) rows.out[i * rows.out_row + k * rows.out_entry] = c[k];
    }
}

// Rates of states that cannot be computed are not numbers.
SYMDYN_KERNEL void SYMDYN_NAME(states)(symdyn_state_rows rows) {
    const symdyn_table times = rows.given[0], states = rows.given[1], values = rows.given[2], parameters = rows.given[3];
    for (long i = SYMDYN_FIRST; i < rows.n; i += SYMDYN_EVERY) {
        double x[SYMDYN_NX], xd[SYMDYN_NX], inputs[SYMDYN_NIN + !SYMDYN_NIN], p[SYMDYN_NP + !SYMDYN_NP],
            own[SYMDYN_NC + !SYMDYN_NC];
        int code = rows.failed;
        for (int k = 0; k < SYMDYN_NX; k++) x[k] = states.at[i * states.row + k * states.entry];
        for (int k = 0; k < SYMDYN_NIN; k++) inputs[k] = values.at[i * values.row + k * values.entry];
        for (int k = 0; k < SYMDYN_NP; k++) p[k] = parameters.at[i * parameters.row + k * parameters.entry];
        if (!rows.constants) code = symdyn_constants_of(p, own);
        const double *const c = rows.constants ? rows.constants : own;
        if (!code) code = symdyn_one(times.at[i * times.row], x, inputs, p, c, xd);
        if (!code && !symdyn_all_finite(xd, SYMDYN_NX)) code = SYMDYN_NOT_FINITE;
        for (int k = 0; k < SYMDYN_NX; k++) rows.out[i * rows.out_row + k * rows.out_entry] = code ? 0.0 / 0.0 : xd[k];
        rows.codes[i] = code;
    }
}
