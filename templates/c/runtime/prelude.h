// What all parts need: the math library, fused sums, what is exported. Nothing is included, so that no header is needed.
#pragma once

double sin(double), cos(double), tan(double), asin(double), acos(double), atan(double), atan2(double, double);
double sinh(double), cosh(double), tanh(double), asinh(double), acosh(double), atanh(double);
double exp(double), exp2(double), log(double), log2(double), log1p(double), sqrt(double), pow(double, double), erf(double);
double fabs(double), floor(double), ceil(double), fmin(double, double), fmax(double, double);

#if SYMDYN_THREADS
#if defined(__CUDACC__)  // CUDA C is C++
#define restrict __restrict__
#define __builtin_fma fma
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
        if (!(fabs(values[i]) <= 1.7976931348623157e308)) return 0;
    return 1;
}
