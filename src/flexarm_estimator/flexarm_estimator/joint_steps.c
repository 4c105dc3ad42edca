/* Joint steps one after the other, without leaving machine code; joint_step.py has the equations.
 *
 * Matrices are column-major; of symmetric ones only the lower triangle is read. The order of the
 * operations depends on nothing but the sizes: an instant that is computed again gives the same bits.
 */
#include "joint_algebra.h"

/* What instants with the same period and sensors share. */
struct step {
    int64_t n, m, inputs, sensors, learned;
    const double *A;        /* (n, n) */
    const double *B;        /* row-major, (n, inputs) */
    const double *Q;        /* (n, n) */
    const double *C;        /* (m, n) */
    const double *D;        /* row-major, (m, inputs) */
    const double *M;        /* covariance of the noise of rows and state, (m, n) */
    const double *R;        /* (m, m) */
    const int64_t *edges;   /* first row of each sensor, and m, (sensors + 1) */
    const double *A_p, *B_p, *C_p; /* what one unit of every learned parameter adds, one behind the other */
};

/* nu' S^-1 nu of every sensor by itself; infinite when its S is not positive definite. */
static void normalise(const struct step *s, const double *J, const double *nu, double *nis, double *work)
{
    int64_t lead = s->m + s->n;
    for (int64_t k = 0; k < s->sensors; k++) {
        int64_t first = s->edges[k], size = s->edges[k + 1] - first;
        double *S = work, *z = work + size * size;
        for (int64_t j = 0; j < size; j++) {
            z[j] = nu[first + j];
            for (int64_t i = j; i < size; i++)
                S[i + j * size] = J[first + i + (first + j) * lead];
        }
        if (!factorise(size, size, S)) {
            nis[k] = INFINITY;
            continue;
        }
        solve_lower(size, size, S, z);
        nis[k] = dot(size, z, z);
    }
}

/* Add to x+, and to the matrix G (rows, n) of the state before, what learned parameters p = x[first..] do. */
static void bend(
    const struct step *s, int64_t rows, const double *x, const double *u, const double *G_p, const double *V_p,
    double *after, double *G)
{
    int64_t n = s->n, first = n - s->learned;
    for (int64_t k = first; k < n; k++, G_p += rows * n) {
        double p = x[k], *column = G + k * rows;
        for (int64_t j = 0; j < n; j++)
            for (int64_t i = 0; i < rows; i++) {
                G[i + j * rows] += p * G_p[i + j * rows];
            }
        for (int64_t i = 0; i < rows; i++) {
            double effect = V_p ? dot(s->inputs, V_p + i * s->inputs, u) : 0.0;
            for (int64_t j = 0; j < n; j++)
                effect += G_p[i + j * rows] * x[j];
            column[i] += effect;
            after[i] += p * effect;
        }
        if (V_p)
            V_p += rows * s->inputs;
    }
}

/* Mean of a linear map G x + V u with what is learned, and its tangent: G itself, or a copy that is bent. */
static const double *map(
    const struct step *s, int64_t rows, const double *G, const double *V, const double *G_p,
    const double *V_p, const double *x, const double *u, double *mean, double *copy)
{
    int64_t n = s->n;
    for (int64_t i = 0; i < rows; i++)
        mean[i] = dot(s->inputs, V + i * s->inputs, u);
    accumulate(rows, n, 1.0, x, 1, G, rows, mean);
    if (!s->learned)
        return G;
    for (int64_t i = 0; i < rows * n; i++)
        copy[i] = G[i];
    bend(s, rows, x, u, G_p, V_p, mean, copy);
    return copy;
}

/* Covariance of the state, P- = A P A' + Q, both triangles, into a matrix with so many rows. */
static void move(const struct step *s, const double *A, const double *P, int64_t lead, double *moved, double *work)
{
    int64_t n = s->n;
    for (int64_t j = 0; j < n; j++) { /* work = A P */
        double *column = work + j * n;
        for (int64_t i = 0; i < n; i++)
            column[i] = 0.0;
        accumulate(n, n, 1.0, P + j * n, 1, A, n, column);
    }
    for (int64_t j = 0; j < n; j++) {
        double *column = moved + j * lead;
        for (int64_t i = j; i < n; i++)
            column[i] = s->Q[i + j * n];
        accumulate(n - j, n, 1.0, A + j, n, work + j, n, column + j);
        for (int64_t i = j + 1; i < n; i++)
            moved[j + i * lead] = column[i];
    }
}

/* The rows' part of J: G = P- C' + M' below S = C G + M C' + R, given P- in its place. */
static void measure(const struct step *s, const double *C, int64_t lead, double *J)
{
    int64_t n = s->n, m = s->m;
    const double *moved = J + m + m * lead;
    for (int64_t j = 0; j < m; j++) {
        double *cross = J + m + j * lead;
        for (int64_t i = 0; i < n; i++)
            cross[i] = s->M[j + i * m];
        accumulate(n, n, 1.0, C + j, m, moved, lead, cross);
    }
    for (int64_t j = 0; j < m; j++) {
        double *column = J + j * lead;
        for (int64_t i = j; i < m; i++)
            column[i] = s->R[i + j * m];
        accumulate(m - j, n, 1.0, J + m + j * lead, 1, C + j, m, column + j);
        accumulate(m - j, n, 1.0, C + j, m, s->M + j, m, column + j);
    }
}

/* P = L_x L_x' of the factor L of J */
static void square(int64_t n, int64_t lead, const double *L_x, double *P)
{
    for (int64_t j = 0; j < n; j++) {
        for (int64_t i = j; i < n; i++)
            P[i + j * n] = 0.0;
        accumulate(n - j, j + 1, 1.0, L_x + j, lead, L_x + j, lead, P + j + j * n);
        for (int64_t i = j + 1; i < n; i++)
            P[j + i * n] = P[i + j * n];
    }
}

/* One step; results go to record = [x; P; nu; nis; u; y], x and P only when it succeeds. */
static int run_step(const struct step *s, const double *x, const double *P, double *record, double *work)
{
    int64_t n = s->n, m = s->m, lead = m + n;
    double *nu = record + n + n * n, *nis = nu + m;
    const double *u = nis + s->sensors, *y = u + s->inputs;
    double *mean = work, *y_mean = mean + n, *z = y_mean + m, *J = z + m;
    double *bent = J + lead * lead, *rest = bent + n * lead;
    const double *A = map(s, n, s->A, s->B, s->A_p, s->B_p, x, u, mean, bent);
    move(s, A, P, lead, J + m + m * lead, rest);
    const double *C = map(s, m, s->C, s->D, s->C_p, 0, mean, u, y_mean, bent);
    measure(s, C, lead, J);
    for (int64_t i = 0; i < m; i++)
        z[i] = nu[i] = y[i] - y_mean[i];
    normalise(s, J, nu, nis, rest);
    if (!factorise(lead, lead, J))
        return 0;
    solve_lower(m, lead, J, z);
    accumulate(n, m, 1.0, z, 1, J + m, lead, mean);
    if (!isfinite(dot(n, mean, mean)))
        return 0;
    for (int64_t i = 0; i < n; i++)
        record[i] = mean[i];
    square(n, lead, J + m + m * lead, record + n);
    return 1;
}

/* Run steps from the belief (x, P) on; return how many succeeded in a row. */
int64_t flexarm_joint_steps(
    int64_t count, const struct step *const *steps, double *const *records,
    const double *x, const double *P, double *work)
{
    for (int64_t i = 0; i < count; i++) {
        if (!run_step(steps[i], x, P, records[i], work))
            return i;
        x = records[i];
        P = records[i] + steps[i]->n;
    }
    return count;
}
