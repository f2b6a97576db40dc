// Taylor series. SYMDYN_ROW numbers of every order: SYMDYN_SUMS left factors of the sums, as many right ones, the derivative. The
// model gives symdyn_constants, symdyn_series_at (order 0) and symdyn_series_after (any other). Where there are few sums, the
// orders are written out one by one: their terms then need no loops.
#pragma once

#include "run.h"

#if SYMDYN_UNROLLED
typedef double symdyn_block;
#else
#if defined(__GNUC__) && !defined(__TINYC__)
typedef double symdyn_block __attribute__((vector_size(8 * SYMDYN_BLOCK_LANES), aligned(8), may_alias));
#else
typedef double symdyn_block;
#endif
#endif

// The sums of order k over factors of orders 1 to k - 1, the latest last: all others are done while it is still computed.
static SYMDYN_INLINE void symdyn_sums(const double *restrict rows, int k, double *restrict out) {
    enum { LANES = sizeof(symdyn_block) / sizeof(double), BLOCKS = SYMDYN_BLOCK / LANES, ROW = SYMDYN_ROW / LANES };
    for (int i = 0; i < SYMDYN_SUMS; i += SYMDYN_BLOCK) {
        const symdyn_block *left = (const symdyn_block *)(rows + i);
        const symdyn_block *right = (const symdyn_block *)(rows + SYMDYN_SUMS + i);
        symdyn_block s[BLOCKS] = {0};
        for (int n = 2; n <= k; n++) {
            const int l = (n < k ? n : 1) * ROW, r = k * ROW - l;
            for (int v = 0; v < BLOCKS; v++) s[v] += left[l + v] * right[r + v];
        }
        for (int v = 0; v < BLOCKS; v++) ((symdyn_block *)(out + i))[v] = s[v];
    }
}

// Order 0 at (t, x). Returns 0 or the failure, recorded.
static int symdyn_zeroth(symdyn_run *run, double t, const double *x) {
    double xd[SYMDYN_NX];
    int bad = 0;
    // Where equations are solved by the singular fallback, there is a right-hand side but no series of it: a method without
    // series can go on from the latest step.
    const int reason = symdyn_series_at(&run->problem, t, x, run->method.constants, run->method.start);
    run->n_evaluations++;
    run->method.t_start = t;
    for (int i = 0; i < SYMDYN_NX; i++) {
        run->method.x_start[i] = x[i];
        bad |= !(fabs(x[i]) <= symdyn_huge) | !(fabs(run->method.start[i]) <= symdyn_huge);
    }
    if ((run->method.ready = !reason && !bad)) return 0;
    const int failure = symdyn_eval(run, t, x, xd);
    return failure ? failure : symdyn_fail(run, SYMDYN_NO_SERIES, reason, -1, t, x);
}

// Coefficients of order k, and what those of the next one need. Returns whether they are the last.
static SYMDYN_INLINE int symdyn_next(symdyn_run *run, double *rows, int k) {
    const double factors[2] = {1.0 / k, k == 1 ? run->method.unit : 0.0}, part = run->method.unit / k;
    const double *const rate = rows + (k - 1) * SYMDYN_ROW + 2 * SYMDYN_SUMS;
    double *const q = run->method.series[k], sums[SYMDYN_SUMS], ud[SYMDYN_NX];
    for (int i = 0; i < SYMDYN_NX; i++) q[i] = part * rate[i];
    if (k == run->method.order) return 1;
    for (int i = 0; i < SYMDYN_NX; i++) ud[i] = run->method.unit * rate[i];
    symdyn_sums(rows, k, sums);
    symdyn_series_after(
        k, q, sums, run->method.start + SYMDYN_NX, ud, factors, run->problem.p, run->method.constants, rows + k * SYMDYN_ROW);
    return 0;
}

// Order k where the orders are written out.
#define SYMDYN_NEXT(k)                                                                                                           \
    if (symdyn_next(run, rows, k)) goto expanded;

// The series at run->x, from order 0.
#if SYMDYN_UNROLLED
__attribute__((noinline))
#endif
static void symdyn_expand(symdyn_run *run) {
#if SYMDYN_UNROLLED
    run->method.skipped = 0;
#else
    run->method.skipped = (int)((-(unsigned long long)run->method.rows & 63) / 8);
#endif
    double *const rows = run->method.rows + run->method.skipped;
    for (int i = 0; i < SYMDYN_NX; i++) rows[2 * SYMDYN_SUMS + i] = run->method.start[i];
#if SYMDYN_UNROLLED
    SYMDYN_EACH_ORDER(SYMDYN_NEXT)
expanded:
#else
    for (int k = 1; !symdyn_next(run, rows, k); k++) {}
#endif
    run->n_evaluations += run->method.order - 1;
}

static int symdyn_begin(symdyn_run *run) {
    double tolerance = run->atol[0];
    for (int i = 0; i < SYMDYN_NX; i++) tolerance = fmin(tolerance, run->atol[i]);
    tolerance = fmax(fmax(tolerance, run->rtol), 1e-18);
    const double wanted = fmin(fmax(ceil(4.0 - 0.55 * log(tolerance)), 6.0), SYMDYN_ORDERS);
    run->method.order = (int)wanted;
    run->method.h_before = run->method.unit = 0.0;
    run->method.ready = 0;
    run->reason = symdyn_constants(run->problem.p, run->method.constants);
    return run->reason ? SYMDYN_FIELD_FAILED : 0;
}

// The series, and how far it goes: the last two coefficients reach the tolerance there. Returns the run's status.
static int symdyn_ahead(symdyn_run *run) {
    double h = 0.0;
    int ready = run->method.ready && run->t == run->method.t_start, failure;
    if (run->rejected) return SYMDYN_STEP_LIMIT;  // it is there
    for (int i = 0; i < SYMDYN_NX; i++) ready &= run->x[i] == run->method.x_start[i];
    for (int i = 0; i < SYMDYN_NX; i++) run->method.series[0][i] = ready ? run->method.low_new[i] : 0.0;
    if (!ready && (failure = symdyn_zeroth(run, run->t, run->x))) return failure;
    run->dense_ready = 0;
    if (!(run->method.unit > 0.0)) run->method.unit = exp2(floor(log2(run->h_max)));
    for (int tries = 0; tries < 16; tries++) {  // in a unit of time in which the coefficients are neither tiny nor huge
        symdyn_expand(run);
        const double last = symdyn_square(run, run->method.series[run->method.order], run->x);
        const double before = symdyn_square(run, run->method.series[run->method.order - 1], run->x);
        if (!(last + before <= symdyn_huge)) {
            run->method.unit *= 0x1p-20;
            continue;
        }
        h = 0.8 * run->method.unit * exp(-0.5 * fmax(log(before) / (run->method.order - 1), log(last) / run->method.order));
        // The last ones vanish where a motion begins with symmetry; earlier ones are weighted by a guess of 4 for the ratio of
        // one to the next at the end of the step.
        if (h > 1.5 * run->method.h_before) {
            double bound = h, weight = 1.0;
            for (int k = run->method.order - 2; k > 0; k--) {
                weight *= 0.0625;
                bound = fmin(
                    bound, run->method.unit * exp(-0.5 * log(symdyn_square(run, run->method.series[k], run->x) * weight) / k));
            }
            h = fmax(1.5 * run->method.h_before, bound);
        }
        const double far = fmin(h, run->h_max), ratio = run->method.unit / far;
        if (ratio > 1e-3 && ratio < 1e3) break;
        run->method.unit = exp2(floor(log2(far)));
    }
    if (!(h > 0.0)) return symdyn_fail(run, SYMDYN_STATE_NOT_FINITE, 0, -1, run->t, run->x);
    // At first it is the requested one.
    run->h = run->method.h_before = run->method.h_before == 0.0 && run->h > 0.0 ? fmin(run->h, h) : h;
    return SYMDYN_STEP_LIMIT;
}

// The polynomial of this degree, in time over the unit; its coefficients are `row` numbers apart.
static inline void symdyn_polynomial(const double *coefficients, int row, int degree, double time, double *restrict y) {
    for (int i = 0; i < SYMDYN_NX; i++) y[i] = coefficients[degree * row + i];
    for (int k = degree - 1; k >= 0; k--)
        for (int i = 0; i < SYMDYN_NX; i++) y[i] = MADD(y[i], time, coefficients[k * row + i]);
}

// Whether a step is as good as its coefficients show, which know nothing of a kink, a branch cut or a bend ahead: by what slope
// and derivative at its end differ, times its length. This is about the tolerance for smooth motions. Returns 0 for a tenth of it
// within the tolerance of each state, else that in the root mean square, 1 where it is tolerated.
static inline double symdyn_defect(
    const symdyn_run *run, double h, const double *x_new, const double *xd_new, const double *slope) {
    const double part = 0.1 * fabs(h);
    double off[SYMDYN_NX], largest = 0.0;
    int bad = 0;
    for (int i = 0; i < SYMDYN_NX; i++) {
        off[i] = part * fabs(slope[i] - xd_new[i]);
        bad |= !(off[i] <= run->atol[i] + run->rtol * fabs(x_new[i]));
    }
    if (!bad) return 0.0;
    for (int i = 0; i < SYMDYN_NX; i++) largest = fmax(largest, fabs(x_new[i]));
    for (int i = 0; i < SYMDYN_NX; i++) {  // rounding: of the derivative; of what it is made of, where atol does not cover that
        const double of_states = run->atol[i] > 0.0 ? 0.0 : symdyn_eps * largest;
        const double rounding = 1e-14 * part * (fabs(xd_new[i]) + fabs(run->xd[i])) + of_states;
        if (off[i] <= rounding) off[i] = 0.0;
    }
    return sqrt(symdyn_square(run, off, x_new));
}

static int symdyn_try(symdyn_run *run, double h, double t_new, double *x_new, double *xd_new, double *err) {
    double *const y = run->method.low_new, slope[SYMDYN_NX];
    *err = fabs(h) > 1.02 * run->method.h_before ? 2.0 : 0.0;  // longer only where a step cannot be so short
    symdyn_polynomial(run->method.series[0], SYMDYN_NX, run->method.order, h / run->method.unit, y);
    symdyn_polynomial(
        run->method.rows + run->method.skipped + 2 * SYMDYN_SUMS, SYMDYN_ROW, run->method.order - 1, h / run->method.unit, slope);
    for (int i = 0; i < SYMDYN_NX; i++) {
        x_new[i] = run->x[i] + y[i];
        y[i] -= x_new[i] - run->x[i];
    }
    const int failure = symdyn_zeroth(run, t_new, x_new);
    for (int i = 0; i < SYMDYN_NX; i++) xd_new[i] = run->method.start[i];
    const double defect = failure ? 0.0 : symdyn_defect(run, h, x_new, xd_new, slope);
    if (!(defect <= *err)) *err = defect;
    return failure;
}

// The state at s within the latest step.
static int symdyn_between(symdyn_run *run, double s, double *x) {
    run->dense_ready = 1;
    symdyn_polynomial(run->method.series[0], SYMDYN_NX, run->method.order, (s - run->t_old) / run->method.unit, x);
    for (int i = 0; i < SYMDYN_NX; i++) x[i] += run->x_old[i];
    return 0;
}
