// Vectors with a state in each lane.
#pragma once

#include "table_type.h"
#include "vector_type.h"

// Rows become vectors, and vectors rows, by exchanges of neighbours, which gcc finds only so; it is left out elsewhere, since it
// fuses products of numbers with sums although contraction is off, but not those of vectors.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("tree-slp-vectorize")
#endif

#undef MADD
#define MADD(a, b, c) symdyn_each_madd(VECTOR(a), VECTOR(b), VECTOR(c))

// A state in each lane, with its parameters, constants and inputs.
typedef struct {
    symdyn_vector x[SYMDYN_NX], p[SYMDYN_NP + !SYMDYN_NP], c[SYMDYN_NC + !SYMDYN_NC], inputs[SYMDYN_NIN + !SYMDYN_NIN];
} symdyn_states;
