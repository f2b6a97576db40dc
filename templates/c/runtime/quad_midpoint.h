// The explicit midpoint rule for a tape of x_dot with SYMDYN_SIZE entries in numbers of 113 binary digits; see `midpoint` in
// symdyn/precision/extrapolation.py.

// x at t + h by n steps; in: t, h, x, x_dot at t. Returns 1 where x_dot cannot be computed.
int symdyn_midpoint(const quad *in, int n, quad *out) {
    const quad t = in[0], h = in[1] / n, *x = in + 2, *begin = x + SYMDYN_SIZE;
    quad before[SYMDYN_SIZE], now[SYMDYN_SIZE + 1], rate[SYMDYN_SIZE];
    for (int k = 0; k < SYMDYN_SIZE; k++) {
        before[k] = x[k];
        now[k + 1] = x[k] + h * begin[k];
    }
    for (int i = 1; i < n; i++) {
        now[0] = t + i * h;
        if (symdyn_quad(now, rate)) return 1;
        for (int k = 0; k < SYMDYN_SIZE; k++) {
            const quad next = before[k] + 2 * h * rate[k];
            before[k] = now[k + 1];
            now[k + 1] = next;
        }
    }
    for (int k = 0; k < SYMDYN_SIZE; k++) out[k] = now[k + 1];
    return 0;
}
