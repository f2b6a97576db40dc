// Example for pendulum.c: checks every function against reference vectors made with 30 digits.
// Build: cc -std=c99 -O2 -o pendulum_check main.c pendulum.c -lm
#include <math.h>
#include <stdio.h>

#include "pendulum.h"

// The default parameters of the reference, or arbitrary ones where there is no default.
static const double p[] = { 9.81, 1.0, 1.0 };

// Whether the largest difference, relative to the largest entry of the reference, is above the tolerance.
static int check(const char *name, int code, const double *found, const double *wanted, int n, double tolerance) {
    double largest = 0.0, error = code ? INFINITY : 0.0;
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
    int code = pendulum_prologue(p, c);
    if (code) return printf("prologue: %s\n", pendulum_reason(code)), 1;
    {
        const double q[] = { -0.00913 };
        const double u[] = { -0.101018 };
        const double ud[] = { 0.303186 };
        {
            const double wanted[] = { -0.101018, 0.0895640556908935 };
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
            const double wanted[] = { 0.0895640556908935 };
            double out[1];
            code = pendulum_F_tilde(q, p, c, out);
            wrong += check("F_tilde", code, out, wanted, 1, 1e-12);
        }
        {
            const double wanted[] = { 0.9999583218395147, -0.009129873159112487, 1.0 };
            double out[3];
            code = pendulum_J(q, p, out);
            wrong += check("J", code, out, wanted, 3, 1e-12);
        }
        {
            const double wanted[] = { 0.005102318162, -9.80959113724564 };
            double out[2];
            code = pendulum_energy(q, u, p, c, out);
            wrong += check("energy", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { 0.2136219443091065 };
            double out[1];
            code = pendulum_inverse_dynamics(q, ud, p, c, out);
            wrong += check("inverse_dynamics", code, out, wanted, 1, 1e-12);
        }
    }
    {
        const double q[] = { -0.812281 };
        const double u[] = { -0.943305 };
        const double ud[] = { 0.67153 };
        {
            const double wanted[] = { -0.943305, 7.120667320541786 };
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
            const double wanted[] = { 7.120667320541786 };
            double out[1];
            code = pendulum_F_tilde(q, p, c, out);
            wrong += check("F_tilde", code, out, wanted, 1, 1e-12);
        }
        {
            const double wanted[] = { 0.6878445416236925, -0.7258580347137397, 1.0 };
            double out[3];
            code = pendulum_J(q, p, out);
            wrong += check("J", code, out, wanted, 3, 1e-12);
        }
        {
            const double wanted[] = { 0.44491216151249996, -6.747754953328423 };
            double out[2];
            code = pendulum_energy(q, u, p, c, out);
            wrong += check("energy", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { -6.449137320541786 };
            double out[1];
            code = pendulum_inverse_dynamics(q, ud, p, c, out);
            wrong += check("inverse_dynamics", code, out, wanted, 1, 1e-12);
        }
    }
    printf(wrong ? "%d results are wrong\n" : "all results agree\n", wrong);
    return wrong != 0;
}
