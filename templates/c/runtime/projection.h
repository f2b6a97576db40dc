// Projection of a state onto what holds for it: unit vectors keep their length, positions and speeds their constraints.
#pragma once

#include "run.h"

#if SYMDYN_HAS_UNIT_GROUPS
// Divide vectors of length 1 by their norm.
SYMDYN_LINKED void symdyn_normalise(double *x) {
    for (int group = 0; group < SYMDYN_UNIT_GROUPS; group++) {
        const int *const index = symdyn_unit_groups[group];
        double square = x[index[0]] * x[index[0]];
        for (int k = 1; k < SYMDYN_UNIT_SIZE && index[k] >= 0; k++) square += x[index[k]] * x[index[k]];
        const double factor = 1.0 / sqrt(square);
        for (int k = 0; k < SYMDYN_UNIT_SIZE && index[k] >= 0; k++) x[index[k]] *= factor;
    }
}
#endif

#if SYMDYN_HAS_CONSTRAINTS
// The reason why a function has no finite result; noted in the run.
static int symdyn_reason_of(symdyn_run *run, int reason, const double *out, int n) {
    run->reason = reason;
    if (!reason && !symdyn_all_finite(out, n)) run->reason = SYMDYN_NOT_FINITE;
    return run->reason;
}

// Rest after a projection: largest residuals of positions and speeds, relative to the length and to the largest speed, and what
// rounding may leave of positions: SYMDYN_ROUNDING, or 4 eps |q| / length where that is more. Coordinates are known to eps |q|
// only, |q| the largest of them in m (angles times the length), so that far away the residuals are no smaller; within 100 lengths
// or rad nothing of this is felt. The first that is too large, of positions also above four times the rounding, is noted.
static int symdyn_left(symdyn_run *run, double t, const double *x, double *left, double *rounding) {
    const double length = run->problem.length, *u = x + SYMDYN_NQ;
    double speed = SYMDYN_SLOWEST * length, far = 0.0, out[2 * SYMDYN_ROWS];
    const int reason = symdyn_violation_at(&run->problem, t, x, out);
    if (symdyn_reason_of(run, reason, out, 2 * SYMDYN_ROWS)) return 1;
    for (int i = 0; i < SYMDYN_NU; i++) speed = fmax(speed, fabs(u[i]) * (symdyn_turning[i] ? length : 1.0));
    for (int i = 0; i < SYMDYN_NQ; i++) far = fmax(far, fabs(x[i]) * (symdyn_angles[i] ? length : 1.0));
    *rounding = fmax(SYMDYN_ROUNDING, SYMDYN_RESOLVED * far / length);
    run->worst = run->of_speeds = -1;
    for (int k = 0; k < 2; k++) {
        const double scale = k ? speed : length, *const row = out + SYMDYN_ROWS * k;
        int most = 0;
        left[k] = 0.0;
        for (int i = 0; i < SYMDYN_ROWS; i++)
            if (fabs(row[i]) > left[k] * scale) {
                left[k] = fabs(row[i]) / scale;
                most = i;
            }
        if (left[k] > (k ? SYMDYN_TOO_MUCH_OF_SPEEDS : fmax(SYMDYN_TOO_MUCH, SYMDYN_FAILED_TIMES * *rounding))
            && run->of_speeds < 0) {
            run->residual = left[k] * scale;
            run->worst = most;
            run->of_speeds = k;
        }
    }
    return 0;
}

// A Newton step to C(t, q) = 0, the smallest change in the metric of the mass matrix, unless the residual is rounding.
static int symdyn_correct_positions(symdyn_run *run, double t, double *x) {
    double residual = 0.0, out[SYMDYN_ROWS + SYMDYN_NQ];
    run->n_corrections++;
    const int reason = symdyn_position_correction_at(&run->problem, t, x, out);
    if (symdyn_reason_of(run, reason, out, SYMDYN_ROWS + SYMDYN_NQ)) return 1;
    for (int i = 0; i < SYMDYN_ROWS; i++) residual = fmax(residual, fabs(out[i]));
    if (!(residual > SYMDYN_SOLVED * run->problem.length)) return 0;
    for (int i = 0; i < SYMDYN_NQ; i++) x[i] += out[SYMDYN_ROWS + i];
#if SYMDYN_HAS_UNIT_GROUPS
    symdyn_normalise(x);
#endif
    return 0;
}

// The smallest change of the speeds that makes C_r u + C_t = 0.
static int symdyn_correct_speeds(symdyn_run *run, double t, double *x) {
    double out[SYMDYN_ROWS + SYMDYN_NU];
    run->n_corrections++;
    const int reason = symdyn_velocity_correction_at(&run->problem, t, x, out);
    if (symdyn_reason_of(run, reason, out, SYMDYN_ROWS + SYMDYN_NU)) return 1;
    for (int i = 0; i < SYMDYN_NU; i++) x[SYMDYN_NQ + i] += out[SYMDYN_ROWS + i];
    return 0;
}

// Corrections of positions, while they are off by more than rounding, each with one of the speeds, until residuals are at
// rounding level, or shrink no further. Returns 0, or 1 if that is too early, or there is no such correction.
static int symdyn_corrections(symdyn_run *run, double t, double *x) {
    double left[2] = {1e300, 1e300}, rounding = SYMDYN_ROUNDING;
    for (int k = 0, shrinks = 1; k < SYMDYN_PROJECTION_ROUNDS && shrinks; k++) {
        const double before[2] = {left[0], left[1]};
        if (left[0] > rounding && symdyn_correct_positions(run, t, x)) return 1;
        if (symdyn_correct_speeds(run, t, x)) return 1;
        if (symdyn_left(run, t, x, left, &rounding)) return 1;
        shrinks = (left[0] > rounding && left[0] < SYMDYN_SHRINKS * before[0])
            || (left[1] > SYMDYN_ROUNDING && left[1] < SYMDYN_SHRINKS * before[1]);
    }
    return run->of_speeds >= 0;
}
#endif

#if SYMDYN_SENSITIVE
// Put the columns of sensitivities of a state on the constraints onto what derivatives fulfil there. Returns 0 or 1.
SYMDYN_LINKED int symdyn_correct_columns(symdyn_run *run, double t, double *x) {
    enum { WIDTH = SYMDYN_NQ + SYMDYN_NU };
    double out[SYMDYN_COLUMNS * WIDTH];
    run->reason = symdyn_corrected_columns_at(&run->problem, t, x, out);
    if (!run->reason && !symdyn_all_finite(out, SYMDYN_COLUMNS * WIDTH)) run->reason = SYMDYN_NOT_FINITE;
    if (run->reason) return 1;
    for (int j = 0; j < SYMDYN_COLUMNS; j++)
        for (int i = 0; i < WIDTH; i++) x[SYMDYN_STATE * (j + 1) + i] = out[WIDTH * j + i];
    return 0;
}
#endif

// Project x at t, in place: q first, then u. Returns 0 or PROJECTION_FAILED.
SYMDYN_LINKED int symdyn_correct(symdyn_run *run, double t, double *x) {
    run->dq = run->du = run->residual = 0.0;
    run->reason = run->of_speeds = 0;
    run->worst = -1;
    for (int i = 0; i < SYMDYN_NX; i++) run->before[i] = x[i];
#if SYMDYN_HAS_UNIT_GROUPS
    symdyn_normalise(x);
#endif
#if SYMDYN_HAS_CONSTRAINTS
    if (symdyn_corrections(run, t, x)) return symdyn_fail(run, SYMDYN_PROJECTION_FAILED, run->reason, run->worst, t, run->before);
#endif
#if SYMDYN_SENSITIVE
    if (symdyn_correct_columns(run, t, x)) return symdyn_fail(run, SYMDYN_PROJECTION_FAILED, run->reason, -1, t, run->before);
#endif
    (void)t;
    for (int i = 0; i < SYMDYN_NQ; i++) run->dq += (x[i] - run->before[i]) * (x[i] - run->before[i]);
    for (int i = SYMDYN_NQ; i < SYMDYN_NQ + SYMDYN_NU; i++) run->du += (x[i] - run->before[i]) * (x[i] - run->before[i]);
    run->dq = sqrt(run->dq);
    run->du = sqrt(run->du);
    return 0;
}

// Project the end x of the step under way from run->x; moved: whether by more than a thousandth of the tolerance. Returns 0 or a
// failure.
static int symdyn_move_end(symdyn_run *run, double t, double *x, int *moved) {
    double way = 0.0, size = 0.0, far[2] = {0.0, 0.0}, change[SYMDYN_NX];
    int failure;
    *moved = run->end_moved = 0;
    for (int i = 0; i < SYMDYN_NX; i++) run->x_end[i] = x[i];
    if (run->problem.project && (failure = symdyn_correct(run, t, x))) return failure;
    for (int i = 0; i < SYMDYN_NX; i++) change[i] = x[i] - run->x_end[i];
    run->moved = sqrt(symdyn_square(run, change, x));
    for (int i = 0; i < SYMDYN_NQ + SYMDYN_NU; i++) far[i >= SYMDYN_NQ] = fmax(far[i >= SYMDYN_NQ], fabs(x[i]));
    for (int i = 0; i < SYMDYN_NQ + SYMDYN_NU; i++)
        *moved |= fabs(x[i] - run->x_end[i]) > SYMDYN_NOTICED * (run->atol[i] + run->rtol * fabs(x[i]))
                + SYMDYN_NOTICED_ROUNDINGS * symdyn_eps * far[i >= SYMDYN_NQ];
#if SYMDYN_SENSITIVE
    for (int i = SYMDYN_STATE; i < SYMDYN_NX; i++)
        *moved |= fabs(x[i] - run->x_end[i])
            > SYMDYN_NOTICED * (run->atol[i] + run->rtol * fabs(x[i])) + SYMDYN_NOTICED_ROUNDINGS * symdyn_eps * fabs(x[i]);
#endif
    for (int i = 0; i < SYMDYN_NQ; i++) {
        way += (run->x_end[i] - run->x[i]) * (run->x_end[i] - run->x[i]);
        size += x[i] * x[i];
    }
    double most = SYMDYN_PART_OF_WAY * sqrt(way) + SYMDYN_PART_OF_SIZE * sqrt(size);
#if SYMDYN_HAS_CONSTRAINTS
    most += SYMDYN_PART_OF_SIZE * run->problem.length;
#endif
    // More than half the way of the step is no correction but a jump, to another branch maybe.
    return run->dq > most ? symdyn_fail(run, SYMDYN_PROJECTION_FAILED, 0, -1, t, run->x_end) : 0;
}

// Record a projection, once the derivative is known where it leads to.
static void symdyn_note_projection(symdyn_run *run, int moved) {
    run->end_moved = moved;
    run->n_corrected += moved;
    run->largest_dq = fmax(run->largest_dq, run->dq);
    run->largest_du = fmax(run->largest_du, run->du);
    if (run->moved > run->largest_moved) {
        run->largest_moved = run->moved;
        run->t_moved = run->t_new;
    }
}

// Project the end x of the step under way from run->x; xd becomes the derivative there. Returns 0 or a failure.
SYMDYN_LINKED int symdyn_project_end(symdyn_run *run, double t, double *x, double *xd) {
    int moved, failure = symdyn_move_end(run, t, x, &moved);
    if (failure) return failure;
    if ((moved || !SYMDYN_SLOPE_AT_END) && (failure = symdyn_eval(run, t, x, xd))) return failure;
    symdyn_note_projection(run, moved);
    return 0;
}
