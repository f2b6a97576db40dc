// Right-hand sides of many states at once. The model gives symdyn_lanes_rhs, which returns the lanes where it cannot be computed
// on vectors, and symdyn_one, the same of one state.
#pragma once

#include "vectors.h"

// Parameters, constants and inputs of one state, one after the other.
enum { SYMDYN_NUMBERS = SYMDYN_NP + SYMDYN_NC + SYMDYN_NIN + !(SYMDYN_NP + SYMDYN_NC + SYMDYN_NIN) };

SYMDYN_EXPORT int SYMDYN_NAME(batch_width)(void);
SYMDYN_EXPORT long SYMDYN_NAME(rhs_batch)(long n, const symdyn_table *given, double *out, const long *out_steps, int *codes);

// Number of lanes; 1: the compiler has no vectors.
SYMDYN_EXPORT int SYMDYN_NAME(batch_width)(void) { return SYMDYN_WIDTH; }

// Parameters and inputs of a trajectory into a lane; of the last one for lanes that are left over. Returns what the prologue
// does.
static int symdyn_lanes_take(symdyn_states *lanes, int l, long i, symdyn_table inputs, symdyn_table p, double *numbers) {
    double *c = numbers + SYMDYN_NP, *u = c + SYMDYN_NC;
    for (int k = 0; k < SYMDYN_NP; k++) numbers[k] = p.at[i * p.row + k * p.entry];
    const int code = SYMDYN_NAME(prologue)(numbers, c);
    for (int k = 0; k < SYMDYN_NIN; k++) u[k] = LANE(lanes->inputs[k], l) = inputs.at[i * inputs.row + k * inputs.entry];
    for (int k = 0; k < SYMDYN_NP; k++) LANE(lanes->p[k], l) = numbers[k];
    for (int k = 0; k < SYMDYN_NC; k++) LANE(lanes->c[k], l) = c[k];
    return code ? code : symdyn_all_finite(c, SYMDYN_NC) ? 0 : SYMDYN_NOT_FINITE;
}

// The right-hand side of n states. codes: of each, what the function `reason` explains; returns how many are not 0.
// given: t, x (SYMDYN_NX), inputs (SYMDYN_NIN), p (SYMDYN_NP); out_steps: from state to state, from entry to entry.
SYMDYN_EXPORT long SYMDYN_NAME(rhs_batch)(long n, const symdyn_table *given, double *out, const long *out_steps, int *codes) {
    const symdyn_table t = given[0], x = given[1], inputs = given[2], p = given[3];
    double numbers[SYMDYN_WIDTH][SYMDYN_NUMBERS], one[SYMDYN_NX], result[SYMDYN_NX];
    int prologue[SYMDYN_WIDTH] = {0};
    symdyn_states lanes;
    long n_failed = 0;
    for (long first = 0; first < n; first += SYMDYN_WIDTH) {
        const int contiguous = x.row == 1 && out_steps[0] == 1 && first + SYMDYN_WIDTH <= n;
        symdyn_vector times = VECTOR(0.0), xd[SYMDYN_NX], rest = VECTOR(0.0);  // not a number where a result is not finite
        long long any = 0;
        for (int l = 0; l < SYMDYN_WIDTH; l++) {
            const long i = first + l < n ? first + l : n - 1;
            if (first == 0 || inputs.row || p.row) prologue[l] = symdyn_lanes_take(&lanes, l, i, inputs, p, numbers[l]);
            LANE(times, l) = t.at[i * t.row];
            if (!contiguous)
                for (int k = 0; k < SYMDYN_NX; k++) LANE(lanes.x[k], l) = x.at[i * x.row + k * x.entry];
        }
        if (contiguous)
            for (int k = 0; k < SYMDYN_NX; k++) lanes.x[k] = *(const symdyn_anywhere *)(x.at + first + k * x.entry);
        symdyn_lanes fault = symdyn_lanes_rhs(&lanes, times, lanes.x, xd);
        for (int k = 0; k < SYMDYN_NX; k++) rest = MADD(xd[k], 0.0, rest);
        fault |= NOT_ZERO(rest);
        for (int l = 0; l < SYMDYN_WIDTH; l++) any |= LANE(fault, l) | prologue[l];
        if (contiguous && !any) {
            for (int k = 0; k < SYMDYN_NX; k++) *(symdyn_anywhere *)(out + first + k * out_steps[1]) = xd[k];
            continue;  // codes are zeros
        }
        for (int l = 0; l < SYMDYN_WIDTH && first + l < n; l++) {
            double *to = out + (first + l) * out_steps[0];
            int code = prologue[l];
            if (!code && LANE(fault, l)) {
                const double *own = numbers[l], *c = own + SYMDYN_NP, *u = c + SYMDYN_NC;
                for (int k = 0; k < SYMDYN_NX; k++) one[k] = LANE(lanes.x[k], l);
                code = symdyn_one(LANE(times, l), one, u, own, c, result);
                if (!code && !symdyn_all_finite(result, SYMDYN_NX)) code = SYMDYN_NOT_FINITE;
                for (int k = 0; k < SYMDYN_NX; k++) LANE(xd[k], l) = result[k];
            }
            for (int k = 0; k < SYMDYN_NX; k++) to[k * out_steps[1]] = code ? 0.0 / 0.0 : LANE(xd[k], l);
            codes[first + l] = code;
            n_failed += code != 0;
        }
    }
    return n_failed;
}
