// Small symmetric systems of which some rows may follow from others.
#pragma once

// Solve G f = gap for the m rows that are open, by elimination with the largest pivots, each relative to the size of its row; G
// (m x m) and gap are overwritten, gap by f. Rows are closed, and numbered in `order`, as they are taken; those that are left
// open follow from them. Returns how many were taken.
static int symdyn_solve_open(int m, double *G, const double *sizes, double *gap, int *open, int *order) {
    int n = 0;
    for (int best = 0; best >= 0;) {
        double most = SYMDYN_DEPENDENT;
        best = -1;
        for (int i = 0; i < m; i++)
            if (open[i] && G[m * i + i] > most * sizes[i]) {
                most = G[m * i + i] / sizes[i];
                best = i;
            }
        if (best < 0) break;
        open[best] = 0;
        order[n++] = best;
        for (int i = 0; i < m; i++)
            if (open[i]) {
                const double factor = G[m * i + best] / G[m * best + best];
                gap[i] -= factor * gap[best];
                for (int j = 0; j < m; j++) G[m * i + j] -= factor * G[m * best + j];
            }
    }
    for (int k = n - 1; k >= 0; k--) {
        const int i = order[k];
        for (int other = k + 1; other < n; other++) gap[i] -= G[m * i + order[other]] * gap[order[other]];
        gap[i] /= G[m * i + i];
    }
    return n;
}
