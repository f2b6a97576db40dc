// Many spheres that touch each other and planes: the pairs that are near, found by a grid of cells, and their rows.
//
// sphere: of each group static and kinetic friction, restitution; of each plane its normal and n times a point of it; of each
// body its radius, centre (3), velocity of the centre and angular velocity (6), derivatives of these by its speeds (6 x
// n_speeds), and the mass matrix of these speeds.
#pragma once

#include "cones.h"
#include "moreau_type.h"

static const double *symdyn_plane(const symdyn_moreau *s, long plane) { return s->sphere + 3 * s->n_groups + 4 * plane; }

static const double *symdyn_sphere(const symdyn_moreau *s, long body) {
    const long size = 10 + 6 * s->n_speeds + s->n_speeds * s->n_speeds;
    return s->sphere + 3 * s->n_groups + 4 * s->n_planes + size * body;
}

// M^-1 B^T of every body, by Cholesky factors. Returns 1 where a mass matrix is not positive.
static int symdyn_responses(symdyn_moreau *s) {
    const int n = s->n_speeds;
    for (long body = 0; body < s->n_bodies; body++) {
        const double *B = symdyn_sphere(s, body) + 10, *M = B + 6 * n;
        double L[36] = {0}, *T = s->response + 6 * n * body;
        for (int j = 0; j < n; j++)
            for (int i = j; i < n; i++) {
                double sum = M[i * n + j];
                for (int k = 0; k < j; k++) sum -= L[i * n + k] * L[j * n + k];
                if (i == j && !(sum > 0.0)) return 1;
                L[i * n + j] = i == j ? sqrt(sum) : sum / L[j * n + j];
            }
        for (int k = 0; k < 6; k++) {  // row k of B to row k of the response
            double *y = T + n * k;
            for (int i = 0; i < n; i++) {
                y[i] = B[n * k + i];
                for (int j = 0; j < i; j++) y[i] -= L[i * n + j] * y[j];
                y[i] /= L[i * n + i];
            }
            for (int i = n - 1; i >= 0; i--) {
                for (int j = i + 1; j < n; j++) y[i] -= L[j * n + i] * y[j];
                y[i] /= L[i * n + i];
            }
        }
    }
    return 0;
}

// Gap of a body from another one or, from n_bodies on, from a plane; the normal points to the first.
static double symdyn_pair(const symdyn_moreau *s, long a, long b, double *normal) {
    const double *one = symdyn_sphere(s, a);
    if (b >= s->n_bodies) {
        const double *plane = symdyn_plane(s, b - s->n_bodies);
        for (int k = 0; k < 3; k++) normal[k] = plane[k];
        return plane[0] * one[1] + plane[1] * one[2] + plane[2] * one[3] - plane[3] - one[0];
    }
    const double *two = symdyn_sphere(s, b);
    double square = 0.0;
    for (int k = 0; k < 3; k++) {
        normal[k] = one[1 + k] - two[1 + k];
        square += normal[k] * normal[k];
    }
    const double distance = sqrt(square);
    for (int k = 0; k < 3; k++) normal[k] = distance > 0.0 ? normal[k] / distance : k == 1;
    return distance - one[0] - two[0];
}

static long symdyn_cell_of(double x, double size) {
    const double cell = floor(x / size);
    return (long)cell;
}

static long symdyn_cell_key(const symdyn_moreau *s, long i, long j, long k) {
    const unsigned long key = (unsigned long)i * 73856093UL ^ (unsigned long)j * 19349663UL ^ (unsigned long)k * 83492791UL;
    return (long)(key % (unsigned long)s->n_table);
}

// Note a pair whose gap is at most reach. Returns 1 where there is no more room.
static int symdyn_note(symdyn_moreau *s, symdyn_cones *c, long a, long b, double reach) {
    double normal[3];
    if (!(symdyn_pair(s, a, b, normal) <= reach)) return 0;
    if (s->n_found >= c->most) return 1;
    s->a[s->n_found] = a;
    s->b[s->n_found++] = b;
    return 0;
}

// Add the pairs whose gap is at most reach. Returns 1 where there is no more room.
static int symdyn_search(symdyn_moreau *s, symdyn_cones *c, double reach) {
    double size = 0.0;
    for (long k = 0; k < s->n_table; k++) s->table[k] = -1;
    for (long body = 0; body < s->n_bodies; body++) size = fmax(size, symdyn_sphere(s, body)[0]);
    size = 2.0 * size + reach;
    for (long body = 0; body < s->n_bodies; body++) {
        const double *p = symdyn_sphere(s, body) + 1;
        long here[3];
        for (int k = 0; k < 3; k++) here[k] = s->cell[3 * body + k] = symdyn_cell_of(p[k], size);
        for (long near = 0; near < 27; near++) {
            const long i = here[0] + near % 3 - 1, j = here[1] + near / 3 % 3 - 1, k = here[2] + near / 9 - 1;
            for (long other = s->table[symdyn_cell_key(s, i, j, k)]; other >= 0; other = s->next[other]) {
                const long *there = s->cell + 3 * other;
                if (there[0] != i || there[1] != j || there[2] != k || s->group_of[other] != s->group_of[body]) continue;
                if (symdyn_note(s, c, body, other, reach)) return 1;
            }
        }
        for (long plane = 0; plane < s->n_planes; plane++)
            if (s->plane_group[plane] == s->group_of[body] && symdyn_note(s, c, body, s->n_bodies + plane, reach)) return 1;
        const long key = symdyn_cell_key(s, here[0], here[1], here[2]);
        s->next[body] = s->table[key];
        s->table[key] = body;
    }
    return 0;
}

// Normal and tangents, row by row: tangents turn with the normal, from those of the step's begin if there are any.
static void symdyn_basis(const symdyn_moreau *s, const double *normal, double *basis, int first) {
    double *t = basis + 3, size = 0.0, along = 0.0;
    for (int k = 0; k < 3; k++) basis[k] = normal[k];
    if (s->planar) {
        t[0] = normal[1];
        t[1] = -normal[0];
        t[2] = 0.0;
        return;
    }
    if (first) {
        int least = 0;
        for (int k = 1; k < 3; k++)
            if (fabs(normal[k]) < fabs(normal[least])) least = k;
        for (int k = 0; k < 3; k++) t[k] = k == least;
    }
    for (int k = 0; k < 3; k++) along += t[k] * normal[k];
    for (int k = 0; k < 3; k++) {
        t[k] -= along * normal[k];
        size += t[k] * t[k];
    }
    for (int k = 0; k < 3; k++) t[k] /= sqrt(size);
    for (int k = 0; k < 3; k++) t[3 + k] = normal[(k + 1) % 3] * t[(k + 2) % 3] - normal[(k + 2) % 3] * t[(k + 1) % 3];
}

// [d; arm x d] of a direction d at the point of a body where it touches along the normal.
static void symdyn_wrench(const double *normal, double arm, const double *d, double *six) {
    for (int k = 0; k < 3; k++) {
        six[k] = d[k];
        six[3 + k] = arm * (normal[(k + 1) % 3] * d[(k + 2) % 3] - normal[(k + 2) % 3] * d[(k + 1) % 3]);
    }
}

// From the centre of the second body of a pair to where the first one touches, along the normal: forces on both act at one point.
static double symdyn_pair_arm(const symdyn_moreau *s, long a, long b) {
    double normal[3];
    return symdyn_sphere(s, b)[0] + symdyn_pair(s, a, b, normal);
}

// Relative velocity of a pair along a direction.
static double symdyn_pair_speed(const symdyn_moreau *s, long a, long b, const double *normal, const double *d) {
    const double *one = symdyn_sphere(s, a);
    double six[6], sum = 0.0;
    symdyn_wrench(normal, -one[0], d, six);
    for (int k = 0; k < 6; k++) sum += six[k] * one[4 + k];
    if (b >= s->n_bodies) return sum;
    const double *two = symdyn_sphere(s, b);
    symdyn_wrench(normal, symdyn_pair_arm(s, a, b), d, six);
    for (int k = 0; k < 6; k++) sum -= six[k] * two[4 + k];
    return sum;
}

// Wrenches of m rows of a pair on one of its bodies, times a 6 x n_speeds matrix of that body: three numbers to a column.
static void symdyn_pair_product(
    const symdyn_moreau *s, const double *matrix, const double *basis, double arm, double sign, int m, double *product) {
    const int n = s->n_speeds;
    double six[18] = {0.0};
    for (int k = 0; k < m; k++) symdyn_wrench(basis, arm, basis + 3 * k, six + 6 * k);
    for (int i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) {
            double sum = 0.0;
            for (int l = 0; l < 6; l++) sum += six[6 * k + l] * matrix[n * l + i];
            product[3 * i + k] = sign * sum;
        }
}

// J of a pair at what the frames looked at last, along a basis, behind the columns e; they are as many as n_speeds of each body.
static void symdyn_pair_along(const symdyn_moreau *s, symdyn_cones *c, long e, long a, long b, const double *basis, int m) {
    const double *one = symdyn_sphere(s, a);
    symdyn_pair_product(s, one + 10, basis, -one[0], 1.0, m, c->along + 3 * e);
    if (b >= s->n_bodies) return;
    symdyn_pair_product(s, symdyn_sphere(s, b) + 10, basis, symdyn_pair_arm(s, a, b), -1.0, m, c->along + 3 * (e + s->n_speeds));
}

// Append the rows of a pair, along the normal alone or with its tangents.
static void symdyn_pair_rows(const symdyn_moreau *s, symdyn_cones *c, long a, long b, const double *basis, int m) {
    const int n = s->n_speeds, two = b < s->n_bodies;
    const long e = c->entry[c->n];
    symdyn_pair_along(s, c, e, a, b, basis, m);
    symdyn_pair_product(s, s->response + 6 * n * a, basis, -symdyn_sphere(s, a)[0], 1.0, m, c->answer + 3 * e);
    if (two) symdyn_pair_product(s, s->response + 6 * n * b, basis, symdyn_pair_arm(s, a, b), -1.0, m, c->answer + 3 * (e + n));
    for (int i = 0; i < n; i++) {
        c->speed[e + i] = (int)s->speed_of[n * a + i];
        if (two) c->speed[e + n + i] = (int)s->speed_of[n * b + i];
    }
    c->first[c->n + 1] = c->first[c->n] + m;
    c->entry[++c->n] = e + (two ? 2 * n : n);
}
