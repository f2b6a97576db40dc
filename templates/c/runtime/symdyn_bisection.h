// Intervals of splines.
#pragma once

// Between which of the growing numbers t x lies, the place of the lower one, from low to high - 1; beyond the ends those of the
// ends.
static int symdyn_interval(const double *t, int low, int high, double x) {
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (x >= t[middle])
            low = middle;
        else
            high = middle;
    }
    return low;
}
