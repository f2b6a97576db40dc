// Integration of many trajectories by the explicit method of one, each with its own steps: the same steps, to the same bits. A
// lane that ends takes the next trajectory. Starts, projections, failures and outputs within a step are left to the integrator of
// one.
#pragma once

#include "batch.h"
#include "batch_type.h"
#include "simulate.h"
#if SYMDYN_EVENTS
#include "dropped_events.h"
#endif

SYMDYN_EXPORT long SYMDYN_NAME(batch_size)(void);
SYMDYN_EXPORT void SYMDYN_NAME(batch_start)(void *memory, const symdyn_batch_motions *motions);
SYMDYN_EXPORT long SYMDYN_NAME(batch_go)(void *memory, long max_steps);

// Zeros until batch_start.
typedef struct {
    symdyn_states lanes;
    symdyn_vector k[SYMDYN_STAGES + 1][SYMDYN_NX];
    symdyn_run run[SYMDYN_WIDTH];
    double numbers[SYMDYN_WIDTH][SYMDYN_NUMBERS];
    long row[SYMDYN_WIDTH], written[SYMDYN_WIDTH];  // -1: no trajectory
    symdyn_batch_motions motions;
    long next, n_done;
#if SYMDYN_SENSITIVE
    symdyn_vector tolerated[SYMDYN_NX];  // the absolute tolerances of each lane
#endif
#if SYMDYN_HAS_INPUTS
    symdyn_problem over_time;  // inputs that are the same for all, if they have pieces
#endif
#if SYMDYN_EVENTS
    long attempts[SYMDYN_WIDTH];  // attempted steps of the trajectory
#endif
} symdyn_batch;

// State and slope of a run into its lane.
static void symdyn_batch_state(symdyn_batch *batch, int l) {
    const symdyn_run *run = batch->run + l;
    for (int i = 0; i < SYMDYN_NX; i++) {
        LANE(batch->lanes.x[i], l) = run->x[i];
        LANE(batch->k[0][i], l) = run->xd[i];
    }
}

// Write the requested times that a lane has passed. Report on its trajectory if that has ended, and begin the next that does not
// end at once, if there is one.
static void symdyn_batch_next(symdyn_batch *batch, int l) {
    const symdyn_batch_motions *const motions = &batch->motions;
    symdyn_run *run = batch->run + l;
    double x0[SYMDYN_NX], *p = batch->numbers[l], *c = p + SYMDYN_NP;
    symdyn_problem problem = {.p = p, .c = c, .inputs = c + SYMDYN_NC, .project = 1};
    for (;;) {
        const long row = batch->row[l];
        if (row >= 0) {
            double *x = motions->x_out + row * motions->n_out * SYMDYN_NX;
            const int bad = run->status < 0 ? 0 : symdyn_serve(run, motions->t_out, motions->n_out, x, batch->written + l);
            if (bad) run->status = bad;
#if SYMDYN_EVENTS
            if (motions->look && (run->status != SYMDYN_STEP_LIMIT || batch->attempts[l] % motions->events_taken_after == 0))
                symdyn_drop_events(run, motions->doubts + row);
#endif
            if (run->status == SYMDYN_STEP_LIMIT) return;
#if SYMDYN_EVENTS
            if (run->status == SYMDYN_STOPPED && motions->n_out == 1 && batch->written[l] == 0)
                for (int k = 0; k < SYMDYN_NX; k++) x[k] = run->x[k];  // the end alone is kept: where it ended
#endif
            batch->row[l] = -1;
            batch->n_done++;
            SYMDYN_NAME(simulation_report)(run, motions->reports + row, motions->states + row * 2 * SYMDYN_NX);
        }
        if (batch->next >= motions->n) return;
        const long i = batch->row[l] = batch->next++;
        const int code = symdyn_lanes_take(&batch->lanes, l, i, *motions->inputs, *motions->p, p);
        batch->written[l] = 0;
#if SYMDYN_HAS_INPUTS
        problem.n_pieces = batch->over_time.n_pieces;
        problem.breaks = batch->over_time.breaks;
        problem.pieces = batch->over_time.pieces;
        problem.n_stops = batch->over_time.n_stops;
        problem.stops = batch->over_time.stops;
#endif
#if SYMDYN_HAS_CONSTRAINTS
        problem.length = motions->lengths->at[i * motions->lengths->row];
#endif
        for (int k = 0; k < SYMDYN_NX; k++) x0[k] = motions->x->at[i * motions->x->row + k * motions->x->entry];
#if SYMDYN_SENSITIVE
        const symdyn_table tolerances = *motions->tolerances;
        double atol[SYMDYN_NX];
        for (int k = 0; k < SYMDYN_NX; k++)
            atol[k] = LANE(batch->tolerated[k], l) = tolerances.at[i * tolerances.row + k * tolerances.entry];
#else
        const double *const atol = motions->atol;
#endif
        SYMDYN_NAME(simulation_start)(run, &problem, motions->span, x0, atol);
        if (code) {
            run->status = SYMDYN_NO_CONSTANTS;
            run->reason = code;
        }
#if SYMDYN_EVENTS
        batch->attempts[l] = 0;
        if (motions->look) SYMDYN_NAME(simulation_look)(run, motions->look, motions->event_spacing);
#endif
        symdyn_batch_state(batch, l);
    }
}

// The right-hand side; lanes where `failure` is set are skipped, those that fail set it.
static void symdyn_batch_eval(symdyn_batch *batch, symdyn_vector t, const symdyn_vector *y, symdyn_vector *yd, int *failure) {
#if SYMDYN_HAS_INPUTS
    double inputs[SYMDYN_NIN];
    for (int l = 0; l < SYMDYN_WIDTH && batch->over_time.n_pieces; l++) {
        if (failure[l]) continue;
        symdyn_inputs_at(&batch->over_time, LANE(t, l), 0, inputs);
        for (int i = 0; i < SYMDYN_NIN; i++) LANE(batch->lanes.inputs[i], l) = inputs[i];
    }
#endif
    symdyn_lanes fault = symdyn_lanes_rhs(&batch->lanes, t, y, yd);
    symdyn_vector rest = VECTOR(0.0);
    for (int i = 0; i < SYMDYN_NX; i++) rest = MADD(y[i] + yd[i], 0.0, rest);
    fault |= NOT_ZERO(rest);
    for (int l = 0; l < SYMDYN_WIDTH; l++)
        if (LANE(fault, l) && !failure[l]) {
            double one[SYMDYN_NX], result[SYMDYN_NX];
            for (int i = 0; i < SYMDYN_NX; i++) one[i] = LANE(y[i], l);
            failure[l] = symdyn_eval(batch->run + l, LANE(t, l), one, result);
            for (int i = 0; i < SYMDYN_NX; i++) LANE(yd[i], l) = result[i];
        }
}

// The stages of a lane into its run.
static void symdyn_batch_stages(symdyn_batch *batch, int l) {
    for (int j = 0; j < SYMDYN_STAGES + SYMDYN_SLOPE_AT_END; j++)
        for (int i = 0; i < SYMDYN_NX; i++) batch->run[l].method.k[j][i] = LANE(batch->k[j][i], l);
}

// Stage j: where it is evaluated, then its slope.
#define SYMDYN_BATCH_STAGE(j)                                                                                                    \
    for (int i = 0; i < SYMDYN_NX; i++) y[i] = x[i] + h * (SYMDYN_A_##j(k, i));                                                  \
    symdyn_batch_eval(batch, SYMDYN_C_##j(t, h, t_new), y, k[j], failure);

// Try one step in every lane.
static void symdyn_batch_attempt(symdyn_batch *batch) {
    const symdyn_vector *x = batch->lanes.x;
    symdyn_vector(*k)[SYMDYN_NX] = batch->k;
    symdyn_vector t = VECTOR(0.0), h = t, t_new = t, sum = t, sum2 = t, y[SYMDYN_NX];
    double err[SYMDYN_WIDTH];
    int failure[SYMDYN_WIDTH], late[SYMDYN_WIDTH];
#if SYMDYN_EVENTS
    int waits[SYMDYN_WIDTH] = {0};  // there is no step now
    for (int l = 0; l < SYMDYN_WIDTH && batch->motions.look; l++) {
        if (batch->row[l] < 0) continue;
        batch->attempts[l]++;
        waits[l] = symdyn_resume(batch->run + l);
        symdyn_batch_state(batch, l);
    }
#endif
    for (int l = 0; l < SYMDYN_WIDTH; l++) {
        if ((failure[l] = batch->row[l] < 0)) continue;
#if SYMDYN_EVENTS
        if ((failure[l] = waits[l])) continue;
#endif
        symdyn_propose(batch->run + l);
        LANE(t, l) = batch->run[l].t;
        LANE(h, l) = batch->run[l].h_try;
        LANE(t_new, l) = batch->run[l].t_new;
    }
    SYMDYN_EACH_STAGE(SYMDYN_BATCH_STAGE)
#if SYMDYN_SLOPE_AT_END
    for (int i = 0; i < SYMDYN_NX; i++) y[i] = x[i] + h * (SYMDYN_B(k, i));
    symdyn_batch_eval(batch, t_new, y, k[SYMDYN_STAGES], failure);
#endif
    for (int i = 0; i < SYMDYN_NX; i++) {
        const symdyn_vector e = SYMDYN_E(k, i);
        symdyn_vector size = x[i], scale;
#if SYMDYN_SECOND_ERROR
        const symdyn_vector slope = SYMDYN_B(k, i);
        const symdyn_vector e2 = SYMDYN_SECOND(k, i, slope);
        y[i] = x[i] + h * slope;
#endif
        for (int l = 0; l < SYMDYN_WIDTH; l++)
            LANE(size, l) = fabs(LANE(x[i], l)) > fabs(LANE(y[i], l)) ? fabs(LANE(x[i], l)) : fabs(LANE(y[i], l));
#if SYMDYN_SENSITIVE
        scale = 1.0 / (batch->tolerated[i] + batch->motions.span[2] * size + 1e-300);
#else
        scale = 1.0 / (batch->motions.atol[i] + batch->motions.span[2] * size + 1e-300);
#endif
        sum += (e * scale) * (e * scale);
#if SYMDYN_SECOND_ERROR
        sum2 += (e2 * scale) * (e2 * scale);
#endif
    }
    sum2 = sum + 0.01 * sum2;
    for (int l = 0; l < SYMDYN_WIDTH; l++)
        err[l] = LANE(sum2, l) > 0.0 ? fabs(LANE(h, l)) * LANE(sum, l) / sqrt(LANE(sum2, l) * SYMDYN_NX) : 0.0;
#if SYMDYN_PROJECTS
    int moved[SYMDYN_WIDTH], again[SYMDYN_WIDTH] = {0};
    for (int l = 0; l < SYMDYN_WIDTH; l++) {
        if (failure[l]) continue;
        symdyn_run *run = batch->run + l;
        double end[SYMDYN_NX];
        for (int i = 0; i < SYMDYN_NX; i++) end[i] = LANE(y[i], l);
#if SYMDYN_CROSSES
        if (err[l] > 100.0) {
            symdyn_batch_stages(batch, l);
            if ((failure[l] = again[l] = symdyn_cross(run, end, err + l))) continue;
        }
#endif
        if (err[l] <= 1.0) failure[l] = symdyn_move_end(run, run->t_new, end, moved + l);
        for (int i = 0; i < SYMDYN_NX; i++) LANE(y[i], l) = end[i];
    }
#endif
    // The slopes at the ends; methods that know them need them again where projection has moved the end.
    const symdyn_vector *end = k[SYMDYN_STAGES];
#if SYMDYN_SLOPE_AT_END && SYMDYN_PROJECTS
    symdyn_vector slope[SYMDYN_NX];
    int any = 0;
    for (int l = 0; l < SYMDYN_WIDTH; l++) any |= !(late[l] = failure[l] || !(err[l] <= 1.0) || !moved[l]);
    if (any) symdyn_batch_eval(batch, t_new, y, slope, late);
    for (int l = 0; l < SYMDYN_WIDTH; l++) {
        const int known = failure[l] || !(err[l] <= 1.0) || !moved[l];
        if (known) late[l] = failure[l] || !(err[l] <= 1.0);
        for (int i = 0; i < SYMDYN_NX; i++)
            if (known) LANE(slope[i], l) = LANE(end[i], l);
    }
    end = slope;
#endif
#if SYMDYN_SLOPE_AT_END && !SYMDYN_PROJECTS
    for (int l = 0; l < SYMDYN_WIDTH; l++) late[l] = failure[l];
#endif
#if !SYMDYN_SLOPE_AT_END
    for (int l = 0; l < SYMDYN_WIDTH; l++) late[l] = failure[l] || !(err[l] <= 1.0);
    symdyn_batch_eval(batch, t_new, y, k[SYMDYN_STAGES], late);
#endif
    for (int l = 0; l < SYMDYN_WIDTH; l++) {
        symdyn_run *run = batch->run + l;
        const double root = symdyn_root(err[l] > 1e-8 ? err[l] : 1e-8);
        double x_new[SYMDYN_NX], xd_new[SYMDYN_NX];
        if (batch->row[l] < 0) continue;
#if SYMDYN_EVENTS
        if (waits[l]) {
            symdyn_batch_next(batch, l);
            continue;
        }
#endif
#if SYMDYN_PROJECTS
        if (again[l]) continue;  // another step is tried
        if (!late[l]) symdyn_note_projection(run, moved[l]);
#endif
        for (int i = 0; i < SYMDYN_NX; i++) {
            x_new[i] = LANE(y[i], l);
            xd_new[i] = LANE(end[i], l);
        }
        symdyn_judge(run, failure[l] ? failure[l] : err[l] <= 1.0 ? late[l] : 0, err[l], root, x_new, xd_new);
        if (!run->rejected) {
            const long next = batch->written[l];
            int within = next < batch->motions.n_out && (batch->motions.t_out[next] - run->t) * run->direction < 0.0;
#if SYMDYN_EVENTS
            within |= batch->motions.look != 0;
#endif
            if (within) symdyn_batch_stages(batch, l);
#if SYMDYN_EVENTS
            if (batch->motions.look) symdyn_look_for_events(run);
#endif
            symdyn_batch_state(batch, l);
        }
        symdyn_batch_next(batch, l);
    }
}

SYMDYN_EXPORT long SYMDYN_NAME(batch_size)(void) { return (long)sizeof(symdyn_batch); }

// Begin motions; what they point to has to stay.
SYMDYN_EXPORT void SYMDYN_NAME(batch_start)(void *memory, const symdyn_batch_motions *motions) {
    symdyn_batch *const batch = (symdyn_batch *)memory;
    batch->motions = *motions;
#if SYMDYN_HAS_INPUTS
    batch->over_time.n_pieces = motions->n_pieces;
    batch->over_time.breaks = motions->breaks;
    batch->over_time.pieces = motions->pieces;
    batch->over_time.n_stops = motions->n_stops;
    batch->over_time.stops = motions->stops;
#endif
    for (int l = 0; l < SYMDYN_WIDTH; l++) {
        batch->row[l] = -1;
        symdyn_batch_next(batch, l);
    }
}

// At most so many steps in every lane; returns how many trajectories have ended.
SYMDYN_EXPORT long SYMDYN_NAME(batch_go)(void *memory, long max_steps) {
    symdyn_batch *const batch = (symdyn_batch *)memory;
    for (; max_steps > 0 && batch->n_done < batch->motions.n; max_steps--) symdyn_batch_attempt(batch);
    return batch->n_done;
}
