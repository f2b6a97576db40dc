// The force at the upper end of a hanging elastic line.
#pragma once

#include "prelude.h"

// out: horizontal and vertical force at the fairlead of a line at rest, over its weight w L. in: horizontal and vertical distance
// from the anchor over its length L; w L / EA; friction with the seabed. Newton's method for what Jonkman, NREL/TP-500-41958
// (2007), writes for both cases: part of the line rests on the seabed, or none.
SYMDYN_LINKED int symdyn_catenary(int seabed, const double *in, double *out) {
    const double x = in[0], z = in[1], e = in[2], friction = in[3], d = sqrt(x * x + z * z);
    if (!(e >= 0.0 && friction >= 0.0 && d < 1e100) || (seabed && !(z > 0.0))) return 1;
    const double hanging =
        seabed ? 2.0 * z / (1.0 + sqrt(1.0 + 2.0 * e * z)) : 2.0;  // slack it hangs straight down, and the rest lies
    if (hanging <= 1.0 && x <= 1.0 - hanging + 9e-16) {
        out[0] = 0.0;
        out[1] = hanging;
        return 0;
    }
    if (!(x > 1e-9)) return 1;
    // Start: a parabola, or a straight line where the ends are far apart, or a stiff line that touches the seabed.
    const double flat = d < 1.0 ? sqrt(3.0 * (1.0 - d * d)) / x : 0.2, f = (1.0 - x) / z;
    double h = 0.5 * x / flat, v = 0.5 * (z / tanh(flat) + 1.0);
    if (d > 1.0 && (d - 1.0) * x > e * h * d && e > 0.0) {
        h = (d - 1.0) * x / (e * d);
        v = (d - 1.0) * z / (e * d) + 0.5;
    }
    if (seabed && f > 0.0 && f < 1.0) {
        const double touching = z * (1.0 - f) / (f * f * (4.5 - f * (4.2 - 3.6 * f))), lifted = sqrt(z * (z + 2.0 * touching));
        if (lifted < 1.0) {
            h = touching;
            v = lifted;
        }
    }
    for (int k = 0; k < 100; k++) {
        const int rests = seabed && v < 1.0;
        const double s = rests ? 1.0 - v : 0.0, b = rests ? 0.0 : v - 1.0;  // length that lies; vertical force at the anchor
        const double l = 1.0 - s, t = sqrt(h * h + v * v), a = sqrt(h * h + b * b);  // length that hangs, tensions at its ends
        const double one_t = 1.0 / t, one_a = 1.0 / a;
        const double top = v > 0.0 ? t + v : h * h / (t - v), foot = b < 0.0 ? h * h / (a - b) : a + b;  // t + v and a + b
        const double arc = log1p(2.0 * l * top / (h * h + foot * top));  // asinh(v/h) - asinh(b/h)
        const double tense = friction * s > h ? h / friction : s;
        const double x_off = s + h * arc + e * (h * (l + tense) - 0.5 * friction * tense * tense) - x;
        const double z_off = l * (v + b) * (1.0 / (t + a) + 0.5 * e) - z;
        const double slope = v * one_t - b * one_a, x_h = arc - slope + e * (l + tense), z_h = h * (one_t - one_a);
        const double x_v = z_h + (rests ? e * friction * tense : 0.0), z_v = slope + e * l;
        const double determinant = x_h * z_v - x_v * z_h;
        if (!(determinant > 0.0)) return 1;
        const double dh = (x_v * z_off - z_v * x_off) / determinant, dv = (z_h * x_off - x_h * z_off) / determinant;
        double step = h + dh >= 0.1 * h ? 1.0 : -0.9 * h / dh;
        if (seabed && v + step * dv < 0.1 * v) step = -0.9 * v / dv;
        out[0] = h += step * dh;
        out[1] = v += step * dv;
        if (fabs(dh) <= 1e-8 * h + 9e-16 && fabs(dv) <= 1e-8 * (h + fabs(v))) return 0;
    }
    return 1;
}
