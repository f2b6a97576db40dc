// Motions with rigid contacts from phase to phase, the same for every mechanism.

#include "prelude.h"
#include "hybrid.h"

// Functions that the library of this file exports.
SYMDYN_EXPORT int symdyn_hybrid_go(symdyn_hybrid *h);
SYMDYN_EXPORT int symdyn_hybrid_modes(int n, const int *rows, const int *excluded, const double *coefficients, const double *D,
    const double *b, const double *tolerances, int *mode, double *answer);

// Go on with a motion, as far as it needs nothing of what is left to the caller, with records that are empty. Returns one of the
// codes of hybrid.h.
SYMDYN_EXPORT int symdyn_hybrid_go(symdyn_hybrid *h) {
    if (symdyn_take_parameters(h)) return SYMDYN_HYBRID_CONSTANTS;
    for (;;) {
        const int soon = h->n_phases && !(h->phase_end[h->n_phases - 1] - h->phase_begin[h->n_phases - 1] > h->same);
        if (h->n_phases && !h->n_fired && h->t >= h->end) return SYMDYN_HYBRID_DONE;
        if (soon) return SYMDYN_HYBRID_SWITCH;
        if (h->n_phases >= h->most_phases || h->n_steps > h->most_steps || h->n_happened + h->n_contacts >= h->most_happened
            || h->n_impacts >= h->most_impacts)
            return SYMDYN_HYBRID_FULL;
        if ((h->begins || h->n_fired) && symdyn_switch(h)) return SYMDYN_HYBRID_SWITCH;
        if (symdyn_phase(h)) return SYMDYN_HYBRID_PHASE;
    }
}

// The only solution of one problem alone, see contact_modes.h, of n sites with so many rows each (0: one of dry friction of a
// joint), modes that are ruled out, and friction (static, kinetic) and the sign of the slip of each; tolerances: noise,
// dependent, different, kept. answer: signs of slips (n), forces, what comes of them. Returns 1, 0 where there is none, -1 where
// that is not certain.
SYMDYN_EXPORT int symdyn_hybrid_modes(int n, const int *rows, const int *excluded, const double *coefficients, const double *D,
    const double *b, const double *tolerances, int *mode, double *answer) {
    symdyn_modes m = {
        .n_sites = n, .noise = tolerances[0], .dependent = tolerances[1], .different = tolerances[2], .kept = tolerances[3]};
    for (int s = 0; s < n; s++) {
        const double *const of = coefficients + 3 * s;
        m.site[s] = (symdyn_site){.first = m.n,
            .n = rows[s] ? rows[s] : 1,
            .bounded = !rows[s],
            .excluded = excluded[s],
            .adhesion = of[0],
            .friction = of[1],
            .slip = of[2]};
        m.n += m.site[s].n;
    }
    for (int i = 0; i < m.n; i++) {
        m.b[i] = b[i];
        for (int j = 0; j < m.n; j++) m.D[i][j] = D[i * m.n + j];
    }
    const int found = symdyn_solve_modes(&m);
    for (int s = 0; s < n; s++) {
        mode[s] = m.mode[s];
        answer[s] = m.sign[s];
    }
    for (int i = 0; i < m.n; i++) {
        answer[n + i] = m.lam[i];
        answer[n + m.n + i] = m.w[i];
    }
    return found;
}
