// Impulses of many contacts with Coulomb's friction at once: the exact cone, by projected Gauss-Seidel sweeps and a nonsmooth
// Newton method.
//
// Relative velocities are w = free + J du, du = M^-1 J^T P, row by row: the first row of a contact is along its normal, one or
// two more along its tangents. The unknown is P with P_n >= 0, w_n >= 0, P_n w_n = 0, and |P_t| <= mu P_n, P_t = -mu P_n
// w_t/|w_t| where w_t is not zero. This P is the root of P_n - max(0, P_n - w_n/d_n) and of P_t - (P_t - w_t/d_t projected onto
// the disc of radius mu P_n). Dry friction of a joint has no normal row: the radius of its disc is given.
//
// Source: Alart and Curnier, A mixed formulation for frictional contact problems prone to Newton like solution methods, 1991;
// Acary and Brogliato, Numerical Methods for Nonsmooth Dynamical Systems, 2008, chapters 12 and 13.
#pragma once

#include "cones_type.h"
#include "elimination.h"
#include "modes.h"
#include "prelude.h"

// Relative velocities that changes of the speeds make along the rows of a contact.
static void symdyn_cones_along(const symdyn_cones *c, long i, const double *du, double *w) {
    double one = 0.0, two = 0.0, three = 0.0;
    for (long e = c->entry[i]; e < c->entry[i + 1]; e++) {
        const double change = du[c->speed[e]], *along = c->along + 3 * e;
        one += along[0] * change;
        two += along[1] * change;
        three += along[2] * change;
    }
    w[0] = one;
    w[1] = two;
    w[2] = three;
}

// Add what three impulses of a contact do to the speeds.
static void symdyn_cones_push(const symdyn_cones *c, long i, const double *impulse, double *du) {
    const double one = impulse[0], two = impulse[1], three = impulse[2];
    for (long e = c->entry[i]; e < c->entry[i + 1]; e++) {
        const double *answer = c->answer + 3 * e;
        du[c->speed[e]] += answer[0] * one + answer[1] * two + answer[2] * three;
    }
}

// Number of a contact's rows along its normal, which come first: one, or none.
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
    for (long i = 0; i < c->n; i++) {
        const long a = c->first[i], m = c->first[i + 1] - a;
        const double own[3] = {P[a], m > 1 ? P[a + 1] : 0.0, m > 2 ? P[a + 2] : 0.0};
        if (own[0] != 0.0 || own[1] != 0.0 || own[2] != 0.0) symdyn_cones_push(c, i, own, du);
    }
}

// Effect of every contact on itself.
static void symdyn_cones_prepare(symdyn_cones *c) {
    for (long i = 0; i < c->n; i++) {
        const long m = c->first[i + 1] - c->first[i], lead = symdyn_cones_lead(c, i);
        double *D = c->block + 9 * i;
        for (int k = 0; k < 9; k++) D[k] = 0.0;
        for (long e = c->entry[i]; e < c->entry[i + 1]; e++)
            for (long j = 0; j < m; j++)
                for (long k = 0; k < m; k++) D[3 * j + k] += c->along[3 * e + j] * c->answer[3 * e + k];
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
    double *P = c->P + a, w[3], by[3] = {0.0, 0.0, 0.0}, off = 0.0;
    if (symdyn_cones_idle(c, i)) return 0.0;
    symdyn_cones_along(c, i, c->du, w);
    for (long k = 0; k < m; k++) w[k] += c->free[a + k];
    if (lead) {
        const double normal = P[0] - w[0] / c->d_n[i];
        by[0] = (normal > 0.0 ? normal : 0.0) - P[0];
        off = fabs(by[0]) * c->d_n[i];
        P[0] += by[0];
        for (long k = lead; k < m; k++) w[k] += c->block[9 * i + 3 * k] * by[0];
    }
    if (m > lead && c->d_t[i] > 0.0) {
        double z[3] = {0.0, 0.0, 0.0}, size = 0.0;
        const double radius = symdyn_cones_radius(c, i);
        for (long k = lead; k < m; k++) {
            z[k] = P[k] - (radius > 0.0 ? w[k] / c->d_t[i] : 0.0);
            size += z[k] * z[k];
        }
        size = sqrt(size);
        const double scale = size > radius ? radius / size : 1.0;
        for (long k = lead; k < m; k++) {
            by[k] = scale * z[k] - P[k];
            P[k] += by[k];
            off = fmax(off, fabs(by[k]) * c->d_t[i]);
        }
    }
    if (off > 0.0) symdyn_cones_push(c, i, by, c->du);
    return off;
}

// A sweep over all contacts. Returns the largest change, m/s.
static double symdyn_cones_sweep(symdyn_cones *c) {
    double worst = 0.0;
    for (long i = 0; i < c->n; i++) worst = fmax(worst, symdyn_cones_one(c, i));
    c->n_sweeps++;
    return worst;
}

// Point that a contact's impulses are projected from: normal and tangents, and the radius of the disc. Returns the tangents'
// size.
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

// w of the present impulses.
static void symdyn_cones_velocities(symdyn_cones *c) {
    symdyn_cones_total(c, c->P, c->du);
    for (long i = 0; i < c->n; i++) {
        double w[3];
        symdyn_cones_along(c, i, c->du, w);
        for (long r = c->first[i]; r < c->first[i + 1]; r++) c->w[r] = c->free[r] + w[r - c->first[i]];
    }
}

// Note the mode of each contact; returns how far all are from the laws by P and w, m/s.
static double symdyn_cones_missed(symdyn_cones *c) {
    double worst = 0.0;
    for (long i = 0; i < c->n; i++) {
        const long a = c->first[i], m = c->first[i + 1] - a, lead = symdyn_cones_lead(c, i);
        double z[3], radius;
        c->state[i] = c->bounded[i] ? SYMDYN_STICKING : SYMDYN_OPEN;
        if (symdyn_cones_idle(c, i)) continue;
        const double size = symdyn_cones_trial(c, i, z, &radius), scale = size > radius ? radius / size : 1.0;
        if (lead) worst = fmax(worst, fabs((z[0] > 0.0 ? z[0] : 0.0) - c->P[a]) * c->d_n[i]);
        for (long k = lead; k < m; k++) worst = fmax(worst, fabs(scale * z[k] - c->P[a + k]) * c->d_t[i]);
        const int slides = m == lead || size > radius || !(radius > 0.0);
        c->state[i] = lead && !(z[0] > 0.0) ? SYMDYN_OPEN : slides ? SYMDYN_SLIDING : SYMDYN_STICKING;
    }
    return worst;
}

// The same by w of the present impulses.
static double symdyn_cones_residual(symdyn_cones *c) {
    symdyn_cones_velocities(c);
    return symdyn_cones_missed(c);
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

// Number of rows of the contacts that are not open.
static long symdyn_cones_closed(const symdyn_cones *c) {
    long n = 0;
    for (long i = 0; i < c->n; i++)
        if (c->state[i] != SYMDYN_OPEN) n += c->first[i + 1] - c->first[i];
    return n;
}

// J M^-1 J^T of the n rows of the contacts that are not open.
static void symdyn_cones_matrix(symdyn_cones *c, long n, double *A) {
    for (int k = 0; k < c->n_u; k++) c->du[k] = 0.0;
    long column = 0;
    for (long j = 0; j < c->n; j++) {
        if (c->state[j] == SYMDYN_OPEN) continue;
        for (long k = 0; k < c->first[j + 1] - c->first[j]; k++, column++) {
            const double unit[3] = {k == 0, k == 1, k == 2};
            long row = 0;
            symdyn_cones_push(c, j, unit, c->du);
            for (long i = 0; i < c->n; i++) {
                if (c->state[i] == SYMDYN_OPEN) continue;
                double w[3];
                symdyn_cones_along(c, i, c->du, w);
                for (long l = 0; l < c->first[i + 1] - c->first[i]; l++) A[row++ * n + column] = w[l];
            }
            for (long e = c->entry[j]; e < c->entry[j + 1]; e++) c->du[c->speed[e]] = 0.0;
        }
    }
}

// One Newton step from the present impulses, whose residual was just formed. Rows that depend on each other
// leave some impulses open: a little on the diagonal keeps their change small. Returns 0 where there is no step.
static int symdyn_cones_newton(symdyn_cones *c, double little) {
    for (long i = 0; i < c->n; i++)
        for (long r = c->first[i]; r < c->first[i + 1] && c->state[i] == SYMDYN_OPEN; r++) c->P[r] = 0.0;
    const long n = symdyn_cones_closed(c);
    if (n > c->most_dense) return 0;
    symdyn_cones_velocities(c);
    if (!n) return 1;
    double *A = c->dense, *right = c->step;
    symdyn_cones_matrix(c, n, A);
    long row = 0;
    for (long i = 0; i < c->n; i++) {
        if (c->state[i] == SYMDYN_OPEN) continue;
        const long a = c->first[i], m = c->first[i + 1] - a, lead = symdyn_cones_lead(c, i);
        for (long k = 0; k < m; k++) {
            const double d = k < lead ? c->d_n[i] : c->d_t[i];
            for (long j = 0; j < n; j++) A[(row + k) * n + j] = d > 0.0 ? A[(row + k) * n + j] / d : 0.0;
            right[row + k] = d > 0.0 ? -c->w[a + k] / d : 0.0;
            A[(row + k) * n + row + k] += d > 0.0 ? little : 1.0;
        }
        if (m > lead && c->state[i] == SYMDYN_SLIDING) symdyn_cones_slip_rows(c, i, row, n, A, right);
        row += m;
    }
    if (symdyn_solve_rows(n, n, A, right, 0.0)) return 0;
    row = 0;
    for (long i = 0; i < c->n; i++)
        for (long r = c->first[i]; r < c->first[i + 1] && c->state[i] != SYMDYN_OPEN; r++) c->P[r] += right[row++];
    c->n_newton++;
    return 1;
}

// Newton steps as long as they get nearer. Returns the residual.
static double symdyn_cones_finish(symdyn_cones *c, double residual, double tolerance) {
    const long rows = c->first[c->n];
    if (symdyn_cones_closed(c) > c->most_dense) return residual;
    for (long r = 0; r < rows; r++) c->kept[r] = c->P[r];
    for (int trial = 0, worse = 0; trial < 30 && worse < 4 && residual > tolerance; trial++) {
        const int there = symdyn_cones_newton(c, 1e-10);
        const double now = symdyn_cones_residual(c);
        if (!there || !(now <= 1e300)) break;
        worse = now < residual ? 0 : worse + 1;
        if (now >= residual) continue;
        residual = now;
        for (long r = 0; r < rows; r++) c->kept[r] = c->P[r];
    }
    for (long r = 0; r < rows; r++) c->P[r] = c->kept[r];
    return symdyn_cones_residual(c);
}

// Newton steps beyond the tolerance, as long as each gets much nearer: down to rounding. Returns the residual.
static double symdyn_cones_polish(symdyn_cones *c, double residual) {
    const long rows = c->first[c->n];
    while (residual > 0.0 && symdyn_cones_closed(c) <= c->most_dense) {
        for (long r = 0; r < rows; r++) c->kept[r] = c->P[r];
        const int there = symdyn_cones_newton(c, 1e-10);
        const double now = symdyn_cones_residual(c);
        if (!there || !(now <= residual)) {
            for (long r = 0; r < rows; r++) c->P[r] = c->kept[r];
            return symdyn_cones_residual(c);
        }
        if (now > 0.25 * residual) return now;
        residual = now;
    }
    return residual;
}

// Bring impulses into the cones.
static void symdyn_cones_within(symdyn_cones *c) {
    for (long i = 0; i < c->n; i++) {
        const long a = c->first[i], m = c->first[i + 1] - a, lead = symdyn_cones_lead(c, i);
        double square = 0.0;
        if (lead && c->P[a] < 0.0) c->P[a] = 0.0;
        const double radius = symdyn_cones_radius(c, i);
        for (long k = lead; k < m; k++) square += c->P[a + k] * c->P[a + k];
        if (!(square > radius * radius)) continue;
        for (long k = lead; k < m; k++) c->P[a + k] *= radius / sqrt(square);
    }
}

static double symdyn_cones_dot(const double *a, const double *b, long n) {
    double sum[4] = {0.0, 0.0, 0.0, 0.0};
    long r = 0;
    for (; r + 4 <= n; r += 4)
        for (int k = 0; k < 4; k++) sum[k] += a[r + k] * b[r + k];
    for (; r < n; r++) sum[0] += a[r] * b[r];
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

// The combination of m columns that is nearest to another one, by the Gram matrix G of the columns and their products with it;
// columns that depend on the ones before are left out.
static void symdyn_cones_nearest(double G[SYMDYN_CONES_DEPTH][SYMDYN_CONES_DEPTH], const double *products, int m, double *x) {
    double L[SYMDYN_CONES_DEPTH][SYMDYN_CONES_DEPTH];
    for (int j = 0; j < m; j++) {
        for (int i = j; i < m; i++) {
            double sum = G[i][j];
            for (int k = 0; k < j; k++) sum -= L[i][k] * L[j][k] * L[k][k];
            L[i][j] = i == j ? sum : L[j][j] > 0.0 ? sum / L[j][j] : 0.0;
        }
        if (!(L[j][j] > 1e-10 * G[j][j])) L[j][j] = 0.0;
        for (int i = j + 1; i < m && !(L[j][j] > 0.0); i++) L[i][j] = 0.0;
    }
    for (int i = 0; i < m; i++) {
        x[i] = products[i];
        for (int k = 0; k < i; k++) x[i] -= L[i][k] * x[k];
    }
    for (int i = m - 1; i >= 0; i--) {
        x[i] = L[i][i] > 0.0 ? x[i] / L[i][i] : 0.0;
        for (int k = i + 1; k < m; k++)
            if (L[i][i] > 0.0) x[i] -= L[k][i] * x[k];
    }
}

// Where the next sweep starts: the latest swept impulses, less a combination of their m latest differences such that the changes
// cancel as far as they can; at most ten times as far as the longest of these.
static void symdyn_cones_combine(
    symdyn_cones *c, double G[SYMDYN_CONES_DEPTH][SYMDYN_CONES_DEPTH], const double *lengths, int m) {
    const long rows = c->first[c->n], room = 3 * c->most;
    const double *changes = c->history, *swept = c->history + SYMDYN_CONES_DEPTH * room;
    double products[SYMDYN_CONES_DEPTH], part[SYMDYN_CONES_DEPTH], longest = 0.0;
    for (int j = 0; j < m; j++) products[j] = symdyn_cones_dot(changes + j * room, c->change, rows);
    symdyn_cones_nearest(G, products, m, part);
    for (long r = 0; r < rows; r++) c->lead[r] = 0.0;
    for (int j = 0; j < m; j++) {
        longest = fmax(longest, lengths[j]);
        for (long r = 0; r < rows && part[j] != 0.0; r++) c->lead[r] -= part[j] * swept[j * room + r];
    }
    const double length = symdyn_cones_dot(c->lead, c->lead, rows), most = 100.0 * longest;
    const double scale = length > most ? sqrt(most / length) : 1.0;
    for (long r = 0; r < rows; r++) c->P[r] += scale * c->lead[r];
    symdyn_cones_within(c);
    symdyn_cones_total(c, c->P, c->du);
}

// Sweeps, each from a combination of the latest ones, until one changes less than wanted.
// Source: Anderson, Iterative procedures for nonlinear integral equations, 1965; Walker and Ni, Anderson acceleration for
// fixed-point iterations, 2011.
static void symdyn_cones_sweeps(symdyn_cones *c, double tolerance, long most) {
    const long rows = c->first[c->n], room = 3 * c->most;
    double G[SYMDYN_CONES_DEPTH][SYMDYN_CONES_DEPTH], lengths[SYMDYN_CONES_DEPTH], least = 0.0;
    int known = 0, index = 0;
    for (long k = 0; k < most; k++) {
        double *changed = c->history + index * room, *swept = c->history + (SYMDYN_CONES_DEPTH + index) * room, size = 0.0;
        for (long r = 0; r < rows; r++) c->before[r] = c->P[r];
        if (symdyn_cones_sweep(c) <= tolerance) return;
        for (long r = 0; r < rows; r++) {
            const double now = c->P[r] - c->before[r];
            size += now * now;
            changed[r] = now - c->change[r];
            swept[r] = c->P[r] - c->kept[r];
            c->change[r] = now;
            c->kept[r] = c->P[r];
        }
        if (!k || size > 4.0 * least) {  // no history, or one that misleads
            known = index = 0;
            least = size;
            continue;
        }
        least = fmin(least, size);
        lengths[index] = symdyn_cones_dot(swept, swept, rows);
        known = known < SYMDYN_CONES_DEPTH ? known + 1 : known;
        for (int j = 0; j < known; j++) G[index][j] = G[j][index] = symdyn_cones_dot(changed, c->history + j * room, rows);
        index = (index + 1) % SYMDYN_CONES_DEPTH;
        symdyn_cones_combine(c, G, lengths, known);
    }
}

// Share of their latest change by which impulses may go on until the first contact that has part in it opens or reaches its
// cone.
static double symdyn_cones_reach(const symdyn_cones *c) {
    double most = 1e300, largest = 0.0;
    for (long r = 0; r < c->first[c->n]; r++) largest = fmax(largest, fabs(c->change[r]));
    for (long i = 0; i < c->n; i++) {
        const long a = c->first[i], m = c->first[i + 1] - a, lead = symdyn_cones_lead(c, i);
        const double *P = c->P + a, *d = c->change + a;
        double size = 0.0, square = 0.0, across = 0.0, along = 0.0;
        for (long k = 0; k < m; k++) size = fmax(size, fabs(d[k]));
        if (!(size > 1e-2 * largest)) continue;
        if (lead && d[0] < 0.0 && P[0] > 0.0) most = fmin(most, -P[0] / d[0]);
        for (long k = lead; k < m; k++) {
            square += P[k] * P[k];
            across += P[k] * d[k];
            along += d[k] * d[k];
        }
        // |P_t + s d_t| = radius + s growth
        const double radius = symdyn_cones_radius(c, i), growth = lead ? c->friction[i] * d[0] : 0.0;
        const double inside = radius * radius - square, half = across - radius * growth;
        const double root = half * half + (along - growth * growth) * inside;
        if (!(inside > 1e-9 * radius * radius) || !(root >= 0.0) || !(half + sqrt(root) > 0.0)) continue;
        most = fmin(most, inside / (half + sqrt(root)));
    }
    return most;
}

// Sweeps that all change the impulses alike, by little, over and over: where more contacts stick than the speeds allow, impulses
// that cancel each other grow until one of these contacts slips. Go there at once, as often as there is such a change.
static void symdyn_cones_drift(symdyn_cones *c, double tolerance, long end) {
    const long rows = c->first[c->n];
    for (int jump = 0, steady = 1; (steady || jump < 6) && jump < 30 && c->n_sweeps < end; jump++) {
        double off = 0.0, size = 0.0;
        for (int k = 0; k < 3; k++) {
            for (long r = 0; r < rows; r++) c->before[r] = c->P[r];
            if (symdyn_cones_sweep(c) <= tolerance) return;
            off = size = 0.0;
            for (long r = 0; r < rows; r++) {
                const double now = c->P[r] - c->before[r];
                off += (now - c->change[r]) * (now - c->change[r]);
                size += now * now;
                c->change[r] = now;
            }
        }
        steady = off <= 0.05 * size;
        if (!steady) continue;
        const double by = symdyn_cones_reach(c);
        if (!(by < 1e12)) return;
        for (long r = 0; r < rows; r++) c->P[r] += 1.0000001 * by * c->change[r];  // just across
        symdyn_cones_within(c);
        symdyn_cones_total(c, c->P, c->du);
    }
}

// Impulses, from those in P, to a tolerance in m/s: the largest velocity by which a law is missed. Returns the residual.
static double symdyn_cones_solve(symdyn_cones *c, double tolerance, long most_sweeps) {
    symdyn_cones_prepare(c);
    double residual = symdyn_cones_residual(c);
    const long end = c->n_sweeps + most_sweeps;
    for (long sweeps = 16; residual > tolerance && c->n_sweeps < end; sweeps = sweeps < 256 ? 2 * sweeps : 64) {
        const double before = residual;
        const long left = end - c->n_sweeps;
        symdyn_cones_sweeps(c, 0.1 * tolerance, sweeps < left ? sweeps : left);
        residual = symdyn_cones_residual(c);
        if (residual > tolerance && c->most_dense && !c->late) residual = symdyn_cones_finish(c, residual, tolerance);
        if (sweeps < 32 || !(residual > 0.1 * before)) continue;
        symdyn_cones_drift(c, 0.1 * tolerance, end);
        residual = symdyn_cones_residual(c);
    }
    if (residual <= tolerance && c->most_dense && !c->late) residual = symdyn_cones_polish(c, residual);
    return c->residual = residual;
}
