// Factors of symmetric matrices.
#pragma once

#include "prelude.h"

// start - a_0 x_0 - ... - a_(n - 1) x_(n - 1), where the a are `step` numbers apart.
static inline double symdyn_less(double start, int n, const double *a, int step, const double *x) {
    for (int i = 0; i < n; i++) start -= a[i * step] * x[i];
    return start;
}

// 0, or no number where one of them is none or infinite: zeros that are passed over would have spread it.
static double symdyn_spoiled(int n, const double *values) {
    double sum = 0.0;
    for (int i = 0; i < n; i++) sum += 0.0 * values[i];
    return sum;
}

// Columns of a row of n entries from the first to the one behind the last that is not zero.
typedef struct {
    int first, end;
} symdyn_span;

static symdyn_span symdyn_span_of(int n, const double *row) {
    symdyn_span span = {0, n};
    while (span.end > 0 && row[span.end - 1] == 0.0) span.end--;
    while (span.first < span.end && row[span.first] == 0.0) span.first++;
    return span;
}

// The envelope of a symmetric matrix, which its factors L D L^T stay within: of row i the first column, and of column i the end
// of its rows. first: that of the matrix alone, n at most. Source: George and Liu, Computer Solution of Large Sparse Positive
// Definite Systems, chapter 4.
static void symdyn_envelope(int n, const int *first, symdyn_span *envelope) {
    for (int i = 0; i < n; i++) {
        envelope[i].first = first[i] < i ? first[i] : i;
        for (int k = envelope[i].first; k <= i; k++) envelope[k].end = i + 1;
    }
}

// A = L D L^T in place, by lower triangles (n x n, rows `row` apart) within the envelope. Returns 1 if a pivot is no more than
// `least` of its entry.
static int symdyn_factorize(int n, int row, const symdyn_span *envelope, double *A, double least) {
    for (int j = 0; j < n; j++) {
        const double entry = A[j * row + j];
        for (int k = envelope[j].first; k < j; k++) {
            const double v = A[j * row + k] * A[k * row + k];
            for (int i = j; i < envelope[k].end; i++)
                if (envelope[i].first <= k) A[i * row + j] -= A[i * row + k] * v;
        }
        if (!(A[j * row + j] > least * entry && A[j * row + j] > 0.0)) return 1;
        for (int i = j + 1; i < envelope[j].end; i++)
            if (envelope[i].first <= j) A[i * row + j] /= A[j * row + j];
    }
    return 0;
}

// r becomes A^-1 r by these factors.
static void symdyn_substitute(int n, int row, const symdyn_span *envelope, const double *A, double *r) {
    for (int i = 0; i < n; i++) {
        const int first = envelope[i].first;
        r[i] = symdyn_less(r[i], i - first, A + i * row + first, 1, r + first);
    }
    for (int i = n - 1; i >= 0; i--) {
        r[i] /= A[i * row + i];
        for (int k = i + 1; k < envelope[i].end; k++)
            if (envelope[k].first <= i) r[i] -= A[k * row + i] * r[k];
    }
}
