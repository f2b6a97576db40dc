// An instance of a mechanism in an FMU: its values, what is computed from them, steps of co-simulation, events, copies of its
// state. Instances share nothing but constants.
#pragma once

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmu_model.h"

// Values by reference: the time, then states, their derivatives, inputs, parameters, outputs (energies last), event indicators.
enum {
    FMU_OF_X = 1,
    FMU_OF_RATES = FMU_OF_X + FMU_N_X,
    FMU_OF_INPUTS = FMU_OF_RATES + FMU_N_X,
    FMU_OF_P = FMU_OF_INPUTS + FMU_N_INPUTS,
    FMU_OF_OUTPUTS = FMU_OF_P + FMU_N_P,
    FMU_OF_EVENTS = FMU_OF_OUTPUTS + FMU_N_OUTPUTS,
    FMU_END = FMU_OF_EVENTS + FMU_N_EVENTS
};
enum { FMU_INSTANTIATED, FMU_INITIALIZATION, FMU_EVENT_MODE, FMU_CONTINUOUS, FMU_STEPPING, FMU_TERMINATED };
enum { FMU_GOOD = 0, FMU_FAILED = 1, FMU_STOPPED = 2 };
enum { FMU_ROWS = FMU_N_X + FMU_N_OUTPUTS };

// All that a copy of the state holds, besides the memory of the integrator.
typedef struct {
    double t, x[FMU_N_X], inputs[FMU_N_INPUTS + 1], p[FMU_N_P + 1], c[FMU_N_C + 1], length;
    double t_end, tolerance, first_step;  // t_end: of the whole simulation, where it has one
    double side[FMU_N_EVENTS + 1];        // sign of each event indicator when it was looked at last
    double run_end;                       // where the run of the integrator ends, where it runs
    double breaks[2], pieces[4 * FMU_N_INPUTS + 1];
    int mode, has_end, constants, running, drifted, stopped;
} fmu_state;

typedef struct fmu_instance {
    fmu_state s;
    // Results for the present values, where they are computed.
    int has_rates, has_outputs, has_derivatives;
    double rates[FMU_N_X], outputs[FMU_N_OUTPUTS + 1];
    double by_x[FMU_ROWS * FMU_N_X], by_inputs[FMU_ROWS * FMU_N_INPUTS + 1], by_p[FMU_ROWS * FMU_N_P + 1];
#if FMU_N_EVENTS
    symdyn_noted noted[FMU_FUNCTION(most_events)];
    double noted_states[FMU_FUNCTION(most_events) * 2 * FMU_N_X];
#endif
    symdyn_problem problem;
    int may_return_early;
    void *run, *block;
    long run_size;
    void *environment;
    void (*log)(void);  // the importer's function, of the type that its version of FMI has
    char *name;
    char message[600];
} fmu_instance;

// Hands a message to the importer; each version of FMI has its own.
static void fmu_log(fmu_instance *f, int failed, const char *message);

static int fmu_fail(fmu_instance *f, const char *what, const char *why) {
    snprintf(f->message, sizeof f->message, "%s at t = %.9g s: %s", what, f->s.t, why);
    fmu_log(f, 1, f->message);
    return FMU_FAILED;
}

static int fmu_finite(const double *values, int n) {
    for (int i = 0; i < n; i++)
        if (!(values[i] - values[i] == 0.0)) return 0;
    return 1;
}

// Results that follow from the present values are to be computed again.
static void fmu_changed(fmu_instance *f) { f->has_rates = f->has_outputs = f->has_derivatives = 0; }

// Values at the start, as they are before anything is set.
static void fmu_reset(fmu_instance *f) {
    static const fmu_state empty;
    f->s = empty;
    memcpy(f->s.x, fmu_start_x, FMU_N_X * sizeof(double));
    memcpy(f->s.inputs, fmu_start_inputs, FMU_N_INPUTS * sizeof(double));
    memcpy(f->s.p, fmu_start_p, FMU_N_P * sizeof(double));
    f->s.tolerance = FMU_TOLERANCE;
    f->s.length = 1.0;
    fmu_changed(f);
}

// A new instance, or none where the token is another model's or there is no memory.
static fmu_instance *fmu_new(const char *name, const char *token) {
    const long size = FMU_FUNCTION(simulation_size)();
    if (!token || strcmp(token, FMU_TOKEN)) return NULL;
    fmu_instance *const f = calloc(1, sizeof(fmu_instance));
    void *const block = calloc(1, (size_t)size + 64);
    char *const copy = calloc(1, name ? strlen(name) + 1 : 1);
    if (!f || !block || !copy) {
        free(f);
        free(block);
        free(copy);
        return NULL;
    }
    if (name) strcpy(copy, name);
    f->name = copy;
    f->block = block;
    f->run = (char *)block + (64 - (size_t)block % 64) % 64;
    f->run_size = size;
    fmu_reset(f);
    return f;
}

static void fmu_free(fmu_instance *f) {
    if (!f) return;
    free(f->block);
    free(f->name);
    free(f);
}

// The constants that follow from the parameters.
static int fmu_constants(fmu_instance *f) {
    fmu_state *const s = &f->s;
    if (!s->constants) {
        int code = FMU_FUNCTION(prologue)(s->p, s->c);
        if (!code && !fmu_finite(s->c, FMU_N_C)) code = -1;
#if FMU_N_ROWS
        if (!code) code = fmu_length(s->t, s->x, s->inputs, s->p, s->c, &s->length);
#endif
        if (code) return fmu_fail(f, "the parameters", FMU_FUNCTION(reason)(code));
        s->constants = 1;
    }
    f->problem.p = s->p;
    f->problem.c = s->c;
    f->problem.inputs = s->inputs;
    f->problem.project = 1;
    f->problem.length = s->length;
#if FMU_MOTIONS
    f->problem.n_pieces = 1;
    f->problem.breaks = s->breaks;
    f->problem.pieces = s->pieces;
#endif
    return FMU_GOOD;
}

// Evaluates a function of the mechanism at the present values, n results.
typedef int fmu_function(double t, const double *x, const double *inputs, const double *p, const double *c, double *out);
static int fmu_evaluate(fmu_instance *f, fmu_function *function, const char *what, int n, double *out) {
    fmu_state *const s = &f->s;
    if (fmu_constants(f)) return FMU_FAILED;
    int code = function(s->t, s->x, s->inputs, s->p, s->c, out);
    if (!code && !fmu_finite(out, n)) code = -1;
    return code ? fmu_fail(f, what, FMU_FUNCTION(reason)(code)) : FMU_GOOD;
}

static int fmu_rates_now(fmu_instance *f) {
    if (f->has_rates) return FMU_GOOD;
    if (fmu_evaluate(f, fmu_rhs, "the right-hand side", FMU_N_X, f->rates)) return FMU_FAILED;
    f->has_rates = 1;
    return FMU_GOOD;
}

static int fmu_outputs_now(fmu_instance *f) {
    if (f->has_outputs) return FMU_GOOD;
    if (fmu_evaluate(f, fmu_outputs, "the outputs", FMU_N_OUTPUTS, f->outputs)) return FMU_FAILED;
    f->has_outputs = 1;
    return FMU_GOOD;
}

// Motions at the time t of a step: each goes on from its value with its rate and its acceleration; other inputs are held.
static void fmu_take_motions(fmu_state *s, double t, double end) {
#if FMU_MOTIONS
    for (int k = 0; k < FMU_N_INPUTS; k++)
        for (int j = 0; j < 4; j++) s->pieces[4 * k + j] = j ? 0.0 : s->inputs[k];
    for (int m = 0; m < FMU_MOTIONS; m++) {
        const int *const at = fmu_motions[m];
        const double rate = s->inputs[at[1]], acceleration = s->inputs[at[2]];
        s->pieces[4 * at[0] + 1] = rate;
        s->pieces[4 * at[0] + 2] = 0.5 * acceleration;
        s->pieces[4 * at[1] + 1] = acceleration;
    }
    s->breaks[0] = t;
    s->breaks[1] = end;
#else
    (void)s;
    (void)t;
    (void)end;
#endif
}

// Why the integrator stopped.
static int fmu_run_failed(fmu_instance *f, int status) {
    symdyn_report report;
    double states[2 * FMU_N_X];
    FMU_FUNCTION(simulation_report)(f->run, &report, states);
    char why[300];
    snprintf(why, sizeof why, "%s%s%s", symdyn_status_text(status), report.reason ? ": " : "",
        report.reason ? FMU_FUNCTION(reason)(report.reason) : "");
    f->s.running = 0;
    return fmu_fail(f, "the integrator stopped", why);
}

// Starts a run from the present state to `end`; at once at its end where there is only a projection to be done.
static int fmu_start_run(fmu_instance *f, double end) {
    fmu_state *const s = &f->s;
    double atol[FMU_N_X];
    if (fmu_constants(f)) return FMU_FAILED;
    fmu_take_motions(s, s->t, end);
    for (int i = 0; i < FMU_N_X; i++) atol[i] = s->tolerance;
    const double span[] = {s->t, end, s->tolerance, s->first_step < end - s->t ? s->first_step : 0.0, 0.0};
    const int status = FMU_FUNCTION(simulation_start)(f->run, &f->problem, span, s->x, atol);
    if (status < 0) return fmu_run_failed(f, status);
#if FMU_N_EVENTS
    int look[FMU_N_EVENTS];
    for (int k = 0; k < FMU_N_EVENTS; k++) look[k] = 1;
    FMU_FUNCTION(simulation_look)(f->run, look, 0.0);
#endif
    s->run_end = end;
    s->running = 1;
    return FMU_GOOD;
}

// Puts the state onto the constraints, unit vectors to length 1.
static int fmu_project(fmu_instance *f) {
#if FMU_PROJECTS
    symdyn_report report;
    double states[2 * FMU_N_X];
    if (fmu_start_run(f, f->s.t)) return FMU_FAILED;
    FMU_FUNCTION(simulation_report)(f->run, &report, states);
    memcpy(f->s.x, states, FMU_N_X * sizeof(double));
    f->s.running = 0;
    fmu_changed(f);
#else
    (void)f;
#endif
    return FMU_GOOD;
}

// Whether the state has left the constraints, or unit vectors length 1, by more than a tenth of the tolerance.
static int fmu_has_drifted(fmu_instance *f, int *drifted) {
    *drifted = 0;
#if FMU_N_ROWS
    double left[2 * FMU_N_ROWS], speed = 1e-5 * f->s.length;
    if (fmu_evaluate(f, fmu_violation, "the constraints", 2 * FMU_N_ROWS, left)) return FMU_FAILED;
    for (int i = 0; i < FMU_N_U; i++) {
        const double u = f->s.x[FMU_N_Q + i] * (fmu_turning[i] ? f->s.length : 1.0);
        speed = u > speed ? u : -u > speed ? -u : speed;
    }
    for (int i = 0; i < 2 * FMU_N_ROWS; i++) {
        const double most = 0.1 * f->s.tolerance * (i < FMU_N_ROWS ? f->s.length : speed);
        *drifted |= left[i] > most || -left[i] > most;
    }
#endif
#ifdef FMU_UNIT_GROUPS
    for (int k = 0; k < FMU_UNIT_GROUPS; k++) {
        double off = -1.0;
        for (int i = 0; i < FMU_UNIT_SIZE && fmu_unit_groups[k][i] >= 0; i++)
            off += f->s.x[fmu_unit_groups[k][i]] * f->s.x[fmu_unit_groups[k][i]];
        *drifted |= off > 0.1 * f->s.tolerance || -off > 0.1 * f->s.tolerance;
    }
#endif
    (void)f;
    return FMU_GOOD;
}

// The event indicators at the present values.
static int fmu_events_now(fmu_instance *f, double *values) {
#if FMU_N_EVENTS
    return fmu_evaluate(f, fmu_events, "the events", FMU_N_EVENTS, values);
#else
    (void)f;
    (void)values;
    return FMU_GOOD;
#endif
}

// Notes on which side of zero the event indicators are.
static int fmu_note_sides(fmu_instance *f) {
    double values[FMU_N_EVENTS + 1];
    if (fmu_events_now(f, values)) return FMU_FAILED;
    for (int k = 0; k < FMU_N_EVENTS; k++) f->s.side[k] = (values[k] > 0.0) - (values[k] < 0.0);
    return FMU_GOOD;
}

// Event mode of model exchange: resets of the events whose indicators have passed zero in the direction that counts, with the
// state on the constraints. changed: whether the state is another one. Returns FMU_STOPPED where an event ends the simulation.
static int fmu_discrete(fmu_instance *f, int *changed) {
    int stopped = 0;
    *changed = 0;
#if FMU_N_EVENTS
    double values[FMU_N_EVENTS];
    int fired[FMU_N_EVENTS], resets = 0;
    if (fmu_events_now(f, values)) return FMU_FAILED;
    for (int k = 0; k < FMU_N_EVENTS; k++) {
        const double side = f->s.side[k];
        const int direction = fmu_event[k].direction;
        fired[k] = side != 0.0 && values[k] * side <= 0.0 && (direction == 0 || direction == -side);
        stopped |= fired[k] && fmu_event[k].stops;
        resets |= fired[k] && fmu_event[k].resets;
        f->s.side[k] = fired[k] && values[k] == 0.0 ? -side : (values[k] > 0.0) - (values[k] < 0.0);
    }
    if (resets && !stopped) {
        double after[FMU_N_X];
        f->s.first_step = 0.0;
        if (fmu_start_run(f, f->s.t)) return FMU_FAILED;
        const int status = FMU_FUNCTION(simulation_reset)(f->run, fired, after);
        if (status < 0) return fmu_run_failed(f, status);
        memcpy(f->s.x, after, sizeof after);
        f->s.running = 0;
        fmu_changed(f);
        *changed = 1;
        return fmu_note_sides(f);
    }
#endif
    if (f->s.drifted) {
        f->s.drifted = 0;
        *changed = 1;
        if (fmu_project(f)) return FMU_FAILED;
    }
    f->s.stopped = stopped;
    return stopped ? FMU_STOPPED : FMU_GOOD;
}

// A step of co-simulation. *reached: the time it came to. Returns FMU_STOPPED where an event ends the simulation.
static int fmu_step(fmu_instance *f, double step, double *reached) {
    fmu_state *const s = &f->s;
    const double target = s->t + step;
    long written = 0;
    *reached = s->t;
    if (s->stopped) return FMU_STOPPED;
    if (!(step > 0.0) || !fmu_finite(&target, 1)) return fmu_fail(f, "a step", "its length must be positive");
    if (!s->running || target > s->run_end + 1e-9 * step) {
        // A motion goes on as it is known at the present time, no further than this step.
        const int whole = s->has_end && s->t_end > target && !FMU_MOTIONS;
        if (fmu_start_run(f, whole ? s->t_end : target)) return FMU_FAILED;
    }
    const double wanted = target < s->run_end ? target : s->run_end;
    // The latest step may reach beyond the target already; attempts of steps follow one by one until one of them does.
    for (long attempts = 0; !written; attempts = 1) {
        double at = wanted;
        const int status = FMU_FUNCTION(simulation_go)(f->run, 0, attempts, &at, 1, s->x, &written);
#if FMU_N_EVENTS
        const long n = FMU_FUNCTION(simulation_events)(f->run, f->noted, f->noted_states);
        for (long k = 0; k < n; k++)
            if (f->noted[k].kind != SYMDYN_HAPPENED) fmu_log(f, 0, "an event varies so quickly that zeros of it may be missed");
#endif
        if (written) break;
        symdyn_report report;
        double states[2 * FMU_N_X];
        FMU_FUNCTION(simulation_report)(f->run, &report, states);
        if (status == SYMDYN_STOPPED) {
            memcpy(s->x, states, FMU_N_X * sizeof(double));
            s->t = *reached = report.t;
            s->running = 0;
            s->stopped = 1;
            fmu_changed(f);
            return FMU_STOPPED;
        }
        s->first_step = report.h;
        if (status < 0) return fmu_run_failed(f, status);
    }
    s->t = *reached = target;
    if (wanted == s->run_end) s->running = 0;
    fmu_changed(f);
    return FMU_GOOD;
}

// The value of a reference, or none where there is no such.
static int fmu_get(fmu_instance *f, unsigned int reference, double *value) {
    double events[FMU_N_EVENTS + 1];
    if (reference >= FMU_END) return fmu_fail(f, "a value", "there is no variable of this reference");
    if (reference >= FMU_OF_EVENTS) {
        if (fmu_events_now(f, events)) return FMU_FAILED;
        *value = events[reference - FMU_OF_EVENTS];
    } else if (reference >= FMU_OF_OUTPUTS) {
        if (fmu_outputs_now(f)) return FMU_FAILED;
        *value = f->outputs[reference - FMU_OF_OUTPUTS];
    } else if (reference >= FMU_OF_P) {
        *value = f->s.p[reference - FMU_OF_P];
    } else if (reference >= FMU_OF_INPUTS) {
        *value = f->s.inputs[reference - FMU_OF_INPUTS];
    } else if (reference >= FMU_OF_RATES) {
        if (fmu_rates_now(f)) return FMU_FAILED;
        *value = f->rates[reference - FMU_OF_RATES];
    } else {
        *value = reference >= FMU_OF_X ? f->s.x[reference - FMU_OF_X] : f->s.t;
    }
    return FMU_GOOD;
}

static int fmu_set(fmu_instance *f, unsigned int reference, double value) {
    fmu_state *const s = &f->s;
    double *where = NULL;
    if (!fmu_finite(&value, 1)) return fmu_fail(f, "a value that was set", "it is not finite");
    if (reference >= FMU_OF_INPUTS && reference < FMU_OF_P)
        where = s->inputs + (reference - FMU_OF_INPUTS);
    else if (reference >= FMU_OF_P && reference < FMU_OF_OUTPUTS && s->mode != FMU_CONTINUOUS)
        where = s->p + (reference - FMU_OF_P);
    else if (reference >= FMU_OF_X && reference < FMU_OF_RATES && s->mode <= FMU_INITIALIZATION)
        where = s->x + (reference - FMU_OF_X);
    if (!where) return fmu_fail(f, "a value", "it cannot be set now: states before the start, parameters at events");
    if (*where == value) return FMU_GOOD;
    *where = value;
    s->running = 0;
    if (reference >= FMU_OF_P) s->constants = 0;
    fmu_changed(f);
    return FMU_GOOD;
}

// The derivative of an unknown (a derivative of a state, an output) by a known (a state, an input, a parameter).
static int fmu_partial(fmu_instance *f, unsigned int unknown, unsigned int known, double *value) {
#if FMU_DERIVATIVES
    int row;
    if (unknown >= FMU_OF_RATES && unknown < FMU_OF_INPUTS)
        row = (int)(unknown - FMU_OF_RATES);
    else if (unknown >= FMU_OF_OUTPUTS && unknown < FMU_OF_EVENTS)
        row = FMU_N_X + (int)(unknown - FMU_OF_OUTPUTS);
    else if (unknown >= FMU_OF_X && unknown < FMU_OF_RATES)
        row = -1;
    else
        return fmu_fail(f, "a derivative", "derivatives are those of outputs and of derivatives of states");
    if (known < FMU_OF_X || (known >= FMU_OF_RATES && known < FMU_OF_INPUTS) || known >= FMU_OF_OUTPUTS)
        return fmu_fail(f, "a derivative", "derivatives are those by states, inputs and parameters");
    if (known >= FMU_OF_P && !FMU_BY_PARAMETERS) return fmu_fail(f, "a derivative", "there are none by parameters");
    if (row < 0) {
        *value = unknown == known;
        return FMU_GOOD;
    }
    if (!f->has_derivatives) {
        if (fmu_evaluate(f, fmu_by_x, "the derivatives by states", FMU_ROWS * FMU_N_X, f->by_x)) return FMU_FAILED;
        if (fmu_evaluate(f, fmu_by_inputs, "the derivatives by inputs", FMU_ROWS * FMU_N_INPUTS, f->by_inputs)) return FMU_FAILED;
        if (fmu_evaluate(f, fmu_by_p, "the derivatives by parameters", FMU_ROWS * FMU_N_P, f->by_p)) return FMU_FAILED;
        f->has_derivatives = 1;
    }
    if (known >= FMU_OF_P)
        *value = f->by_p[row * FMU_N_P + (int)(known - FMU_OF_P)];
    else if (known >= FMU_OF_INPUTS)
        *value = f->by_inputs[row * FMU_N_INPUTS + (int)(known - FMU_OF_INPUTS)];
    else
        *value = f->by_x[row * FMU_N_X + (int)(known - FMU_OF_X)];
    return FMU_GOOD;
#else
    (void)unknown;
    (void)known;
    (void)value;
    return fmu_fail(f, "a derivative", "a function of this mechanism has no derivatives");
#endif
}

// The derivatives of unknowns by knowns times a seed: of each unknown along the seed of the knowns or, backward, by each known of
// the unknowns weighted with the seed. Returns FMU_GOOD or FMU_FAILED.
static int fmu_derivatives(fmu_instance *f, const unsigned int unknowns[], size_t n_unknowns, const unsigned int knowns[],
    size_t n_knowns, const double seed[], int backward, double result[]) {
    for (size_t k = 0; k < (backward ? n_knowns : n_unknowns); k++) result[k] = 0.0;
    for (size_t i = 0; i < n_unknowns; i++)
        for (size_t j = 0; j < n_knowns; j++) {
            double partial;
            if (fmu_partial(f, unknowns[i], knowns[j], &partial)) return FMU_FAILED;
            result[backward ? j : i] += partial * seed[backward ? i : j];
        }
    return FMU_GOOD;
}

// The start of the simulation at t: the state comes onto the constraints.
static int fmu_begin(fmu_instance *f, int has_tolerance, double tolerance, double t, int has_end, double t_end) {
    f->s.t = t;
    f->s.has_end = has_end;
    f->s.t_end = t_end;
    if (has_tolerance) f->s.tolerance = tolerance > 1e-15 ? tolerance : 1e-15;
    f->s.mode = FMU_INITIALIZATION;
    fmu_changed(f);
    return has_end && t_end < t ? fmu_fail(f, "the start", "the simulation would end before it begins") : FMU_GOOD;
}

static int fmu_begun(fmu_instance *f) {
    f->s.mode = FMU_MODEL_EXCHANGE ? FMU_EVENT_MODE : FMU_STEPPING;
    return fmu_project(f) || fmu_note_sides(f) ? FMU_FAILED : FMU_GOOD;
}

// Copies of the state: what an instance holds, then the memory of the integrator.
static size_t fmu_copy_size(const fmu_instance *f) { return sizeof(fmu_state) + (size_t)f->run_size; }

static void fmu_copy_out(const fmu_instance *f, char *copy) {
    memcpy(copy, &f->s, sizeof(fmu_state));
    memcpy(copy + sizeof(fmu_state), f->run, (size_t)f->run_size);
}

// The problem stands first in the memory of a run: it points into this instance, whichever the copy is of.
static int fmu_copy_in(fmu_instance *f, const char *copy) {
    memcpy(&f->s, copy, sizeof(fmu_state));
    memcpy(f->run, copy + sizeof(fmu_state), (size_t)f->run_size);
    fmu_changed(f);
    if (f->s.constants && fmu_constants(f)) return FMU_FAILED;
    if (f->s.running) memcpy(f->run, &f->problem, sizeof f->problem);
    return FMU_GOOD;
}

// Serialized, a copy begins with the model that it is of.
enum { FMU_SEAL = sizeof FMU_HASH };
static size_t fmu_serialized_size(const fmu_instance *f) { return FMU_SEAL + fmu_copy_size(f); }

static int fmu_serialize(fmu_instance *f, const void *copy, char *bytes, size_t size) {
    if (size < fmu_serialized_size(f)) return fmu_fail(f, "a copy of the state", "there is too little room for it");
    memcpy(bytes, FMU_HASH, FMU_SEAL);
    memcpy(bytes + FMU_SEAL, copy, fmu_copy_size(f));
    return FMU_GOOD;
}

static int fmu_deserialize(fmu_instance *f, const char *bytes, size_t size, void **copy) {
    if (size != fmu_serialized_size(f) || memcmp(bytes, FMU_HASH, FMU_SEAL))
        return fmu_fail(f, "a copy of the state", "it is of another model");
    if (!*copy) *copy = malloc(fmu_copy_size(f));
    if (!*copy) return fmu_fail(f, "a copy of the state", "there is no memory for it");
    memcpy(*copy, bytes + FMU_SEAL, fmu_copy_size(f));
    return FMU_GOOD;
}
