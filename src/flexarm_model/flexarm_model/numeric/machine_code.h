/* What the C files of flexarm share; build_library finds it. */
#ifndef FLEXARM_MACHINE_CODE_H
#define FLEXARM_MACHINE_CODE_H

#include <math.h>
#include <stdint.h>
#include <string.h>

/* Wider vectors where the processor has them, found out when the library is loaded: the same bits, sooner. */
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__)
#define WIDE __attribute__((target_clones("avx2", "default")))
#else
#define WIDE
#endif

/* A generated function and the room it works in; results lie where res points. */
struct function {
    int (*evaluate)(const double **arg, double **res, long long *iw, double *w, int mem);
    const double **arg;
    double **res;
    long long *iw;
    double *w;
};

/* Take factor times row p of A, from column j on, from row i; nothing where the factor is zero. */
static inline void take_row(double *restrict A, int64_t columns, int64_t i, int64_t p, int64_t j, double factor)
{
    if (factor == 0.0)
        return;
    for (; j < columns; j++)
        A[i * columns + j] -= factor * A[p * columns + j];
}

/* Solve A X = B by elimination with row pivoting: A (m, m) and B (m, k) row-major, B becomes X. Zeros are
   left out: rows of loops hold few coordinates each. Returns 0 when A is singular. */
WIDE static int64_t eliminate(int64_t m, int64_t k, double *restrict A, double *restrict B)
{
    for (int64_t p = 0; p < m; p++) {
        int64_t best = p;
        for (int64_t i = p + 1; i < m; i++)
            if (fabs(A[i * m + p]) > fabs(A[best * m + p]))
                best = i;
        if (!(fabs(A[best * m + p]) > 0.0)) /* also when it is NaN */
            return 0;
        if (best != p) {
            for (int64_t j = p; j < m; j++) {
                double a = A[p * m + j];
                A[p * m + j] = A[best * m + j], A[best * m + j] = a;
            }
            for (int64_t j = 0; j < k; j++) {
                double b = B[p * k + j];
                B[p * k + j] = B[best * k + j], B[best * k + j] = b;
            }
        }
        double scale = 1.0 / A[p * m + p];
        for (int64_t i = p + 1; i < m; i++) {
            double factor = A[i * m + p] * scale;
            take_row(A, m, i, p, p + 1, factor);
            take_row(B, k, i, p, 0, factor);
        }
    }
    for (int64_t p = m - 1; p >= 0; p--) {
        double scale = 1.0 / A[p * m + p];
        for (int64_t j = 0; j < k; j++)
            B[p * k + j] *= scale;
        for (int64_t i = 0; i < p; i++)
            take_row(B, k, i, p, 0, A[i * m + p]);
    }
    return 1;
}

#endif
