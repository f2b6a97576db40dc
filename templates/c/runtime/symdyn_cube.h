// Part of the unit cube under water.
#pragma once

#include "prelude.h"

// Part of the square |x|, |y| <= 1/2 where a (x + 1/2) + b (y + 1/2) < s, for a >= b >= 0.
// m: integrals of 1, x, y, x^2, x y, y^2; ends: (1, x, y, h) at both Gauss points of the line inside. Returns half its height.
static double symdyn_cube_corner(double a, double b, double s, double h, double m[6], double ends[2][4]) {
    // Counted from a corner, it is as wide as the square below y0; then its width falls from w0 to w1 at y1.
    double y0 = 1.0, y1 = 1.0, w0 = 1.0, w1 = 1.0;
    if (s <= 0.0)
        y0 = y1 = 0.0;
    else if (s < a + b) {
        y0 = s > a ? (s - a) / b : 0.0;
        w0 = s > a ? 1.0 : s / a;
        y1 = s < b ? s / b : 1.0;
        w1 = s < b ? 0.0 : (s - b) / a;
    }
    const double dy = 0.5 * (y1 - y0);
    const double below[6] = {y0, 0.0, 0.5 * y0 * (y0 - 1.0), y0 / 12.0, 0.0, y0 * (3.0 + y0 * (4.0 * y0 - 6.0)) / 12.0};
    for (int k = 0; k < 2; k++) {
        const double share = k ? 0.7886751345948129 : 0.21132486540518713;  // (1 +- 1/sqrt(3))/2
        const double w = w0 + (w1 - w0) * share, y = y0 + (y1 - y0) * share - 0.5, first = 0.5 * w * (w - 1.0);
        const double part[6] = {
            dy * w, dy * first, dy * w * y, dy * w * (3.0 + w * (4.0 * w - 6.0)) / 12.0, dy * first * y, dy * w * y * y};
        for (int i = 0; i < 6; i++) m[i] = (k ? m[i] : below[i]) + part[i];
        ends[k][0] = 1.0;
        ends[k][1] = w - 0.5;
        ends[k][2] = y;
        ends[k][3] = h;
    }
    return dy;
}

// Integrals over the wet part of the unit cube |x|, |y|, |z| <= 1/2; in: e, where the depth of a point r = (1, x, y, z) below
// the water is e.r. out, for i <= j <= k in lexical order: order 0: (4) of r_i where e.r > 0; order 1: (10) of r_i r_j over
// the cut e.r = 0, by the length of (e1, e2, e3), which are the derivatives of the former by e_j; order 2: (20) the derivatives
// of the latter by e_k. Returns 1 if e1, e2, e3 are 0, or anything is no number.
// The cut is the graph z = h(x, y), along z depth changes most, over P, what the lines h = -1/2 and h = 1/2 leave of the square.
SYMDYN_LINKED int symdyn_cube(int order, const double *in, double *out) {
    int x = 2, y = 3, z = 1, n = 0;
    if (fabs(in[2]) > fabs(in[1])) {
        z = 2;
        x = 1;
    }
    if (fabs(in[3]) > fabs(in[x])) {
        y = x;
        x = 3;
    }
    if (fabs(in[x]) > fabs(in[z])) {
        x = z;
        z = 3;
    }
    const double A = fabs(in[x]), B = fabs(in[y]), C = fabs(in[z]), reach = 0.5 * (A + B + C), most = in[0] + reach;
    if (!(C > 0.0) || most != most) return 1;
    if (fabs(in[0]) > reach) {
        for (int k = 0; k < (order == 0 ? 4 : order == 1 ? 10 : 20); k++) out[k] = 0.0;
        if (order == 0 && in[0] > 0.0) out[0] = 1.0;
        return 0;
    }
    // P: the square without what is below the line h = -1/2, and without the top, where h > 1/2.
    const double a = A / C, b = B / C, c = in[0] / C, s = c + 0.5 * (a + b);
    double m[6] = {1.0, 0.0, 0.0, 1.0 / 12.0, 0.0, 1.0 / 12.0}, top[6] = {0.0}, edges[4][4] = {{0.0}}, width[4] = {0.0};
    if (s + 0.5 < a + b) width[0] = width[1] = symdyn_cube_corner(a, b, s + 0.5, -0.5, m, edges);
    if (s - 0.5 > 0.0) width[2] = width[3] = -symdyn_cube_corner(a, b, s - 0.5, 0.5, top, edges + 2);
    for (int k = 0; k < 6; k++) m[k] -= top[k];
    // Q: integrals of r_i r_j over P with r = (1, x, y, h). Axes are turned so that the depth falls along each.
    double Q[4][4] = {{m[0], m[1], m[2], 0.0}, {m[1], m[3], m[4], 0.0}, {m[2], m[4], m[5], 0.0}, {0.0}};
    for (int k = 0; k < 4; k++) Q[k][3] = Q[3][k] = c * Q[0][k] - a * Q[1][k] - b * Q[2][k];
    const double sign[4] = {1.0, in[1] > 0.0 ? -1.0 : 1.0, in[2] > 0.0 ? -1.0 : 1.0, in[3] > 0.0 ? -1.0 : 1.0};
    int place[4] = {0};
    place[x] = 1;
    place[y] = 2;
    place[z] = 3;
    for (int i = 0; i < 4; i++) {
        const int p = place[i];
        // Under P the cube is wet from -1/2 to h, under the top altogether.
        if (order == 0) out[n++] = sign[i] * (p == 3 ? 0.5 * Q[3][3] - 0.125 * Q[0][0] : Q[p][3] + 0.5 * Q[0][p] + top[p]);
        for (int j = i; j < 4 && order > 0; j++) {
            const int q = place[j];
            const double factor = sign[i] * sign[j] / C;
            if (order == 1) out[n++] = factor * Q[p][q];
            for (int k = j; k < 4 && order == 2; k++) {
                // As the water rises, so does the cut, by 1/C, and its edges move along x by 1/A.
                const int r = place[k];
                double sum = ((p == 3 ? Q[q][r] : 0.0) + (q == 3 ? Q[p][r] : 0.0) + (r == 3 ? Q[p][q] : 0.0)) / C;
                for (int e = 0; e < 4; e++)
                    if (width[e] != 0.0) sum += edges[e][p] * edges[e][q] * edges[e][r] * (width[e] / A);
                out[n++] = factor * sign[k] * sum;
            }
        }
    }
    return 0;
}
