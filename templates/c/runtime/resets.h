// States after resets, on the constraints. The entries of [q; u] that events reset are those of the function reset_directions, in
// its order.
#pragma once

#include "projection.h"

// What an entry of [q; u] counts by: angles count times the length.
static double symdyn_arm(const symdyn_run *run, int i) {
    return (i < SYMDYN_NQ ? symdyn_angles[i] : symdyn_turning[i - SYMDYN_NQ]) ? run->problem.length : 1.0;
}

// Close the gaps of the entries that are open, to first order: along the changes that forces along them make of x where the
// constraints let them, by elimination with the largest pivots. What others determine has no say, nor what would take the others
// a million times as far: the constraints hold it. Returns 0 or 1.
static int symdyn_close(symdyn_run *run, double t, double *x, int *open, double *gap) {
    enum { WIDTH = SYMDYN_NQ + SYMDYN_NU };
    double rows[SYMDYN_HELD * WIDTH], G[SYMDYN_HELD][SYMDYN_HELD];
    int order[SYMDYN_HELD], n = 0;
    if (symdyn_reset_directions_at(&run->problem, t, x, rows) || !symdyn_all_finite(rows, SYMDYN_HELD * WIDTH)) return 1;
    for (int i = 0; i < SYMDYN_HELD; i++) {
        const double own = rows[WIDTH * i + symdyn_held[i]];
        double most = 0.0;
        for (int j = 0; j < SYMDYN_HELD; j++) G[i][j] = rows[WIDTH * j + symdyn_held[i]];
        for (int j = 0; j < WIDTH; j++) most = fmax(most, fabs(rows[WIDTH * i + j]) * symdyn_arm(run, j));
        open[i] &= 1e6 * own * symdyn_arm(run, symdyn_held[i]) > most;
    }
    for (int best = 0; best >= 0;) {
        double most = 1e-10;
        best = -1;
        for (int i = 0; i < SYMDYN_HELD; i++) {
            const double size = rows[WIDTH * i + symdyn_held[i]];
            if (open[i] && G[i][i] > most * size) {
                most = G[i][i] / size;
                best = i;
            }
        }
        if (best < 0) break;
        open[best] = 0;
        order[n++] = best;
        for (int i = 0; i < SYMDYN_HELD; i++)
            if (open[i]) {
                const double factor = G[i][best] / G[best][best];
                gap[i] -= factor * gap[best];
                for (int j = 0; j < SYMDYN_HELD; j++) G[i][j] -= factor * G[best][j];
            }
    }
    for (int last = n, k = n - 1; k >= 0; k--) {
        const int i = order[k];
        for (int other = k + 1; other < last; other++) gap[i] -= G[i][order[other]] * gap[order[other]];
        gap[i] /= G[i][i];
        for (int j = 0; j < WIDTH; j++) x[j] += gap[i] * rows[WIDTH * i + j];
    }
    return 0;
}

// Put x, after the resets of the entries that are asked for, onto the constraints: these entries stay, all others change by as
// little as can be in the metric of the mass matrix, first coordinates, then speeds. x_old: the state before. Returns 0 or a
// failure: what the constraints do not let an entry be is one.
static int symdyn_keep_resets(symdyn_run *run, double t, const double *x_old, double *x, const int *asked) {
    const double length = run->problem.length;
    double wanted[SYMDYN_HELD], u[SYMDYN_NU];
    int failure;
#if SYMDYN_HAS_UNIT_GROUPS
    symdyn_normalise(x);
#endif
    for (int i = 0; i < SYMDYN_HELD; i++) wanted[i] = x[symdyn_held[i]];
    for (int i = 0; i < SYMDYN_NU; i++) u[i] = x[SYMDYN_NQ + i];
    for (int speeds = 0; speeds < 2; speeds++) {
        double worst = 1e300, left = 0.0, size = speeds ? 1e-5 * length : length, far = 0.0;
        int which = 0;
        for (int i = 0; i < SYMDYN_NU; i++) x[SYMDYN_NQ + i] = u[i];
        if ((failure = symdyn_correct(run, t, x))) return failure;
        for (int i = 0; i < SYMDYN_NQ; i++) far = fmax(far, fabs(x[i]) * symdyn_arm(run, i));
        if (speeds)
            for (int i = SYMDYN_NQ; i < SYMDYN_NQ + SYMDYN_NU; i++) size = fmax(size, fabs(x[i]) * symdyn_arm(run, i));
        for (int round = 0; round < 13; round++) {
            const double before = worst;
            double gap[SYMDYN_HELD];
            int open[SYMDYN_HELD];
            worst = 0.0;
            for (int i = 0; i < SYMDYN_HELD; i++) {
                open[i] = asked[i] && (symdyn_held[i] >= SYMDYN_NQ) == speeds;
                gap[i] = open[i] ? wanted[i] - x[symdyn_held[i]] : 0.0;
                const double part = fabs(gap[i]) * symdyn_arm(run, symdyn_held[i]);
                if (round == 0 && speeds) size = fmax(size, part);
                if (part > worst) {
                    worst = part;
                    which = i;
                    left = fabs(gap[i]);
                }
            }
            if (worst <= 1e-15 * size || worst > 0.7 * before || round == 12) break;
            if (symdyn_close(run, t, x, open, gap) || symdyn_correct(run, t, x)) {
                worst = 1e300;
                break;
            }
        }
        run->events.reset_gap = left;
        if (worst > size * (speeds ? 1e-8 : fmax(1e-9, 3.6e-15 * far / length)))
            return symdyn_fail(run, SYMDYN_RESET_REJECTED, 0, symdyn_held[which], t, x_old);
    }
    return 0;
}
