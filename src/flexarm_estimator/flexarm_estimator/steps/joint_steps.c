/* Joint steps one after the other, without leaving machine code; joint_step.py has the equations.
 *
 * Matrices are column-major; of symmetric ones only the lower triangle is read. The order of the
 * operations depends on nothing but the sizes: an instant that is computed again gives the same bits.
 */
#include "joint_algebra.h"
#include "tiles.h"

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

/* Copy the part of A below its diagonal to above it. */
static void mirror(int64_t n, double *A, int64_t lead)
{
    for (int64_t j = 0; j < n; j++)
        for (int64_t i = j + 1; i < n; i++)
            A[j + i * lead] = A[i + j * lead];
}

/* Copy a matrix (rows, columns) to one with another leading dimension. */
static void copy(int64_t rows, int64_t columns, const double *A, int64_t lead_a, double *to, int64_t lead)
{
    for (int64_t j = 0; j < columns; j++)
        for (int64_t i = 0; i < rows; i++)
            to[i + j * lead] = A[i + j * lead_a];
}

/* How many states at the end a step leaves as they are: their rows of A are those of the unit matrix. */
static int64_t count_still(int64_t n, const double *A)
{
    for (int64_t i = n - 1; i >= 0; i--)
        for (int64_t j = 0; j < n; j++)
            if (A[i + j * n] != (double)(i == j))
                return n - 1 - i;
    return n;
}

/* How many of these move none of the others, the first ``moving`` states: their columns of A are empty. */
static int64_t count_idle(int64_t n, int64_t moving, const double *A)
{
    for (int64_t j = n - 1; j >= moving; j--)
        for (int64_t i = 0; i < moving; i++)
            if (A[i + j * n] != 0.0)
                return n - 1 - j;
    return n - moving;
}

/* Covariance of the state, P- = A P A' + Q, both triangles, into a matrix with so many rows. */
static void move(const struct step *s, const double *A, const double *P, int64_t lead, double *moved, double *work)
{
    int64_t n = s->n, moving = n - count_still(n, A), terms = n - count_idle(n, moving, A);
    double *AP = work, *start = AP + n * n;
    for (int64_t i = 0; i < n * n; i++)
        start[i] = 0.0;
    multiply(moving, n, terms, 1.0, 0, A, n, (struct right){P, 1, n}, start, AP, n);
    for (int64_t j = 0; j < n; j++)
        for (int64_t i = moving; i < n; i++)
            AP[i + j * n] = P[i + j * n];
    copy(moving, moving, s->Q, n, start, lead);
    multiply(moving, moving, terms, 1.0, 1, A, n, (struct right){AP, n, 1}, start, moved, lead);
    for (int64_t j = 0; j < n; j++)
        for (int64_t i = j > moving ? j : moving; i < n; i++)
            moved[i + j * lead] = s->Q[i + j * n] + AP[j + i * n];
    mirror(n, moved, lead);
}

/* The rows' part of J: G = P- C' + M' below S = C G + M C' + R, given P- in its place. */
static void measure(const struct step *s, const double *C, int64_t lead, double *J, double *work)
{
    int64_t n = s->n, m = s->m;
    struct right C_t = {C, m, 1};
    double *start = work, *half = start + m * lead;
    for (int64_t j = 0; j < m; j++)
        for (int64_t i = 0; i < n; i++)
            start[i + j * lead] = s->M[j + i * m];
    multiply(n, m, n, 1.0, 0, J + m + m * lead, lead, C_t, start, J + m, lead);
    copy(m, m, s->R, m, start, lead);
    multiply(m, m, n, 1.0, 1, C, m, (struct right){J + m, 1, lead}, start, half, lead);
    multiply(m, m, n, 1.0, 1, s->M, m, C_t, half, J, lead);
}

/* P = L_x L_x' of what is left of J once y is known; 0, with P untouched, when that is not positive definite. */
static int leave(int64_t n, int64_t m, int64_t lead, const double *J, double *P, double *work)
{
    const double *L_xy = J + m;
    double *left = work, *factor = left + n * lead;
    multiply(n, n, m, -1.0, 1, L_xy, lead, (struct right){L_xy, lead, 1}, J + m + m * lead, left, lead);
    copy(n, n, left, lead, factor, lead);
    if (!factorise_first(n, n, lead, factor, factor + n * lead))
        return 0;
    for (int64_t j = 0; j < n; j++)
        for (int64_t i = 0; i < j; i++)
            factor[i + j * lead] = 0.0;
    double *start = left;
    for (int64_t i = 0; i < n * n; i++)
        start[i] = 0.0;
    multiply(n, n, n, 1.0, 1, factor, lead, (struct right){factor, lead, 1}, start, P, n);
    mirror(n, P, n);
    return 1;
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
    measure(s, C, lead, J, rest);
    for (int64_t i = 0; i < m; i++)
        z[i] = nu[i] = y[i] - y_mean[i];
    normalise(s, J, nu, nis, rest);
    if (!factorise_first(lead, m, lead, J, rest))
        return 0;
    solve_lower(m, lead, J, z);
    accumulate(n, m, 1.0, z, 1, J + m, lead, mean);
    if (!isfinite(dot(n, mean, mean)) || !leave(n, m, lead, J, record + n, rest))
        return 0;
    for (int64_t i = 0; i < n; i++)
        record[i] = mean[i];
    return 1;
}

/* States that are held within limits. */
struct limits {
    int64_t count;
    const int64_t *at;
    const double *most;
};

static int is_within(const struct limits *limits, const double *x)
{
    for (int64_t i = 0; i < limits->count; i++)
        if (!(fabs(x[limits->at[i]]) <= limits->most[i]))
            return 0;
    return 1;
}

/* Steps to run from the belief (x, P) on. */
struct run {
    int64_t count;
    const struct step *const *steps;
    double *const *records;
    const double *x, *P;
    double *work;
    struct limits limits;
};

/* Run them; return how many succeeded in a row. After one that leads beyond the limits somebody else has to lead
   the state back before the next. */
int64_t flexarm_joint_steps(const struct run *run)
{
    const double *x = run->x, *P = run->P;
    for (int64_t i = 0; i < run->count; i++) {
        if (!run_step(run->steps[i], x, P, run->records[i], run->work))
            return i;
        x = run->records[i];
        P = x + run->steps[i]->n;
        if (!is_within(&run->limits, x))
            return i + 1;
    }
    return run->count;
}
