// Where a round shape touches a curve or a surface.
#pragma once

#include "prelude.h"

// A function of what is known, in, and of the point s of the shape.
typedef void symdyn_of_shape(const double *in, const double *s, double *out);

// equations   k(s) = 0 for the n = 1 or 2 components of s, then dk/ds, row by row, then how low the shape is there
// others      n_others other points of the shape, each with its value behind it, and room for them
// nearest     the equations of the point that is nearest to the deepest one, in the same order; 0: that is the one
// close       a step below this part of the size is the last one
typedef struct {
    int n, n_others;
    symdyn_of_shape *equations, *others, *size, *nearest;
    double *room, close;
} symdyn_shape;

// The step of Newton's method; returns whether the point that it leads to is lowest.
static int symdyn_touching_step(int n, const double *k, double step[2]) {
    if (n == 1) {
        step[0] = -k[0] / k[1];
        step[1] = 0.0;
        return k[1] > 0.0;
    }
    const double determinant = k[2] * k[5] - k[3] * k[4];
    step[0] = (k[3] * k[1] - k[5] * k[0]) / determinant;
    step[1] = (k[4] * k[0] - k[2] * k[1]) / determinant;
    return determinant > 0.0 && k[2] + k[5] > 0.0;
}

// Newton's method from s, with steps that are halved until the equations are met better; value: of the point that it finds.
static int symdyn_touching_from(
    const symdyn_shape *shape, symdyn_of_shape *equations, const double *in, double *s, double size, double *value) {
    const int n = shape->n;
    double k[7];
    equations(in, s, k);
    for (int round = 0; round < 50; round++) {
        double step[2], start[2] = {0.0, 0.0}, square = 0.0, largest = 0.0, far = 0.0, part = 1.0;
        const int lowest = symdyn_touching_step(n, k, step);
        for (int i = 0; i < n; i++) {
            largest = fmax(largest, fabs(step[i]));
            far = fmax(far, fabs(s[i]));
            square += k[i] * k[i];
            start[i] = s[i];
        }
        *value = k[n + n * n];
        if (largest <= shape->close * (size + far)) {
            for (int i = 0; i < n; i++) s[i] += step[i];
            return !lowest;
        }
        for (;;) {
            double now = 0.0;
            for (int i = 0; i < n; i++) s[i] = start[i] + part * step[i];
            equations(in, s, k);
            for (int i = 0; i < n; i++) now += k[i] * k[i];
            if (now <= square * (1.0 - part / 4.0)) break;
            part /= 2.0;
            if (part < 1e-9) return 1;
        }
    }
    return 1;
}

// s where the shape is lowest, from its centre, which in begins with, then the nearest point if that is wanted. Returns 1 where
// there is no such point.
static int symdyn_touching(const symdyn_shape *shape, const double *in, double *s) {
    const int n = shape->n;
    double size, value = 0.0, best = 0.0;
    for (int i = 0; i < n; i++) s[i] = in[i];
    shape->size(in, s, &size);
    int found = !symdyn_touching_from(shape, shape->equations, in, s, size, &best);
    for (int i = 0; !found && i < n; i++) s[i] = in[i];
    for (int round = 0; round < 4; round++) {
        const double *lowest = shape->room;
        double other[2] = {0.0, 0.0};
        shape->others(in, s, shape->room);
        for (int j = 1; j < shape->n_others; j++) {
            const double *point = shape->room + (n + 1) * j;
            if (point[n] < lowest[n]) lowest = point;
        }
        if (found && !(lowest[n] < best - 1e-9 * size))
            return shape->nearest ? symdyn_touching_from(shape, shape->nearest, in, s, size, &value) : 0;
        for (int i = 0; i < n; i++) other[i] = lowest[i];
        if (symdyn_touching_from(shape, shape->equations, in, other, size, &value) || (found && !(value < best))) return 1;
        for (int i = 0; i < n; i++) s[i] = other[i];
        best = value;
        found = 1;
    }
    return 1;
}
