// Vectors of doubles. A vector has as many lanes as the processor's registers; without vectors in the compiler it is one number.
#pragma once

#include "prelude.h"

#if defined(__GNUC__) && !defined(__TINYC__)
#if defined(__AVX512F__)
#define SYMDYN_WIDTH 8
#elif defined(__AVX__)
#define SYMDYN_WIDTH 4
#else
#define SYMDYN_WIDTH 2
#endif
typedef double symdyn_vector __attribute__((vector_size(8 * SYMDYN_WIDTH)));
typedef double symdyn_anywhere __attribute__((vector_size(8 * SYMDYN_WIDTH), aligned(8), may_alias));
typedef long long symdyn_lanes __attribute__((vector_size(8 * SYMDYN_WIDTH)));
#define VECTOR(a) ((a) - (symdyn_vector){0.0})
#define LANE(v, l) ((v)[l])
#else
#define SYMDYN_WIDTH 1
typedef double symdyn_vector, symdyn_anywhere;
typedef long long symdyn_lanes;
#define VECTOR(a) (a)
#define LANE(v, l) ((&(v))[l])
#endif
#define NOT_POSITIVE(a) (symdyn_lanes)(((a) > 0.0) == 0)
#define NOT_ZERO(a) (symdyn_lanes)((a) != 0.0)

// a*b + c, rounded as that of numbers.
static inline __attribute__((always_inline)) symdyn_vector symdyn_each_madd(symdyn_vector a, symdyn_vector b, symdyn_vector c) {
#if SYMDYN_WIDTH > 1 && (defined(__FMA__) || defined(__ARM_FEATURE_FMA))
    for (int l = 0; l < SYMDYN_WIDTH; l++) LANE(c, l) = __builtin_fma(LANE(a, l), LANE(b, l), LANE(c, l));
    return c;
#else
    return MADD(a, b, c);
#endif
}
