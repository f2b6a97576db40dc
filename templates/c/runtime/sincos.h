// Sines and cosines of several angles at once.
#pragma once

#include "prelude.h"

#if SYMDYN_SINGLE
static inline void symdyn_sincos(int n, const double *restrict angles, double *restrict sines, double *restrict cosines) {
    for (int i = 0; i < n; i++) {
        sines[i] = sin(angles[i]);
        cosines[i] = cos(angles[i]);
    }
}
#else
// Sine and cosine of an angle x, |x| <= 2^16*pi/2. Measured, the error is below 0.8 ulp.
// The angle is reduced to h + l = x - n*pi/2 with |h| <= pi/4, where l is what rounding cuts off h. pi/2 has three parts,
// the first two of 37 bits, so that their products with n are exact. Polynomials in z = h*h give sin(h + l) and cos(h + l);
// the last two bits of n show whether to exchange and to negate them. There is no branch, so that the compiler takes several
// angles at once, and only IEEE arithmetic as written: the same bits from every compiler that contracts no products and sums.
// The coefficients are computed for symdyn: Remez' algorithm in 60 digits makes the largest error on |h| <= pi/4 smallest
// (of the sine: the relative error times z); they are rounded one after the other, the rest fitted again each time.
static inline void symdyn_sincos_one(double x, double *sine, double *cosine) {
    union {
        double value;
        unsigned long long bits;
    } shifted, a, b;
    // A sum of this size has no room for a fraction: it rounds to the integer n and holds it in its last bits.
    shifted.value = x * 0.6366197723675814 + 6755399441055744.0;
    const double n = shifted.value - 6755399441055744.0;
    const double rest = x - n * 1.5707963267923333, part = n * 2.5633441515839558e-12;
    const double h = rest - part;
    const double l = ((rest - h) - part) - n * 1.0562999066987428e-23;
    const double z = h * h, zz = z * z, hz = h * z, hzz = hz * z;
    const double half = 0.5 * z, w = 1.0 - half;
    a.value = h
        + ((l * w - hz * 0.16666666666666557)
            + (hzz * (0.008333333333309417 - z * 0.00019841269821722923)
                + hzz * zz * ((2.75573113801828e-06 - z * 2.5050448285906677e-08) + zz * 1.588101519049919e-10)));
    b.value = w
        + ((((1.0 - w) - half) - h * l)
            + (zz * (0.0416666666666666 - z * 0.0013888888888874474)
                + zz * zz
                    * ((2.4801587289671544e-05 - z * 2.7557314401035757e-07)
                        + zz * (2.0875729282436057e-09 - z * 1.1359934331481983e-11))));
    const unsigned long long exchange = (a.bits ^ b.bits) & (0u - (shifted.bits & 1u));
    a.bits ^= exchange ^ ((shifted.bits & 2u) << 62);
    b.bits ^= exchange ^ (((shifted.bits + 1u) & 2u) << 62);
    *sine = a.value;
    *cosine = b.value;
}

// Sines and cosines of n angles. Large ones, NaN and Inf are left to the math library; so are all if the compiler may rearrange
// sums.
static inline void symdyn_sincos(int n, const double *restrict angles, double *restrict sines, double *restrict cosines) {
#if defined(__FAST_MATH__)
    const double largest = -1.0;
#else
    const double largest = 102943.7;
#endif
    int small = 1;
    for (int i = 0; i < n; i++) symdyn_sincos_one(angles[i], sines + i, cosines + i);
    for (int i = 0; i < n; i++) small &= fabs(angles[i]) <= largest;
    for (int i = 0; !small && i < n; i++) {
        if (!(fabs(angles[i]) <= largest)) {
            sines[i] = sin(angles[i]);
            cosines[i] = cos(angles[i]);
        }
    }
}
#endif
