// Contacts that open, stick or slide at one instant, in a plane: all combinations of modes that fulfil the laws of contact and
// friction, as symdyn/runtime/contact_laws.py finds them, where the rows that hold do not depend on each other.
//
// Velocities of an impact, or accelerations, are w = b + D lam, with lam_N >= 0, w_N >= 0 and lam_N w_N = 0 in every contact, and
// friction within Coulomb's cone.
#pragma once

#include "elimination.h"
#include "modes.h"

enum { SYMDYN_MOST_SITES = 4, SYMDYN_MOST_ROWS = 2 * SYMDYN_MOST_SITES };

// One contact: its first row, their number (1, or 2 with friction), whether it is dry friction of a joint, whose one row is
// tangential and whose coefficients are forces, modes that are ruled out, by bits, coefficients of static and kinetic friction,
// the sign of the slip that it has (0: none, it may stick or begin to slide).
typedef struct {
    int first, n, bounded, excluded;
    double adhesion, friction, slip;
} symdyn_site;

// A problem with its answer. noise: part of the sizes to which inequalities hold; dependent: pivots below this part of the
// largest entry; different: accelerations that differ by more than this part are different solutions; kept: a tangent that is
// left this part of its mobility where other rows hold does not move. The answer: what every site does, the sign of its slip,
// forces and what comes of them.
typedef struct {
    int n, n_sites;
    double D[SYMDYN_MOST_ROWS][SYMDYN_MOST_ROWS], b[SYMDYN_MOST_ROWS];
    symdyn_site site[SYMDYN_MOST_SITES];
    double noise, dependent, different, kept;
    int mode[SYMDYN_MOST_SITES];
    double sign[SYMDYN_MOST_SITES], lam[SYMDYN_MOST_ROWS], w[SYMDYN_MOST_ROWS];
} symdyn_modes;

// The row of friction of a site, -1: there is none.
static int symdyn_rubs(const symdyn_site *site) { return site->bounded ? site->first : site->n > 1 ? site->first + 1 : -1; }

// The size of forces that count, by the largest force.
static double symdyn_force_size(const symdyn_modes *m, const double *lam, double size) {
    double most = 1e-300;
    for (int i = 0; i < m->n; i++) most = fmax(most, m->D[i][i]);
    return fmax(symdyn_most(lam, m->n), size / most);
}

// The size of w that counts.
static double symdyn_size_of(const symdyn_modes *m) {
    double size = fmax(symdyn_most(m->b, m->n), 1e-300);
    for (int i = 0; i < m->n; i++) {
        double given = 0.0;
        for (int s = 0; s < m->n_sites; s++)
            if (m->site[s].bounded) given += fabs(m->D[i][m->site[s].first]) * m->site[s].adhesion;
        size = fmax(size, given);
    }
    return size;
}

// The forces of one combination of modes and what comes of them. Returns 1 if it is a solution, 0 if it breaks an inequality, -1
// where rows depend on each other.
static int symdyn_combination(const symdyn_modes *m, const int *mode, const double *sign, double *lam, double *w) {
    double A[SYMDYN_MOST_ROWS][SYMDYN_MOST_ROWS], x[SYMDYN_MOST_ROWS];
    int active[SYMDYN_MOST_ROWS], n = 0;
    for (int s = 0; s < m->n_sites; s++) {
        const symdyn_site *const site = m->site + s;
        if (mode[s] != SYMDYN_OPEN && !site->bounded) active[n++] = site->first;
        if (mode[s] == SYMDYN_STICKING) active[n++] = symdyn_rubs(site);
    }
    for (int i = 0; i < n; i++) {
        x[i] = -m->b[active[i]];
        int j = 0;
        for (int s = 0; s < m->n_sites; s++) {
            const symdyn_site *const site = m->site + s;
            const double *const row = m->D[active[i]];
            const int k = site->first, rubs = symdyn_rubs(site);
            const double along = mode[s] == SYMDYN_SLIDING && rubs >= 0 ? -site->friction * sign[s] * row[rubs] : 0.0;
            if (site->bounded)
                x[i] -= along;
            else if (mode[s] != SYMDYN_OPEN)
                A[i][j++] = row[k] + along;
            if (mode[s] == SYMDYN_STICKING) A[i][j++] = row[rubs];
        }
    }
    if (symdyn_solve_rows(n, SYMDYN_MOST_ROWS, A[0], x, m->dependent)) return -1;
    for (int s = 0, j = 0; s < m->n_sites; s++) {
        const symdyn_site *const site = m->site + s;
        const int k = site->first, rubs = symdyn_rubs(site);
        const double pressed = site->bounded ? 1.0 : mode[s] == SYMDYN_OPEN ? 0.0 : x[j++];
        if (!site->bounded) lam[k] = pressed;
        if (rubs >= 0) lam[rubs] = mode[s] == SYMDYN_STICKING ? x[j++] : -site->friction * sign[s] * pressed;
    }
    for (int i = 0; i < m->n; i++) {
        w[i] = m->b[i];
        for (int j = 0; j < m->n; j++) w[i] += m->D[i][j] * lam[j];
    }
    for (int i = 0; i < n; i++) w[active[i]] = 0.0;
    const double size = symdyn_size_of(m), force = symdyn_force_size(m, lam, size);
    for (int s = 0; s < m->n_sites; s++) {
        const symdyn_site *const site = m->site + s;
        const int k = site->first, rubs = symdyn_rubs(site);
        const double bound = site->adhesion * (site->bounded ? 1.0 : lam[k]);
        if (!site->bounded && (mode[s] == SYMDYN_OPEN ? w[k] < -m->noise * size : lam[k] < -m->noise * force)) return 0;
        if (mode[s] == SYMDYN_STICKING && fabs(lam[rubs]) > bound + m->noise * force) return 0;
        if (mode[s] == SYMDYN_SLIDING && rubs >= 0 && site->slip == 0.0 && w[rubs] * sign[s] < -m->noise * size) return 0;
    }
    return 1;
}

// The modes of a site, the preferred ones first, with the signs of its slip. Returns how many.
static int symdyn_options(const symdyn_site *site, int *mode, double *sign) {
    int n = 0;
    const int known = symdyn_rubs(site) < 0 || site->slip != 0.0;
    if (!known && !(site->excluded >> SYMDYN_STICKING & 1)) {
        mode[n] = SYMDYN_STICKING;
        sign[n++] = 0.0;
    }
    for (int k = 0; k < (known ? 1 : 2) && !(site->excluded >> SYMDYN_SLIDING & 1); k++) {
        mode[n] = SYMDYN_SLIDING;
        sign[n++] = known ? site->slip : k ? -1.0 : 1.0;
    }
    if (!site->bounded && !(site->excluded >> SYMDYN_OPEN & 1)) {
        mode[n] = SYMDYN_OPEN;
        sign[n++] = 0.0;
    }
    return n;
}

// The only solution of a problem whose kinetic friction holds what static friction holds. Returns 1, 0 where there is none, -1
// where there are several or where it is not certain.
static int symdyn_only_solution(symdyn_modes *m) {
    int modes[SYMDYN_MOST_SITES][4], n[SYMDYN_MOST_SITES] = {0}, at[SYMDYN_MOST_SITES] = {0}, found = 0;
    double signs[SYMDYN_MOST_SITES][4];
    for (int s = 0; s < m->n_sites; s++)
        if (!(n[s] = symdyn_options(m->site + s, modes[s], signs[s]))) return 0;
    for (int s = 0; s >= 0;) {
        int mode[SYMDYN_MOST_SITES];
        double sign[SYMDYN_MOST_SITES], lam[SYMDYN_MOST_ROWS] = {0}, w[SYMDYN_MOST_ROWS] = {0}, apart = 0.0;
        for (int k = 0; k < m->n_sites; k++) {
            mode[k] = modes[k][at[k]];
            sign[k] = signs[k][at[k]];
        }
        const int good = symdyn_combination(m, mode, sign, lam, w);
        if (good < 0) return -1;
        for (int i = 0; found && i < m->n; i++) apart = fmax(apart, fabs(w[i] - m->w[i]));
        if (good && found && apart > m->different * fmax(symdyn_most(w, m->n), symdyn_most(m->b, m->n))) return -1;
        if (good && !found) {
            found = 1;
            for (int k = 0; k < m->n_sites; k++) {
                m->mode[k] = mode[k];
                m->sign[k] = sign[k];
            }
            for (int i = 0; i < m->n; i++) {
                m->lam[i] = lam[i];
                m->w[i] = w[i];
            }
        }
        for (s = m->n_sites - 1; s >= 0 && ++at[s] == n[s]; s--) at[s] = 0;
    }
    return found;
}

// Whether other rows that may hold would keep a site from slipping, which has no slip but must not stick: its friction may then
// be static.
static int symdyn_may_be_kept(const symdyn_modes *m, int of) {
    const int rubs = symdyn_rubs(m->site + of), never = 1 << SYMDYN_STICKING | 1 << SYMDYN_SLIDING;
    double A[SYMDYN_MOST_ROWS][SYMDYN_MOST_ROWS], x[SYMDYN_MOST_ROWS], left = m->D[rubs][rubs];
    int held[SYMDYN_MOST_ROWS], n = 0;
    for (int s = 0; s < m->n_sites; s++) {
        const symdyn_site *const site = m->site + s;
        if ((site->excluded & never) == never) continue;
        if (!site->bounded) held[n++] = site->first;
        if (s != of && symdyn_rubs(site) >= 0 && site->slip == 0.0 && !(site->excluded >> SYMDYN_STICKING & 1))
            held[n++] = symdyn_rubs(site);
    }
    if (!n) return 0;
    for (int i = 0; i < n; i++) {
        x[i] = m->D[held[i]][rubs];
        for (int j = 0; j < n; j++) A[i][j] = m->D[held[i]][held[j]];
    }
    if (symdyn_solve_rows(n, SYMDYN_MOST_ROWS, A[0], x, m->dependent)) return 1;
    for (int i = 0; i < n; i++) left -= m->D[held[i]][rubs] * x[i];
    return !(left > m->kept * m->D[rubs][rubs]);
}

// The same of any problem: what static friction can hold does not begin to slide; kinetic friction, where it is less, counts for
// what slides then. A site that must not stick, but may be kept from slipping by others, is left to the caller.
static int symdyn_solve_modes(symdyn_modes *m) {
    for (int s = 0; s < m->n_sites && m->n_sites > 1; s++) {
        const symdyn_site *const site = m->site + s;
        const int begins = symdyn_rubs(site) >= 0 && site->slip == 0.0 && site->friction != 0.0;
        if (begins && site->excluded >> SYMDYN_STICKING & 1 && symdyn_may_be_kept(m, s)) return -1;
    }
    for (;;) {
        symdyn_modes held = *m;
        int steep[SYMDYN_MOST_SITES], slides = 0;
        for (int s = 0; s < m->n_sites; s++) {
            symdyn_site *const site = held.site + s;
            steep[s] = symdyn_rubs(site) >= 0 && site->slip == 0.0 && site->friction != site->adhesion
                && !(site->excluded >> SYMDYN_STICKING & 1);
            if (steep[s]) site->friction = site->adhesion;
        }
        const int found = symdyn_only_solution(&held);
        for (int s = 0; s < m->n_sites; s++)
            if (found == 1 && steep[s] && held.mode[s] == SYMDYN_SLIDING) {
                m->site[s].excluded |= 1 << SYMDYN_STICKING;
                slides = 1;
            }
        if (slides) continue;
        for (int s = 0; s < m->n_sites; s++) {
            m->mode[s] = held.mode[s];
            m->sign[s] = held.sign[s];
        }
        for (int i = 0; i < m->n; i++) {
            m->lam[i] = held.lam[i];
            m->w[i] = held.w[i];
        }
        return found;
    }
}

// Whether a site is on the border of two modes with the same accelerations; sites: as they were given.
static int symdyn_on_a_border(const symdyn_modes *m, const symdyn_site *sites) {
    const double size = symdyn_most(m->b, m->n), force = symdyn_force_size(m, m->lam, size);
    for (int s = 0; s < m->n_sites; s++) {
        const symdyn_site *const site = sites + s;
        const int k = site->first, rubs = symdyn_rubs(site);
        if (site->excluded) continue;
        const double slip = rubs >= 0 ? fabs(m->w[rubs]) : 0.0;
        const double bound = site->adhesion * (site->bounded ? 1.0 : m->lam[k]) - (rubs >= 0 ? fabs(m->lam[rubs]) : 0.0);
        const int held = site->slip == 0.0 && site->adhesion > 0.0 && slip <= m->noise * size && bound <= m->noise * force;
        if (site->bounded || m->lam[k] > m->noise * force ? rubs >= 0 && held : fabs(m->w[k]) <= m->noise * size) return 1;
    }
    return 0;
}
