// Complex numbers by their parts.
#pragma once

#include "prelude.h"

// 1/(a + i b), in place.
static inline void symdyn_invert(double *a, double *b) {
    const double part = fabs(*a) + fabs(*b), u = *a / part, v = *b / part, size = part * (u * u + v * v);
    *a = u / size;
    *b = -v / size;
}
