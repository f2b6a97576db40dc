// Polynomials piece by piece.
#pragma once

#include "symdyn_bisection.h"

// A derivative of n pieces between breaks, each with degree + 1 coefficients, from the highest; beyond the ends those of the ends
// go on.
static double symdyn_line_spline(const double *breaks, const double *coefficients, int n, int degree, double x, int order) {
    const int piece = symdyn_interval(breaks, 0, n, x);
    const double at = x - breaks[piece], *c = coefficients + (degree + 1) * piece;
    double value = 0.0;
    for (int k = 0; k <= degree - order; k++) {
        double factor = 1.0;
        for (int power = degree - k - order + 1; power <= degree - k; power++) factor *= power;
        value = value * at + factor * c[k];
    }
    return value;
}
