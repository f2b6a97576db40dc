// Time stepping with contacts (Moreau and Jean): the implicit midpoint rule, with the impulses of all contacts over a step.
//
// A step goes from x to x + h f(t + h/2, (x + x_end)/2) + [0; M^-1 J^T P], J at the middle. The impulses P of the contacts whose
// gap would close within the step fulfil the laws of contact and friction with the relative velocities at its end, along the
// normal added to restitution times those at its begin. Without contacts the rule is of second order; an impact is at the begin
// of a step. Then bodies that overlap are moved apart by the smallest change of the positions.
//
// Source: Jean, The non-smooth contact dynamics method, 1999; Acary, Projected event-capturing time-stepping schemes for
// nonsmooth mechanical systems with unilateral contact and Coulomb's friction, 2013.
#pragma once

#include "elimination.h"
#include "many.h"
#include "modes.h"

enum {
    SYMDYN_MOREAU_DONE = 0,
    SYMDYN_MOREAU_FIELD = -1,      // the right-hand side cannot be evaluated
    SYMDYN_MOREAU_CONTACT = -2,    // what contacts need cannot be evaluated
    SYMDYN_MOREAU_LONG_STEP = -3,  // the equations of a step are not solved by iteration
    SYMDYN_MOREAU_ROOM = -4,       // more contacts than there is room for
    SYMDYN_MOREAU_NOT_FINITE = -5,
    SYMDYN_MOREAU_CONSTRAINTS = -6,
    SYMDYN_MOREAU_INPUTS = -7
};

// Quantity that closes a contact with a name: a gap; a speed, of a one-way clutch; nothing, of dry friction of a joint, which has
// no normal row.
enum { SYMDYN_PLACED = 0, SYMDYN_SPEED = 1, SYMDYN_BOUNDED = 2 };

// Let all frames look at a time and a state.
static int symdyn_look(symdyn_moreau *s, double t, const double *x) {
    *s->t = t;
    for (int i = 0; i < s->n_x; i++) s->x[i] = x[i];
    return s->function && s->function(t, x, s->inputs) ? SYMDYN_MOREAU_INPUTS : 0;
}

static int symdyn_rate(symdyn_moreau *s, double t, const double *x) {
    const int stopped = symdyn_look(s, t, x);
    if (stopped) return stopped;
    s->n_evaluations++;
    s->reason = s->field(s->field_frame);
    return s->reason ? SYMDYN_MOREAU_FIELD : 0;
}

// Gaps and relative velocities at (t, x).
static int symdyn_gaps(symdyn_moreau *s, double t, const double *x) {
    const int stopped = symdyn_look(s, t, x);
    if (stopped) return stopped;
    s->reason = s->n_given ? s->gaps(s->gaps_frame) : 0;
    if (!s->reason && s->n_bodies) s->reason = s->spheres(s->spheres_frame);
    return s->reason ? SYMDYN_MOREAU_CONTACT : 0;
}

// Put a state onto the constraints, and unit vectors to their length.
static int symdyn_settle(symdyn_moreau *s, double t, double *x) {
    for (int group = 0; group < s->n_units; group++) {
        double square = 0.0;
        for (long k = s->unit_first[group]; k < s->unit_first[group + 1]; k++)
            square += x[s->unit_index[k]] * x[s->unit_index[k]];
        for (long k = s->unit_first[group]; k < s->unit_first[group + 1]; k++)
            if (square > 0.0) x[s->unit_index[k]] /= sqrt(square);
    }
    for (int round = 0; s->n_c && round < 8; round++) {
        if (symdyn_look(s, t, x)) return SYMDYN_MOREAU_INPUTS;
        s->reason = s->position(s->position_frame);
        if (s->reason) return SYMDYN_MOREAU_CONSTRAINTS;
        const double off = symdyn_most(s->position_change, s->n_c);
        for (int i = 0; i < s->n_q; i++) x[i] += s->position_change[s->n_c + i];
        if (symdyn_look(s, t, x)) return SYMDYN_MOREAU_INPUTS;
        s->reason = s->velocity(s->velocity_frame);
        if (s->reason) return SYMDYN_MOREAU_CONSTRAINTS;
        for (int i = 0; i < s->n_u; i++) x[s->n_q + i] += s->velocity_change[s->n_c + i];
        if (off <= 1e-13 * s->length) return 0;
    }
    return 0;
}

// Relative velocity and gap of a contact at what the frames looked at last; velocities to w. Returns the gap.
static double symdyn_contact_now(const symdyn_moreau *s, long i, long m, double *basis, double *w) {
    if (s->b[i] < 0) {
        const long first = s->given_first[s->a[i]];
        for (long k = 0; k < m; k++) w[k] = s->gap[4 * s->n_given + first + k];
        return s->gap[4 * s->a[i]];
    }
    double normal[3];
    const double gap = symdyn_pair(s, s->a[i], s->b[i], normal);
    symdyn_basis(s, normal, basis, 0);
    for (long k = 0; k < m; k++) w[k] = symdyn_pair_speed(s, s->a[i], s->b[i], basis, basis + 3 * k);
    return gap;
}

// Coefficients of a contact: static and kinetic friction, restitution.
static const double *symdyn_coefficients(const symdyn_moreau *s, long i) {
    return s->b[i] < 0 ? s->gap + 4 * s->a[i] + 1 : s->sphere + 3 * s->group_of[s->a[i]];
}

// Whether a contact is dry friction of a joint.
static int symdyn_bounded(const symdyn_moreau *s, long i) { return s->b[i] < 0 && s->given_kind[s->a[i]] == SYMDYN_BOUNDED; }

static long symdyn_rows(const symdyn_moreau *s, long i) {
    if (s->b[i] < 0) return s->given_first[s->a[i] + 1] - s->given_first[s->a[i]];
    const double *coefficients = symdyn_coefficients(s, i);
    return coefficients[0] > 0.0 || coefficients[1] > 0.0 ? s->planar ? 2 : 3 : 1;
}

// Append the first m rows of a contact with a name.
static void symdyn_given_rows(const symdyn_moreau *s, symdyn_cones *c, long contact, long m) {
    const double *J = s->direction, *answer = J + s->n_rows * s->n_u;
    const long row = s->given_first[contact];
    long e = c->entry[c->n];
    for (int i = 0; i < s->n_u; i++) {
        double any = 0.0;
        for (long k = 0; k < 3; k++) {
            c->along[3 * e + k] = k < m ? J[(row + k) * s->n_u + i] : 0.0;
            c->answer[3 * e + k] = k < m ? answer[i * s->n_rows + row + k] : 0.0;
            any += fabs(c->along[3 * e + k]) + fabs(c->answer[3 * e + k]);
        }
        c->speed[e] = i;
        if (any > 0.0) e++;
    }
    c->first[c->n + 1] = c->first[c->n] + m;
    c->entry[++c->n] = e;
}

// J and M^-1 J^T of the contacts that were found, or of their normals alone, at (t, x). Bases turn to the normals there.
static int symdyn_assemble(symdyn_moreau *s, symdyn_cones *c, double t, const double *x, int normals) {
    const int stopped = symdyn_gaps(s, t, x);
    if (stopped) return stopped;
    s->reason = s->n_given ? s->directions(s->directions_frame) : 0;
    if (s->reason) return SYMDYN_MOREAU_CONTACT;
    if (s->n_bodies && symdyn_responses(s)) return SYMDYN_MOREAU_CONTACT;
    c->n = 0;
    c->first[0] = c->entry[0] = 0;
    for (long i = 0; i < s->n_found; i++) {
        const long m = normals ? 1 : symdyn_rows(s, i);
        c->bounded[i] = symdyn_bounded(s, i);
        if (s->b[i] < 0) {
            symdyn_given_rows(s, c, s->a[i], m);
        } else {
            double normal[3];
            symdyn_pair(s, s->a[i], s->b[i], normal);
            symdyn_basis(s, normal, s->basis + 9 * i, 0);
            symdyn_pair_rows(s, c, s->a[i], s->b[i], s->basis + 9 * i, (int)m);
        }
    }
    return 0;
}

// The contacts whose gap is at most reach at what the frames looked at last; speeds: and elements of joints without a gap.
static int symdyn_find(symdyn_moreau *s, symdyn_cones *c, double reach, int speeds) {
    s->n_found = 0;
    for (long i = 0; i < s->n_given; i++) {
        if (s->given_kind[i] == SYMDYN_PLACED ? !(s->gap[4 * i] <= reach) : !speeds) continue;
        s->a[s->n_found] = i;
        s->b[s->n_found++] = -1;
    }
    return s->n_bodies && symdyn_search(s, c, reach) ? SYMDYN_MOREAU_ROOM : 0;
}

// Move bodies apart that overlap at t, by the smallest change of the positions in the metric of the mass matrix.
static int symdyn_part(symdyn_moreau *s, symdyn_cones *c, double t, double *x) {
    double *before = s->work + 6 * s->n_x, *moved = s->work + 7 * s->n_x;
    for (int round = 0; round < 8; round++) {
        double deep = 0.0;
        int failed = symdyn_gaps(s, t, x);
        if (!failed) failed = symdyn_find(s, c, 0.0, 0);
        if (failed) return failed;
        for (long i = 0; i < s->n_found; i++) {
            double w[3], basis[9] = {0.0};
            deep = fmax(deep, -symdyn_contact_now(s, i, 1, basis, w));
        }
        if (deep <= s->depth || round == 7) {
            s->worst_depth = fmax(s->worst_depth, deep);
            return 0;
        }
        failed = symdyn_find(s, c, 2.0 * deep, 0);
        if (!failed) failed = symdyn_assemble(s, c, t, x, 1);
        if (failed) return failed;
        for (long i = 0; i < c->n; i++) {
            double w[3], basis[9] = {0.0};
            c->free[i] = symdyn_contact_now(s, i, 1, basis, w) - 0.1 * s->depth;
            c->friction[i] = c->P[i] = 0.0;
        }
        symdyn_cones_solve(c, 0.1 * s->depth, s->most_sweeps);
        failed = symdyn_rate(s, t, x);
        if (failed) return failed;
        for (int i = 0; i < s->n_x; i++) {
            before[i] = s->xd[i];
            moved[i] = x[i];
        }
        for (int i = 0; i < s->n_u; i++) moved[s->n_q + i] += c->du[i];
        failed = symdyn_rate(s, t, moved);
        if (failed) return failed;
        for (int i = 0; i < s->n_q; i++) x[i] += s->xd[i] - before[i];
        failed = symdyn_settle(s, t, x);
        if (failed) return failed;
    }
    return 0;
}

// The place of a contact among those of the step before; -1: it was not there.
static long symdyn_earlier(const symdyn_moreau *s, long i) {
    const int named = s->b[i] < 0;
    for (long j = named ? 0 : s->old_from[s->a[i]]; j < s->n_old; j++) {
        if (named ? s->old_b[j] >= 0 : s->old_b[j] < 0 || s->old_a[j] != s->a[i]) return -1;
        if (s->old_a[j] == s->a[i] && s->old_b[j] == s->b[i]) return j;
    }
    return -1;
}

// Bound of friction of a contact, in a step of length h: a coefficient, of friction of a joint an impulse.
static double symdyn_friction_bound(const symdyn_moreau *s, long i, int sticks, double h) {
    const double *coefficients = symdyn_coefficients(s, i);
    return coefficients[sticks ? 0 : 1] * (symdyn_bounded(s, i) ? h : 1.0);
}

// Whether nothing slips in a contact at the begin of the step.
static int symdyn_still(const symdyn_moreau *s, const symdyn_cones *c, long i) {
    double square = 0.0;
    for (long k = c->bounded[i] ? 0 : 1; k < 3; k++) square += s->incoming[3 * i + k] * s->incoming[3 * i + k];
    return sqrt(square) <= s->tolerance;
}

// Memory of contacts from the step before: impulses to start from, whether they stuck; bounds of friction.
static void symdyn_bring(symdyn_moreau *s, symdyn_cones *c, double h) {
    for (long i = 0; i < c->n; i++) {
        const long old = symdyn_earlier(s, i), r = c->first[i];
        const double *mu = symdyn_coefficients(s, i);
        const int stuck =
            old < 0 || s->old_state[old] == SYMDYN_OPEN ? symdyn_still(s, c, i) : s->old_state[old] == SYMDYN_STICKING;
        const double *P = s->was_at[i] >= 0 ? s->P_guess + 3 * s->was_at[i] : old >= 0 ? s->P_old + 3 * old : 0;
        for (long k = r; k < c->first[i + 1]; k++) c->P[k] = P ? P[k - r] : 0.0;
        s->broken[i] = !stuck || !(mu[0] > mu[1]);
        c->friction[i] = symdyn_friction_bound(s, i, stuck, h);
    }
}

// Whether a contact slips in the present solution. Where contacts are redundant, forces of one may be at the bound of static
// friction while others hold all of them.
static int symdyn_slips(const symdyn_moreau *s, const symdyn_cones *c, long i) {
    double square = 0.0;
    for (long r = c->first[i] + symdyn_cones_lead(c, i); r < c->first[i + 1]; r++) square += c->w[r] * c->w[r];
    return c->state[i] == SYMDYN_SLIDING && sqrt(square) > s->tolerance;
}

// Solve for the impulses; contacts that stuck and slip now have kinetic friction. rough: by few sweeps alone, which say nothing
// of slip.
static void symdyn_impulses(symdyn_moreau *s, symdyn_cones *c, double h, int rough) {
    for (int again = 1; again;) {
        const long begun = c->n_sweeps, left = c->n ? s->updates_left / c->n : 0;
        const long most = left < s->most_sweeps ? left : s->most_sweeps;
        symdyn_cones_solve(c, s->tolerance, rough || most < s->rough_sweeps ? s->rough_sweeps : most);
        s->updates_left -= (c->n_sweeps - begun) * c->n;
        if (!rough && c->late && c->residual > s->tolerance) c->residual = symdyn_cones_finish(c, c->residual, s->tolerance);
        again = 0;
        for (long i = 0; i < c->n && !rough; i++)
            if (!s->broken[i] && symdyn_slips(s, c, i)) {
                s->broken[i] = again = 1;
                c->friction[i] = symdyn_friction_bound(s, i, 0, h);
            }
    }
}

// One round on the end of a step, from a guess in end: what contacts and loads do in the middle, then impulses that keep the laws
// with the velocities at the end. Impulses of pairs act along the normals in the middle, their laws hold along those at the end.
// round: how many went before since contacts were added; rough: by few sweeps alone. off: how far the end moved, size: of the
// state. Returns 0 or a failure.
static int symdyn_round(symdyn_moreau *s, symdyn_cones *c, double t, double h, const double *x, double *end, int round, int rough,
    double *off, double *size) {
    double *middle = s->work, *next = s->work + s->n_x, *kick = s->work + 2 * s->n_x;
    const int n_q = s->n_q, n_u = s->n_u;
    int failed = 0;
    for (int i = 0; i < s->n_x; i++) middle[i] = 0.5 * (x[i] + end[i]);
    if (s->n_found && (round < 4 || round % 8 == 0)) failed = symdyn_assemble(s, c, t + 0.5 * h, middle, 0);
    if (failed) return failed;
    if (!round) symdyn_bring(s, c, h);
    failed = symdyn_rate(s, t + 0.5 * h, middle);
    if (failed) return failed;
    for (int i = 0; i < s->n_x; i++) next[i] = x[i] + h * s->xd[i];
    if (s->n_found) {
        symdyn_cones_total(c, c->P, c->du);
        for (int i = 0; i < n_u; i++) next[n_q + i] += kick[i] = c->du[i];
    }
    failed = symdyn_settle(s, t + h, next);
    if (!failed && s->n_found) failed = symdyn_gaps(s, t + h, next);
    if (failed) return failed;
    if (s->n_found) {
        for (long i = 0; i < c->n; i++) {
            double w[3], kicked[3], basis[9];
            const long r = c->first[i], m = c->first[i + 1] - r;
            for (int k = 0; k < 9; k++) basis[k] = s->basis[9 * i + k];
            symdyn_contact_now(s, i, m, basis, w);
            if (s->b[i] >= 0) symdyn_pair_along(s, c, c->entry[i], s->a[i], s->b[i], basis, (int)m);
            symdyn_cones_along(c, i, kick, kicked);
            for (long k = 0; k < m; k++) c->free[r + k] = w[k] - kicked[k];
            if (!c->bounded[i] && s->incoming[3 * i] < 0.0) c->free[r] += symdyn_coefficients(s, i)[2] * s->incoming[3 * i];
        }
        symdyn_impulses(s, c, h, rough);
        for (int i = 0; i < n_u; i++) next[n_q + i] += c->du[i] - kick[i];
    }
    *off = *size = 0.0;
    for (int i = 0; i < s->n_x; i++) {
        *off = fmax(*off, fabs(next[i] - end[i]));
        *size = fmax(*size, fabs(next[i]));
        end[i] = next[i];
    }
    s->n_rounds++;
    return *size <= 1e300 ? 0 : SYMDYN_MOREAU_NOT_FINITE;
}

// Keep what contacts did: what the next step starts from, velocities and gaps at the end.
static int symdyn_keep(symdyn_moreau *s, symdyn_cones *c, double t, const double *x) {
    const int failed = symdyn_gaps(s, t, x);
    if (failed) return failed;
    for (long body = 0; body <= s->n_bodies; body++) s->old_from[body] = -1;
    for (long i = 0; i < s->n_found; i++) {
        const long r = c->first[i], m = c->first[i + 1] - r;
        double *end = s->at_end + 4 * i, basis[9];
        for (int k = 0; k < 9; k++) basis[k] = s->basis[9 * i + k];
        for (int k = 0; k < 4; k++) end[k] = 0.0;
        end[0] = symdyn_contact_now(s, i, m, basis, end + 1);
        for (long k = 0; k < m; k++) c->w[r + k] = end[1 + k];
        if (!c->bounded[i] && s->incoming[3 * i] < 0.0) c->w[r] += symdyn_coefficients(s, i)[2] * s->incoming[3 * i];
    }
    s->missed = s->n_found ? symdyn_cones_missed(c) : 0.0;
    for (long i = 0; i < s->n_found; i++) {
        const long r = c->first[i], m = c->first[i + 1] - r;
        for (int k = 0; k < 3; k++) s->P_old[3 * i + k] = k < m ? c->P[r + k] : 0.0;
        s->old_a[i] = s->a[i];
        s->old_b[i] = s->b[i];
        s->old_state[i] = s->broken[i] || c->state[i] == SYMDYN_OPEN || symdyn_slips(s, c, i) ? c->state[i] : SYMDYN_STICKING;
        if (s->b[i] >= 0 && s->old_from[s->a[i]] < 0) s->old_from[s->a[i]] = i;
    }
    s->n_old = s->n_found;
    s->old_from[s->n_bodies] = s->n_old;
    for (long body = s->n_bodies - 1; body >= 0; body--)
        if (s->old_from[body] < 0) s->old_from[body] = s->old_from[body + 1];
    return 0;
}

// Order of contacts: those with a name first, then pairs by their first body.
static long symdyn_order(const symdyn_moreau *s, const long *a, const long *b, long i, long n) {
    return i >= n ? s->n_given + s->n_bodies : b[i] < 0 ? a[i] : s->n_given + a[i];
}

// Add to the contacts of a step those whose gap closes at what the frames looked at last. added: whether there are new ones.
static int symdyn_add_contacts(symdyn_moreau *s, symdyn_cones *c, int *added) {
    const long n_was = s->n_found;
    for (long i = 0; i < n_was; i++) {
        s->was_a[i] = s->a[i];
        s->was_b[i] = s->b[i];
        for (long k = 0; k < 3 && c->n == n_was; k++)
            s->P_guess[3 * i + k] = c->first[i] + k < c->first[i + 1] ? c->P[c->first[i] + k] : 0.0;
    }
    const int failed = symdyn_find(s, c, s->depth, 1);
    if (failed) return failed;
    long n = 0, i = 0, j = 0;
    *added = 0;
    while (i < n_was || j < s->n_found) {
        const long one = symdyn_order(s, s->was_a, s->was_b, i, n_was), two = symdyn_order(s, s->a, s->b, j, s->n_found);
        const long now = one < two ? one : two, begin = i;
        for (; symdyn_order(s, s->was_a, s->was_b, i, n_was) == now && i < n_was; i++) {
            if (n >= c->most) return SYMDYN_MOREAU_ROOM;
            s->was_at[n] = c->n == n_was ? i : -1;
            s->sum_a[n] = s->was_a[i];
            s->sum_b[n++] = s->was_b[i];
        }
        for (; symdyn_order(s, s->a, s->b, j, s->n_found) == now && j < s->n_found; j++) {
            int there = 0;
            for (long k = begin; k < i; k++) there |= s->was_b[k] == s->b[j];
            if (there) continue;
            if (n >= c->most) return SYMDYN_MOREAU_ROOM;
            *added = 1;
            s->was_at[n] = -1;
            s->sum_a[n] = s->a[j];
            s->sum_b[n++] = s->b[j];
        }
    }
    s->n_found = n;
    for (long k = 0; k < n; k++) {
        s->a[k] = s->sum_a[k];
        s->b[k] = s->sum_b[k];
    }
    return 0;
}

// Relative velocities of the contacts of a step, and their tangents, at its begin.
static int symdyn_begin_contacts(symdyn_moreau *s, double t, const double *x) {
    const int failed = symdyn_gaps(s, t, x);
    if (failed) return failed;
    for (long i = 0; i < s->n_found; i++) {
        double normal[3];
        if (s->b[i] >= 0) {
            symdyn_pair(s, s->a[i], s->b[i], normal);
            symdyn_basis(s, normal, s->basis + 9 * i, 1);
        }
        for (int k = 0; k < 3; k++) s->incoming[3 * i + k] = 0.0;
        symdyn_contact_now(s, i, symdyn_rows(s, i), s->basis + 9 * i, s->incoming + 3 * i);
    }
    return 0;
}

// Whether the rounds on the end of a step, of which round is the latest since contacts were added, are over, by how far the
// latest two moved it. Returns 1, or 0; or a failure.
static int symdyn_settled(const symdyn_moreau *s, const symdyn_cones *c, int round, double off, double last, double size) {
    const double noise = 1e-13 * size + (s->n_found ? 10.0 * s->tolerance : 0.0);
    const int most = s->n_found ? s->most_rounds : 60;
    if (s->n_found && s->rough_sweeps)
        return s->updates_left < s->rough_sweeps * c->n || round + 1 >= most
            || (round && off <= noise && c->residual <= s->tolerance);
    const int nearer = off < 0.25 * last && off > 1e-15 * size;  // beyond what is noise in general
    if (round && off <= noise && !nearer) return 1;
    if (round + 1 < most) return 0;
    return off > (s->n_found ? s->accepted : 1e-6) * (1.0 + size) ? SYMDYN_MOREAU_LONG_STEP : 1;
}

// Put the end of a step where loads in the middle and the present impulses take it, as far as the latest round left that open.
static int symdyn_follow(symdyn_moreau *s, const symdyn_cones *c, double t, double h, const double *x, double *end) {
    double *middle = s->work, *next = s->work + s->n_x, off = 1.0, size = 0.0;
    for (int round = 0; round < 60 && off > 1e-13 * size; round++) {
        for (int i = 0; i < s->n_x; i++) middle[i] = 0.5 * (x[i] + end[i]);
        int failed = symdyn_rate(s, t + 0.5 * h, middle);
        if (failed) return failed;
        for (int i = 0; i < s->n_x; i++) next[i] = x[i] + h * s->xd[i];
        for (int i = 0; i < s->n_u; i++) next[s->n_q + i] += c->du[i];
        failed = symdyn_settle(s, t + h, next);
        if (failed) return failed;
        off = size = 0.0;
        for (int i = 0; i < s->n_x; i++) {
            off = fmax(off, fabs(next[i] - end[i]));
            size = fmax(size, fabs(next[i]));
            end[i] = next[i];
        }
    }
    return off > 1e-6 * (1.0 + size) ? SYMDYN_MOREAU_LONG_STEP : 0;
}

// Add contacts that close until the middle of a step that ends at end; the first time after those that touch at its begin.
static int symdyn_add_closing(
    symdyn_moreau *s, symdyn_cones *c, double t, double h, const double *x, const double *end, int first, int *added) {
    double *middle = s->work;
    int failed = 0, more = 0;
    *added = 0;
    if (first) failed = symdyn_gaps(s, t, x);
    if (first && !failed) failed = symdyn_add_contacts(s, c, added);
    for (int i = 0; i < s->n_x; i++) middle[i] = 0.5 * (x[i] + end[i]);
    if (!failed) failed = symdyn_gaps(s, t + 0.5 * h, middle);
    if (!failed) failed = symdyn_add_contacts(s, c, &more);
    *added |= more;
    return failed || !*added ? failed : symdyn_begin_contacts(s, t, x);
}

// Centres at what the frames looked at last.
static void symdyn_centers(symdyn_moreau *s) {
    for (long body = 0; body < s->n_bodies; body++)
        for (int k = 0; k < 3; k++) s->was[3 * body + k] = symdyn_sphere(s, body)[1 + k];
}

// Note the first pair that a step from t took through each other: the line of centres turned by more than a right angle, and they
// were nearer than they can be on the straight way. Only where one moves by more than its radius.
static void symdyn_passing(symdyn_moreau *s, double t) {
    for (long a = 0; a < s->n_bodies && !s->passed; a++) {
        const double *one = symdyn_sphere(s, a), *was = s->was + 3 * a;
        double moved = 0.0;
        for (int k = 0; k < 3; k++) moved += (one[1 + k] - was[k]) * (one[1 + k] - was[k]);
        if (!(sqrt(moved) > one[0])) continue;
        for (long b = 0; b < s->n_bodies; b++) {
            const double *two = symdyn_sphere(s, b), reach = one[0] + two[0] - s->depth;
            double begin = 0.0, dot = 0.0, way = 0.0, along = 0.0;
            for (int k = 0; k < 3; k++) {
                const double before = was[k] - s->was[3 * b + k], after = one[1 + k] - two[1 + k];
                begin += before * before;
                dot += before * after;
                way += (after - before) * (after - before);
                along += before * (before - after);
            }
            if (s->group_of[a] != s->group_of[b] || !(dot < 0.0) || !(begin - along * along / way < reach * reach)) continue;
            s->passed = 1;
            s->passed_a = a;
            s->passed_b = b;
            s->passed_at = t;
            return;
        }
    }
}

// Gaps of contacts with a name and their rates at the begin of a step from (t, x).
static int symdyn_given_begin(symdyn_moreau *s, double t, const double *x) {
    const int failed = s->n_given ? symdyn_gaps(s, t, x) : 0;
    for (long i = 0; i < s->n_given && !failed; i++) {
        s->given_was[2 * i] = s->gap[4 * i];
        s->given_was[2 * i + 1] = s->gap[4 * s->n_given + s->given_first[i]];
    }
    return failed;
}

// Relative velocity along the normal of contact i by the speeds, at (t, x).
static int symdyn_given_row(symdyn_moreau *s, long i, double t, const double *x, const double **row) {
    const int stopped = symdyn_look(s, t, x);
    if (stopped) return stopped;
    *row = s->direction + s->given_first[i] * s->n_u;
    s->reason = s->directions(s->directions_frame);
    return s->reason ? SYMDYN_MOREAU_CONTACT : 0;
}

// Note the first contact with a name that a step from (t, x) to end leapt over: without an impulse its gap goes from closing to
// opening, is negative somewhere on the straight way, and its normal turns by more than a right angle.
static int symdyn_given_passing(
    symdyn_moreau *s, const symdyn_cones *c, double t, double h, const double *x, const double *end, double *between) {
    const int points = 32;
    int failed = s->n_given && !s->passed ? symdyn_gaps(s, t + h, end) : 0;
    for (long i = 0; i < s->n_given && !failed && !s->passed; i++) {
        const double rate = s->gap[4 * s->n_given + s->given_first[i]];
        int suspect = s->given_kind[i] == SYMDYN_PLACED && s->given_was[2 * i] > 0.0 && s->given_was[2 * i + 1] < 0.0
            && s->gap[4 * i] > 0.0 && rate > 0.0;
        for (long k = 0; k < c->n; k++) suspect = suspect && !(s->a[k] == i && s->b[k] < 0 && c->P[c->first[k]] > 0.0);
        for (int p = 1, inside = 0; suspect && p < points && !failed && !inside; p++) {
            for (int k = 0; k < s->n_x; k++) between[k] = x[k] + (end[k] - x[k]) * p / points;
            failed = symdyn_settle(s, t + h * p / points, between);
            if (!failed) failed = symdyn_gaps(s, t + h * p / points, between);
            inside = !failed && s->gap[4 * i] < -1e3 * s->depth;
            if (!inside) continue;
            const double *row = s->direction;
            double dot = 0.0;
            failed = symdyn_given_row(s, i, t, x, &row);
            for (int k = 0; k < s->n_u && !failed; k++) between[k] = row[k];
            if (!failed) failed = symdyn_given_row(s, i, t + h, end, &row);
            for (int k = 0; k < s->n_u && !failed; k++) dot += between[k] * row[k];
            if (failed || !(dot < 0.0)) continue;
            s->passed = 1;
            s->passed_a = i;
            s->passed_b = -1;
            s->passed_at = t;
        }
        if (suspect && !failed) failed = symdyn_gaps(s, t + h, end);
    }
    return failed;
}

// One step from (t, x), in place: the motion without contacts, then rounds with those that touch at its begin and those whose gap
// closes until its middle. They are over only where the latest one makes no further gap close: contacts are only added, so that
// there is a last one.
static int symdyn_moreau_step(symdyn_moreau *s, symdyn_cones *c, double t, double h, double *x) {
    double *guess = s->work + 3 * s->n_x, *end = s->work + 4 * s->n_x, off = 0.0, size = 0.0;
    int failed = s->n_steps || !s->n_bodies ? 0 : symdyn_gaps(s, t, x);
    symdyn_centers(s);
    if (!failed) failed = symdyn_given_begin(s, t, x);
    if (!failed) failed = symdyn_rate(s, t, x);
    if (failed) return failed;
    for (int i = 0; i < s->n_x; i++) guess[i] = x[i] + 0.5 * h * s->xd[i];
    failed = symdyn_rate(s, t + 0.5 * h, guess);
    if (failed) return failed;
    for (int i = 0; i < s->n_x; i++) end[i] = x[i] + h * s->xd[i];
    s->n_found = c->n = 0;
    s->updates_left = s->step_updates;
    for (int round = 0, settled = 0, checked = 0;; round++) {
        int added = 0;
        if (settled || (checked && s->rough_sweeps)) {
            failed = symdyn_add_closing(s, c, t, h, x, end, !checked, &added);
            if (failed) return failed;
            if (settled && !added) break;
            checked = 1;
            if (added) round = 0;
        }
        const int rough = added && s->rough_sweeps;
        const double last = round ? off : 0.0;
        failed = symdyn_round(s, c, t, h, x, end, round, rough, &off, &size);
        if (failed) return failed;
        settled = rough ? 0 : symdyn_settled(s, c, round, off, last, size);
        if (settled < 0) return settled;
    }
    if (s->n_found && s->rough_sweeps) failed = symdyn_follow(s, c, t, h, x, end);
    if (!failed) failed = symdyn_keep(s, c, t + h, end);
    if (!failed) failed = symdyn_part(s, c, t + h, end);
    if (failed) return failed;
    symdyn_passing(s, t);
    failed = symdyn_given_passing(s, c, t, h, x, end, guess);
    if (failed) return failed;
    for (int i = 0; i < s->n_x; i++) x[i] = end[i];
    s->n_steps++;
    return 0;
}
