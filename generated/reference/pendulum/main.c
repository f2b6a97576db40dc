// Example for pendulum.c: checks every function against reference vectors made with 30 digits.
// 2 states visited, 31 of 32 statements exercised; not exercised: 1 of rhs.
// Build: cc -std=c99 -O2 -o pendulum_check main.c pendulum.c -lm
#include <math.h>
#include <stdio.h>

#include "pendulum.h"

// Whether the largest difference, relative to the largest entry of the reference, is above the tolerance.
static int check(const char *name, int code, const double *found, const double *wanted, int n, double tolerance) {
    double largest = 0.0, error = code ? HUGE_VAL : 0.0;
    for (int i = 0; i < n; i++) largest = fmax(largest, fabs(wanted[i]));
    for (int i = 0; i < n && !code; i++)
        if (!(fabs(found[i] - wanted[i]) <= error)) error = fabs(found[i] - wanted[i]);
    error /= largest > 0.0 ? largest : 1.0;
    const int good = error <= tolerance;
    printf("%-18s %-5s difference %.1e, tolerance %.1e%s%s\n", name, good ? "ok" : "WRONG", error, tolerance, code ? ": " : "",
           code ? pendulum_reason(code) : "");
    return !good;
}

int main(void) {
    int wrong = 0;
    double c[3];
    {
        const double p[] = { 9.81, 1.0, 1.0 };
        int code = pendulum_prologue(p, c);
        if (code) {
            printf("prologue: %s\n", pendulum_reason(code));
            return 1;
        }
        const double q[] = { 0.577447 };
        const double u[] = { -0.812281 };
        const double ud[] = { -0.943305 };
        {
            const double wanted[] = { -0.812281, -5.355148173935361 };
            double out[2];
            code = pendulum_rhs(q, u, p, c, out);
            wrong += check("rhs", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { 1.0 };
            double out[1];
            code = pendulum_mass_matrix(c, out);
            wrong += check("mass_matrix", code, out, wanted, 1, 1e-12);
        }
        {
            const double wanted[] = { 0.0 };
            double out[1];
            code = pendulum_k_tilde(out);
            wrong += check("k_tilde", code, out, wanted, 1, 1e-12);
        }
        {
            const double wanted[] = { -5.355148173935361 };
            double out[1];
            code = pendulum_F_tilde(q, p, c, out);
            wrong += check("F_tilde", code, out, wanted, 1, 1e-12);
        }
        {
            const double wanted[] = { 0.8378590275555537, 0.5458866640097207, 1.0 };
            double out[3];
            code = pendulum_J(q, p, out);
            wrong += check("J", code, out, wanted, 3, 1e-12);
        }
        {
            const double wanted[] = { 0.3299002114805, -8.219397060319983 };
            double out[2];
            code = pendulum_energy(q, u, p, c, out);
            wrong += check("energy", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { 4.4118431739353605 };
            double out[1];
            code = pendulum_inverse_dynamics(q, ud, p, c, out);
            wrong += check("inverse_dynamics", code, out, wanted, 1, 1e-12);
        }
    }
    {
        const double p[] = { 8.974002, 1.022946, 1.002271 };
        int code = pendulum_prologue(p, c);
        if (code) {
            printf("prologue: %s\n", pendulum_reason(code));
            return 1;
        }
        const double q[] = { -0.134466 };
        const double u[] = { 0.52456 };
        const double ud[] = { -0.995788 };
        {
            const double wanted[] = { 0.52456, 1.200339062984576 };
            double out[2];
            code = pendulum_rhs(q, u, p, c, out);
            wrong += check("rhs", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { 1.027597496515641 };
            double out[1];
            code = pendulum_mass_matrix(c, out);
            wrong += check("mass_matrix", code, out, wanted, 1, 1e-12);
        }
        {
            const double wanted[] = { 0.0 };
            double out[1];
            code = pendulum_k_tilde(out);
            wrong += check("k_tilde", code, out, wanted, 1, 1e-12);
        }
        {
            const double wanted[] = { 1.2334654160928806 };
            double out[1];
            code = pendulum_F_tilde(q, p, c, out);
            wrong += check("F_tilde", code, out, wanted, 1, 1e-12);
        }
        {
            const double wanted[] = { 0.9932235609683471, -0.13436560340487436, 1.0 };
            double out[3];
            code = pendulum_J(q, p, out);
            wrong += check("J", code, out, wanted, 3, 1e-12);
        }
        {
            const double wanted[] = { 0.14137850443830433, -9.117712285424322 };
            double out[2];
            code = pendulum_energy(q, u, p, c, out);
            wrong += check("energy", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { -2.2567346719531978 };
            double out[1];
            code = pendulum_inverse_dynamics(q, ud, p, c, out);
            wrong += check("inverse_dynamics", code, out, wanted, 1, 1e-12);
        }
    }
    puts("2 states visited, 31 of 32 statements exercised; not exercised: 1 of rhs");
    printf(wrong ? "%d results are wrong\n" : "all results agree\n", wrong);
    return wrong != 0;
}
