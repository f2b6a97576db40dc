// A spline over a grid by de Boor's algorithm.
#pragma once

#include "symdyn_bisection.h"

enum { SYMDYN_SPLINE_DEGREE = 5 };

// Knots along x and y, (n_x + k_x + 1) and (n_y + k_y + 1) of them, degrees k and coefficients (n_x, n_y).
typedef struct {
    const double *x, *y, *c;
    int n_x, n_y, k_x, k_y;
} symdyn_spline;

// The derivative of an order at x, between the knots m and m + 1, from the coefficients m - k to m, which are overwritten.
static double symdyn_de_boor(const double *t, int k, int m, double *c, double x, int order) {
    for (int p = 0; p < order; p++)
        for (int j = k; j > p; j--) c[j] = (k - p) * (c[j] - c[j - 1]) / (t[m + j - p] - t[m - k + j]);
    for (int r = 1; r <= k - order; r++)
        for (int j = k; j >= order + r; j--) {
            const double low = t[m - k + j];
            c[j] = c[j - 1] + (x - low) / (t[m + j - order - r + 1] - low) * (c[j] - c[j - 1]);
        }
    return c[k];
}

// A derivative of a spline; beyond its ends the polynomials of the ends go on.
static double symdyn_grid_spline(const symdyn_spline *grid, double x, double y, int order_x, int order_y) {
    const int k = grid->k_x, other = grid->k_y;
    const int m = symdyn_interval(grid->x, k, grid->n_x, x), n = symdyn_interval(grid->y, other, grid->n_y, y);
    double lines[SYMDYN_SPLINE_DEGREE + 1];
    for (int i = 0; i <= k; i++) {
        const double *row = grid->c + (m - k + i) * grid->n_y + n - other;
        double c[SYMDYN_SPLINE_DEGREE + 1];
        for (int j = 0; j <= other; j++) c[j] = row[j];
        lines[i] = symdyn_de_boor(grid->y, other, n, c, y, order_y);
    }
    return symdyn_de_boor(grid->x, k, m, lines, x, order_x);
}
