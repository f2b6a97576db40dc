// Intervals of splines.
#pragma once

// Index of the lower one of the growing numbers t between which x lies, from low to high - 1; beyond the ends that of the end.
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
