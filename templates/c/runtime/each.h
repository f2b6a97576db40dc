// Sums of products of numbers and vectors, for derivatives along directions.
#pragma once

#include "vector_type.h"

// a*b + c of numbers and vectors.
#define MADD_EACH(a, b, c) symdyn_each_madd(VECTOR(a), VECTOR(b), VECTOR(c))
