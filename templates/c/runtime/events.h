// Where quantities of events pass zero within a step. Their order is that of the functions events and event_resets.
//
// On a panel, a part of a step, a quantity is known by samples at Chebyshev nodes and one more for a check: it has no zero where
// the mean of the polynomial through them is larger than all its other coefficients and its error, and at most one where that
// holds for its derivative. The error is SYMDYN_PANEL_TAIL times the last two coefficients and SYMDYN_PANEL_CHECK times what the
// polynomial is off at the check. Values between samples are bounded by interval arithmetic, where a quantity has bounds.
// Panels on which this says nothing are halved. Source: Trefethen, Approximation Theory and Approximation Practice, 2013; Boyd,
// SIAM J. Numer. Anal. 40 (2002), 1666.
#pragma once

#include "start.h"
#if SYMDYN_SENSITIVE || SYMDYN_KEEPS_RESETS
#include "pivots.h"
#endif
#if SYMDYN_KEEPS_RESETS
#include "resets.h"
#endif

// Values of all quantities at (t, x). Returns 0 or the failure, and records it with the first that is not finite.
static int symdyn_event_values(symdyn_run *run, double t, const double *x, double *values) {
    const int reason = symdyn_events_at(&run->problem, t, x, values);
    long bad = -1;
    for (int k = (SYMDYN_N_EVENTS - 1); k >= 0; k--)
        if (run->events.look[k] && !(fabs(values[k]) <= symdyn_huge)) bad = k;
    return reason || bad >= 0 ? symdyn_fail(run, SYMDYN_EVENT_FAILED, reason, reason ? -1 : bad, t, x) : 0;
}

// Changes of the quantities by the rounding of t and of a state x within the latest step. Returns 0 or the failure.
static int symdyn_event_noise(symdyn_run *run, double t, const double *x, double *noise) {
    double y[SYMDYN_NX], there[SYMDYN_N_EVENTS];
    int failure;
    for (int i = 0; i < SYMDYN_NX; i++)
        y[i] = x[i] + symdyn_eps * symdyn_roundings[i] * fmax(fabs(run->x_old[i]), fabs(run->x[i]));
    if ((failure = symdyn_event_values(run, t, x, there))) return failure;
    if ((failure = symdyn_event_values(run, t + 2.0 * symdyn_eps * t, y, noise))) return failure;
    for (int k = 0; k < SYMDYN_N_EVENTS; k++) noise[k] = fabs(noise[k] - there[k]);
    return 0;
}

// At the start of the run and after a reset, before it: note on which side of zero every quantity is, or, at zero, which it goes
// to within a small step (0: that is not known yet). A quantity that has just vanished counts as zero, whatever rounding has left
// of it, unless its reset has moved it from there. Zero counts where a quantity goes on in the direction of its event, of what
// has just vanished only where its reset has stopped it; before: the changes of that within the same step before the reset.
static int symdyn_event_sides(symdyn_run *run, double t, const double *x, const double *xd, double step, const double *before) {
    double *const now = run->events.now, then[SYMDYN_N_EVENTS], y[SYMDYN_NX], noise[SYMDYN_N_EVENTS];
    int failure;
    for (int i = 0; i < SYMDYN_NX; i++) y[i] = x[i] + step * xd[i];
    if ((failure = symdyn_event_values(run, t, x, now))) return failure;
    if ((failure = symdyn_event_values(run, t + step, y, then))) return failure;
    if ((failure = symdyn_event_noise(run, t, x, noise))) return failure;
    for (int k = 0; k < SYMDYN_N_EVENTS; k++) {
        const double change = then[k] - now[k], left = 2.0 * fabs(run->events.left[k]) + fabs(change);
        const int fired = run->events.fired[k], zero = fabs(now[k]) <= noise[k] || (fired && fabs(now[k]) <= left);
        const int side = (int)run->events.side[k], way = symdyn_event[k].direction;
        const int stopped = symdyn_event[k].resets && fabs(change) <= 1e-6 * fabs(before[k]);
        const int kept = run->events.kept && !fired && side != 0;
        run->events.leaving[k] = !zero || kept ? 0 : fired ? stopped * side : (side != way) * way;
        if (!kept) run->events.side[k] = zero ? (change > 0.0) - (change < 0.0) : now[k] > 0.0 ? 1.0 : -1.0;
    }
    run->events.kept = 0;
    return 0;
}

// The zero of quantity k, which leaves its side between a and b, by regula falsi with halved ends (Illinois), from its values
// times that side there: at_a > 0 >= at_b, but at_a = 0 where the step begins at the zero.
static int symdyn_event_root(symdyn_run *run, int k, double a, double b, double at_a, double at_b, double least, double *root) {
    double values[SYMDYN_N_EVENTS], x[SYMDYN_NX];
    int failure, last = 0;
    for (int round = 0; round < SYMDYN_MOST_SECANTS + SYMDYN_MOST_HALVINGS; round++) {
        const double close = SYMDYN_CLOSE * symdyn_eps * fmax(fabs(a), fabs(b)), inside = b > a ? close : -close;
        if (fabs(b - a) <= close || at_b == 0.0 || (at_a <= 0.0 && fabs(b - a) <= least)) break;
        double s = at_a > 0.0 && round < SYMDYN_MOST_SECANTS ? b - at_b * (b - a) / (at_b - at_a) : 0.5 * (a + b);
        if (!(fabs(s - a) > 0.25 * close && fabs(s - b) > 0.25 * close)) s = fabs(s - a) < fabs(s - b) ? a + inside : b - inside;
        if ((failure = symdyn_state_at(run, s, x)) || (failure = symdyn_event_values(run, s, x, values))) return failure;
        const double value = values[k] * run->events.side[k];
        if (value > 0.0) {
            a = s;
            at_a = value;
            at_b *= last == 1 ? 0.5 : 1.0;
            last = 1;
        } else {
            b = s;
            at_b = value;
            at_a *= last == -1 ? 0.5 : 1.0;
            last = -1;
        }
    }
    *root = at_a <= 0.0 && fabs(b - a) <= least ? a : b;
    return 0;
}

// Samples of a panel, with the states there; those at its start are known.
static int symdyn_event_samples(
    symdyn_run *run, double left, double right, double (*v)[SYMDYN_N_EVENTS], double (*states)[SYMDYN_NX]) {
    int failure;
    for (int k = 0; k < SYMDYN_N_EVENTS; k++) v[0][k] = run->events.now[k];
    for (int j = 1; j < SYMDYN_PANEL + 1; j++) {
        const double s = j == SYMDYN_PANEL - 1 ? right : left + symdyn_node[j] * (right - left);
        double *const y = states[j];
        if (s == run->t)
            for (int i = 0; i < SYMDYN_NX; i++) y[i] = run->x[i];
        else if ((failure = symdyn_state_at(run, s, y)))
            return failure;
        if ((failure = symdyn_event_values(run, s, y, v[j]))) return failure;
    }
    return 0;
}

// The same where quantities are resolved: of those that are bounded no less than what they vary by within the rounding, and with
// that of their own operations.
static int symdyn_event_rounding(symdyn_run *run, double t, const double *x, double *noise) {
    int failure = symdyn_event_noise(run, t, x, noise);
#if SYMDYN_HAS_BOUNDS
    double ud[6 * SYMDYN_LEAVES], ranges[2 * SYMDYN_N_EVENTS];
#if SYMDYN_BOUNDED_INPUTS
    double inputs[SYMDYN_NIN];
    if (failure || (failure = symdyn_inputs_at(&run->problem, t, x, inputs))) return failure;
#endif
    for (int l = 0; l < SYMDYN_LEAVES; l++) {
        const int leaf = symdyn_event_leaf[l];
#if SYMDYN_BOUNDED_INPUTS
        const double at = leaf == 0 ? t : leaf > SYMDYN_NX ? inputs[leaf - (SYMDYN_NX + 1)] : x[leaf - 1];
#else
        const double at = leaf == 0 ? t : x[leaf - 1];
#endif
        const double size = leaf == 0 || leaf > SYMDYN_NX ? fabs(at) : fmax(fabs(run->x_old[leaf - 1]), fabs(run->x[leaf - 1]));
        const double radius = symdyn_eps * (leaf == 0 ? 2.0 : SYMDYN_PANEL_DENSE) * size;
        ud[6 * l] = at - radius;
        ud[6 * l + 1] = at + radius;
    }
    if (failure || symdyn_event_ranges_of(&run->problem, ud, ranges)) return failure;
    for (int k = 0; k < SYMDYN_N_EVENTS; k++)
        if (symdyn_event_enclosed[k]) noise[k] = fmax(noise[k], ranges[2 * k + 1] - ranges[2 * k]);
#endif
    return failure;
}

// The first quantity that may have zeros on a panel which the signs at its ends do not show, -1 if there is none. A
// quantity no larger than its rounding is not resolved any further.
static int symdyn_event_undecided(symdyn_run *run, double right, double (*v)[SYMDYN_N_EVENTS], const double *x) {
    double noise[SYMDYN_N_EVENTS];
    int known = 0;
    for (int k = 0; k < SYMDYN_N_EVENTS; k++)
        if (run->events.look[k]) {
            double c[SYMDYN_PANEL] = {0.0}, s[SYMDYN_PANEL - 1] = {0.0}, check = v[SYMDYN_PANEL][k], rest = 0.0, rise = 0.0;
            for (int j = 0; j < SYMDYN_PANEL; j++) {
                for (int i = 0; i < SYMDYN_PANEL; i++) c[i] += symdyn_chebyshev[i][j] * v[j][k];
                for (int i = 0; i < SYMDYN_PANEL - 1; i++) s[i] += symdyn_slopes[i][j] * v[j][k];
                check -= symdyn_at_check[j] * v[j][k];
            }
            for (int i = 1; i < SYMDYN_PANEL; i++) rest += fabs(c[i]);
            for (int i = 1; i < SYMDYN_PANEL - 1; i++) rise += fabs(s[i]);
            const double tail = fabs(c[SYMDYN_PANEL - 2]) + fabs(c[SYMDYN_PANEL - 1]);
            const double error = SYMDYN_PANEL_TAIL * tail + SYMDYN_PANEL_CHECK * fabs(check);
            if (fabs(c[0]) - rest > error || fabs(s[0]) - rise > SYMDYN_PANEL_SLOPE * error || fabs(c[0]) + rest == 0.0) continue;
            if (!known && symdyn_event_rounding(run, right, x, noise)) return k;
            known = 1;
            if (fabs(c[0]) + rest > SYMDYN_PANEL_NOISE * noise[k]) return k;
        }
    return -1;
}

#if SYMDYN_HAS_BOUNDS
// The values l of what is bounded at the samples of a panel: w. Returns 0, or 1 where an input has none.
static int symdyn_event_leaves(
    symdyn_run *run, double left, double right, double (*states)[SYMDYN_NX], double (*w)[SYMDYN_PANEL + 1]) {
#if SYMDYN_BOUNDED_INPUTS
    double inputs[SYMDYN_PANEL + 1][SYMDYN_NIN];
    for (int j = 0; j < SYMDYN_PANEL + 1; j++) {
        const double s = j == SYMDYN_PANEL - 1 ? right : left + symdyn_node[j] * (right - left);
        if (symdyn_inputs_at(&run->problem, s, states[j], inputs[j])) return 1;
    }
#else
    (void)run;
    (void)left;
    (void)right;
#endif
    for (int l = 0; l < SYMDYN_LEAVES; l++) {
        const int leaf = symdyn_event_leaf[l];
        if (leaf == 0) continue;
        for (int j = 0; j < SYMDYN_PANEL + 1; j++)
#if SYMDYN_BOUNDED_INPUTS
            w[l][j] = leaf > SYMDYN_NX ? inputs[j][leaf - (SYMDYN_NX + 1)] : states[j][leaf - 1];
#else
            w[l][j] = states[j][leaf - 1];
#endif
    }
    return 0;
}

// The first quantity that may have zeros between the samples of a panel, -1 if there is none: neither it nor its derivative nor
// the second one keeps its sign within its bounds, and two samples, h apart, leave room for more than the signs there show: the
// second derivative may reach 8/h^2 times the smaller of them and 2/h^2 times their difference. Bounds of the values alone, which
// are quick, leave little to do.
static int symdyn_event_unproved(
    symdyn_run *run, double left, double right, double (*v)[SYMDYN_N_EVENTS], double (*states)[SYMDYN_NX]) {
    double ud[6 * SYMDYN_LEAVES], bounds[6 * SYMDYN_N_EVENTS], ranges[2 * SYMDYN_N_EVENTS], noise[SYMDYN_N_EVENTS];
    double w[SYMDYN_LEAVES][SYMDYN_PANEL + 1], error[SYMDYN_LEAVES];
    int known = 0, open = 0;
    for (int k = 0; k < SYMDYN_N_EVENTS; k++) open |= symdyn_event_enclosed[k] && run->events.look[k];
    if (!open || symdyn_event_leaves(run, left, right, states, w)) return -1;
    for (int l = 0; l < SYMDYN_LEAVES; l++) {
        double *const jet = ud + 6 * l, c[SYMDYN_PANEL] = {0.0};
        if (symdyn_event_leaf[l] == 0) {
            jet[0] = fmin(left, right);
            jet[1] = fmax(left, right);
            jet[2] = jet[3] = 0.5 * (right - left);
            jet[4] = jet[5] = 0.0;
            continue;
        }
        double check = w[l][SYMDYN_PANEL];
        for (int j = 0; j < SYMDYN_PANEL; j++) {
            for (int i = 0; i < SYMDYN_PANEL; i++) c[i] += symdyn_chebyshev[i][j] * w[l][j];
            check -= symdyn_at_check[j] * w[l][j];
        }
        double radius = error[l] = SYMDYN_PANEL_CHECK * fabs(check);
        for (int i = 1; i < SYMDYN_PANEL; i++) radius += fabs(c[i]);
        jet[0] = c[0] - radius;
        jet[1] = c[0] + radius;
    }
    open = symdyn_event_ranges_of(&run->problem, ud, ranges);
    for (int k = 0; k < SYMDYN_N_EVENTS; k++)
        open |= symdyn_event_enclosed[k] && run->events.look[k] && !(ranges[2 * k] > 0.0 || ranges[2 * k + 1] < 0.0);
    if (!open) return -1;
    for (int l = 0; l < SYMDYN_LEAVES; l++)
        if (symdyn_event_leaf[l]) {
            double *const jet = ud + 6 * l, s[SYMDYN_PANEL - 1] = {0.0}, b[SYMDYN_PANEL - 2] = {0.0};
            for (int j = 0; j < SYMDYN_PANEL; j++) {
                for (int i = 0; i < SYMDYN_PANEL - 1; i++) s[i] += symdyn_slopes[i][j] * w[l][j];
                for (int i = 0; i < SYMDYN_PANEL - 2; i++) b[i] += symdyn_bends[i][j] * w[l][j];
            }
            double slope = SYMDYN_PANEL_SLOPE * error[l], bend = SYMDYN_PANEL_BEND * error[l];
            for (int i = 1; i < SYMDYN_PANEL - 1; i++) slope += fabs(s[i]);
            for (int i = 1; i < SYMDYN_PANEL - 2; i++) bend += fabs(b[i]);
            jet[2] = s[0] - slope;
            jet[3] = s[0] + slope;
            jet[4] = b[0] - bend;
            jet[5] = b[0] + bend;
        }
    const int failed = symdyn_event_bounds_of(&run->problem, ud, bounds);
    for (int k = 0; k < SYMDYN_N_EVENTS; k++)
        if (symdyn_event_enclosed[k] && run->events.look[k]) {
            const double *const of = bounds + 6 * k, beta = fmax(fabs(of[4]), fabs(of[5]));
            int proved = !failed;
            double most = 0.0;
            if (!failed && (of[0] > 0.0 || of[1] < 0.0 || of[2] > 0.0 || of[3] < 0.0 || of[4] > 0.0 || of[5] < 0.0)) continue;
            for (int j = 0; j < SYMDYN_PANEL - 1; j++) {
                const double at = v[j][k], then = v[j + 1][k], allowance = symdyn_node_gap[j] * symdyn_node_gap[j] * beta;
                const int clear = at * then > 0.0 && fmin(fabs(at), fabs(then)) > 0.125 * allowance;
                proved &= clear || fabs(at - then) > 0.5 * allowance;
                most = fmax(most, fmax(fabs(at), fabs(then)));
            }
            if (proved || most == 0.0) continue;
            if (!known && symdyn_event_rounding(run, right, states[SYMDYN_PANEL - 1], noise)) return k;
            known = 1;
            if (most > SYMDYN_PANEL_NOISE * noise[k]) return k;
        }
    return -1;
}
#endif

// Note event k, or a doubt about it.
static void symdyn_event_note(symdyn_run *run, int kind, int k, double t, const double *before, const double *after) {
    double *const states = run->events.noted_states + 2 * SYMDYN_NX * run->events.n_noted;
    const symdyn_noted note = {kind, k, t};
    run->events.noted[run->events.n_noted++] = note;
    for (int i = 0; i < SYMDYN_NX; i++) {
        states[i] = before[i];
        states[SYMDYN_NX + i] = after[i];
    }
}

#if SYMDYN_SENSITIVE
// A millionth of the time in which the state x changes away along a slope, with the sign of the direction.
static double symdyn_short_time(const symdyn_run *run, const double *x, const double *slope) {
    const double change = symdyn_square(run, slope, x), size = symdyn_square(run, x, x);
    const double most = fmin(run->h_max, fabs(run->t_end - run->t_old)), there = change > 0.0 ? sqrt(size / change) : most;
    return 1e-6 * run->direction * fmax(fabs(run->h_old), fmin(there, most));
}

// The right-hand side just before (way -1) or just after (way 1) an event at (t, x), where signs and conditions have the values
// of that side: extrapolated from two states on the way, one and two short times away. Returns 0 or a failure.
static int symdyn_one_sided_slope(symdyn_run *run, double t, const double *x, double way, double *slope) {
    double y[SYMDYN_NX], far[SYMDYN_NX];
    int failure = symdyn_eval(run, t, x, slope);
    if (failure) return failure;
    const double step = symdyn_short_time(run, x, slope) * way;
    for (int k = 2; k > 0; k--)
        for (int round = 0; round < 3; round++) {  // the first ones go over to the side
            for (int i = 0; i < SYMDYN_NX; i++) y[i] = x[i] + k * step * slope[i];
            if ((failure = symdyn_eval(run, t + k * step, y, slope))) return failure;
            if (k == 2)
                for (int i = 0; i < SYMDYN_NX; i++) far[i] = slope[i];
        }
    for (int i = 0; i < SYMDYN_NX; i++) slope[i] = 2.0 * slope[i] - far[i];
    return 0;
}

#endif

// The state after the resets of the events at (t, x), on the constraints, whatever keeps the steps there. Returns 0 or a failure.
static int symdyn_event_reset(symdyn_run *run, double t, const double *x, double *after) {
    for (int i = 0; i < SYMDYN_NX; i++) after[i] = x[i];
#if SYMDYN_HAS_RESETS
    double becomes[SYMDYN_RESETS];
#if SYMDYN_KEEPS_RESETS
    int asked[SYMDYN_HELD] = {0};
    const int failure = symdyn_correct(run, t, after);
    if (failure) return failure;
#endif
    const int reason = symdyn_event_resets_at(&run->problem, t, after, becomes);
    if (reason) return symdyn_fail(run, SYMDYN_EVENT_FAILED, reason, -1, t, x);
    for (int k = 0, r = 0; k < SYMDYN_N_EVENTS; k++)
        for (int end = r + symdyn_event[k].resets; r < end; r++)
            if (run->events.fired[k]) {
                after[symdyn_reset_index[r]] = becomes[r];
#if SYMDYN_KEEPS_RESETS
                for (int i = 0; i < SYMDYN_HELD; i++) asked[i] |= symdyn_held[i] == symdyn_reset_index[r];
#endif
            }
#if SYMDYN_HAS_UNIT_GROUPS
    for (int group = 0; group < SYMDYN_UNIT_GROUPS; group++) {  // zeros have no direction
        const int *const index = symdyn_unit_groups[group];
        double most = 0.0;
        for (int k = 0; k < SYMDYN_UNIT_SIZE && index[k] >= 0; k++) most = fmax(most, fabs(after[index[k]]));
        if (most == 0.0) {
            run->events.reset_gap = 1.0;
            return symdyn_fail(run, SYMDYN_RESET_REJECTED, 0, index[0], t, x);
        }
    }
#endif
#endif
#if SYMDYN_KEEPS_RESETS
#if SYMDYN_SENSITIVE
    for (int i = 0; i < SYMDYN_HELD; i++) run->events.asked[i] = asked[i];
#endif
    return symdyn_keep_resets(run, t, x, after, asked);
#endif
#if SYMDYN_PROJECTS && !SYMDYN_KEEPS_RESETS
    return symdyn_correct(run, t, after);
#endif
#if !SYMDYN_PROJECTS
    (void)run;
    (void)t;
    return 0;
#endif
}

#if SYMDYN_SENSITIVE
// By how much the events at (t, x) come later along each column, later[k][j], along a motion with this slope: by what the
// quantity of event k is moved by, over its rate. Returns 0 or a failure.
static int symdyn_event_later(symdyn_run *run, double t, const double *x, const double *slope, double (*later)[SYMDYN_COLUMNS]) {
    enum { N = SYMDYN_STATE, WIDTH = 1 + SYMDYN_COLUMNS };
    double y[SYMDYN_NX], g[3][SYMDYN_N_EVENTS * WIDTH];
    int reason = 0;
    // Along the columns; along none, and along the motion in place of the first: their difference is the rate at a fixed time.
    for (int i = 0; i < SYMDYN_NX; i++) y[i] = x[i];
    for (int way = 0; way < 3 && !reason; way++) {
        for (int i = N; i < SYMDYN_NX; i++) y[i] = way == 0 ? x[i] : way == 2 && i < 2 * N ? slope[i - N] : 0.0;
        reason = symdyn_event_columns_at(&run->problem, t, y, g[way]);
    }
    if (reason) return symdyn_fail(run, SYMDYN_EVENT_FAILED, reason, -1, t, x);
    for (int k = 0; k < SYMDYN_N_EVENTS; k++) {
        const double rate = g[0][k * WIDTH] + (g[2][k * WIDTH + 1] - g[1][k * WIDTH + 1]);
        for (int j = 0; j < SYMDYN_COLUMNS; j++) later[k][j] = -g[0][k * WIDTH + 1 + j] / rate;
    }
    return 0;
}

// The columns after the events that fire at (t, x), at one time, behind the state after them; slope, then: those before and after
// them. (Saltation: Hiskens and Pai, Trajectory sensitivity analysis of hybrid systems, 2000.) Returns 0 or a failure.
static int symdyn_jump_columns(
    symdyn_run *run, double t, const double *x, double *after, const double *slope, const double *then) {
    enum { N = SYMDYN_STATE, WIDTH = 1 + SYMDYN_COLUMNS };
    double y[SYMDYN_NX], all[SYMDYN_N_EVENTS][SYMDYN_COLUMNS];
    int failure, first = -1;
    for (int k = SYMDYN_N_EVENTS - 1; k >= 0; k--)
        if (run->events.fired[k] && (first < 0 || symdyn_event[k].resets)) first = k;
    if ((failure = symdyn_event_later(run, t, x, slope, all))) return failure;
    const double *const later = all[first];
    for (int i = 0; i < N; i++) y[i] = x[i];
    for (int j = 0; j < SYMDYN_COLUMNS; j++)
        for (int i = 0; i < N; i++) y[N * (j + 1) + i] = x[N * (j + 1) + i] + slope[i] * later[j];
#if SYMDYN_HAS_RESETS
    double becomes[SYMDYN_RESETS * WIDTH], columns[SYMDYN_NX];
    const int reason = symdyn_event_reset_columns_at(&run->problem, t, y, becomes);
    if (reason) return symdyn_fail(run, SYMDYN_EVENT_FAILED, reason, -1, t, x);
    for (int i = 0; i < SYMDYN_NX; i++) columns[i] = y[i];
    for (int k = 0, r = 0; k < SYMDYN_N_EVENTS; k++)
        for (int end = r + symdyn_event[k].resets; r < end; r++)
            for (int j = 0; j < SYMDYN_COLUMNS && run->events.fired[k]; j++)
                columns[N * (j + 1) + symdyn_reset_index[r]] = becomes[r * WIDTH + 1 + j] + becomes[r * WIDTH] * later[j];
    for (int i = N; i < SYMDYN_NX; i++) y[i] = columns[i];
#endif
#if SYMDYN_KEEPS_RESETS
    for (int i = 0; i < N; i++) y[i] = after[i];
    if (symdyn_event[first].resets && (failure = symdyn_keep_columns(run, t, x, y, run->events.asked, then, later)))
        return failure;
#endif
    for (int j = 0; j < SYMDYN_COLUMNS; j++)
        for (int i = 0; i < N; i++) after[N * (j + 1) + i] = y[N * (j + 1) + i] - then[i] * later[j];
#if SYMDYN_PROJECTS
    if (run->problem.project && symdyn_correct_columns(run, t, after))
        return symdyn_fail(run, SYMDYN_PROJECTION_FAILED, run->reason, -1, t, x);
#endif
    return 0;
}

// The slope at (t, x) between events at one time, where quantities of some have gone over, 1 in `sides`, and those of others have
// not yet, -1: as symdyn_one_sided_slope, along the nearest way from (t, x) to that side. clear: whether there is one. before:
// the slope before all of them. Returns 0 or a failure.
static int symdyn_slope_between(
    symdyn_run *run, double t, const double *x, const int *sides, const double *before, double *slope, int *clear) {
    enum { N = SYMDYN_STATE, WIDTH = 1 + SYMDYN_COLUMNS };
    double y[SYMDYN_NX], far[SYMDYN_NX], none[SYMDYN_N_EVENTS * WIDTH], along[SYMDYN_N_EVENTS * WIDTH];
    double g[SYMDYN_N_EVENTS][1 + SYMDYN_STATE], G[SYMDYN_N_EVENTS][SYMDYN_N_EVENTS], way[1 + SYMDYN_STATE];
    int failure = symdyn_eval(run, t, x, slope), reason;
    if (failure) return failure;
    // Derivatives of the quantities by time and state.
    for (int i = 0; i < SYMDYN_NX; i++) y[i] = i < N ? x[i] : 0.0;
    reason = symdyn_event_columns_at(&run->problem, t, y, none);
    for (int k = 0; k < SYMDYN_N_EVENTS; k++) g[k][0] = none[k * WIDTH];
    for (int begin = 0; begin < N && !reason; begin += SYMDYN_COLUMNS) {
        for (int j = 0; j < SYMDYN_COLUMNS; j++)
            for (int i = 0; i < N; i++) y[N * (j + 1) + i] = i == begin + j;
        reason = symdyn_event_columns_at(&run->problem, t, y, along);
        for (int k = 0; k < SYMDYN_N_EVENTS; k++)
            for (int j = 0; j < SYMDYN_COLUMNS && begin + j < N; j++)
                g[k][1 + begin + j] = along[k * WIDTH + 1 + j] - none[k * WIDTH + 1 + j];
    }
    if (reason) return symdyn_fail(run, SYMDYN_EVENT_FAILED, reason, -1, t, x);
    const double step = symdyn_short_time(run, x, slope);
    *clear = 1;
    for (int times = 2; times > 0; times--)
        for (int round = 0; round < 3; round++) {
            double gap[SYMDYN_N_EVENTS], own[SYMDYN_N_EVENTS];
            int open[SYMDYN_N_EVENTS], order[SYMDYN_N_EVENTS];
            way[0] = 1.0;
            for (int i = 0; i < N; i++) way[1 + i] = slope[i];
            for (int k = 0; k < SYMDYN_N_EVENTS; k++) {
                double rate = g[k][0], size_k = 0.0, now = g[k][0];
                open[k] = sides[k] != 0;
                for (int i = 0; i < N; i++) {
                    rate += g[k][1 + i] * before[i];
                    now += g[k][1 + i] * slope[i];
                }
                for (int i = 0; i <= N; i++) size_k = fmax(size_k, fabs(g[k][i]));
                gap[k] = sides[k] < 0 ? -rate - now : 0.0;
                for (int l = 0; l < SYMDYN_N_EVENTS; l++) {
                    G[k][l] = 0.0;
                    for (int i = 0; i <= N; i++) G[k][l] += g[k][i] * g[l][i];
                }
                own[k] = 0.0;
                for (int i = 0; i <= N; i++) own[k] += g[k][i] * g[k][i];
                open[k] &= size_k > 0.0;
            }
            // The least change of the way that makes up for the gaps.
            const int n = symdyn_solve_open(SYMDYN_N_EVENTS, &G[0][0], own, gap, open, order);
            for (int k = 0; k < SYMDYN_N_EVENTS; k++) *clear &= !open[k];
            for (int m = n - 1; m >= 0; m--)
                for (int i = 0; i <= N; i++) way[i] += gap[order[m]] * g[order[m]][i];
            for (int i = 0; i < SYMDYN_NX; i++) y[i] = i < N ? x[i] + times * step * way[1 + i] : x[i];
            if ((failure = symdyn_eval(run, t + times * step * way[0], y, slope))) return failure;
            if (times == 2)
                for (int i = 0; i < SYMDYN_NX; i++) far[i] = slope[i];
        }
    for (int i = 0; i < SYMDYN_NX; i++) slope[i] = 2.0 * slope[i] - far[i];
    return 0;
}

// Whether a state or its slope jumps.
static int symdyn_jumps(const double *x, const double *after, const double *slope, const double *then) {
    int same = 1;
    for (int i = 0; i < SYMDYN_STATE; i++)
        same &= after[i] == x[i] && fabs(then[i] - slope[i]) <= 1e-8 * (fabs(then[i]) + fabs(slope[i]));
    return !same;
}

// State and columns after events at (t, x) one after the other, each at its own time, in the order of their numbers in `order`;
// slope: before all of them. clear: whether slopes between them are known. Returns 0 or a failure.
static int symdyn_in_order(
    symdyn_run *run, double t, const double *x, const int *order, int n, const double *slope, double *after, int *clear) {
    double now[SYMDYN_NX], at[SYMDYN_NX], then[SYMDYN_NX];
    int failure, sides[SYMDYN_N_EVENTS] = {0};
    for (int m = 0; m < n; m++) sides[order[m]] = -1;
    for (int i = 0; i < SYMDYN_NX; i++) {
        at[i] = slope[i];
        now[i] = x[i];
    }
    *clear = 1;
    for (int m = 0; m < n; m++) {
        int known = 1;
        for (int k = 0; k < SYMDYN_N_EVENTS; k++) run->events.fired[k] = k == order[m];
        sides[order[m]] = 1;
        for (int i = 0; i < SYMDYN_NX; i++) after[i] = now[i];
        if (symdyn_event[order[m]].resets && (failure = symdyn_event_reset(run, t, now, after))) return failure;
        failure = m == n - 1 ? symdyn_one_sided_slope(run, t, after, 1.0, then)
                             : symdyn_slope_between(run, t, after, sides, slope, then, &known);
        if (failure) return failure;
        *clear &= known;
        if (symdyn_jumps(now, after, at, then) && (failure = symdyn_jump_columns(run, t, now, after, at, then))) return failure;
        for (int i = 0; i < SYMDYN_NX; i++) {
            at[i] = then[i];
            now[i] = after[i];
        }
    }
    return 0;
}

// The same as symdyn_jump_columns where several events fire, n of them, which have an effect: columns along which they come at
// different times are those of one event after the other, if the result is the same in any order; else they are those of one
// time, and `ordered` is 0. Orders that are compared: by number, the reverse, and with two neighbours exchanged. Returns 0 or a
// failure.
static int symdyn_several_columns(symdyn_run *run, double t, const double *x, double *after, const double *slope,
    const double *then, const int *events, int n, int *ordered) {
    enum { N = SYMDYN_STATE };
    double later[SYMDYN_N_EVENTS][SYMDYN_COLUMNS], one[SYMDYN_NX], other[SYMDYN_NX];
    int failure, apart[SYMDYN_COLUMNS], any = 0, agree[SYMDYN_COLUMNS], clear;
    double fastest = 0.0;
    if ((failure = symdyn_event_later(run, t, x, slope, later))) return failure;
    for (int i = 0; i < N; i++) fastest = fmax(fastest, fabs(slope[i]));
    for (int j = 0; j < SYMDYN_COLUMNS; j++) {
        double size = 0.0;
        for (int i = 0; i < N; i++) size = fmax(size, fabs(x[N * (j + 1) + i]));
        apart[j] = 0;
        for (int m = 1; m < n; m++) {
            const double a = later[events[0]][j], b = later[events[m]][j];
            apart[j] |= !(fabs(a - b) * fastest <= 1e-9 * fmax(fabs(a), fabs(b)) * fastest + 1e-12 * size);
        }
        any |= apart[j];
        agree[j] = 1;
    }
    for (int i = 0; i < SYMDYN_NX; i++) one[i] = other[i] = x[i];
    if ((failure = symdyn_jump_columns(run, t, x, after, slope, then)) || !any) return failure;
    for (int way = 0; way < (n > 2 ? n + 1 : 2); way++) {
        int order[SYMDYN_N_EVENTS];
        double *const result = way ? other : one;
        for (int m = 0; m < n; m++) order[m] = events[way == 1 ? n - 1 - m : m];
        if (way > 1) {
            order[way - 2] = events[way - 1];
            order[way - 1] = events[way - 2];
        }
        failure = symdyn_in_order(run, t, x, order, n, slope, result, &clear);
        for (int i = 0; i < N && !failure; i++) clear &= fabs(result[i] - after[i]) * symdyn_scale(run, i, after[i]) <= 1.0;
        for (int j = 0; j < SYMDYN_COLUMNS; j++) {
            double off = 0.0, size = 0.0;
            for (int i = N * (j + 1); i < N * (j + 2) && !failure; i++) {
                off = fmax(off, fabs(result[i] - one[i]));
                size = fmax(size, fmax(fabs(result[i]), fabs(one[i])));
            }
            agree[j] &= !failure && clear && off <= 1e-7 * size;
        }
    }
    for (int j = 0; j < SYMDYN_COLUMNS; j++) {
        for (int i = N * (j + 1); i < N * (j + 2) && apart[j] && agree[j]; i++) after[i] = one[i];
        *ordered &= !apart[j] || agree[j];
    }
    return 0;
}

// The columns of sensitivities after the events at (t, x), behind the state after them: each comes earlier by what its quantity
// is moved by over its rate. changed: whether they differ from those before. Returns 0 or a failure.
static int symdyn_event_columns(symdyn_run *run, double t, const double *x, double *after, int *changed) {
    enum { N = SYMDYN_STATE };
    double slope[SYMDYN_NX], then[SYMDYN_NX], y[SYMDYN_NX];
    int failure, events[SYMDYN_N_EVENTS], all[SYMDYN_N_EVENTS], n = 0, n_fired = 0, ordered = 1;
    *changed = 0;
    if ((failure = symdyn_one_sided_slope(run, t, x, -1.0, slope))) return failure;
    for (int i = 0; i < SYMDYN_NX; i++) y[i] = i < N ? after[i] : x[i];
    if ((failure = symdyn_one_sided_slope(run, t, y, 1.0, then))) return failure;
    if (!symdyn_jumps(x, after, slope, then)) return 0;
    *changed = 1;
    for (int k = 0; k < SYMDYN_N_EVENTS; k++) n_fired += all[k] = run->events.fired[k];
    if (n_fired == 1) return symdyn_jump_columns(run, t, x, after, slope, then);
    for (int k = 0; k < SYMDYN_N_EVENTS; k++)
        if (all[k]) {  // those that have an effect
            int sides[SYMDYN_N_EVENTS], clear = 1;
            for (int l = 0; l < SYMDYN_N_EVENTS; l++) sides[l] = all[l] ? l == k ? 1 : -1 : 0;
            if (!symdyn_event[k].resets && (failure = symdyn_slope_between(run, t, x, sides, slope, y, &clear))) return failure;
            if (symdyn_event[k].resets || !clear || symdyn_jumps(x, x, slope, y)) events[n++] = k;
        }
    for (int k = 0; k < SYMDYN_N_EVENTS && n; k++) run->events.fired[k] = 0;
    for (int m = 0; m < n; m++) run->events.fired[events[m]] = 1;
    failure = n > 1 ? symdyn_several_columns(run, t, x, after, slope, then, events, n, &ordered)
                    : symdyn_jump_columns(run, t, x, after, slope, then);
    for (int k = 0; k < SYMDYN_N_EVENTS; k++) run->events.fired[k] = all[k];
    if (!ordered && !run->events.entangled && !failure) {
        run->events.entangled = 1;
        symdyn_event_note(run, SYMDYN_ENTANGLED, events[0], t, x, x);
    }
    return failure;
}
#endif

#if SYMDYN_HAS_BOUNDS && SYMDYN_EXPLICIT && !SYMDYN_BOUNDED_INPUTS
// Whether every quantity that is looked for stays on its side within ranges of what they depend on.
static int symdyn_event_safe(symdyn_run *run, const double *range) {
    double ud[6 * SYMDYN_LEAVES] = {0.0}, ranges[2 * SYMDYN_N_EVENTS];
    for (int l = 0; l < SYMDYN_LEAVES; l++) {
        ud[6 * l] = range[2 * l];
        ud[6 * l + 1] = range[2 * l + 1];
    }
    if (symdyn_event_ranges_of(&run->problem, ud, ranges)) return 0;
    for (int k = 0; k < SYMDYN_N_EVENTS; k++) {
        const int clear = run->events.side[k] > 0.0 ? ranges[2 * k] > 0.0 : run->events.side[k] < 0.0 && ranges[2 * k + 1] < 0.0;
        if (run->events.look[k] && !(symdyn_event_enclosed[k] && run->events.leaving[k] == 0 && clear)) return 0;
    }
    return 1;
}

// Take away the ends of the ranges of leaves that nothing depends on which is looked for, or only periodically: as those of
// velocities, and of angles below which contacts are far away.
__attribute__((noinline)) static void symdyn_event_unlimited(symdyn_run *run) {
    double *const safe = run->events.safe;
    run->events.n_limited = 0;
    for (int l = 0; l < SYMDYN_LEAVES; l++) {
        const double from = safe[2 * l], to = safe[2 * l + 1];
        safe[2 * l] = -1e100;
        safe[2 * l + 1] = 1e100;
        if (symdyn_event_safe(run, safe)) continue;
        safe[2 * l] = from;
        safe[2 * l + 1] = to;
        run->events.limited[run->events.n_limited++] = l;
    }
}

// Ranges around those of a step in which all that is looked for is safe, as wide as they can be by powers of two. Returns whether
// there are any.
__attribute__((noinline)) static int symdyn_event_widened(symdyn_run *run, const double *range) {
    double wider[2 * SYMDYN_LEAVES];
    int inside = 0, power = run->events.widened + 4;
    for (; !inside && power >= 0; power--) {
        const double factor = power ? (double)(1L << power) : 0.0;
        for (int l = 0; l < SYMDYN_LEAVES; l++) {
            const double more = factor * (range[2 * l + 1] - range[2 * l]);
            wider[2 * l] = range[2 * l] - more;
            wider[2 * l + 1] = range[2 * l + 1] + more;
        }
        inside = symdyn_event_safe(run, wider);
        run->events.widened = inside ? (power < 26 ? power : 26) : 0;
    }
    run->events.ranged = inside;
    for (int l = 0; l < 2 * SYMDYN_LEAVES; l++) run->events.safe[l] = wider[l];
    for (int l = 0; l < SYMDYN_LEAVES; l++) run->events.limited[l] = l;
    run->events.n_limited = SYMDYN_LEAVES;
    // Far away, at the first time, the second, the fourth, ...
    if (inside && run->events.widened >= 8) {
        const long n = ++run->events.n_widened;
        if (!(n & (n - 1))) symdyn_event_unlimited(run);
    }
    return inside;
}

// The range of a leaf throughout the latest step, no further than twice as far as by the slopes of stages.
static inline void symdyn_event_range(const symdyn_run *run, int l, double *range) {
    const int leaf = symdyn_event_leaf[l];
    double least = 0.0, most = 0.0;
    if (!leaf) {
        range[0] = run->direction > 0.0 ? run->t_old : run->t;
        range[1] = run->direction > 0.0 ? run->t : run->t_old;
        return;
    }
    for (int j = 0; j <= 4; j++) {
        const double slope = j < 4 ? run->method.k[j * SYMDYN_STAGES / 4][leaf - 1] : run->xd[leaf - 1];
        least = slope < least ? slope : least;
        most = slope > most ? slope : most;
    }
    const double from = 2.0 * run->h_old * least, to = 2.0 * run->h_old * most, x = run->x_old[leaf - 1];
    range[0] = x + (from < to ? from : to);
    range[1] = x + (from < to ? to : from);
}

// Whether nothing that is looked for can vanish in the latest step, so that there is nothing to search. As long as what it
// depends on stays within ranges that were found to be safe, this costs a few comparisons.
__attribute__((noinline)) static int symdyn_event_far(symdyn_run *run) {
    double range[2 * SYMDYN_LEAVES];
    int inside = run->events.ranged;
    for (int i = 0; inside && i < run->events.n_limited; i++) {
        const int l = run->events.limited[i];
        symdyn_event_range(run, l, range);
        inside = range[0] >= run->events.safe[2 * l] && range[1] <= run->events.safe[2 * l + 1];
    }
    if (!inside && run->events.waits-- <= 0) {
        for (int l = 0; l < SYMDYN_LEAVES; l++) symdyn_event_range(run, l, range + 2 * l);
        inside = symdyn_event_widened(run, range);
        run->events.wait = inside ? 0 : run->events.wait < 7 ? 2 * run->events.wait + 1 : 7;
        run->events.waits = run->events.wait;
    }
    run->events.stale |= inside;
    return inside;
}
#endif

// Search the latest step for events: note them, and end the step at the first that stops the motion or changes its state.
// Panels are divided until it is certain what happens in each, the rest of the step waiting in `ends`.
__attribute__((noinline)) static void symdyn_search_step(symdyn_run *run) {
    enum { DEPTH = 64 };  // of halves of halves: no more than 46 are longer than twice the least time
    const double least = SYMDYN_AT_ONCE * run->h_floor / (symdyn_eps * symdyn_eps);  // times that are closer count as one
    double left = run->t_old, ends[DEPTH] = {run->t}, v[SYMDYN_PANEL + 1][SYMDYN_N_EVENTS];
    double states[SYMDYN_PANEL + 1][SYMDYN_NX], xd[SYMDYN_NX], *const x = states[SYMDYN_PANEL - 1];
    int failure = 0, n = 1;
    run->events.divisions = run->events.proofs = 0;
#if SYMDYN_HAS_BOUNDS
    if (run->events.stale && (failure = symdyn_event_values(run, run->t_old, run->x_old, run->events.now))) n = 0;
    run->events.stale = 0;
#endif
    for (int i = 0; i < SYMDYN_NX; i++) states[0][i] = run->x_old[i];
    while (n) {
        const double right = ends[n - 1], middle = 0.5 * (left + right), width = fabs(right - left);
        double first = right, root[SYMDYN_N_EVENTS];
        int passed[SYMDYN_N_EVENTS], any = 0, cut = 0, resets = 0, again = 0;
        const int divisible = n < DEPTH && width > fmax(2.0 * least, 16.0 * symdyn_eps * fabs(right));
        if (divisible && run->events.spacing > 0.0 && SYMDYN_PANEL_WIDEST * width > run->events.spacing) {
            ends[n++] = middle;
            continue;
        }
        if ((failure = symdyn_event_samples(run, left, right, v, states))) {
            if (!divisible || width < SYMDYN_PANEL_EVALUATED * fabs(run->t - run->t_old)) break;
            ends[n++] = middle;
            failure = 0;
            continue;
        }
        const int wavy = divisible ? symdyn_event_undecided(run, right, v, x) : -1;
        const int most = run->events.coarse ? SYMDYN_FEW_DIVISIONS : SYMDYN_MOST_DIVISIONS;
        if (wavy >= 0 && run->events.divisions++ < most) {
            ends[n++] = middle;
            continue;
        }
        if (wavy >= 0 && !run->events.unresolved[wavy]) {
            run->events.unresolved[wavy] = run->events.coarse = 1;
            symdyn_event_note(run, SYMDYN_UNRESOLVED, wavy, left, run->x_old, run->x_old);
        }
#if SYMDYN_HAS_BOUNDS
        const int hidden = divisible && wavy < 0 ? symdyn_event_unproved(run, left, right, v, states) : -1;
        const int most_proofs = hidden >= 0 && run->events.unproved[hidden] ? SYMDYN_FEW_DIVISIONS : SYMDYN_MOST_PROOFS;
        if (hidden >= 0 && run->events.proofs++ < most_proofs) {
            ends[n++] = middle;
            continue;
        }
        if (hidden >= 0 && !run->events.unproved[hidden]) {
            run->events.unproved[hidden] = 1;
            symdyn_event_note(run, SYMDYN_UNPROVED, hidden, left, run->x_old, run->x_old);
        }
#endif
        const double *const values = v[SYMDYN_PANEL - 1];
        for (int k = 0; k < SYMDYN_N_EVENTS; k++) {
            const double side = (values[k] > 0.0) - (values[k] < 0.0), leaving = run->events.leaving[k];
            if (run->events.side[k] == 0.0) run->events.side[k] = side;
            const double before = run->events.side[k];
            const int leaves = before != 0.0 && before == leaving;
            passed[k] = run->events.look[k]
                && (leaves
                    || (before != 0.0 && side != before
                        && (symdyn_event[k].direction == 0 || symdyn_event[k].direction == -before)));
            root[k] = left;
            if (before != 0.0 && !leaves) run->events.leaving[k] = 0;
            if (passed[k] && !leaves && !failure)
                failure = symdyn_event_root(run, k, left, right, before * v[0][k], before * values[k], least, &root[k]);
            if (passed[k] && (root[k] - first) * run->direction < 0.0) first = root[k];
            any |= passed[k];
        }
        if (!any) {
            for (int k = 0; k < SYMDYN_N_EVENTS; k++) {
                if (values[k] != 0.0) run->events.side[k] = values[k] > 0.0 ? 1.0 : -1.0;
                run->events.now[k] = values[k];
            }
            for (int i = 0; i < SYMDYN_NX; i++) states[0][i] = x[i];
            left = right;
            n--;
            continue;
        }
        if (failure || (failure = symdyn_state_at(run, first, x))) break;
        if ((failure = symdyn_event_values(run, first, x, run->events.left))) break;
        const int no_time = fabs(first - run->events.t) <= least;  // since the latest reset
        for (int k = 0; k < SYMDYN_N_EVENTS; k++) {
            const int fires = passed[k] && fabs(root[k] - first) <= least;
            const int leaves = run->events.leaving[k] != 0 && run->events.leaving[k] == run->events.side[k];
            again |= fires && run->events.fired[k] && symdyn_event[k].resets && no_time && !leaves;
            run->events.fired[k] = fires;
            if (fires && !leaves) run->events.side[k] = -run->events.side[k];
            cut |= run->events.fired[k] && symdyn_event[k].stops;
            resets |= run->events.fired[k] ? symdyn_event[k].resets : 0;
        }
        if (cut || !resets)
            for (int i = 0; i < SYMDYN_NX; i++) run->events.after[i] = x[i];
        else
            failure = symdyn_event_reset(run, first, x, run->events.after);
#if SYMDYN_SENSITIVE
        int jumps = 0;
        if (!cut && !failure) failure = symdyn_event_columns(run, first, x, run->events.after, &jumps);
        resets |= jumps;
#endif
        for (int k = 0; k < SYMDYN_N_EVENTS; k++)
            if (run->events.fired[k]) symdyn_event_note(run, SYMDYN_HAPPENED, k, first, x, run->events.after);
        left = first;
        if (failure) break;
        if (resets) {
            // Again at once, although its reset sends it away from zero: it goes less far than is resolved.
            run->events.at_once = again                              ? SYMDYN_MOST_RESETS
                : fabs(first - run->events.t) <= SYMDYN_NEAR * least ? run->events.at_once + 1
                                                                     : 1;
            run->events.t = first;
        }
        for (int k = 0; k < SYMDYN_N_EVENTS; k++) {
            if (run->events.fired[k]) run->events.leaving[k] = 0;
            run->events.now[k] = run->events.left[k];
        }
        if (cut || resets || run->events.n_noted >= SYMDYN_WAITING) {
            run->unstored = first != run->t_old;  // else it is
            run->t = first;
            run->t_low = 0.0;
            run->events.pending = !cut;
            run->events.resetting = resets != 0;
            for (int i = 0; i < SYMDYN_NX; i++) run->x[i] = x[i];
            run->status = first == run->t_end ? SYMDYN_DONE : SYMDYN_STEP_LIMIT;
            if (cut || run->events.at_once >= SYMDYN_MOST_RESETS) run->status = cut ? SYMDYN_STOPPED : SYMDYN_EVENT_AT_ONCE;
            if (cut || !resets) return;
            // Changes of the quantities in a small step before.
            const double earlier = first - run->direction * fmin(1e-6 * fabs(run->h_old), fabs(first - run->t_old));
            failure = symdyn_state_at(run, earlier, xd) || symdyn_event_values(run, earlier, xd, run->events.now);
            for (int k = 0; k < SYMDYN_N_EVENTS; k++)
                run->events.now[k] = failure ? 0.0 : run->events.left[k] - run->events.now[k];
            return;
        }
        for (int i = 0; i < SYMDYN_NX; i++) states[0][i] = x[i];
        run->events.divisions = run->events.proofs = 0;
        if (first == right) n--;
    }
    if (!failure) return;
    // The motion is trusted up to where the quantities were known.
    if (left == run->t_old || symdyn_state_at(run, left, x)) {
        left = run->t_old;
        run->unstored = 0;
        for (int i = 0; i < SYMDYN_NX; i++) x[i] = run->x_old[i];
    }
    run->t = left;
    run->t_low = 0.0;
    run->status = failure;
    for (int i = 0; i < SYMDYN_NX; i++) run->x[i] = x[i];
}

// Look for events in the latest step.
static void symdyn_look_for_events(symdyn_run *run) {
    if (!run->events.looking) return;
#if SYMDYN_HAS_BOUNDS && SYMDYN_EXPLICIT && !SYMDYN_BOUNDED_INPUTS
    if (symdyn_event_far(run)) return;
#endif
    symdyn_search_step(run);
}

// Before a step: begin to look, or go on from an event, before whose reset events.now has the changes of a small step. Returns 1
// if there is to be no step now.
static int symdyn_resume(symdyn_run *run) {
    const double step = run->events.begun ? 1e-6 * run->h_old : 1e-9 * (run->t_end - run->t);
    const int pending = run->events.pending;
    double before[SYMDYN_N_EVENTS];
    int failure = 0;
    if (!run->events.looking || (run->events.begun && !pending && run->events.n_noted < SYMDYN_WAITING)) return 0;
    if (run->events.n_noted >= SYMDYN_WAITING) {  // until they are taken
        run->status = SYMDYN_STORE_FULL;
        return 1;
    }
    for (int k = 0; k < SYMDYN_N_EVENTS; k++) before[k] = pending ? run->events.now[k] : step * run->events.now[k];
    run->events.pending = 0;
    if (pending && symdyn_restart(run, run->t, run->events.after, 0.0)) return 1;
    if (!pending) run->events.t = -run->direction * symdyn_huge;
    run->events.begun = 1;
    if (pending && !run->events.resetting) return 1;
    if ((failure = symdyn_event_sides(run, run->t, run->x, run->xd, step, before))) run->status = failure;
    return failure || pending;
}

// Mask of the SYMDYN_N_EVENTS events to look for, after the start, by samples no further apart than spacing, s (0: any).
SYMDYN_EXPORT void SYMDYN_NAME(simulation_look)(void *memory, const int *look, double spacing) {
    symdyn_run *const run = (symdyn_run *)memory;
    run->events.spacing = spacing;
    for (int k = 0; k < SYMDYN_N_EVENTS; k++) run->events.looking |= run->events.look[k] = look[k];
}

// Go on from the end of another run, after simulation_look: known: the sides of the quantities there, 0 where unknown, of those
// that have just vanished the rates, NaN of all others, and what was left of them; reset: whether the state was changed since.
SYMDYN_EXPORT void SYMDYN_NAME(simulation_carry)(void *memory, const double *known, int reset) {
    symdyn_run *const run = (symdyn_run *)memory;
    const double *const sides = known, *const rates = known + SYMDYN_N_EVENTS, *const left = known + 2 * SYMDYN_N_EVENTS;
    for (int k = 0; k < SYMDYN_N_EVENTS; k++) {
        const int fired = run->events.fired[k] = rates[k] == rates[k];
        run->events.left[k] = left[k];
        run->events.now[k] = fired ? rates[k] : 0.0;
        run->events.side[k] = fired ? (rates[k] * run->direction > 0.0) - (rates[k] * run->direction < 0.0) : sides[k];
    }
    run->events.kept = !reset;
}

// The state after the events that have fired, where a run has just been started, for callers that look for events on their own:
// the same resets, kept on the constraints. after: SYMDYN_NX. Returns 0 or a failure.
SYMDYN_EXPORT int SYMDYN_NAME(simulation_reset)(void *memory, const int *fired, double *after) {
    symdyn_run *const run = (symdyn_run *)memory;
    for (int k = 0; k < SYMDYN_N_EVENTS; k++) run->events.fired[k] = fired[k];
    return symdyn_event_reset(run, run->t, run->x, after);
}

// Take the events so far, and doubts about them, at most SYMDYN_NOTES; states (2 SYMDYN_NX each): before and after them. Returns
// how many.
SYMDYN_EXPORT long SYMDYN_NAME(simulation_events)(void *memory, symdyn_noted *noted, double *states) {
    symdyn_run *const run = (symdyn_run *)memory;
    const int n = run->events.n_noted;
    for (int k = 0; k < n; k++) noted[k] = run->events.noted[k];
    for (int k = 0; k < n * 2 * SYMDYN_NX; k++) states[k] = run->events.noted_states[k];
    run->events.n_noted = 0;
    if (run->status == SYMDYN_STORE_FULL) run->status = SYMDYN_STEP_LIMIT;
    return n;
}
