// Gauss collocation of SYMDYN_STAGES stages with constant steps.
#pragma once

#include "run.h"

// States first .. last - 1 of all stages from the increments L, and the largest change of each.
static inline void symdyn_stage_states(const double *x, const double *low, double (*restrict L)[SYMDYN_NX], int first, int last,
    double (*restrict y)[SYMDYN_NX], double *restrict change) {
    double sum[SYMDYN_NX];
    for (int k = first; k < last; k++) change[k] = 0.0;
    for (int i = 0; i < SYMDYN_STAGES; i++) {
        for (int k = first; k < last; k++) sum[k] = low[k];
        for (int j = 0; j < SYMDYN_STAGES; j++)
            for (int k = first; k < last; k++) sum[k] += symdyn_ratios[i][j] * L[j][k];
        for (int k = first; k < last; k++) {
            const double far = fabs(x[k] + sum[k] - y[i][k]);
            change[k] = far > change[k] ? far : change[k];
            y[i][k] = x[k] + sum[k];
        }
    }
}

// The end x_new + low_new of a step h from (t, x + low), `from` the latest one's start (0) or end (1). Sweeps end when no state
// changes less than it did before: what is left is rounding then. If they end at a tolerance, energy drifts.
static int symdyn_collocate(
    symdyn_run *run, double t, double h, const double *x, const double *low, double from, double *x_new, double *low_new) {
    const double ratio = fabs(h - run->method.h_L) < 1e-6 * fabs(h) ? 1.0 : h / run->method.h_L;
    const int known = run->method.h_L != 0.0, stale = known && (from != run->method.from || ratio != run->method.ratio);
    double L[SYMDYN_STAGES][SYMDYN_NX] = {{0.0}}, y[SYMDYN_STAGES][SYMDYN_NX] = {{0.0}}, f[SYMDYN_NX];
    double change[SYMDYN_NX], least[SYMDYN_NX];
    for (int i = 0; i < SYMDYN_STAGES; i++)
        for (int j = 0; j < SYMDYN_STAGES; j++) {
            if (stale) {
                run->method.from = from;
                run->method.ratio = ratio;
                run->method.E[i][j] = ratio * symdyn_b[i] / symdyn_b[j];
            }
            for (int k = 0; stale && k < SYMDYN_STAGES; k++)
                if (k != j) run->method.E[i][j] *= (from + ratio * symdyn_c[i] - symdyn_c[k]) / (symdyn_c[j] - symdyn_c[k]);
            for (int k = 0; k < SYMDYN_NX; k++)
                L[i][k] += known ? run->method.E[i][j] * run->method.L[j][k] : h * symdyn_b[i] * symdyn_b[j] * run->xd[k];
        }
    for (int k = 0; k < SYMDYN_NX; k++) least[k] = symdyn_huge;
#if SYMDYN_SECOND_ORDER
    symdyn_stage_states(x, low, L, SYMDYN_NQ, SYMDYN_NX, y, change);
#endif
    for (int sweep = 0, idle = 1;; sweep++, idle++) {  // where q_dot = u: speeds, then coordinates from them
        double moved = 0.0, size = 0.0;
        symdyn_stage_states(x, low, L, 0, SYMDYN_SECOND_ORDER ? SYMDYN_NQ : SYMDYN_NX, y, change);
        for (int i = 0; i < SYMDYN_STAGES; i++) {
            const int failure = symdyn_eval(run, t + symdyn_c[i] * h, y[i], f);
            if (failure) return failure;
            for (int k = (SYMDYN_SECOND_ORDER ? SYMDYN_NQ : 0); k < SYMDYN_NX; k++) L[i][k] = h * symdyn_b[i] * f[k];
        }
#if SYMDYN_SECOND_ORDER
        symdyn_stage_states(x, low, L, SYMDYN_NQ, SYMDYN_NX, y, change);
        for (int i = 0; i < SYMDYN_STAGES; i++)
            for (int k = 0; k < SYMDYN_NQ; k++) L[i][k] = h * symdyn_b[i] * y[i][SYMDYN_NQ + k];
#endif
        for (int k = 0; k < SYMDYN_NX; k++) {
            if (change[k] > 0.0 && change[k] < least[k]) {
                least[k] = change[k];
                idle = 0;
            }
            moved += change[k] * change[k];
            size += x[k] * x[k] + y[0][k] * y[0][k];
        }
        if (sweep && idle && moved <= 1e-24 * size) break;
        if (sweep == 60 || idle == 4) {  // no fixed point: the step is too long
            run->reason = 0;
            run->bad_index = -1;
            return SYMDYN_STEP_TOO_SMALL;
        }
    }
    for (int k = 0; k < SYMDYN_NX; k++) {  // two-sum
        double sum = low[k];
        for (int i = 0; i < SYMDYN_STAGES / 2; i++) sum += L[i][k] + L[SYMDYN_STAGES - 1 - i][k];
        const double end = x[k] + sum, back = end - x[k];
        low_new[k] = (x[k] - (end - back)) + (sum - back);
        x_new[k] = end;
        for (int i = 0; from >= 1.0 && i < SYMDYN_STAGES; i++) run->method.L[i][k] = L[i][k];
    }
    run->method.h_L = from >= 1.0 ? h : run->method.h_L;
    return 0;
}

// A whole number of steps to the end, each no longer than h.
static void symdyn_grid(symdyn_run *run, double h) {
    run->method.t_first = run->t;
    run->method.n_whole = 0;
    run->method.n_given_up *= run->method.fixed;
    run->method.h_whole = fabs(run->t_end - run->t);
    run->method.h_whole /= ceil(run->method.h_whole / fmin(h, run->h_max) * (1.0 - 1e-12));
}

static int symdyn_begin(symdyn_run *run) {
    run->method.fixed = run->method.fixed || run->h > 0.0;
    symdyn_grid(run, run->h > 0.0 ? run->h : run->method.h_whole > 0.0 ? run->method.h_whole : fabs(run->t_end - run->t) / 16.0);
    for (int k = 0; k < SYMDYN_NX; k++) run->method.low[k] = run->method.low_new[k] = run->method.h_L = 0.0;
    return 0;
}

// The next step: a whole one, or a part of one that was given up. The first one says how long they are; where more than one in
// eight is given up, they get shorter. A length that was requested is given up only where the sweeps find no end.
static int symdyn_ahead(symdyn_run *run) {
    const double left = fabs(run->method.t_first + run->direction * (double)run->method.n_whole * run->method.h_whole - run->t);
    const int first = run->rejected && !run->method.fixed && run->n_steps == 0,
              part = !first && left > 1e-6 * run->method.h_whole;
    if (run->rejected)
        run->method.h_L = 0.0;
    else
        for (int k = 0; k < SYMDYN_NX; k++) run->method.low[k] = run->method.low_new[k];
    if (part
        && fmin(left, run->method.fixed ? fabs(run->h_try) : left)
            > (1.0 - 1e-6) * run->method.h_whole) {  // each that was requested once
        run->method.n_given_up++;
        run->method.t_rough = run->method.n_rough ? run->method.t_rough : run->t;
    }
    if (first)
        symdyn_grid(run, 0.8 * run->h);
    else if (!part && !run->method.fixed && 8 * run->method.n_given_up > 32 + run->method.n_whole)
        symdyn_grid(run, 0.75 * run->method.h_whole);
    run->method.n_whole += !part;
    if (part && !run->rejected && left > 64.0 * run->h) run->h *= 4.0;  // away from what made them so short
    run->h = part ? left / ceil(left / run->h * (1.0 - 1e-6)) : run->method.h_whole;
    return SYMDYN_STEP_LIMIT;
}

// Distance of the end of the step from that of two halves, in the root mean square, 1 where it is tolerated.
static double symdyn_halved(symdyn_run *run, double h, const double *x_new) {
    double x[2][SYMDYN_NX], low[2][SYMDYN_NX];
    run->method.n_halved++;
    if (symdyn_collocate(run, run->t, 0.5 * h, run->x, run->method.low, 0.0, x[0], low[0])) return 0.0;
    if (symdyn_collocate(run, run->t + 0.5 * h, 0.5 * h, x[0], low[0], 0.5, x[1], low[1])) return 0.0;
    for (int k = 0; k < SYMDYN_NX; k++) x[1][k] -= x_new[k];
    return sqrt(symdyn_square(run, x[1], x_new));
}

// Coefficients of the slopes in Legendre polynomials fall off at a rate that the last two show; of twice as many the last one is
// about the error, within a factor of 10 over 10 decades for pendulums and chains. At a kink they stop to fall off: where those
// of degrees 5 to 7 are not small compared with 3 and 4, rough becomes the square of the error that the rate between these would
// make.
static double symdyn_error(const symdyn_run *run, const double *x_new, double *rough) {
    double all = 1e-300, last[2] = {0.0, 0.0};
    for (int k = 0; k < SYMDYN_NX; k++) {
        const double scale = symdyn_scale(run, k, x_new[k]);
        double sum[5] = {0.0, 0.0, 0.0, 0.0, 0.0},
               scaled[2] = {0.0, 0.0};  // of degrees SYMDYN_STAGES - 2, SYMDYN_STAGES - 1, 3, 4, 5
        for (int i = 0; i < SYMDYN_STAGES; i++) all += run->method.L[i][k] * scale * (run->method.L[i][k] * scale) / symdyn_b[i];
        for (int i = 0; i < SYMDYN_STAGES; i++)
            for (int p = 0; p < 2; p++) scaled[p] += symdyn_legendre[p][i] * run->method.L[i][k] * scale;
        for (int i = 0; i < SYMDYN_STAGES; i++)
            for (int p = 0; p < 5; p++) sum[p] += symdyn_legendre[p][i] * run->method.L[i][k];
        for (int p = 0; p < 2; p++) last[p] += scaled[p] * scaled[p];
        const double late = sum[0] * sum[0] + sum[1] * sum[1], later = late + sum[4] * sum[4];
        const double ratio = later / (sum[2] * sum[2] + sum[3] * sum[3] + 1e-300);
        if (late * scale * scale >= 20.0 && ratio > 0.09)
            *rough = fmax(*rough, later * scale * scale * (ratio * ratio) * (ratio * ratio));
    }
    if (run->method.fixed && *rough <= 400.0) return 0.0;
    const double exponents[2] = {(double)SYMDYN_STAGES / (SYMDYN_STAGES - 2), (double)SYMDYN_STAGES / (SYMDYN_STAGES - 1)};
    return sqrt(all / SYMDYN_NX) * fmax(pow(last[0] / all, exponents[0]), pow(last[1] / all, exponents[1]));
}

// One rough step in a hundred is done again by halves, which give its error.
static int symdyn_try(symdyn_run *run, double h, double t_new, double *x_new, double *xd_new, double *err) {
    (void)xd_new;
    const int failure = symdyn_collocate(run, run->t, h, run->x, run->method.low, 1.0, x_new, run->method.low_new);
    if (failure) return failure;
    double rough = 0.0;
    const double estimate = symdyn_error(run, x_new, &rough);
    if (!run->method.fixed) *err = estimate;
    if (*err <= 1.0 && rough > 400.0 * (1.0 + estimate) * (1.0 + estimate) && 100 * run->method.n_halved <= run->n_steps
        && symdyn_halved(run, h, x_new) > 10.0 * (1.0 + estimate)) {
        run->method.n_rough++;
        run->method.t_rough = t_new;
    }
    return 0;
}

// The state at s within the latest step, by a step of its own from its start: as exact as the ends, which no polynomial is.
static int symdyn_between(symdyn_run *run, double s, double *x) {
    double cut[SYMDYN_NX];
    return symdyn_collocate(run, run->t_old, s - run->t_old, run->x_old, run->method.low, 0.0, x, cut);
}
