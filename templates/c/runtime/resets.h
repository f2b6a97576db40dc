// States after resets, on the constraints. The entries of [q; u] that events reset are those of the function reset_directions, in
// its order.
#pragma once

#include "pivots.h"
#include "projection.h"

// Weight of an entry of [q; u]: angles count times the length.
static double symdyn_arm(const symdyn_run *run, int i) {
    return (i < SYMDYN_NQ ? symdyn_angles[i] : symdyn_turning[i - SYMDYN_NQ]) ? run->problem.length : 1.0;
}

// Close the gaps of the entries that are open, to first order: along the changes that forces along them make of x where the
// constraints let them, by elimination with the largest pivots; gap then has these forces. Entries that others determine do not
// count, nor those that would take the others SYMDYN_RESET_HELD times as far: the constraints hold them. The changed state is
// `of`: x, or its derivative. Returns 0 or 1.
static int symdyn_close(symdyn_run *run, double t, const double *x, int *open, double *gap, double *of) {
    enum { WIDTH = SYMDYN_NQ + SYMDYN_NU };
    double rows[SYMDYN_HELD * WIDTH], G[SYMDYN_HELD][SYMDYN_HELD];
    double sizes[SYMDYN_HELD];
    int order[SYMDYN_HELD];
    if (symdyn_reset_directions_at(&run->problem, t, x, rows) || !symdyn_all_finite(rows, SYMDYN_HELD * WIDTH)) return 1;
    for (int i = 0; i < SYMDYN_HELD; i++) {
        double most = 0.0;
        sizes[i] = rows[WIDTH * i + symdyn_held[i]];
        for (int j = 0; j < SYMDYN_HELD; j++) G[i][j] = rows[WIDTH * j + symdyn_held[i]];
        for (int j = 0; j < WIDTH; j++) most = fmax(most, fabs(rows[WIDTH * i + j]) * symdyn_arm(run, j));
        open[i] &= SYMDYN_RESET_HELD * sizes[i] * symdyn_arm(run, symdyn_held[i]) > most;
    }
    const int n = symdyn_solve_open(SYMDYN_HELD, &G[0][0], sizes, gap, open, order);
    for (int k = n - 1; k >= 0; k--)
        for (int j = 0; j < WIDTH; j++) of[j] += gap[order[k]] * rows[WIDTH * order[k] + j];
    for (int i = 0, k; i < SYMDYN_HELD; i++) {
        for (k = 0; k < n && order[k] != i; k++) continue;
        if (k == n) gap[i] = 0.0;
    }
    return 0;
}

// Put x, after the resets of the entries that are requested, onto the constraints: these entries stay, all others change by as
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
#if SYMDYN_SENSITIVE
    double q[SYMDYN_NQ], off = 0.0, most = length;
    for (int i = 0; i < SYMDYN_NQ; i++) q[i] = x[i];
    for (int i = 0; i < SYMDYN_NU + SYMDYN_HELD; i++) run->events.made[i] = 0.0;
#endif
    for (int i = 0; i < SYMDYN_NU; i++) u[i] = x[SYMDYN_NQ + i];
    for (int speeds = 0; speeds < 2; speeds++) {
        double worst = 1e300, left = 0.0, size = speeds ? SYMDYN_SLOWEST * length : length, far = 0.0;
        int which = 0;
        for (int i = 0; i < SYMDYN_NU; i++) x[SYMDYN_NQ + i] = u[i];
        if ((failure = symdyn_correct(run, t, x))) return failure;
        for (int i = 0; i < SYMDYN_NQ; i++) far = fmax(far, fabs(x[i]) * symdyn_arm(run, i));
        if (speeds)
            for (int i = SYMDYN_NQ; i < SYMDYN_NQ + SYMDYN_NU; i++) size = fmax(size, fabs(x[i]) * symdyn_arm(run, i));
        for (int round = 0; round <= SYMDYN_PROJECTION_ROUNDS; round++) {
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
            if (worst <= SYMDYN_RESET_KEPT * size || worst > SYMDYN_SHRINKS * before || round == SYMDYN_PROJECTION_ROUNDS) break;
            if (symdyn_close(run, t, x, open, gap, x) || symdyn_correct(run, t, x)) {
                worst = 1e300;
                break;
            }
#if SYMDYN_SENSITIVE
            for (int i = 0; i < SYMDYN_HELD; i++) run->events.made[SYMDYN_NU + i] += speeds ? gap[i] : 0.0;
#endif
        }
        run->events.reset_gap = left;
        if (worst > size
                * (speeds ? SYMDYN_TOO_MUCH_OF_SPEEDS
                          : fmax(SYMDYN_TOO_MUCH, SYMDYN_FAILED_TIMES * SYMDYN_RESOLVED * far / length)))
            return symdyn_fail(run, SYMDYN_RESET_REJECTED, 0, symdyn_held[which], t, x_old);
    }
#if SYMDYN_SENSITIVE
    for (int i = 0; i < SYMDYN_NU; i++) run->events.made[i] = x[SYMDYN_NQ + i] - u[i];
    for (int i = 0; i < SYMDYN_NQ; i++) {
        off = fmax(off, fabs(x[i] - q[i]) * symdyn_arm(run, i));
        most = fmax(most, fabs(x[i]) * symdyn_arm(run, i));
    }
    run->events.off_constraints = off > 1e-9 * most;
#endif
    return 0;
}

#if SYMDYN_SENSITIVE
// Close gaps of entries, see symdyn_close, in a column; which: those of coordinates, 0, or of speeds, 1, that are requested.
static int symdyn_close_column(
    symdyn_run *run, double t, const double *x, const int *asked, int which, const double *gaps, double *column) {
    int open[SYMDYN_HELD];
    double gap[SYMDYN_HELD];
    for (int i = 0; i < SYMDYN_HELD; i++) {
        open[i] = asked[i] && (symdyn_held[i] >= SYMDYN_NQ) == which;
        gap[i] = open[i] ? gaps[i] : 0.0;
    }
    return symdyn_close(run, t, x, open, gap, column);
}

// Whether the constraints leave coordinates free that no reset holds: a change, any will do, is put onto the constraints, and
// what is held is then taken back; nothing remains of it where everything is held. x: with columns, which are not read. Returns
// 0, 1, or -1 for a failure.
static int symdyn_leaves_free(symdyn_run *run, double t, const double *x, const int *asked) {
    enum { N = SYMDYN_STATE, WIDTH = SYMDYN_NQ + SYMDYN_NU };
    double y[SYMDYN_NX], out[2][SYMDYN_COLUMNS * WIDTH], change[WIDTH] = {0.0}, gaps[SYMDYN_HELD], whole = 0.0, left = 0.0;
    for (int way = 0; way < 2; way++) {
        for (int i = 0; i < SYMDYN_NX; i++) y[i] = i < N ? x[i] : 0.0;
        for (int i = 0; i < SYMDYN_NQ && way; i++) y[N + i] = sin(1.0 + 7.0 * i) / symdyn_arm(run, i);
        if (symdyn_corrected_columns_at(&run->problem, t, y, out[way])) return -1;
    }
    for (int i = 0; i < SYMDYN_NQ; i++) {
        change[i] = out[1][i] - out[0][i];
        whole = fmax(whole, fabs(y[N + i]) * symdyn_arm(run, i));
    }
    for (int i = 0; i < SYMDYN_HELD; i++) gaps[i] = -change[symdyn_held[i]];
    if (symdyn_close_column(run, t, x, asked, 0, gaps, change)) return -1;
    for (int i = 0; i < SYMDYN_NQ; i++) left = fmax(left, fabs(change[i]) * symdyn_arm(run, i));
    return left > 1e-8 * whole;
}

// The columns behind the state x that symdyn_keep_resets has made, in place: from those that the resets ask for to what they
// become on the constraints. then: the rate of x; later: by how much the event comes later along each column. Held entries are as
// requested, all others follow as they do for the state: see carried_columns. x_old: the state before. Returns 0 or a failure.
static int symdyn_keep_columns(
    symdyn_run *run, double t, const double *x_old, double *x, const int *asked, const double *then, const double *later) {
    enum { N = SYMDYN_STATE, WIDTH = SYMDYN_NQ + SYMDYN_NU };
    double y[SYMDYN_NX], out[SYMDYN_COLUMNS * WIDTH], gaps[SYMDYN_HELD];
    double given[SYMDYN_BOUNDS + SYMDYN_NU + SYMDYN_HELD + SYMDYN_COLUMNS] = {0.0};
    // Coordinates that are off the constraints are put there on a way that has no derivative here, unless only one end is left.
    int failed = run->events.off_constraints ? symdyn_leaves_free(run, t, x, asked) : 0;
    if (failed > 0) return symdyn_fail(run, SYMDYN_RESET_NOT_SMOOTH, 0, -1, t, x_old);
    // At a given time, which is what the projection of columns takes.
    for (int i = 0; i < SYMDYN_NX; i++) y[i] = i < N ? x[i] : x[i] - then[i % N] * later[i / N - 1];
    run->reason = symdyn_corrected_columns_at(&run->problem, t, y, out);
    if (failed || run->reason) return symdyn_fail(run, SYMDYN_PROJECTION_FAILED, run->reason, -1, t, x_old);
    for (int i = 0; i < SYMDYN_NX; i++) y[i] = x[i];
    for (int j = 0; j < SYMDYN_COLUMNS; j++) {
        double *const column = y + N * (j + 1);
        for (int i = 0; i < SYMDYN_NQ; i++) column[i] = out[WIDTH * j + i] + then[i] * later[j];
        for (int i = 0; i < SYMDYN_HELD; i++) gaps[i] = x[N * (j + 1) + symdyn_held[i]] - column[symdyn_held[i]];
        failed |= symdyn_close_column(run, t, x, asked, 0, gaps, column);
    }
    for (int i = 0; i < SYMDYN_NU + SYMDYN_HELD; i++) given[SYMDYN_BOUNDS + i] = run->events.made[i];
    for (int j = 0; j < SYMDYN_COLUMNS; j++) given[SYMDYN_BOUNDS + SYMDYN_NU + SYMDYN_HELD + j] = later[j];
    run->reason = symdyn_carried_columns_at(&run->problem, t, y, given, out);
    if (failed || run->reason) return symdyn_fail(run, SYMDYN_PROJECTION_FAILED, run->reason, -1, t, x_old);
    for (int j = 0; j < SYMDYN_COLUMNS; j++) {
        double *const column = y + N * (j + 1), size[2] = {0.0}, before = 0.0;
        for (int i = 0; i < SYMDYN_NU; i++) column[SYMDYN_NQ + i] = out[SYMDYN_NU * j + i];
        for (int i = 0; i < SYMDYN_HELD; i++) gaps[i] = x[N * (j + 1) + symdyn_held[i]] - column[symdyn_held[i]];
        if (symdyn_close_column(run, t, x, asked, 1, gaps, column))
            return symdyn_fail(run, SYMDYN_PROJECTION_FAILED, 0, -1, t, x_old);
        for (int i = 0; i < WIDTH; i++) {
            const double most = fmax(fabs(column[i]), fabs(x[N * (j + 1) + i])) * symdyn_arm(run, i);
            size[i >= SYMDYN_NQ] = fmax(size[i >= SYMDYN_NQ], most);
            before = fmax(before, fabs(x_old[N * (j + 1) + i]) * symdyn_arm(run, i));
        }
        for (int i = 0; i < SYMDYN_HELD; i++) {
            const int place = symdyn_held[i];
            const double gap = fabs(x[N * (j + 1) + place] - column[place]) * symdyn_arm(run, place);
            if (asked[i] && gap > fmax(1e-6 * size[place >= SYMDYN_NQ], 1e-10 * fmax(before, fmax(size[0], size[1]))))
                return symdyn_fail(run, SYMDYN_RESET_NOT_SMOOTH, 0, place, t, x_old);
        }
    }
    for (int i = N; i < SYMDYN_NX; i++) x[i] = y[i];
    return 0;
}
#endif
