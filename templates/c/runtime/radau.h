// Implicit collocation by simplified Newton iteration.
#pragma once

#include "run.h"
#if SYMDYN_BANDED
#include "newton_banded.h"
#else
#include "newton_dense.h"
#endif

// out += factor matrix in, by vectors of states
static void symdyn_mix(
    int rows, int columns, const double *matrix, double factor, double in[][SYMDYN_NX], double out[][SYMDYN_NX]) {
    for (int k = 0; k < rows; k++)
        for (int j = 0; j < columns; j++)
            for (int i = 0; i < SYMDYN_NX; i++) out[k][i] += factor * matrix[k * columns + j] * in[j][i];
}

// Weights of the stages, of the error and of the gap in the polynomial of a step at theta (0 at its start, 1 at its end).
static void symdyn_weights(double theta, double *w) {
    for (int j = 0; j < SYMDYN_STAGES; j++) w[j] = theta / symdyn_c[j];
    for (int j = 0; j < SYMDYN_STAGES; j++)
        for (int k = 0; k < SYMDYN_STAGES; k++)
            if (k != j) w[j] *= (theta - symdyn_c[k]) / (symdyn_c[j] - symdyn_c[k]);
    w[SYMDYN_STAGES] = symdyn_tail[SYMDYN_TAIL - 1];
    for (int k = SYMDYN_TAIL - 2; k > 0; k--) w[SYMDYN_STAGES] = symdyn_tail[k] + theta * w[SYMDYN_STAGES];
    w[SYMDYN_STAGES] *= theta;
    w[SYMDYN_STAGES + 1] = symdyn_gap_factor * theta;
    for (int j = 0; j < SYMDYN_STAGES; j++) w[SYMDYN_STAGES + 1] *= theta - symdyn_c[j];
}

static int symdyn_begin(symdyn_run *run) {
    double r = run->rtol;
    for (int i = 0; i < SYMDYN_STATE; i++) r = fmax(r, run->atol[i]);
    run->method.ease = fmin(1.0, 10.0 * sqrt(sqrt(r)));
    run->method.tolerance = r / run->method.ease;
    run->method.tried = run->method.warm = run->method.current = 0;
    run->method.eta = run->method.theta = 1.0;
    run->method.gap = run->method.h_quiet = run->method.h_factors = 0.0;
    run->method.h_gap = run->h_max;
    return 0;
}

// The matrices of Newton's iteration for steps of length h from (t, x), factorized; those of the step
// before serve again where neither the Jacobian nor the length is another one. Returns 0 or a failure.
static int symdyn_prepare(symdyn_run *run, double h) {
    if (run->method.theta > 0.01 && !run->method.current) {
#if SYMDYN_BANDED
        const int reason = symdyn_jacobian_x_packed_at(&run->problem, run->t, run->x, run->method.jacobian);
#else
        const int reason = symdyn_jacobian_x_at(&run->problem, run->t, run->x, run->method.jacobian);
#endif
        run->n_jacobians++;
        if (reason) return symdyn_fail(run, SYMDYN_FIELD_FAILED, reason, -1, run->t, run->x);
        for (int i = 0; i < SYMDYN_ENTRIES; i++)
            if (!(fabs(run->method.jacobian[i]) <= symdyn_huge)) run->method.jacobian[i] = 0.0;  // infinite ones: no help
        run->method.current = 1;
        run->method.h_factors = 0.0;
    }
    if (h == run->method.h_factors) return 0;
    run->method.h_factors = 0.0;
    for (int k = 0; k < SYMDYN_ROOTS; k++) {
        run->n_factorizations++;
        if (symdyn_newton_matrix(&run->method, h, k)) return SYMDYN_STEP_TOO_SMALL;
    }
    run->method.h_factors = h;
    return 0;
}

// The stages z by Newton's iteration, which starts from the polynomial of the step before. Returns 0 or a failure.
static int symdyn_newton(symdyn_run *run, double h, double z[][SYMDYN_NX]) {
    const double enough = fmax(10.0 * symdyn_eps / run->method.tolerance, fmin(0.03, sqrt(run->method.tolerance)));
    double (*const before)[SYMDYN_NX] = run->method.z[run->method.accepted], f[SYMDYN_STAGES][SYMDYN_NX], w[SYMDYN_STAGES + 2],
                   size_old = 1.0, rate_old = 1.0;
    for (int k = 0; k < SYMDYN_STAGES; k++) {
        for (int i = 0; i < SYMDYN_NX; i++) z[k][i] = run->method.warm ? -before[SYMDYN_STAGES - 1][i] : 0.0;
        if (!run->method.warm) continue;
        symdyn_weights(1.0 + symdyn_c[k] * h / run->h_old, w);
        symdyn_mix(1, SYMDYN_STAGES, w, 1.0, before, z + k);
    }
    run->method.eta = pow(fmax(run->method.eta, symdyn_eps), 0.8);
    run->method.theta = 0.0;
    for (int round = 1; round <= 12; round++) {
        double y[SYMDYN_NX], r[2 * SYMDYN_ROOTS][SYMDYN_NX] = {{0.0}}, change[SYMDYN_STAGES][SYMDYN_NX] = {{0.0}}, size = 0.0;
        for (int k = 0; k < SYMDYN_STAGES; k++) {
            for (int i = 0; i < SYMDYN_NX; i++) y[i] = run->x[i] + z[k][i];
            const int failure = symdyn_eval(run, run->t + symdyn_c[k] * h, y, f[k]);
            if (failure) return failure;
        }
        symdyn_mix(SYMDYN_STAGES, SYMDYN_STAGES, symdyn_inverse[0], -1.0 / h, z, f);
        symdyn_mix(2 * SYMDYN_ROOTS, SYMDYN_STAGES, symdyn_part[0], 1.0, f, r);
        for (int k = 0; k < SYMDYN_ROOTS; k++) symdyn_newton_solve(&run->method, k, r[2 * k], r[2 * k + 1]);
        symdyn_mix(SYMDYN_STAGES, 2 * SYMDYN_ROOTS, symdyn_join[0], 1.0, r, change);
        for (int k = 0; k < SYMDYN_STAGES; k++)
            for (int i = 0; i < SYMDYN_NX; i++) z[k][i] += change[k][i];
        for (int i = 0; i < SYMDYN_NX; i++) y[i] = symdyn_scale(run, i, run->x[i] + z[SYMDYN_STAGES - 1][i]);
        for (int k = 0; k < SYMDYN_STAGES; k++)
            for (int i = 0; i < SYMDYN_NX; i++) size += change[k][i] * y[i] * change[k][i] * y[i] / (SYMDYN_STAGES * SYMDYN_NX);
        size = run->method.ease * sqrt(size);
        const double rate = size / size_old;
        if (round > 1) {
            run->method.theta = round == 2 ? rate : sqrt(rate * rate_old);
            run->method.eta = run->method.theta / (1.0 - run->method.theta);
        }
        if (!(run->method.theta < 0.99) || (round > 1 && run->method.eta * size * pow(run->method.theta, 12 - round) > enough))
            break;
        if (run->method.eta * size <= enough) return 0;
        size_old = size;
        rate_old = rate;
    }
    run->method.eta = run->method.theta = 1.0;
    return SYMDYN_STEP_TOO_SMALL;
}

// The gap between the motion and the polynomial of a step at the extra place: the defect there, divided by the matrix of the
// estimate. The estimate of the end knows nothing of it where motion is stiff: the stages, and so the end, are on the slow motion
// however long the step is. A start that is off the slow motion adds to the gap what symdyn_off times the estimate takes away;
// it is no error of the step.
static int symdyn_gap(symdyn_run *run, double h, double z[][SYMDYN_NX], double e[][SYMDYN_NX], const double *x_new, double *err) {
    double w[SYMDYN_STAGES + 2], y[SYMDYN_NX], slope[1][SYMDYN_NX] = {{0.0}}, none[SYMDYN_NX] = {0.0};
    symdyn_weights(symdyn_extra, w);
    for (int i = 0; i < SYMDYN_NX; i++) y[i] = run->x[i] + w[SYMDYN_STAGES] * e[0][i];
    symdyn_mix(1, SYMDYN_STAGES, w, 1.0, z, (double (*)[SYMDYN_NX])y);
    symdyn_mix(1, SYMDYN_STAGES, symdyn_extra_slope, 1.0 / h, z, slope);
    const int failure = symdyn_eval(run, run->t + symdyn_extra * h, y, e[1]);
    if (failure) return failure;
    for (int i = 0; i < SYMDYN_NX; i++) e[1][i] -= slope[0][i] + symdyn_extra_slope[SYMDYN_STAGES] / h * e[0][i];
    symdyn_newton_solve(&run->method, 0, e[1], none);
    for (int i = 0; i < SYMDYN_NX; i++) y[i] = e[1][i] + symdyn_off * e[0][i];
    const double gap = 0.5 * sqrt(fmin(symdyn_square(run, e[1], x_new), symdyn_square(run, y, x_new))),
                 part = h / run->method.h_gap;
    // A gap that falls off more slowly than the square of the step is rounding: for some steps it does not count.
    run->method.h_quiet = run->rejected && gap > run->method.gap * part * part ? 100.0 * fabs(h) : 0.7 * run->method.h_quiet;
    run->method.gap = gap;
    run->method.h_gap = h;
    if (fabs(h) > run->method.h_quiet) *err = fmax(*err, gap);
    return 0;
}

// The step of length h (with sign) from run->t to t_new: its end and the error relative to the tolerance.
static int symdyn_try(symdyn_run *run, double h, double t_new, double *x_new, double *y, double *err) {
    double sum[1][SYMDYN_NX] = {{0.0}}, f[SYMDYN_NX];
    int failure;
    (void)t_new;
    if (run->method.tried && !run->rejected) {
        run->method.accepted = 1 - run->method.accepted;
        run->method.warm = 1;
        run->method.current = 0;
    }
    run->method.tried = 1;
    double (*const z)[SYMDYN_NX] = run->method.z[1 - run->method.accepted],
                   (*const e)[SYMDYN_NX] = run->method.e[1 - run->method.accepted];
    do {
        if ((failure = symdyn_prepare(run, h))) return failure;
        failure = symdyn_newton(run, h, z);
    } while (failure == SYMDYN_STEP_TOO_SMALL && !run->method.current);  // an old Jacobian may be why
    if (failure) return failure;
    symdyn_mix(1, SYMDYN_STAGES, symdyn_estimate, 1.0 / h, z, sum);
    for (int i = 0; i < SYMDYN_NX; i++) x_new[i] = run->x[i] + z[SYMDYN_STAGES - 1][i];
    for (int again = 0; again < 2; again++) {
        double *const estimate = again ? y : e[0], none[SYMDYN_NX] = {0.0};
        for (int i = 0; i < SYMDYN_NX; i++) estimate[i] = (again ? f[i] : run->xd[i]) + sum[0][i];
        symdyn_newton_solve(&run->method, 0, estimate, none);
        *err = run->method.ease * sqrt(symdyn_square(run, estimate, x_new));
        // In the first step, and after a rejection, what is stiff in the error is damped once more.
        if (*err <= 1.0 || (run->method.warm && !run->rejected)) break;
        for (int i = 0; i < SYMDYN_NX; i++) y[i] = run->x[i] + e[0][i];
        if (symdyn_eval(run, run->t, y, f)) break;
    }
    return *err <= 1.0 ? symdyn_gap(run, h, z, e, x_new, err) : 0;
}

// The state at s within the latest step.
static int symdyn_between(symdyn_run *run, double s, double *x) {
    const int latest = run->rejected ? run->method.accepted : 1 - run->method.accepted;
    double w[SYMDYN_STAGES + 2];
    run->dense_ready = 1;
    symdyn_weights((s - run->t_old) / run->h_old, w);
    for (int i = 0; i < SYMDYN_NX; i++) x[i] = run->x_old[i];
    symdyn_mix(1, SYMDYN_STAGES, w, 1.0, run->method.z[latest], (double (*)[SYMDYN_NX])x);
    symdyn_mix(1, 2, w + SYMDYN_STAGES, 1.0, run->method.e[latest], (double (*)[SYMDYN_NX])x);
    return 0;
}
