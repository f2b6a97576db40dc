// Impulses of many contacts with Coulomb's friction at once: the exact cone, by projected Gauss-Seidel sweeps and a nonsmooth
// Newton method.
//
// Relative velocities are w = free + J du, du = M^-1 J^T P, row by row: the first row of a contact is along its normal, one or
// two more along its tangents. Wanted is P with P_n >= 0, w_n >= 0, P_n w_n = 0, and |P_t| <= mu P_n, P_t = -mu P_n w_t/|w_t|
// where w_t is not zero. That is the root of P_n - max(0, P_n - w_n/d_n) and of P_t - (P_t - w_t/d_t projected onto the disc of
// radius mu P_n). Dry friction of a joint has no normal row: the radius of its disc is given.
//
// Source: Alart and Curnier, A mixed formulation for frictional contact problems prone to Newton like solution methods, 1991;
// Acary and Brogliato, Numerical Methods for Nonsmooth Dynamical Systems, 2008, chapters 12 and 13.
#pragma once

#include "cones_type.h"
#include "prelude.h"

static double symdyn_cones_along(const symdyn_cones *c, long r, const double *du) {
    double sum = 0.0;
    for (long e = c->entry[r]; e < c->entry[r + 1]; e++) sum += c->along[e] * du[c->speed[e]];
    return sum;
}

static void symdyn_cones_push(const symdyn_cones *c, long r, double impulse, double *du) {
    for (long e = c->entry[r]; e < c->entry[r + 1]; e++) du[c->speed[e]] += c->answer[e] * impulse;
}

// How many of a contact's rows, which come first, are along its normal: one, or none.
static long symdyn_cones_lead(const symdyn_cones *c, long i) { return c->bounded[i] ? 0 : 1; }

// The radius of the disc that a contact's tangential impulses are in.
static double symdyn_cones_radius(const symdyn_cones *c, long i) {
    if (c->bounded[i]) return c->friction[i];
    const double normal = c->P[c->first[i]];
    return c->friction[i] * (normal > 0.0 ? normal : 0.0);
}

// Whether nothing moves along a contact.
static int symdyn_cones_idle(const symdyn_cones *c, long i) { return !((c->bounded[i] ? c->d_t[i] : c->d_n[i]) > 0.0); }

// du of all impulses.
static void symdyn_cones_total(const symdyn_cones *c, const double *P, double *du) {
    for (int k = 0; k < c->n_u; k++) du[k] = 0.0;
    for (long r = 0; r < c->first[c->n]; r++)
        if (P[r] != 0.0) symdyn_cones_push(c, r, P[r], du);
}

// What every contact does to itself.
static void symdyn_cones_prepare(symdyn_cones *c) {
    for (int k = 0; k < c->n_u; k++) c->du[k] = 0.0;
    for (long i = 0; i < c->n; i++) {
        const long a = c->first[i], m = c->first[i + 1] - a;
        double *D = c->block + 9 * i;
        for (long k = 0; k < m; k++) {
            symdyn_cones_push(c, a + k, 1.0, c->du);
            for (long j = 0; j < m; j++) D[3 * j + k] = symdyn_cones_along(c, a + j, c->du);
            for (long e = c->entry[a + k]; e < c->entry[a + k + 1]; e++) c->du[c->speed[e]] = 0.0;
        }
        const long lead = symdyn_cones_lead(c, i);
        const double *T = D + 4 * lead;
        const double mean = 0.5 * (T[0] + T[4]), half = 0.5 * (T[0] - T[4]), across = 0.5 * (T[1] + T[3]);
        c->d_n[i] = lead ? D[0] : 0.0;
        c->d_t[i] = m == lead ? 0.0 : m == lead + 1 ? T[0] : mean + sqrt(half * half + across * across);
    }
    symdyn_cones_total(c, c->P, c->du);
}

// One contact of a sweep: its impulses as those of the others are. Returns by how much it was off, m/s.
static double symdyn_cones_one(symdyn_cones *c, long i) {
    const long a = c->first[i], m = c->first[i + 1] - a, lead = symdyn_cones_lead(c, i);
    double *P = c->P + a, off = 0.0;
    if (symdyn_cones_idle(c, i)) return 0.0;
    if (lead) {
        const double normal = P[0] - (c->free[a] + symdyn_cones_along(c, a, c->du)) / c->d_n[i];
        const double change = (normal > 0.0 ? normal : 0.0) - P[0];
        off = fabs(change) * c->d_n[i];
        if (change != 0.0) {
            P[0] += change;
            symdyn_cones_push(c, a, change, c->du);
        }
    }
    if (m == lead || !(c->d_t[i] > 0.0)) return off;
    double z[3] = {0.0, 0.0, 0.0}, size = 0.0;
    const double radius = symdyn_cones_radius(c, i);
    for (long k = lead; k < m; k++) {
        z[k] = P[k];
        if (radius > 0.0) z[k] -= (c->free[a + k] + symdyn_cones_along(c, a + k, c->du)) / c->d_t[i];
        size += z[k] * z[k];
    }
    size = sqrt(size);
    const double scale = size > radius ? radius / size : 1.0;
    for (long k = lead; k < m; k++) {
        const double by = scale * z[k] - P[k];
        if (by == 0.0) continue;
        P[k] += by;
        symdyn_cones_push(c, a + k, by, c->du);
        off = fmax(off, fabs(by) * c->d_t[i]);
    }
    return off;
}

// A sweep over all contacts, there or back. Returns the largest change, m/s.
static double symdyn_cones_sweep(symdyn_cones *c, int back) {
    double worst = 0.0;
    for (long k = 0; k < c->n; k++) worst = fmax(worst, symdyn_cones_one(c, back ? c->n - 1 - k : k));
    c->n_sweeps++;
    return worst;
}

// What a contact's impulses are projected from: normal and tangents, and the radius of the disc. Returns the tangents' size.
static double symdyn_cones_trial(const symdyn_cones *c, long i, double *z, double *radius) {
    const long a = c->first[i], m = c->first[i + 1] - a, lead = symdyn_cones_lead(c, i);
    double square = 0.0;
    z[0] = z[1] = z[2] = 0.0;
    if (lead) z[0] = c->P[a] - c->w[a] / c->d_n[i];
    *radius = symdyn_cones_radius(c, i);
    for (long k = lead; k < m; k++) {
        z[k] = c->P[a + k] - (*radius > 0.0 && c->d_t[i] > 0.0 ? c->w[a + k] / c->d_t[i] : 0.0);
        square += z[k] * z[k];
    }
    return sqrt(square);
}

// w of the present impulses, what each contact does, and how far all are from the laws, m/s.
static double symdyn_cones_residual(symdyn_cones *c) {
    double worst = 0.0;
    symdyn_cones_total(c, c->P, c->du);
    for (long i = 0; i < c->n; i++) {
        const long a = c->first[i], m = c->first[i + 1] - a, lead = symdyn_cones_lead(c, i);
        double z[3], radius;
        for (long k = 0; k < m; k++) c->w[a + k] = c->free[a + k] + symdyn_cones_along(c, a + k, c->du);
        c->state[i] = c->bounded[i];
        if (symdyn_cones_idle(c, i)) continue;
        const double size = symdyn_cones_trial(c, i, z, &radius), scale = size > radius ? radius / size : 1.0;
        if (lead) worst = fmax(worst, fabs((z[0] > 0.0 ? z[0] : 0.0) - c->P[a]) * c->d_n[i]);
        for (long k = lead; k < m; k++) worst = fmax(worst, fabs(scale * z[k] - c->P[a + k]) * c->d_t[i]);
        c->state[i] = lead && !(z[0] > 0.0) ? 0 : m == lead || size > radius || !(radius > 0.0) ? 2 : 1;
    }
    return worst;
}

// Solve a dense system in place by elimination with row exchanges; the result replaces b. Returns 0 if it is singular.
static int symdyn_cones_eliminate(double *A, double *b, long n) {
    for (long k = 0; k < n; k++) {
        long best = k;
        for (long i = k + 1; i < n; i++)
            if (fabs(A[i * n + k]) > fabs(A[best * n + k])) best = i;
        if (!(fabs(A[best * n + k]) > 0.0)) return 0;
        if (best != k) {
            for (long j = k; j < n; j++) {
                const double kept = A[k * n + j];
                A[k * n + j] = A[best * n + j];
                A[best * n + j] = kept;
            }
            const double kept = b[k];
            b[k] = b[best];
            b[best] = kept;
        }
        for (long i = k + 1; i < n; i++) {
            const double part = A[i * n + k] / A[k * n + k];
            if (part == 0.0) continue;
            for (long j = k + 1; j < n; j++) A[i * n + j] -= part * A[k * n + j];
            b[i] -= part * b[k];
        }
    }
    for (long k = n - 1; k >= 0; k--) {
        for (long j = k + 1; j < n; j++) b[k] -= A[k * n + j] * b[j];
        b[k] /= A[k * n + k];
    }
    return 1;
}

// Rows of a slipping contact: P_t - mu P_n z/|z| = 0 along z/|z| and across it, in place of the rows of D.
static void symdyn_cones_slip_rows(const symdyn_cones *c, long i, long row, long n, double *A, double *right) {
    const long a = c->first[i], m = c->first[i + 1] - a, lead = symdyn_cones_lead(c, i);
    double z[3], radius, part[3] = {0.0, 0.0, 0.0};
    const double size = symdyn_cones_trial(c, i, z, &radius), bend = size > 0.0 ? radius / size : 0.0;
    for (long k = lead; k < m; k++) part[k] = size > 0.0 ? z[k] / size : 0.0;
    for (long j = 0; j < n; j++) {
        double inward = 0.0;
        for (long k = lead; k < m; k++) inward += part[k] * A[(row + k) * n + j];  // scaled by d_t
        for (long k = lead; k < m; k++) A[(row + k) * n + j] = bend * (A[(row + k) * n + j] - part[k] * inward);
    }
    for (long k = lead; k < m; k++) {
        for (long l = lead; l < m; l++) A[(row + k) * n + row + l] += (k == l) - bend * ((k == l) - part[k] * part[l]);
        if (lead) A[(row + k) * n + row] -= c->friction[i] * part[k];
        right[row + k] = radius * part[k] - c->P[a + k];
    }
}

// One Newton step from the present impulses, whose residual was just formed. Returns 0 where there is none.
static int symdyn_cones_newton(symdyn_cones *c) {
    long n = 0;
    for (long i = 0; i < c->n; i++) {
        const long a = c->first[i], b = c->first[i + 1];
        if (!c->state[i]) {
            for (long r = a; r < b; r++) c->P[r] = 0.0;
            continue;
        }
        if (n + b - a > c->most_dense) return 0;
        for (long r = a; r < b; r++) c->active[n++] = r;
    }
    symdyn_cones_total(c, c->P, c->du);
    for (long r = 0; r < c->first[c->n]; r++) c->w[r] = c->free[r] + symdyn_cones_along(c, r, c->du);
    if (!n) return 1;
    double *A = c->dense, *right = c->step;
    for (int k = 0; k < c->n_u; k++) c->du[k] = 0.0;
    for (long j = 0; j < n; j++) {
        const long r = c->active[j];
        symdyn_cones_push(c, r, 1.0, c->du);
        for (long i = 0; i < n; i++) A[i * n + j] = symdyn_cones_along(c, c->active[i], c->du);
        for (long e = c->entry[r]; e < c->entry[r + 1]; e++) c->du[c->speed[e]] = 0.0;
    }
    // Rows that depend on each other leave some impulses open: a little on the diagonal makes their change the smallest one.
    const double little = 1e-10;
    long row = 0;
    for (long i = 0; i < c->n; i++) {
        if (!c->state[i]) continue;
        const long a = c->first[i], m = c->first[i + 1] - a, lead = symdyn_cones_lead(c, i);
        for (long k = 0; k < m; k++) {
            const double d = k < lead ? c->d_n[i] : c->d_t[i];
            for (long j = 0; j < n; j++) A[(row + k) * n + j] = d > 0.0 ? A[(row + k) * n + j] / d : 0.0;
            right[row + k] = d > 0.0 ? -c->w[a + k] / d : 0.0;
            A[(row + k) * n + row + k] += d > 0.0 ? little : 1.0;
        }
        if (m > lead && c->state[i] == 2) symdyn_cones_slip_rows(c, i, row, n, A, right);
        row += m;
    }
    if (!symdyn_cones_eliminate(A, right, n)) return 0;
    for (long j = 0; j < n; j++) c->P[c->active[j]] += right[j];
    c->n_newton++;
    return 1;
}

// Newton steps as long as they get nearer. Returns the residual.
static double symdyn_cones_finish(symdyn_cones *c, double residual, double tolerance) {
    const long rows = c->first[c->n];
    for (int trial = 0, worse = 0; trial < 30 && worse < 4 && residual > tolerance; trial++) {
        if (!worse)
            for (long r = 0; r < rows; r++) c->kept[r] = c->P[r];
        const int there = symdyn_cones_newton(c);
        const double now = symdyn_cones_residual(c);
        if (!there || !(now <= 1e300)) break;
        worse = now < residual ? 0 : worse + 1;
        if (now < residual) {
            residual = now;
            for (long r = 0; r < rows; r++) c->kept[r] = c->P[r];
        }
    }
    for (long r = 0; r < rows; r++) c->P[r] = c->kept[r];
    return symdyn_cones_residual(c);
}

// Sweeps that go on along what the latest ones changed (nonlinear conjugate gradients), until they change less than wanted.
// Source: Silcowitz-Hansen, Niebe, Erleben, A nonsmooth nonlinear conjugate gradient method for interactive contact force
// problems, 2010.
static void symdyn_cones_sweeps(symdyn_cones *c, double tolerance, long most) {
    const long rows = c->first[c->n];
    double old = 0.0;
    for (long k = 0; k < most; k++) {
        double size = 0.0;
        for (long r = 0; r < rows; r++) c->before[r] = c->P[r];
        if (symdyn_cones_sweep(c, 0) <= tolerance) return;
        for (long r = 0; r < rows; r++) size += (c->P[r] - c->before[r]) * (c->P[r] - c->before[r]);
        const double part = old > 0.0 ? size / old : 2.0;
        for (long r = 0; r < rows; r++) {
            const double change = c->P[r] - c->before[r];
            if (part > 1.0) {
                c->step[r] = old > 0.0 ? 0.0 : change;
                continue;
            }
            c->P[r] += part * c->step[r];
            c->step[r] = part * c->step[r] + change;
        }
        old = size;
        if (part <= 1.0) symdyn_cones_total(c, c->P, c->du);
    }
}

// Impulses, from those in P, to a tolerance in m/s: the largest velocity by which a law is missed. Returns the residual.
static double symdyn_cones_solve(symdyn_cones *c, double tolerance, long most_sweeps) {
    symdyn_cones_prepare(c);
    double residual = symdyn_cones_residual(c);
    const long begun = c->n_sweeps, rows = c->first[c->n];
    for (long sweeps = 8; residual > tolerance && c->n_sweeps - begun < most_sweeps; sweeps *= 2) {
        const long left = most_sweeps - (c->n_sweeps - begun);
        symdyn_cones_sweeps(c, 0.1 * tolerance, sweeps < left ? sweeps : left);
        residual = symdyn_cones_residual(c);
        for (long r = 0; r < rows; r++) c->kept[r] = c->P[r];
        if (residual > tolerance && c->most_dense) residual = symdyn_cones_finish(c, residual, tolerance);
    }
    return c->residual = residual;
}
