// Example for four_bar.c: checks every function against reference vectors made with 30 digits.
// Build: cc -std=c99 -O2 -o four_bar_check main.c four_bar.c -lm
#include <math.h>
#include <stdio.h>

#include "four_bar.h"

// The default parameters of the reference, or arbitrary ones where there is no default.
static const double p[] = { 9.81, 1.0, 0.4, 0.053333333333333344, 2.0, 1.0, 0.6666666666666666, 1.5, 0.8, 0.32000000000000006, 0.8, 2.0, 2.0, 1.6 };

// Whether the largest difference, relative to the largest entry of the reference, is above the tolerance.
static int check(const char *name, int code, const double *found, const double *wanted, int n, double tolerance) {
    double largest = 0.0, error = code ? INFINITY : 0.0;
    for (int i = 0; i < n; i++) largest = fmax(largest, fabs(wanted[i]));
    for (int i = 0; i < n && !code; i++)
        if (!(fabs(found[i] - wanted[i]) <= error)) error = fabs(found[i] - wanted[i]);
    error /= largest > 0.0 ? largest : 1.0;
    const int good = error <= tolerance;
    printf("%-18s %-5s difference %.1e, tolerance %.1e%s%s\n", name, good ? "ok" : "WRONG", error, tolerance, code ? ": " : "",
           code ? four_bar_reason(code) : "");
    return !good;
}

int main(void) {
    int wrong = 0;
    double c[9];
    int code = four_bar_prologue(p, c);
    if (code) return printf("prologue: %s\n", four_bar_reason(code)), 1;
    {
        const double q[] = { 0.44308, -0.542476, 0.890541 };
        const double u[] = { 0.802855, -0.93882, -0.949108 };
        {
            const double wanted[] = { 0.802855, -0.93882, -0.949108, -15.467749960071389, 19.720573840881954, -0.45434304564415606 };
            double out[6];
            code = four_bar_rhs(q, u, p, c, out);
            wrong += check("rhs", code, out, wanted, 6, 1e-12);
        }
        {
            const double wanted[] = { 1.8377273505101424, 1.282368363632516 };
            double out[2];
            code = four_bar_C(q, p, out);
            wrong += check("C", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { -1.282368363632516, -0.9393891032578042, -1.1378539351720607, 3.8377273505101424, 3.1149789662484992, 1.1248503999258996 };
            double out[6];
            code = four_bar_C_r(q, p, out);
            wrong += check("C_r", code, out, wanted, 6, 1e-12);
        }
        {
            const double wanted[] = { 1.8270370516625136, 1.5570976874831506 };
            double out[2];
            code = four_bar_F_d(q, u, p, out);
            wrong += check("F_d", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { -11.097092606944518, -16.42167667446779 };
            double out[2];
            code = four_bar_lam(q, u, p, c, out);
            wrong += check("lam", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { 6.043152997219739, 5.489965425658171, 0.0, 0.0, 0.0, -3.727367777169281e-29, 3.6235274625800615, 1.380149197327382, 0.0, 0.0, 0.0, 0.0, -6.862220178267993, -3.906450925124819, 0.0, 0.0, 0.0, 1.5777218104420236e-30, 11.097092606944518, 16.42167667446779, 0.0, 0.0, 0.0, 0.0 };
            double out[24];
            code = four_bar_reactions(q, u, p, c, out);
            wrong += check("reactions", code, out, wanted, 24, 1e-12);
        }
    }
    {
        const double q[] = { -0.155767, -0.941918, -0.556617 };
        const double u[] = { -0.124225, -0.008376, -0.533831 };
        {
            const double wanted[] = { -0.124225, -0.008376, -0.533831, -6.3705487834205785, 10.479615937456565, -8.220777984024418 };
            double out[6];
            code = four_bar_rhs(q, u, p, c, out);
            wrong += check("rhs", code, out, wanted, 6, 1e-12);
        }
        {
            const double wanted[] = { -0.43182348802113396, -3.49884476567811 };
            double out[2];
            code = four_bar_C(q, p, out);
            wrong += check("C", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { 3.49884476567811, 3.374734478757397, 1.5944246829794957, 1.568176511978866, 0.7778622474736261, -0.13345385084640646 };
            double out[6];
            code = four_bar_C_r(q, p, out);
            wrong += check("C_r", code, out, wanted, 6, 1e-12);
        }
        {
            const double wanted[] = { -0.031051368120899845, -0.7413528858838805 };
            double out[2];
            code = four_bar_F_d(q, u, p, out);
            wrong += check("F_d", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { -3.660498117723673, -31.372495441342192 };
            double out[2];
            code = four_bar_lam(q, u, p, c, out);
            wrong += check("lam", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { 6.50418069378499, 3.0237724903517544, 0.0, 0.0, 0.0, 1.0255191767873153e-29, 6.905604018299679, -4.269817347220746, 0.0, 0.0, 0.0, 1.5777218104420236e-30, 1.2119085044417826, -17.600138976066575, 0.0, 0.0, 0.0, 0.0, 3.660498117723673, 31.372495441342192, 0.0, 0.0, 0.0, 0.0 };
            double out[24];
            code = four_bar_reactions(q, u, p, c, out);
            wrong += check("reactions", code, out, wanted, 24, 1e-12);
        }
    }
    printf(wrong ? "%d results are wrong\n" : "all results agree\n", wrong);
    return wrong != 0;
}
