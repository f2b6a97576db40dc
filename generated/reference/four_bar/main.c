// Example for four_bar.c: checks every function against reference vectors made with 30 digits.
// 18 states visited, 804 of 823 statements exercised; not exercised: 4 of rhs, 4 of lam, 11 of reactions; 84 more only decide validity or a branch.
// Build: cc -std=c99 -O2 -o four_bar_check main.c four_bar.c -lm
#include <math.h>
#include <stdio.h>

#include "four_bar.h"

// Whether the largest difference, relative to the largest entry of the reference, is above the tolerance.
static int check(const char *name, int code, const double *found, const double *wanted, int n, double tolerance) {
    double largest = 0.0, error = code ? HUGE_VAL : 0.0;
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
    {
        const double p[] = { 9.81, 1.0, 0.4, 0.053333333333333344, 2.0, 1.0, 0.6666666666666666, 1.5, 0.8, 0.32000000000000006, 0.8, 2.0, 2.0, 1.6 };
        int code = four_bar_prologue(p, c);
        if (code) {
            printf("prologue: %s\n", four_bar_reason(code));
            return 1;
        }
        const double q[] = { -0.008376, -0.533831, -0.538267 };
        const double u[] = { -0.562438, -0.080793, -0.420437 };
        {
            const double wanted[] = { -0.562438, -0.080793, -0.420437, -7.704715340710006, 10.407652923795744, -3.3573061080257127 };
            double out[6];
            code = four_bar_rhs(q, u, p, c, out);
            wrong += check("rhs", code, out, wanted, 6, 1e-12);
        }
        {
            const double wanted[] = { 1.26657214893405, -2.450245911633196 };
            double out[2];
            code = four_bar_C(q, p, out);
            wrong += check("C", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { 2.450245911633196, 2.4435451899846785, 1.4114897879101214, 3.26657214893405, 2.466600211720382, 0.7534564211853535 };
            double out[6];
            code = four_bar_C_r(q, p, out);
            wrong += check("C_r", code, out, wanted, 6, 1e-12);
        }
        {
            const double wanted[] = { 1.8143196907322383, -2.0260734870581762 };
            double out[2];
            code = four_bar_F_d(q, u, p, out);
            wrong += check("F_d", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { 11.36862097627822, -29.21077220477494 };
            double out[2];
            code = four_bar_lam(q, u, p, c, out);
            wrong += check("lam", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { 14.019742463590891, 3.760236474880382, 0.0, 0.0, 0.0, 2.3493263833613258e-29, 14.172086202926213, -2.969045338155554, 0.0, 0.0, 0.0, 3.3132158019282496e-29, 12.700686421414778, -15.323702244540293, 0.0, 0.0, 0.0, 2.5637979419682884e-30, -11.36862097627822, 29.21077220477494, 0.0, 0.0, 0.0, 0.0 };
            double out[24];
            code = four_bar_reactions(q, u, p, c, out);
            wrong += check("reactions", code, out, wanted, 24, 1e-12);
        }
    }
    {
        const double p[] = { 9.814162, 1.124693, 0.361177, 0.065353, 2.411285, 0.813765, 0.540967, 1.565453, 0.978094, 0.310893, 0.717976, 1.979905, 1.626137, 1.439618 };
        int code = four_bar_prologue(p, c);
        if (code) {
            printf("prologue: %s\n", four_bar_reason(code));
            return 1;
        }
        const double q[] = { -0.628187, 0.985087, 0.719893 };
        const double u[] = { -0.75822, -0.33461, 0.442969 };
        {
            const double wanted[] = { -0.75822, -0.33461, 0.442969, -0.8367952684182905, 3.0783308064733914, -5.982275901504298 };
            double out[6];
            code = four_bar_rhs(q, u, p, c, out);
            wrong += check("rhs", code, out, wanted, 6, 1e-12);
        }
        {
            const double wanted[] = { 1.4925145096227823, 1.537282368052072 };
            double out[2];
            code = four_bar_C(q, p, out);
            wrong += check("C", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { -1.537282368052072, -1.9592216684547539, -1.2674997538423134, 3.1186515096227825, 2.5377412210655086, 0.6826011719398637 };
            double out[6];
            code = four_bar_C_r(q, p, out);
            wrong += check("C_r", code, out, wanted, 6, 1e-12);
        }
        {
            const double wanted[] = { 2.837791425667873, 1.1188256113310144 };
            double out[2];
            code = four_bar_F_d(q, u, p, out);
            wrong += check("F_d", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { -11.76682574984956, -34.45654882845108 };
            double out[2];
            code = four_bar_lam(q, u, p, c, out);
            wrong += check("lam", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { -19.77947964725691, 19.737326149068345, 0.0, 0.0, 0.0, 1.262177448353619e-29, -19.390768826270467, 8.837190782884704, 0.0, 0.0, 0.0, 0.0, -14.001687468236762, -17.54281679836079, 0.0, 0.0, 0.0, 5.5220263365470826e-30, 11.76682574984956, 34.45654882845108, 0.0, 0.0, 0.0, 0.0 };
            double out[24];
            code = four_bar_reactions(q, u, p, c, out);
            wrong += check("reactions", code, out, wanted, 24, 1e-12);
        }
    }
    {
        const double p[] = { 11.512193, 1.101638, 0.374606, 0.056769, 2.394231, 1.180789, 0.684918, 1.597577, 0.652429, 0.290955, 0.927066, 1.972883, 1.755707, 1.675135 };
        int code = four_bar_prologue(p, c);
        if (code) {
            printf("prologue: %s\n", four_bar_reason(code));
            return 1;
        }
        const double q[] = { 0.348972, -0.250594, -0.122077 };
        const double u[] = { 0.016853, 0.556885, 0.041877 };
        {
            const double wanted[] = { 0.016853, 0.556885, 0.041877, 1.3561415054619999, -8.588091311119596, 15.034218161078753 };
            double out[6];
            code = four_bar_rhs(q, u, p, c, out);
            wrong += check("rhs", code, out, wanted, 6, 1e-12);
        }
        {
            const double wanted[] = { 44.77468746166589, -4.61364413502743 };
            double out[2];
            code = four_bar_lam(q, u, p, c, out);
            wrong += check("lam", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { 44.952336426560706, 24.18072327964344, 0.0, 0.0, 0.0, 6.310887241768095e-30, 45.14380973077416, 10.972574560727393, 0.0, 0.0, 0.0, 2.8398992587956425e-29, 45.09163303224073, 1.0191287381483944, 0.0, 0.0, 0.0, 3.944304526105059e-31, -44.77468746166589, 4.61364413502743, 0.0, 0.0, 0.0, 0.0 };
            double out[24];
            code = four_bar_reactions(q, u, p, c, out);
            wrong += check("reactions", code, out, wanted, 24, 1e-12);
        }
    }
    {
        const double p[] = { 8.039975, 1.116522, 0.496974, 0.056903, 1.95424, 0.876657, 0.684005, 1.862902, 0.917388, 0.333705, 0.949704, 1.808959, 2.062394, 1.965777 };
        int code = four_bar_prologue(p, c);
        if (code) {
            printf("prologue: %s\n", four_bar_reason(code));
            return 1;
        }
        const double q[] = { -0.081737, -0.461441, 0.095993 };
        const double u[] = { 0.914233, -0.988582, 0.56731 };
        {
            const double wanted[] = { 0.914233, -0.988582, 0.56731, -5.239312639281604, 2.0719151359520627, 8.576577378148723 };
            double out[6];
            code = four_bar_rhs(q, u, p, c, out);
            wrong += check("rhs", code, out, wanted, 6, 1e-12);
        }
        {
            const double wanted[] = { 15.86291455162086, -10.147986879658294 };
            double out[2];
            code = four_bar_lam(q, u, p, c, out);
            wrong += check("lam", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { 5.870152895244114, 2.7228711472973743, 0.0, 0.0, 0.0, 3.4315449377114014e-29, 6.569748910793735, -3.3943074648292475, 0.0, 0.0, 0.0, 2.524354896707238e-29, 11.722512339550171, -4.9010970630818855, 0.0, 0.0, 0.0, 2.406025760924086e-29, -15.86291455162086, 10.147986879658294, 0.0, 0.0, 0.0, 0.0 };
            double out[24];
            code = four_bar_reactions(q, u, p, c, out);
            wrong += check("reactions", code, out, wanted, 24, 1e-12);
        }
    }
    {
        const double p[] = { 11.419948, 1.033405, 0.421044, 0.052893, 1.650511, 1.191505, 0.704333, 1.334892, 0.821699, 0.325829, 0.768444, 1.91147, 2.084631, 1.728912 };
        int code = four_bar_prologue(p, c);
        if (code) {
            printf("prologue: %s\n", four_bar_reason(code));
            return 1;
        }
        const double q[] = { -0.083706, -0.94405, -0.54079 };
        const double u[] = { -0.645577, 0.168922, 0.722018 };
        {
            const double wanted[] = { -0.645577, 0.168922, 0.722018, -5.29570734507844, 8.903790147040171, -6.511972458961371 };
            double out[6];
            code = four_bar_rhs(q, u, p, c, out);
            wrong += check("rhs", code, out, wanted, 6, 1e-12);
        }
        {
            const double wanted[] = { -1.0574602339736594, -36.86714792370595 };
            double out[2];
            code = four_bar_lam(q, u, p, c, out);
            wrong += check("lam", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { 6.841697741190719, 4.081625230215301, 0.0, 0.0, 0.0, -2.2581143411951463e-29, 7.215054061549127, -5.438825618152853, 0.0, 0.0, 0.0, -3.1554436208840472e-30, 2.45939641491687, -21.68774451665331, 0.0, 0.0, 0.0, -1.5777218104420236e-30, 1.0574602339736594, 36.86714792370595, 0.0, 0.0, 0.0, 0.0 };
            double out[24];
            code = four_bar_reactions(q, u, p, c, out);
            wrong += check("reactions", code, out, wanted, 24, 1e-12);
        }
    }
    {
        const double p[] = { 8.974996, 1.178785, 0.44116, 0.044664, 1.615022, 0.806552, 0.760009, 1.368452, 0.679416, 0.345972, 0.763992, 1.662564, 1.743663, 1.659714 };
        int code = four_bar_prologue(p, c);
        if (code) {
            printf("prologue: %s\n", four_bar_reason(code));
            return 1;
        }
        const double q[] = { -0.454171, 0.42318, -0.090597 };
        const double u[] = { -0.355996, -0.052458, -0.952731 };
        {
            const double wanted[] = { -0.355996, -0.052458, -0.952731, 6.697507461700453, -18.480304067444557, 20.619468112867256 };
            double out[6];
            code = four_bar_rhs(q, u, p, c, out);
            wrong += check("rhs", code, out, wanted, 6, 1e-12);
        }
        {
            const double wanted[] = { -42.40997270239341, 3.187453069688939 };
            double out[2];
            code = four_bar_lam(q, u, p, c, out);
            wrong += check("lam", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { -37.11961018918579, 23.79471618780241, 0.0, 0.0, 0.0, 1.5619445923376034e-28, -38.588405455867516, 10.056369434122935, 0.0, 0.0, 0.0, -4.7726084765871214e-29, -41.38056918570576, 3.4010395777269786, 0.0, 0.0, 0.0, 4.0281209972847915e-29, 42.40997270239341, -3.187453069688939, 0.0, 0.0, 0.0, 0.0 };
            double out[24];
            code = four_bar_reactions(q, u, p, c, out);
            wrong += check("reactions", code, out, wanted, 24, 1e-12);
        }
    }
    {
        const double p[] = { 8.328128, 1.204918, 0.411821, 0.047685, 2.145084, 1.167668, 0.539579, 1.212059, 0.692726, 0.359512, 0.697682, 2.234145, 2.210358, 1.672186 };
        int code = four_bar_prologue(p, c);
        if (code) {
            printf("prologue: %s\n", four_bar_reason(code));
            return 1;
        }
        const double q[] = { 0.951189, 0.595622, 0.033199 };
        const double u[] = { -0.553608, 0.297013, -0.210204 };
        {
            const double wanted[] = { -0.553608, 0.297013, -0.210204, 1.741066743864905, -2.1478711590353377, 0.2844152426126566 };
            double out[6];
            code = four_bar_rhs(q, u, p, c, out);
            wrong += check("rhs", code, out, wanted, 6, 1e-12);
        }
        {
            const double wanted[] = { 0.34384344048592125, -37.82246946681855 };
            double out[2];
            code = four_bar_lam(q, u, p, c, out);
            wrong += check("lam", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { -1.9684298816382444, 1.7566142287292559, 0.0, 0.0, 0.0, -2.1693674893577825e-30, -1.1767792689178342, -8.6559890353982, 0.0, 0.0, 0.0, 0.0, 0.1961702725508031, -27.47095220584622, 0.0, 0.0, 0.0, 9.860761315262648e-32, -0.34384344048592125, 37.82246946681855, 0.0, 0.0, 0.0, 0.0 };
            double out[24];
            code = four_bar_reactions(q, u, p, c, out);
            wrong += check("reactions", code, out, wanted, 24, 1e-12);
        }
    }
    {
        const double p[] = { 8.107507, 0.934373, 0.494223, 0.063679, 1.875748, 1.186331, 0.626442, 1.83402, 0.907783, 0.315929, 0.730849, 1.607632, 2.390846, 1.3073 };
        int code = four_bar_prologue(p, c);
        if (code) {
            printf("prologue: %s\n", four_bar_reason(code));
            return 1;
        }
        const double q[] = { 0.924402, 0.140561, -0.656966 };
        const double u[] = { 0.735562, 0.94755, 0.408046 };
        {
            const double wanted[] = { 0.735562, 0.94755, 0.408046, -1.3973783563186752, -7.934983117762842, 21.376104301377612 };
            double out[6];
            code = four_bar_rhs(q, u, p, c, out);
            wrong += check("rhs", code, out, wanted, 6, 1e-12);
        }
        {
            const double wanted[] = { -29.896731772003402, -19.743125623157805 };
            double out[2];
            code = four_bar_lam(q, u, p, c, out);
            wrong += check("lam", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { -6.895281663577892, -6.830546539908504, 0.0, 0.0, 0.0, 3.944304526105059e-30, -7.259905549166557, -13.817867594724598, 0.0, 0.0, 0.0, -1.262177448353619e-29, -23.454188807491793, -11.702841154919616, 0.0, 0.0, 0.0, -7.888609052210118e-31, 29.896731772003402, 19.743125623157805, 0.0, 0.0, 0.0, 0.0 };
            double out[24];
            code = four_bar_reactions(q, u, p, c, out);
            wrong += check("reactions", code, out, wanted, 24, 1e-12);
        }
    }
    {
        const double p[] = { 8.756335, 1.103369, 0.397931, 0.047326, 1.693982, 1.099681, 0.622155, 1.537365, 0.757124, 0.381513, 0.963884, 1.616284, 1.780768, 1.515973 };
        int code = four_bar_prologue(p, c);
        if (code) {
            printf("prologue: %s\n", four_bar_reason(code));
            return 1;
        }
        const double q[] = { 0.565401, -0.321809, -0.57394 };
        const double u[] = { 0.34891, 0.675402, 0.864375 };
        {
            const double wanted[] = { 0.34891, 0.675402, 0.864375, -6.971534752976693, 5.080865431669549, 7.021343540018401 };
            double out[6];
            code = four_bar_rhs(q, u, p, c, out);
            wrong += check("rhs", code, out, wanted, 6, 1e-12);
        }
        {
            const double wanted[] = { 0.480674443890709, -5.0927497697248265 };
            double out[2];
            code = four_bar_lam(q, u, p, c, out);
            wrong += check("lam", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { 8.953794913623609, 9.630857285196916, 0.0, 0.0, 0.0, -3.6287601640166543e-29, 7.3590072097339165, 2.5826155909373334, 0.0, 0.0, 0.0, -2.01159530831358e-29, 2.475623820757916, 1.3571065145994146, 0.0, 0.0, 0.0, -4.930380657631324e-31, -0.480674443890709, 5.0927497697248265, 0.0, 0.0, 0.0, 0.0 };
            double out[24];
            code = four_bar_reactions(q, u, p, c, out);
            wrong += check("reactions", code, out, wanted, 24, 1e-12);
        }
    }
    {
        const double p[] = { 9.98682, 1.243479, 0.362235, 0.060078, 1.676212, 0.876362, 0.80663, 1.343754, 0.913282, 0.34243, 0.942808, 1.931297, 1.906257, 1.489675 };
        int code = four_bar_prologue(p, c);
        if (code) {
            printf("prologue: %s\n", four_bar_reason(code));
            return 1;
        }
        const double q[] = { 0.207965, 0.908615, 0.77453 };
        const double u[] = { -0.729308, 0.102341, -0.79145 };
        {
            const double wanted[] = { -0.729308, 0.102341, -0.79145, -6.697679843073191, 13.92224403509016, -15.085306499852436 };
            double out[6];
            code = four_bar_rhs(q, u, p, c, out);
            wrong += check("rhs", code, out, wanted, 6, 1e-12);
        }
        {
            const double wanted[] = { 8.516472863457833, -27.783729999773808 };
            double out[2];
            code = four_bar_lam(q, u, p, c, out);
            wrong += check("lam", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { -5.7914119384809775, 4.962596237236194, 0.0, 0.0, 0.0, 2.1496459667272572e-29, -6.1798798681425495, -4.454495721886952, 0.0, 0.0, 0.0, 1.8932661725304283e-29, 2.247116611448931, -14.801891821516266, 0.0, 0.0, 0.0, 4.733165431326071e-30, -8.516472863457833, 27.783729999773808, 0.0, 0.0, 0.0, 0.0 };
            double out[24];
            code = four_bar_reactions(q, u, p, c, out);
            wrong += check("reactions", code, out, wanted, 24, 1e-12);
        }
    }
    {
        const double p[] = { 11.32714, 1.172828, 0.381362, 0.057431, 2.303713, 0.970118, 0.704568, 1.351007, 0.669428, 0.294408, 0.960677, 2.108002, 2.43256, 1.609594 };
        int code = four_bar_prologue(p, c);
        if (code) {
            printf("prologue: %s\n", four_bar_reason(code));
            return 1;
        }
        const double q[] = { 0.574029, 0.655536, -0.975237 };
        const double u[] = { 0.340823, -0.816634, -0.769795 };
        {
            const double wanted[] = { 0.340823, -0.816634, -0.769795, -12.478777127085765, 12.992591584346963, 6.44643830566958 };
            double out[6];
            code = four_bar_rhs(q, u, p, c, out);
            wrong += check("rhs", code, out, wanted, 6, 1e-12);
        }
        {
            const double wanted[] = { -9.414299346150154, -6.328186990718792 };
            double out[2];
            code = four_bar_lam(q, u, p, c, out);
            wrong += check("lam", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { 11.233810459754768, 12.155858625462004, 0.0, 0.0, 0.0, 1.5777218104420236e-30, 8.246623951607198, 3.586104162122864, 0.0, 0.0, 0.0, 4.1020767071492614e-29, -5.282699267581543, 0.9143529346276963, 0.0, 0.0, 0.0, 2.3665827156630354e-30, 9.414299346150154, 6.328186990718792, 0.0, 0.0, 0.0, 0.0 };
            double out[24];
            code = four_bar_reactions(q, u, p, c, out);
            wrong += check("reactions", code, out, wanted, 24, 1e-12);
        }
    }
    {
        const double p[] = { 12.210226, 0.989456, 0.3408, 0.046684, 1.817278, 1.134803, 0.564184, 1.814766, 0.77618, 0.395718, 0.96732, 1.864621, 1.828069, 1.623447 };
        int code = four_bar_prologue(p, c);
        if (code) {
            printf("prologue: %s\n", four_bar_reason(code));
            return 1;
        }
        const double q[] = { 0.3041, -0.92076, -0.978988 };
        const double u[] = { 0.965167, -0.4089, 0.193141 };
        {
            const double wanted[] = { 0.965167, -0.4089, 0.193141, -7.668906103151896, 11.596510608494267, -7.100082716257165 };
            double out[6];
            code = four_bar_rhs(q, u, p, c, out);
            wrong += check("rhs", code, out, wanted, 6, 1e-12);
        }
        {
            const double wanted[] = { -2.2154821696983227, -36.98972756189177 };
            double out[2];
            code = four_bar_lam(q, u, p, c, out);
            wrong += check("lam", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { 9.752019350587014, 9.517971037398533, 0.0, 0.0, 0.0, -6.310887241768095e-30, 9.277390677552445, -0.002099126979888884, 0.0, 0.0, 0.0, 6.310887241768095e-30, 2.639528649487875, -15.815501570585052, 0.0, 0.0, 0.0, 0.0, 2.2154821696983227, 36.98972756189177, 0.0, 0.0, 0.0, 0.0 };
            double out[24];
            code = four_bar_reactions(q, u, p, c, out);
            wrong += check("reactions", code, out, wanted, 24, 1e-12);
        }
    }
    {
        const double p[] = { 11.880169, 1.236416, 0.494563, 0.045339, 1.793674, 1.078013, 0.827319, 1.566466, 0.887748, 0.351304, 0.733271, 2.087442, 1.876589, 1.457394 };
        int code = four_bar_prologue(p, c);
        if (code) {
            printf("prologue: %s\n", four_bar_reason(code));
            return 1;
        }
        const double q[] = { -0.438427, 0.966753, -0.104196 };
        const double u[] = { 0.304021, 0.286932, 0.881469 };
        {
            const double wanted[] = { 0.304021, 0.286932, 0.881469, 3.3498308728227464, -12.852787914399979, 21.9606669811351 };
            double out[6];
            code = four_bar_rhs(q, u, p, c, out);
            wrong += check("rhs", code, out, wanted, 6, 1e-12);
        }
        {
            const double wanted[] = { -33.40024547904355, -22.282491411143134 };
            double out[2];
            code = four_bar_lam(q, u, p, c, out);
            wrong += check("lam", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { -15.804259125884178, 12.699491679533429, 0.0, 0.0, 0.0, -1.6250534647552843e-28, -16.62265257080786, -3.8679718310702977, 0.0, 0.0, 0.0, -5.99534287967969e-29, -27.06234803237199, -13.0079260546073, 0.0, 0.0, 0.0, -4.733165431326071e-29, 33.40024547904355, 22.282491411143134, 0.0, 0.0, 0.0, 0.0 };
            double out[24];
            code = four_bar_reactions(q, u, p, c, out);
            wrong += check("reactions", code, out, wanted, 24, 1e-12);
        }
    }
    {
        const double p[] = { 9.246227, 1.181211, 0.48083, 0.049934, 1.9009, 1.044901, 0.707029, 1.602275, 0.728235, 0.258934, 0.727753, 1.665095, 2.096084, 1.33106 };
        int code = four_bar_prologue(p, c);
        if (code) {
            printf("prologue: %s\n", four_bar_reason(code));
            return 1;
        }
        const double q[] = { 0.270764, -0.418357, 0.58437 };
        const double u[] = { -0.013478, 0.725298, -0.691641 };
        {
            const double wanted[] = { -0.013478, 0.725298, -0.691641, -16.854175988338422, 19.827512268040124, 2.6629580239815835 };
            double out[6];
            code = four_bar_rhs(q, u, p, c, out);
            wrong += check("rhs", code, out, wanted, 6, 1e-12);
        }
        {
            const double wanted[] = { -10.937833412485233, -11.134697539908705 };
            double out[2];
            code = four_bar_lam(q, u, p, c, out);
            wrong += check("lam", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { 0.034725768545749186, 1.544773534154559, 0.0, 0.0, 0.0, -4.5901843922547624e-29, -2.525516187300322, -0.15317516750549717, 0.0, 0.0, 0.0, 1.1044052673094165e-29, -8.634528932501512, -1.2524926046553677, 0.0, 0.0, 0.0, 5.7192415628523356e-30, 10.937833412485233, 11.134697539908705, 0.0, 0.0, 0.0, 0.0 };
            double out[24];
            code = four_bar_reactions(q, u, p, c, out);
            wrong += check("reactions", code, out, wanted, 24, 1e-12);
        }
    }
    {
        const double p[] = { 12.038367, 0.877959, 0.459718, 0.066304, 2.339395, 0.943903, 0.565397, 1.547192, 0.970968, 0.298262, 0.961753, 1.727513, 2.419434, 1.302867 };
        int code = four_bar_prologue(p, c);
        if (code) {
            printf("prologue: %s\n", four_bar_reason(code));
            return 1;
        }
        const double q[] = { 0.806177, 0.607713, 0.814308 };
        const double u[] = { 0.681437, 0.49237, 0.37919 };
        {
            const double wanted[] = { 0.681437, 0.49237, 0.37919, -11.462721444305433, 23.9949530260645, -24.350966400000985 };
            double out[6];
            code = four_bar_rhs(q, u, p, c, out);
            wrong += check("rhs", code, out, wanted, 6, 1e-12);
        }
        {
            const double wanted[] = { 13.995426087289436, -29.036733382730695 };
            double out[2];
            code = four_bar_lam(q, u, p, c, out);
            wrong += check("lam", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { 1.7229115366237793, 4.966088678049188, 0.0, 0.0, 0.0, 4.141519752410312e-29, -1.4860462506295777, -2.2650942503417397, 0.0, 0.0, 0.0, 6.310887241768095e-30, 8.434474337753421, -13.139273854595197, 0.0, 0.0, 0.0, -6.310887241768095e-30, -13.995426087289436, 29.036733382730695, 0.0, 0.0, 0.0, 0.0 };
            double out[24];
            code = four_bar_reactions(q, u, p, c, out);
            wrong += check("reactions", code, out, wanted, 24, 1e-12);
        }
    }
    {
        const double p[] = { 11.003593, 1.1005, 0.365466, 0.044213, 2.467047, 1.163714, 0.698114, 1.56543, 0.946465, 0.321277, 0.782456, 1.904802, 1.832172, 1.297574 };
        int code = four_bar_prologue(p, c);
        if (code) {
            printf("prologue: %s\n", four_bar_reason(code));
            return 1;
        }
        const double q[] = { -0.166632, 0.141207, -0.875357 };
        const double u[] = { -0.290113, -0.723432, -0.749742 };
        {
            const double wanted[] = { -0.290113, -0.723432, -0.749742, -17.354556701806118, 19.925875594454396, 3.9712614758211093 };
            double out[6];
            code = four_bar_rhs(q, u, p, c, out);
            wrong += check("rhs", code, out, wanted, 6, 1e-12);
        }
        {
            const double wanted[] = { 3.591880760418191, -15.482737597676056 };
            double out[2];
            code = four_bar_lam(q, u, p, c, out);
            wrong += check("lam", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { -7.833880324664395, 4.993399868274998, 0.0, 0.0, 0.0, 2.6426840324903895e-29, -6.642794802748935, -0.23842612899331173, 0.0, 0.0, 0.0, 2.721570123012491e-29, 1.8344919113849478, -1.8299876828927248, 0.0, 0.0, 0.0, 7.099748146989106e-30, -3.591880760418191, 15.482737597676056, 0.0, 0.0, 0.0, 0.0 };
            double out[24];
            code = four_bar_reactions(q, u, p, c, out);
            wrong += check("reactions", code, out, wanted, 24, 1e-12);
        }
    }
    {
        const double p[] = { 9.618577, 1.0756, 0.362035, 0.042846, 2.075832, 1.025405, 0.727985, 1.495864, 0.887145, 0.361325, 0.725815, 2.045565, 2.030944, 1.442045 };
        int code = four_bar_prologue(p, c);
        if (code) {
            printf("prologue: %s\n", four_bar_reason(code));
            return 1;
        }
        const double q[] = { 0.120815, 0.813879, 0.835413 };
        const double u[] = { -0.449549, 0.29283, -0.903605 };
        {
            const double wanted[] = { -0.449549, 0.29283, -0.903605, -10.750311741775176, 16.961635021628478, -12.673818912368459 };
            double out[6];
            code = four_bar_rhs(q, u, p, c, out);
            wrong += check("rhs", code, out, wanted, 6, 1e-12);
        }
        {
            const double wanted[] = { 5.8584432319150626, -29.365665726721932 };
            double out[2];
            code = four_bar_lam(q, u, p, c, out);
            wrong += check("lam", code, out, wanted, 2, 1e-12);
        }
        {
            const double wanted[] = { -8.174561742580211, 2.7185816353422374, 0.0, 0.0, 0.0, -1.5580002878114983e-29, -8.600968004710635, -3.4619661610015435, 0.0, 0.0, 0.0, 2.8398992587956425e-29, 0.41563919617984846, -15.124920400347749, 0.0, 0.0, 0.0, 1.5777218104420236e-30, -5.8584432319150626, 29.365665726721932, 0.0, 0.0, 0.0, 0.0 };
            double out[24];
            code = four_bar_reactions(q, u, p, c, out);
            wrong += check("reactions", code, out, wanted, 24, 1e-12);
        }
    }
    {
        const double p[] = { 9.81, 1.0, 0.4, 0.053333333333333344, 2.0, 1.0, 0.6666666666666666, 1.5, 0.8, 0.32000000000000006, 0.8, 2.0, 2.0, 1.6 };
        int code = four_bar_prologue(p, c);
        if (code) {
            printf("prologue: %s\n", four_bar_reason(code));
            return 1;
        }
        const double q[] = { 76.62460479074576, -0.00019939005023796746, -0.008224923277109563 };
        const double u[] = { -0.0006638302270933178, -0.00043377443092171454, 0.00015608466193168169 };
        {
            const double wanted[] = { -0.0006638302270933178, -0.00043377443092171454, 0.00015608466193168169, -6.125409153292262, 8.634714604765826, -2.5832352579355335 };
            double out[6];
            code = four_bar_rhs(q, u, p, c, out);
            wrong += check("rhs", code, out, wanted, 6, 1e-11);
        }
        {
            const double wanted[] = { 180.87246976487668, 483.7248817313454 };
            double out[2];
            code = four_bar_lam(q, u, p, c, out);
            wrong += check("lam", code, out, wanted, 2, 1e-11);
        }
        {
            const double wanted[] = { 187.59703853356694, 525.4595503854447, 0.0, 0.0, 0.0, 1.0097419586828951e-28, 185.29076554218605, 516.4768392445893, 0.0, 0.0, 0.0, 0.0, 180.78921967682567, 498.47053968771684, 0.0, 0.0, 0.0, 5.048709793414476e-29, -180.87246976487668, -483.7248817313454, 0.0, 0.0, 0.0, 0.0 };
            double out[24];
            code = four_bar_reactions(q, u, p, c, out);
            wrong += check("reactions", code, out, wanted, 24, 1e-11);
        }
    }
    puts("18 states visited, 804 of 823 statements exercised; not exercised: 4 of rhs, 4 of lam, 11 of reactions; 84 more only decide validity or a branch");
    printf(wrong ? "%d results are wrong\n" : "all results agree\n", wrong);
    return wrong != 0;
}
