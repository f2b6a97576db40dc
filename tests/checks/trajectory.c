// A trajectory of a written mechanism from its initial values, and with BATCH several states and trajectories in SIMD lanes;
// every number is printed by its bits. MECHANISM is its name, HEADER its header.
#ifdef EXACT
#define _POSIX_C_SOURCE 200809L
#endif
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include HEADER

#define JOINED(a, b) a##b
#define OF_NAME(name, what) JOINED(name, what)
#define OF(what) OF_NAME(MECHANISM, what)

enum { N_TIMES = 101, N_STATES = 7, N_X = OF(_n_x), N_P = OF(_n_p), N_INPUTS = OF(_n_inputs) };

static void print_bits(const char *what, const double *values, int n) {
    for (int i = 0; i < n; i++) {
        unsigned long long bits;
        memcpy(&bits, values + i, sizeof bits);
        printf("%s %08lx%08lx\n", what, (unsigned long)(bits >> 32), (unsigned long)(bits & 0xffffffffu));
    }
}

static void *blocks[2];
static int n_blocks;

// Zeroed memory on a multiple of 64; exactly so much with EXACT, so that a sanitizer sees what goes beyond.
static void *memory_of(long size) {
#ifdef EXACT
    void *block = 0;
    if (posix_memalign(&block, 64, (size_t)size)) exit(3);
    memset(block, 0, (size_t)size);
    blocks[n_blocks++] = block;
    return block;
#else
    char *const block = calloc((size_t)size + 64, 1);
    if (!block) exit(3);
    blocks[n_blocks++] = block;
    return block + (64 - (uintptr_t)block % 64) % 64;
#endif
}

static double x0[N_X], p[N_P + 1], c[OF(_n_c) + 1], inputs[N_INPUTS + 1], times[N_TIMES], tolerances[N_X];
static double states[N_STATES * N_TIMES * N_X];

static void read_tables(void) {
    for (int k = 0; k < OF(_n_q); k++) x0[k] = OF(_coordinates)[k].value;
    for (int k = 0; k < OF(_n_u); k++) x0[OF(_n_q) + k] = OF(_speeds)[k].value;
    for (int k = 0; k < OF(_n_z); k++) x0[OF(_n_q) + OF(_n_u) + k] = OF(_states)[k].value;
    for (int k = 0; k < N_P; k++) p[k] = OF(_parameters)[k].value;
    for (int k = 0; k < N_INPUTS; k++) inputs[k] = OF(_inputs)[k].value;
    for (int k = 0; k < N_X; k++) tolerances[k] = 1e-10;
    for (int k = 0; k < N_TIMES; k++) times[k] = 0.02 * k;
}

static int one_trajectory(const double *span) {
    void *const run = memory_of(OF(_simulation_size)());
    const symdyn_problem problem = {.p = p, .c = c, .inputs = inputs, .project = 1, .length = 1.0};
    symdyn_report report;
    double ends[2 * N_X];
    long written = 0;
    int status = OF(_simulation_start)(run, &problem, span, x0, tolerances);
    if (!status) status = OF(_simulation_go)(run, 0, 100000, times, N_TIMES, states, &written);
    OF(_simulation_report)(run, &report, ends);
    printf("status %d, %ld steps, %ld rejected\n", status, report.n_steps, report.n_rejected);
    print_bits("x", states, (int)written * N_X);
    return status != 0 || written != N_TIMES;
}

#ifdef BATCH
static int in_lanes(const double *span) {
    void *const batch = memory_of(OF(_batch_size)());
    const long out_steps[2] = {N_X, 1};
    double several[N_STATES * N_X], out[N_STATES * N_X], ends[N_STATES * 2 * N_X];
    const double zero = 0.0, one = 1.0;
    symdyn_report reports[N_STATES];
    int codes[N_STATES], wrong = 0;
    for (int i = 0; i < N_STATES; i++)
        for (int k = 0; k < N_X; k++) several[i * N_X + k] = x0[k] + 0.01 * i * (k + 1);
    const symdyn_table given[4] = {{&zero, 0, 0}, {several, N_X, 1}, {inputs, 0, 1}, {p, 0, 1}}, length = {&one, 0, 1};
    const symdyn_batch_motions motions = {.n = N_STATES,
        .n_out = N_TIMES,
        .x = given + 1,
        .inputs = given + 2,
        .p = given + 3,
        .lengths = &length,
        .span = span,
        .atol = tolerances,
        .t_out = times,
        .x_out = states,
        .states = ends,
        .reports = reports};
    wrong += OF(_rhs_batch)(N_STATES, given, out, out_steps, codes) != 0;
    print_bits("x_dot", out, N_STATES * N_X);
    OF(_batch_start)(batch, &motions);
    wrong += OF(_batch_go)(batch, 100000) != N_STATES;
    for (int i = 0; i < N_STATES; i++) wrong += reports[i].status != 0;
    print_bits("lanes", states, N_STATES * N_TIMES * N_X);
    return wrong;
}
#endif

int main(void) {
    const double span[5] = {0.0, 2.0, 1e-10, 0.0, 0.0};
    int wrong;
    read_tables();
    wrong = OF(_prologue)(p, c) != 0 || one_trajectory(span);
#ifdef BATCH
    wrong += in_lanes(span);
#endif
    for (int k = 0; k < n_blocks; k++) free(blocks[k]);
    return wrong != 0;
}
