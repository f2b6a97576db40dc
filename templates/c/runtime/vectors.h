// Vectors with a state in each lane.
#pragma once

#include "table_type.h"
#include "vector_type.h"

#undef MADD
#define MADD(a, b, c) symdyn_each_madd(VECTOR(a), VECTOR(b), VECTOR(c))

// A state in each lane, with its parameters, constants and inputs.
typedef struct {
    symdyn_vector x[SYMDYN_NX], p[SYMDYN_NP + !SYMDYN_NP], c[SYMDYN_NC + !SYMDYN_NC], inputs[SYMDYN_NIN + !SYMDYN_NIN];
} symdyn_states;
