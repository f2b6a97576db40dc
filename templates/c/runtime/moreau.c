// Time stepping with contacts, the same for every mechanism.

#include "moreau.h"

// Functions that the library of this file exports.
SYMDYN_EXPORT int symdyn_moreau_go(symdyn_moreau *s, symdyn_cones *c, const double *span, double *x, long n, double *out,
    long *ends, long *places, double *values, double *missed, long room, long *done);
SYMDYN_EXPORT double symdyn_moreau_impulses(symdyn_cones *c, double tolerance, long most_sweeps);

// Steps of one length from (t, x), in place, at most n; the state after each is a row of out. The contacts of each step go to
// places (n_contacts*3: a, b, state) and values (n_contacts*10: gap and velocities at its end, impulses, velocities at its
// begin), behind each other, as far as there is room; ends: how many after each step. Returns 0 or a failure; done: how many
// steps.
SYMDYN_EXPORT int symdyn_moreau_go(symdyn_moreau *s, symdyn_cones *c, const double *span, double *x, long n, double *out,
    long *ends, long *places, double *values, double *missed, long room, long *done) {
    const double begin = span[0], h = span[1];
    long kept = 0;
    for (*done = 0; *done < n; ++*done) {
        if (kept + c->most > room) return 0;
        const int failed = symdyn_moreau_step(s, c, begin + h * (double)*done, h, x);
        if (failed) return failed;
        for (int i = 0; i < s->n_x; i++) out[*done * s->n_x + i] = x[i];
        for (long i = 0; i < s->n_old; i++, kept++) {
            places[3 * kept] = s->old_a[i];
            places[3 * kept + 1] = s->old_b[i];
            places[3 * kept + 2] = s->old_state[i];
            for (int k = 0; k < 4; k++) values[10 * kept + k] = s->at_end[4 * i + k];
            for (int k = 0; k < 3; k++) values[10 * kept + 4 + k] = s->P_old[3 * i + k];
            for (int k = 0; k < 3; k++) values[10 * kept + 7 + k] = s->incoming[3 * i + k];
        }
        ends[*done] = kept;
        missed[*done] = s->missed;
    }
    return 0;
}

// The impulses of one problem alone, see cones.h.
SYMDYN_EXPORT double symdyn_moreau_impulses(symdyn_cones *c, double tolerance, long most_sweeps) {
    return symdyn_cones_solve(c, tolerance, most_sweeps);
}
