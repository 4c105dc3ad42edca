/* Dense matrices, column by column, of which symmetric ones have their lower triangle only: what the joint
 * steps of estimator and isolation share. The order of the operations depends on nothing but the sizes.
 */
#ifndef FLEXARM_JOINT_ALGEBRA_H
#define FLEXARM_JOINT_ALGEBRA_H

#include "machine_code.h"

/* a += sign * sum_k factors[k stride] b_k, with the columns b_k of a matrix; four at a time are fastest */
WIDE static void accumulate(
    int64_t count, int64_t terms, double sign, const double *restrict factors, int64_t stride,
    const double *restrict b, int64_t lead, double *restrict a)
{
    int64_t k = 0;
    for (; k + 3 < terms; k += 4, b += 4 * lead, factors += 4 * stride) {
        const double *b1 = b + lead, *b2 = b1 + lead, *b3 = b2 + lead;
        double f0 = sign * factors[0], f1 = sign * factors[stride];
        double f2 = sign * factors[2 * stride], f3 = sign * factors[3 * stride];
        for (int64_t i = 0; i < count; i++)
            a[i] += f0 * b[i] + f1 * b1[i] + f2 * b2[i] + f3 * b3[i];
    }
    for (; k < terms; k++, b += lead, factors += stride) {
        double f = sign * factors[0];
        for (int64_t i = 0; i < count; i++)
            a[i] += f * b[i];
    }
}

/* Replace the lower triangle of J, (size, size), by its Cholesky factor; 0 when it has none. */
static inline int factorise(int64_t size, int64_t lead, double *J)
{
    for (int64_t j = 0; j < size; j++) {
        double *column = J + j * lead;
        accumulate(size - j, j, -1.0, J + j, lead, J + j, lead, column + j);
        if (!(column[j] > 0.0)) /* also when it is NaN */
            return 0;
        double scale = 1.0 / sqrt(column[j]);
        for (int64_t i = j; i < size; i++)
            column[i] *= scale;
    }
    return 1;
}

/* z = L^-1 z */
static inline void solve_lower(int64_t size, int64_t lead, const double *L, double *z)
{
    for (int64_t j = 0; j < size; j++) {
        z[j] /= L[j + j * lead];
        for (int64_t i = j + 1; i < size; i++)
            z[i] -= z[j] * L[i + j * lead];
    }
}

static inline double dot(int64_t count, const double *a, const double *b)
{
    double sum = 0.0;
    for (int64_t i = 0; i < count; i++)
        sum += a[i] * b[i];
    return sum;
}

#endif
