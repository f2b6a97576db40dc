// A motion with rigid contacts in a plane, from phase to phase: what symdyn/runtime/integrating/contacts.py does, of which this
// is the part without exceptions. Before a switch or a phase that needs more than that (rows that depend on each other, several
// solutions or none, bouncing that comes to its end, failures) it stops, with all as it was, for the caller to
// go on.
#pragma once

#include "contact_modes.h"
#include "hybrid_type.h"
#include "mode_events.h"
#include "phase_code_type.h"
#include "report_type.h"
#include "status.h"

enum {
    SYMDYN_HYBRID_DONE = 0,       // the end is reached
    SYMDYN_HYBRID_SWITCH = 1,     // a switch is left to the caller
    SYMDYN_HYBRID_PHASE = 2,      // so is a phase
    SYMDYN_HYBRID_FULL = 3,       // call again, with empty records
    SYMDYN_HYBRID_CONSTANTS = 4,  // constants that follow from the parameters cannot be computed
    SYMDYN_LEFT = -1              // of what is done within: it is left to the caller
};

// Parts of what the function "contacts" gives.
typedef struct {
    const double *of_contact, *slip, *free, *D, *speeds, *coordinates;  // of_contact: gap, friction (2), restitution of each
} symdyn_numbers;

static symdyn_numbers symdyn_parts(const symdyn_hybrid *h) {
    const long n = h->n_rows;
    const double *const rest = h->of_contacts + 4 * h->n_contacts;
    return (symdyn_numbers){
        h->of_contacts, rest, rest + n, rest + 3 * n, rest + 3 * n + n * n, rest + 3 * n + n * n + h->n_u * n};
}

// Let frames look at (t, x), and evaluate what contacts take there. Returns 0, or SYMDYN_LEFT where that fails.
static int symdyn_look_at(symdyn_hybrid *h, double t, const double *x) {
    *h->t_now = t;
    for (int i = 0; i < h->n_state; i++) h->x_now[i] = x[i];
    return h->contacts(h->contacts_frame) ? SYMDYN_LEFT : 0;
}

// The row of friction of a contact, -1: there is none.
static int symdyn_friction_of(const symdyn_hybrid *h, int k) {
    return h->rows[k] > h->normal[k] ? h->first[k] + h->normal[k] : -1;
}

static int symdyn_event_of(const symdyn_hybrid *h, int contact, int kind) { return h->event[SYMDYN_KINDS * contact + kind]; }

static int symdyn_has_fired(const symdyn_hybrid *h, int contact, int kind) {
    const int event = symdyn_event_of(h, contact, kind);
    for (int i = 0; i < h->n_fired; i++)
        if (event >= 0 && h->fired[i] == event) return 1;
    return 0;
}

// -- switches

// Move x by the rows' least change in the metric of the mass matrix that makes `wanted` of these rows: n of them. by: what x
// changes by with forces along all rows.
static int symdyn_move_along_rows(
    const symdyn_hybrid *h, int n, const int *row, double *wanted, const double *by, int n_by, double *x) {
    const symdyn_numbers at = symdyn_parts(h);
    double A[2 * SYMDYN_MOST_ROWS][2 * SYMDYN_MOST_ROWS];
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) A[i][j] = at.D[row[i] * h->n_rows + row[j]];
    if (symdyn_solve_rows(n, 2 * SYMDYN_MOST_ROWS, A[0], wanted, h->dependent)) return SYMDYN_LEFT;
    for (int i = 0; i < n_by; i++)
        for (int j = 0; j < n; j++) x[i] += by[i * h->n_rows + row[j]] * wanted[j];
    return 0;
}

// Closed contacts back to gap zero without normal velocity, those without slip to none; frames look at the result.
static int symdyn_onto_surfaces(symdyn_hybrid *h, double t, double *x) {
    int row[2 * SYMDYN_MOST_ROWS], n = 0;
    double wanted[2 * SYMDYN_MOST_ROWS], most = 0.0;
    if (symdyn_look_at(h, t, x)) return SYMDYN_LEFT;
    symdyn_numbers at = symdyn_parts(h);
    for (int k = 0; k < h->n_contacts; k++)
        if (h->mode[k] != SYMDYN_OPEN && h->normal[k]) {
            if (n >= SYMDYN_MOST_ROWS) return SYMDYN_LEFT;
            wanted[n] = -at.of_contact[4 * k];
            most = fmax(most, fabs(wanted[n]));
            row[n++] = h->first[k];
        }
    if (n && most > 0.0) {
        if (symdyn_move_along_rows(h, n, row, wanted, at.coordinates, h->n_q, x) || symdyn_look_at(h, t, x)) return SYMDYN_LEFT;
    }
    for (int k = 0; k < h->n_contacts; k++)
        if (h->mode[k] != SYMDYN_OPEN && h->still[k] && symdyn_friction_of(h, k) >= 0) {
            if (n >= 2 * SYMDYN_MOST_ROWS) return SYMDYN_LEFT;
            row[n++] = symdyn_friction_of(h, k);
        }
    if (!n) return 0;
    for (int i = 0; i < n; i++) wanted[i] = -at.slip[row[i]];
    if (symdyn_move_along_rows(h, n, row, wanted, at.speeds, h->n_u, x + h->n_q)) return SYMDYN_LEFT;
    return symdyn_look_at(h, t, x);
}

// Whether a contact does not slip, at what frames look at.
static int symdyn_slow(const symdyn_hybrid *h, int k) {
    const symdyn_numbers at = symdyn_parts(h);
    const double fastest = symdyn_most(at.slip, h->n_rows);
    const int rubs = symdyn_friction_of(h, k);
    return rubs < 0 || fabs(at.slip[rubs]) <= fmax(h->touching, h->no_speed * fastest);
}

// The problem of n contacts at what frames look at, with b of all rows. Returns 0, or SYMDYN_LEFT where it is too large.
static int symdyn_problem_of(const symdyn_hybrid *h, int n, const int *contact, const double *b, int impact, symdyn_modes *m) {
    const symdyn_numbers at = symdyn_parts(h);
    int row[SYMDYN_MOST_ROWS];
    if (n > SYMDYN_MOST_SITES) return SYMDYN_LEFT;
    m->n = 0;
    m->n_sites = n;
    m->noise = h->noise;
    m->dependent = h->dependent;
    m->different = h->different;
    m->kept = h->kept;
    for (int s = 0; s < n; s++) {
        const int k = contact[s];
        const int rubs = impact || h->still[k] ? -1 : symdyn_friction_of(h, k);
        const double v = rubs >= 0 ? at.slip[rubs] : 0.0, before = rubs >= 0 ? h->sign[k] : 0.0;
        m->site[s] = (symdyn_site){.first = m->n,
            .n = h->rows[k],
            .bounded = !h->normal[k],
            .excluded = impact ? 0 : h->ruled_out[k],
            .adhesion = at.of_contact[4 * k + 1],
            .friction = at.of_contact[4 * k + 2],
            .slip = v > 0.0 ? 1.0
                : v < 0.0   ? -1.0
                            : before};
        for (int i = 0; i < h->rows[k]; i++) row[m->n++] = h->first[k] + i;
    }
    for (int i = 0; i < m->n; i++) {
        m->b[i] = b[row[i]];
        for (int j = 0; j < m->n; j++) m->D[i][j] = at.D[row[i] * h->n_rows + row[j]];
    }
    return 0;
}

// The state after an impact by Newton's law of n contacts, of which some are hit; leaves: which of all contacts leave.
static int symdyn_impact(symdyn_hybrid *h, int n, const int *contact, const int *hit) {
    const symdyn_numbers at = symdyn_parts(h);
    double *const impulse = h->impact + 3 * h->n_rows * h->n_impacts, *const before = impulse + h->n_rows;
    double *const after = before + h->n_rows, v[SYMDYN_MOST_ROWS] = {0}, back[SYMDYN_MOST_ROWS] = {0}, gained = 0.0, size = 0.0;
    symdyn_modes m = {0};
    if (h->n_impacts >= h->most_impacts || symdyn_problem_of(h, n, contact, at.slip, 1, &m)) return SYMDYN_LEFT;
    for (int s = 0; s < n; s++) {
        const int first = m.site[s].first;
        for (int i = first; i < first + m.site[s].n; i++) {
            v[i] = m.b[i];
            back[i] = i == first ? at.of_contact[4 * contact[s] + 3] * fmin(v[i], 0.0) : 0.0;
            m.b[i] = v[i] + back[i];
        }
    }
    if (symdyn_solve_modes(&m) != 1) return SYMDYN_LEFT;
    for (int i = 0; i < h->n_rows; i++) {
        before[i] = at.slip[i];
        impulse[i] = 0.0;
    }
    for (int s = 0; s < n; s++)
        for (int i = 0; i < m.site[s].n; i++) impulse[h->first[contact[s]] + i] = m.lam[m.site[s].first + i];
    for (int i = 0; i < m.n; i++) {
        m.w[i] -= back[i];
        gained += 0.5 * (v[i] + m.w[i]) * m.lam[i];
        size += fabs(v[i]) * fabs(m.lam[i]);
    }
    if (gained > h->energy * size) return SYMDYN_LEFT;
    for (int i = 0; i < h->n_x; i++) h->states[i] = h->x[i];
    for (int i = 0; i < h->n_u; i++)
        for (int j = 0; j < h->n_rows; j++) h->x[h->n_q + i] += at.speeds[i * h->n_rows + j] * impulse[j];
    if (symdyn_look_at(h, h->t, h->x)) return SYMDYN_LEFT;
    for (int i = 0; i < h->n_rows; i++) after[i] = at.slip[i];
    h->impact_t[h->n_impacts++] = h->t;
    int known = 0;
    const long begin = h->n_phases > 1 ? h->phase_happened[h->n_phases - 2] : 0;
    for (long e = begin; e <= h->n_happened; e++) {
        int of_hit = e == h->n_happened && !known;  // one more, where none is known
        for (int k = 0; k < h->n_contacts && e < h->n_happened; k++)
            of_hit |= hit[k] && h->happened[e] == symdyn_event_of(h, k, SYMDYN_CLOSES) && h->happened_t[e] == h->t;
        if (!of_hit) continue;
        known = 1;
        for (int i = 0; i < h->n_x; i++) {
            h->happened_states[2 * h->n_x * e + i] = h->states[i];
            h->happened_states[2 * h->n_x * e + h->n_x + i] = h->x[i];
        }
        if (e < h->n_happened) continue;
        int first = 0;
        while (!hit[first]) first++;
        h->happened[e] = symdyn_event_of(h, first, SYMDYN_CLOSES);
        h->happened_t[e] = h->t;
        h->n_happened++;
        break;
    }
    const double stays = h->no_speed * symdyn_most(v, m.n);
    for (int s = 0; s < n; s++) {
        const int k = contact[s], first = m.site[s].first;
        h->still[k] = m.mode[s] == SYMDYN_STICKING || m.site[s].n < 2 || fabs(m.w[first + 1]) <= stays;
        h->leaves[k] = m.w[first] > stays;
        if (h->leaves[k])
            h->mode[k] = SYMDYN_OPEN;
        else if (h->mode[k] == SYMDYN_OPEN)
            h->mode[k] = SYMDYN_SLIDING;
    }
    for (int k = 0; k < h->n_contacts; k++)  // their forces are finite: an impact may tear the joints that they hold
        if (!h->normal[k]) h->still[k] = symdyn_slow(h, k);
    return symdyn_onto_surfaces(h, h->t, h->x);
}

// The modes of n contacts that are closed, from the accelerations; the others are open. accelerations: along all rows.
static int symdyn_choose(symdyn_hybrid *h, int n, const int *contact, double *acceleration) {
    const symdyn_numbers at = symdyn_parts(h);
    symdyn_modes m = {0};
    for (int i = 0; i < h->n_rows; i++) acceleration[i] = at.free[i];
    if (n) {
        if (symdyn_problem_of(h, n, contact, at.free, 0, &m)) return SYMDYN_LEFT;
        const symdyn_modes given = m;
        if (symdyn_solve_modes(&m) != 1 || symdyn_on_a_border(&m, given.site)) return SYMDYN_LEFT;
    }
    for (int k = 0; k < h->n_contacts; k++) {
        h->mode[k] = SYMDYN_OPEN;
        h->slipping[k] = 0;
    }
    for (int s = 0; s < n; s++) {
        const int k = contact[s];
        h->mode[k] = m.mode[s];
        const int slides = m.mode[s] == SYMDYN_SLIDING && symdyn_friction_of(h, k) >= 0;
        h->sign[k] = slides ? m.sign[s] : 0.0;
        h->slipping[k] = h->still[k] && slides;
        h->still[k] = m.mode[s] == SYMDYN_STICKING;
        for (int i = 0; i < h->rows[k]; i++)
            for (int j = 0; j < h->n_rows; j++)
                acceleration[j] += at.D[j * h->n_rows + h->first[k] + i] * m.lam[m.site[s].first + i];
    }
    return 0;
}

// Whether the next flight of a contact that leaves is too short to be followed.
static int symdyn_flight_is_short(const symdyn_hybrid *h, int k, double acceleration) {
    const symdyn_numbers at = symdyn_parts(h);
    const double speed = at.slip[h->first[k]], flight = -2.0 * speed / acceleration;
    const double shortest = fmax(h->shortest_flight * (h->end - h->begin), h->resolved_flight * fabs(h->t));
    if (!(acceleration < 0.0) || at.of_contact[4 * k + 3] >= 1.0) return 0;
    return flight < shortest || 0.25 * flight * speed < h->lowest_flight * h->size;
}

// Note which contacts are ignored at x, those in `turned` as they are now. Contacts that overlap where that ends are left.
static int symdyn_pass_by(symdyn_hybrid *h, const double *x, int start) {
    if (!h->events) return 0;
    const symdyn_numbers at = symdyn_parts(h);
    if (symdyn_look_at(h, h->t, x) || h->events(h->events_frame)) return SYMDYN_LEFT;
    for (int k = 0; k < h->n_contacts; k++) {
        const int event = symdyn_event_of(h, k, SYMDYN_IGNORED);
        const int turned = symdyn_has_fired(h, k, SYMDYN_IGNORED) || symdyn_has_fired(h, k, SYMDYN_COUNTS);
        const int old = h->passed[k];
        if (start || !turned) h->passed[k] = event >= 0 && h->of_events[event] > 0.0;
        if (old && !h->passed[k] && h->mode[k] == SYMDYN_OPEN && at.of_contact[4 * k] < -h->missed * h->size) return SYMDYN_LEFT;
    }
    return 0;
}

// The state after what happens at a switch, and the modes of the next phase. Returns 0, or SYMDYN_LEFT.
static int symdyn_make_switch(symdyn_hybrid *h) {
    const int start = h->begins;
    const double t = h->t;
    double most = 0.0, *const acceleration = h->states;
    int contact[SYMDYN_MOST_SITES], n = 0, any_hit = 0, *const hit = h->look, *const closing = h->leaves;
    for (int k = 0; k < h->n_contacts; k++) {
        const int turned = symdyn_has_fired(h, k, SYMDYN_IGNORED) || symdyn_has_fired(h, k, SYMDYN_COUNTS);
        h->ruled_out[k] = 0;
        if (turned && !start) {
            if (h->passed[k]) {
                const symdyn_numbers at = symdyn_parts(h);
                if (symdyn_look_at(h, t, h->x)) return SYMDYN_LEFT;
                if (h->mode[k] == SYMDYN_OPEN && at.of_contact[4 * k] < -h->missed * h->size) return SYMDYN_LEFT;
            }
            h->passed[k] = !h->passed[k];
        }
        if (symdyn_has_fired(h, k, SYMDYN_STICKS)) h->still[k] = 1;
        if (symdyn_has_fired(h, k, SYMDYN_OPENS)) h->ruled_out[k] |= 1 << SYMDYN_STICKING | 1 << SYMDYN_SLIDING;
        if (symdyn_has_fired(h, k, SYMDYN_SLIPS)) h->ruled_out[k] |= 1 << SYMDYN_STICKING;
    }
    if (start && symdyn_pass_by(h, h->x, 1)) return SYMDYN_LEFT;
    if (symdyn_onto_surfaces(h, t, h->x)) return SYMDYN_LEFT;
    const symdyn_numbers at = symdyn_parts(h);
    h->size = fmax(h->size, symdyn_most(h->x, h->n_q));
    for (int k = 0; k < h->n_contacts; k++)
        if (h->normal[k]) h->size = fmax(h->size, fabs(at.of_contact[4 * k]));
    most = symdyn_most(h->x, h->n_state);
    const double near = start ? h->touching : h->together * fmax(1.0, most);
    // An approach that is rounding of what the accelerations make in the run is no impact.
    const double rounded = h->resolved_approach * symdyn_most(at.free, h->n_rows) * (h->end - h->begin);
    for (int k = 0; k < h->n_contacts; k++) {
        closing[k] = hit[k] = 0;
        if (!h->normal[k]) {
            if (start) h->still[k] = symdyn_slow(h, k);
            continue;
        }
        const double v = at.slip[h->first[k]];
        const int touches = fabs(at.of_contact[4 * k]) <= near && v <= (start ? h->touching : 0.0);
        closing[k] = symdyn_has_fired(h, k, SYMDYN_CLOSES) || (h->mode[k] == SYMDYN_OPEN && !h->passed[k] && touches);
        hit[k] = closing[k] && v < -(start ? h->touching : rounded);
        any_hit |= hit[k];
        if (h->mode[k] == SYMDYN_OPEN && !closing[k]) continue;
        if (n >= SYMDYN_MOST_SITES) return SYMDYN_LEFT;
        contact[n++] = k;
    }
    for (int k = 0; k < h->n_contacts && !any_hit; k++)
        if (closing[k] || !h->normal[k]) h->still[k] = symdyn_slow(h, k);
    for (int k = 0; k < h->n_contacts; k++) h->leaves[k] = 0;
    if (any_hit && symdyn_impact(h, n, contact, hit)) return SYMDYN_LEFT;
    int n_closed = 0, touched = 0;
    int closed[SYMDYN_MOST_SITES];
    for (int k = 0; k < h->n_contacts; k++) {
        const int touches = touched < n && contact[touched] == k;
        touched += touches;
        if (h->normal[k] ? !touches || h->leaves[k] : 0) continue;
        if (n_closed >= SYMDYN_MOST_SITES) return SYMDYN_LEFT;
        closed[n_closed++] = k;
    }
    if (symdyn_choose(h, n_closed, closed, acceleration)) return SYMDYN_LEFT;
    for (int k = 0; k < h->n_contacts; k++)
        if (h->leaves[k] && symdyn_flight_is_short(h, k, acceleration[h->first[k]])) return SYMDYN_LEFT;
    if (symdyn_pass_by(h, h->x, 0)) return SYMDYN_LEFT;
    for (int s = 0; s < n_closed; s++)
        if (h->mode[closed[s]] == SYMDYN_OPEN) h->left[closed[s]] = t;
    return 0;
}

// Make a switch. Returns 0, or SYMDYN_LEFT with all as it was.
static int symdyn_switch(symdyn_hybrid *h) {
    const long n_happened = h->n_happened, n_impacts = h->n_impacts;
    const double size = h->size;
    for (int i = 0; i < h->n_x; i++) h->old_x[i] = h->x[i];
    for (int k = 0; k < h->n_contacts; k++) {
        h->old_mode[k] = h->mode[k];
        h->old_still[k] = h->still[k];
        h->old_passed[k] = h->passed[k];
        h->old_sign[k] = h->sign[k];
    }
    if (!symdyn_make_switch(h)) {
        h->begins = h->n_fired = 0;
        return 0;
    }
    h->n_happened = n_happened;
    h->n_impacts = n_impacts;
    h->size = size;
    for (int i = 0; i < h->n_x; i++) h->x[i] = h->old_x[i];
    for (int k = 0; k < h->n_contacts; k++) {
        h->mode[k] = h->old_mode[k];
        h->still[k] = h->old_still[k];
        h->passed[k] = h->old_passed[k];
        h->sign[k] = h->old_sign[k];
        h->slipping[k] = 0;
    }
    return SYMDYN_LEFT;
}

// -- phases

// The parameters with the modes of all contacts. Returns whether any is closed.
static int symdyn_parameters(const symdyn_hybrid *h, double *p) {
    int any = 0;
    for (int i = 0; i < h->n_p; i++) p[i] = h->p[i];
    for (int k = 0; k < h->n_contacts; k++) {
        any |= h->mode[k] != SYMDYN_OPEN;
        if (h->closed_at[k] >= 0) p[h->closed_at[k]] = h->mode[k] != SYMDYN_OPEN;
        if (h->sticking_at[k] >= 0) p[h->sticking_at[k]] = h->mode[k] == SYMDYN_STICKING;
        if (h->sliding_at[k] >= 0) p[h->sliding_at[k]] = h->mode[k] == SYMDYN_SLIDING ? h->sign[k] : 0.0;
    }
    p[h->shared_at] = 0.0;
    return any;
}

// Whether the slip of any contact begins.
static int symdyn_begins_to_slip(const symdyn_hybrid *h) {
    int any = 0;
    for (int k = 0; k < h->n_contacts; k++) any |= h->slipping[k];
    return any;
}

// The error of slips that begin which the tolerances of the speeds let pass. Returns SYMDYN_LEFT where it is not known.
static int symdyn_tolerated(symdyn_hybrid *h, double *tolerated) {
    const symdyn_numbers at = symdyn_parts(h);
    double *const moved = h->ahead, *const sum = h->ahead + h->n_state, *const slip = sum + h->n_contacts;
    if (symdyn_look_at(h, h->t, h->x)) return SYMDYN_LEFT;
    for (int i = 0; i < h->n_state; i++) moved[i] = h->x[i];
    for (int k = 0; k < h->n_contacts; k++) {
        sum[k] = 0.0;
        slip[k] = h->slipping[k] ? at.slip[symdyn_friction_of(h, k)] : 0.0;
    }
    for (int j = h->n_q; j < h->n_q + h->n_u; j++) {  // slips are linear in the speeds
        moved[j] = h->x[j] + 1.0;
        if (symdyn_look_at(h, h->t, moved)) return SYMDYN_LEFT;
        moved[j] = h->x[j];
        for (int k = 0; k < h->n_contacts; k++)
            if (h->slipping[k])
                sum[k] += fabs(at.slip[symdyn_friction_of(h, k)] - slip[k]) * (h->atol[j] + h->rtol * fabs(h->x[j]));
    }
    *tolerated = symdyn_most(sum, h->n_contacts);
    return 0;
}

static int symdyn_rate_at(symdyn_hybrid *h, double t, const double *x) {
    *h->t_now = t;
    for (int i = 0; i < h->n_state; i++) h->x_now[i] = x[i];
    return h->rate(h->rate_frame) ? SYMDYN_LEFT : 0;
}

// Until when the directions of slips that begin are held; p: the parameters with the modes.
static int symdyn_held_until(symdyn_hybrid *h, const double *p, double *until) {
    const symdyn_numbers at = symdyn_parts(h);
    const double length = h->end - h->begin;
    double wanted = 0.0, *const slope = h->states, *const ahead = h->ahead;
    if (!h->rate || symdyn_tolerated(h, &wanted)) return SYMDYN_LEFT;
    for (int i = 0; i < h->n_p; i++) h->rate_p[i] = p[i];
    if (h->rate_prologue(h->rate_p, h->rate_c) || !symdyn_all_finite(h->rate_c, h->n_rate_c)) return SYMDYN_LEFT;
    wanted = h->tolerated * wanted + h->rounded * symdyn_most(h->x, h->n_state);
    const double shortest = fmax(h->shortest * length, h->resolved * fabs(h->t)), most = h->longest * length;
    double after = fmax(h->guess * length, shortest);
    if (symdyn_rate_at(h, h->t, h->x)) return SYMDYN_LEFT;
    for (int i = 0; i < h->n_state; i++) slope[i] = h->of_rate[i];
    for (int guess = 0; guess < h->guesses; guess++) {
        for (int i = 0; i < h->n_state; i++) ahead[i] = h->x[i] + after * slope[i];
        if (symdyn_rate_at(h, h->t + after, ahead)) return SYMDYN_LEFT;
        for (int i = 0; i < h->n_state; i++) ahead[i] = h->x[i] + 0.5 * after * (slope[i] + h->of_rate[i]);
        if (symdyn_look_at(h, h->t + after, ahead)) return SYMDYN_LEFT;
        double slip = 1e300;
        for (int k = 0; k < h->n_contacts; k++)
            if (h->slipping[k]) slip = fmin(slip, at.slip[symdyn_friction_of(h, k)] * h->sign[k]);
        if (slip > h->larger * wanted && after > shortest)
            after = fmax(shortest, after * 2.0 * wanted / slip);
        else if (slip >= wanted || after >= most || slip < -wanted)
            break;
        else
            after = fmin(most, after * fmin(h->grows, fmax(1.5, sqrt(2.0 * wanted / fmax(slip, 1e-300)))));
    }
    *until = fmin(h->t + after, h->end);
    return 0;
}

// Whether a contact slips against its direction at what frames look at.
static int symdyn_slips_back(const symdyn_hybrid *h) {
    const symdyn_numbers at = symdyn_parts(h);
    for (int k = 0; k < h->n_contacts; k++)
        if (h->mode[k] == SYMDYN_SLIDING && h->sign[k] != 0.0 && at.slip[symdyn_friction_of(h, k)] * h->sign[k] < 0.0) return 1;
    return 0;
}

// The events that the modes of contacts can end with; held: directions of slips are.
static void symdyn_looked_for(symdyn_hybrid *h, int held) {
    for (int k = 0; k < h->n_events; k++) h->look[k] = 0;
    for (int k = 0; k < h->n_contacts; k++)
        for (int kind = 0; kind < SYMDYN_KINDS; kind++) {
            const int event = symdyn_event_of(h, k, kind), open = h->mode[k] == SYMDYN_OPEN;
            if (event < 0) continue;
            h->look[event] = kind == SYMDYN_CLOSES || kind == SYMDYN_IGNORED ? open && !h->passed[k]
                : kind == SYMDYN_COUNTS                                      ? open && h->passed[k]
                : kind == SYMDYN_OPENS                                       ? !open
                : kind == SYMDYN_SLIPS ? h->mode[k] == SYMDYN_STICKING
                                       : h->mode[k] == SYMDYN_SLIDING && h->sign[k] != 0.0 && !held;
        }
}

// Whether an open contact overlaps at the end of a phase that has taken a time, since it was not seen to close.
static int symdyn_missed_one(const symdyn_hybrid *h, double passed) {
    const symdyn_numbers at = symdyn_parts(h);
    for (int k = 0; k < h->n_contacts; k++)
        if (h->mode[k] == SYMDYN_OPEN && !h->passed[k]
            && at.of_contact[4 * k] < -h->missed * fmax(h->size, passed * fabs(at.slip[h->first[k]])))
            return 1;
    return 0;
}

// From one switch to the next, or to the end. Returns 0, or SYMDYN_LEFT with all as it was.
static int symdyn_phase(symdyn_hybrid *h) {
    double *const p = h->phase_p + h->n_p * h->n_phases;
    const int any = symdyn_parameters(h, p);
    symdyn_phase_code *const code = any ? h->closed : h->open;
    if (!code) return SYMDYN_LEFT;
    for (int i = 0; i < h->n_p; i++) code->p[i] = p[i];
    if (any && (code->prologue(code->p, code->c) || !symdyn_all_finite(code->c, code->n_constants))) return SYMDYN_LEFT;
    const int held = symdyn_begins_to_slip(h);
    double until = h->end;
    if (held && symdyn_held_until(h, p, &until)) return SYMDYN_LEFT;
    const double span[] = {h->t, until, h->rtol, h->first_step, h->max_step};
    symdyn_looked_for(h, held);
    if (code->start(code->memory, code->problem, span, h->x, h->atol) < 0) return SYMDYN_LEFT;
    code->look(code->memory, h->look, h->spacing);
    long written = 0;
    const int status = code->go(code->memory, 0, h->most_steps, h->times + h->n_written, h->n_times - h->n_written,
        h->out + h->n_x * h->n_written, &written);
    if (status != SYMDYN_DONE && status != SYMDYN_STOPPED) return SYMDYN_LEFT;
    const long n = code->take(code->memory, h->noted, h->noted_states);
    for (long i = 0; i < n; i++)
        if (h->noted[i].kind != SYMDYN_HAPPENED) return SYMDYN_LEFT;
    if ((status == SYMDYN_STOPPED) != (n > 0) || n > h->n_events || h->n_happened + n >= h->most_happened) return SYMDYN_LEFT;
    symdyn_report report;
    code->report(code->memory, &report, h->states);
    if (report.largest_moved > h->far || symdyn_look_at(h, report.t, h->states) || symdyn_missed_one(h, report.t - h->t))
        return SYMDYN_LEFT;
    if (held && !n && report.t < h->end && symdyn_slips_back(h)) return SYMDYN_LEFT;
    for (long i = 0; i < n; i++) {
        h->fired[i] = h->happened[h->n_happened] = h->noted[i].event;
        h->happened_t[h->n_happened] = h->noted[i].t;
        for (int j = 0; j < 2 * h->n_x; j++)
            h->happened_states[2 * h->n_x * h->n_happened + j] = h->noted_states[2 * h->n_x * i + j];
        h->n_happened++;
    }
    const double *const at_end = n ? h->noted_states + 2 * h->n_x * (n - 1) : h->states;
    for (int i = 0; i < h->n_x; i++) h->x[i] = at_end[i];
    for (int k = 0; k < h->n_contacts; k++) {
        h->phase_mode[h->n_contacts * h->n_phases + k] = h->mode[k];
        h->slipping[k] = 0;
    }
    h->n_fired = (int)n;
    h->phase_begin[h->n_phases] = h->t;
    h->phase_end[h->n_phases] = h->t = report.t;
    h->phase_written[h->n_phases] = h->n_written += written;
    h->phase_happened[h->n_phases] = h->n_happened;
    h->phase_impacts[h->n_phases++] = h->n_impacts;
    h->n_steps += report.n_steps;
    h->n_rejected += report.n_rejected;
    h->n_evaluations += report.n_evaluations;
    h->n_corrected += report.n_corrected;
    h->n_corrections += report.n_corrections;
    h->n_jacobians += report.n_jacobians;
    h->n_factorizations += report.n_factorizations;
    h->largest_dq = fmax(h->largest_dq, report.largest_dq);
    h->largest_du = fmax(h->largest_du, report.largest_du);
    h->next_step = report.h;
    return 0;
}

// Compute the constants of all code from the parameters. Returns 1 where that fails.
static int symdyn_take_parameters(symdyn_hybrid *h) {
    if (h->contacts_prologue(h->p, h->contacts_c) || !symdyn_all_finite(h->contacts_c, h->n_contacts_c)) return 1;
    if (h->events && (h->events_prologue(h->p, h->events_c) || !symdyn_all_finite(h->events_c, h->n_events_c))) return 1;
    symdyn_phase_code *const open = h->open;
    for (int i = 0; open && i < h->n_p; i++) open->p[i] = h->p[i];
    return open && (open->prologue(open->p, open->c) || !symdyn_all_finite(open->c, open->n_constants));
}
