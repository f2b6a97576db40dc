// Needs of all parts: the math library, fused sums, what is exported. Nothing is included, so that no header is needed.
#pragma once

#if SYMDYN_SINGLE
#define sin sinf
#define cos cosf
#define tan tanf
#define asin asinf
#define acos acosf
#define atan atanf
#define atan2 atan2f
#define sinh sinhf
#define cosh coshf
#define tanh tanhf
#define asinh asinhf
#define acosh acoshf
#define atanh atanhf
#define exp expf
#define exp2 exp2f
#define log logf
#define log2 log2f
#define log1p log1pf
#define sqrt sqrtf
#define pow powf
#define erf erff
#define fabs fabsf
#define floor floorf
#define ceil ceilf
#define fmin fminf
#define fmax fmaxf
#define __builtin_fma __builtin_fmaf
#endif

double sin(double), cos(double), tan(double), asin(double), acos(double), atan(double), atan2(double, double);
double sinh(double), cosh(double), tanh(double), asinh(double), acosh(double), atanh(double);
double exp(double), exp2(double), log(double), log2(double), log1p(double), sqrt(double), pow(double, double), erf(double);
double fabs(double), floor(double), ceil(double), fmin(double, double), fmax(double, double);

#if SYMDYN_THREADS
#if defined(__CUDACC__)  // CUDA C is C++
#define restrict __restrict__
#if SYMDYN_SINGLE
#define __builtin_fmaf fmaf
#else
#define __builtin_fma fma
#endif
#define __FMA__ 1
// Right-hand sides would be compiled for minutes in each of twelve stages, and registers would not suffice.
#define SYMDYN_APART __noinline__
#else
#define SYMDYN_APART
#endif
#endif

// a*b + c, rounded once where the processor can.
#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
#define MADD(a, b, c) __builtin_fma(a, b, c)
#else
#define MADD(a, b, c) ((a) * (b) + (c))
#endif

#if defined(_WIN32)
#define SYMDYN_EXPORT __declspec(dllexport)
#else
#define SYMDYN_EXPORT
#endif
#if !defined(__GNUC__) && !defined(__CUDACC__)
#define __attribute__(list)
#endif

// Code of a result with an entry that is not finite; other codes are what the model's functions return.
enum { SYMDYN_NOT_FINITE = -1 };

static inline int symdyn_all_finite(const double *values, int n) {
    for (int i = 0; i < n; i++)
#if SYMDYN_SINGLE
        if (!(fabs(values[i]) <= 3.4028234e38)) return 0;
#else
        if (!(fabs(values[i]) <= 1.7976931348623157e308)) return 0;
#endif
    return 1;
}
