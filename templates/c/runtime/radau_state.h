// Memory of implicit collocation in a run. Matrices are stored by columns.
#pragma once

typedef struct {
    double z[2][SYMDYN_STAGES][SYMDYN_NX],
        e[2][2][SYMDYN_NX];              // of the latest steps tried and accepted: stages less x; error, gap
    int accepted, tried, warm, current;  // which is accepted; since the start one was tried, accepted; the Jacobian is that at x
    double gap, h_gap, h_quiet;          // of the latest step tried: its gap, its length; of shorter ones gaps are rounding
    double ease, tolerance;  // the estimate is of lower order than the step: ease 10 r^(1/4) of it counts; r/ease, r as rtol
    double eta, theta;       // of Newton's iteration: its error by the latest change, its rate
    double jacobian[SYMDYN_ENTRIES], h_factors;  // length of the step that the factors are for; 0: there are none
    double re[SYMDYN_ROOTS][SYMDYN_FACTORS], im[SYMDYN_ROOTS][SYMDYN_FACTORS];
    int order[SYMDYN_ROOTS][SYMDYN_BAND];
#if SYMDYN_BANDED
    double over[SYMDYN_ROOTS][2];  // one over each root, for the length of the step
#endif
} symdyn_method;
