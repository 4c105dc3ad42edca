/* Loops closed by Newton's iteration, and rates that keep them closed; closure.py has the equations.
 *
 * Matrices are column-major. Functions of the model are code that CasADi generated.
 */
#include <math.h>
#include <stdint.h>
#include <string.h>

/* A generated function and the room it works in; results lie where res points. */
struct function {
    int (*evaluate)(const double **arg, double **res, long long *iw, double *w, int mem);
    const double **arg;
    double **res;
    long long *iw;
    double *w;
};

struct loops {
    int64_t n, m, iterations;
    double tolerance, longest_step;
    const int64_t *dependent; /* m coordinates */
    struct function *rows;    /* q -> c (m), G (m, n) */
    double *work;             /* m (m + rows of J) */
};

/* Solve A X = B by elimination with row pivoting: A (m, m) and B (m, k) row-major, B becomes X. Zeros are
   left out: columns of G belong to a few loops each. Returns 0 when A is singular. */
int64_t flexarm_eliminate(int64_t m, int64_t k, double *restrict A, double *restrict B)
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
        for (int64_t i = p + 1; i < m; i++) {
            double factor = A[i * m + p] / A[p * m + p];
            if (factor == 0.0)
                continue;
            for (int64_t j = p + 1; j < m; j++)
                A[i * m + j] -= factor * A[p * m + j];
            for (int64_t j = 0; j < k; j++)
                B[i * k + j] -= factor * B[p * k + j];
        }
    }
    for (int64_t p = m - 1; p >= 0; p--) {
        for (int64_t i = p + 1; i < m; i++) {
            double factor = A[p * m + i];
            if (factor == 0.0)
                continue;
            for (int64_t j = 0; j < k; j++)
                B[p * k + j] -= factor * B[i * k + j];
        }
        double scale = 1.0 / A[p * m + p];
        for (int64_t j = 0; j < k; j++)
            B[p * k + j] *= scale;
    }
    return 1;
}

static void gather(const struct loops *s, const double *G, double *A)
{
    for (int64_t i = 0; i < s->m; i++)
        for (int64_t j = 0; j < s->m; j++)
            A[i * s->m + j] = G[i + s->dependent[j] * s->m];
}

/* Close the loops from q on; with v, (n,), its dependent rates are made to follow the others. Returns 0 when
   they do not close; q and v are then of no use. */
int64_t flexarm_close(const struct loops *s, double *q, double *v)
{
    double *A = s->work, *b = A + s->m * s->m;
    const double *c = s->rows->res[0], *G = s->rows->res[1];
    for (int64_t k = 0;; k++) {
        s->rows->arg[0] = q;
        s->rows->evaluate(s->rows->arg, s->rows->res, s->rows->iw, s->rows->w, 0);
        double open = 0.0, far = 1e-300;
        for (int64_t i = 0; i < s->m; i++)
            open = fabs(c[i]) <= open ? open : fabs(c[i]); /* NaN stays */
        if (open <= s->tolerance)
            break;
        gather(s, G, A);
        memcpy(b, c, s->m * sizeof *b);
        if (k == s->iterations || !flexarm_eliminate(s->m, 1, A, b))
            return 0;
        for (int64_t i = 0; i < s->m; i++)
            far = fmax(far, fabs(b[i]));
        double share = fmin(1.0, s->longest_step / far);
        for (int64_t i = 0; i < s->m; i++)
            q[s->dependent[i]] -= share * b[i];
    }
    if (!v)
        return 1;
    memset(b, 0, s->m * sizeof *b);
    for (int64_t j = 0; j < s->n; j++)
        for (int64_t i = 0; i < s->m; i++)
            b[i] += G[i + j * s->m] * v[j];
    gather(s, G, A);
    if (!flexarm_eliminate(s->m, 1, A, b))
        return 0;
    for (int64_t i = 0; i < s->m; i++)
        v[s->dependent[i]] -= b[i];
    return 1;
}

/* Let rows J (k, n) follow the loops at the closed pose q: dependent rates follow the others, and their own
   columns are zero. Returns 0 when the pose is singular. */
int64_t flexarm_follow(const struct loops *s, const double *q, int64_t k, double *J)
{
    double *A = s->work, *B = A + s->m * s->m;
    const double *G = s->rows->res[1];
    s->rows->arg[0] = q;
    s->rows->evaluate(s->rows->arg, s->rows->res, s->rows->iw, s->rows->w, 0);
    for (int64_t i = 0; i < s->m; i++) { /* A = G_d', B = J_d' */
        for (int64_t j = 0; j < s->m; j++)
            A[i * s->m + j] = G[j + s->dependent[i] * s->m];
        memcpy(B + i * k, J + s->dependent[i] * k, k * sizeof *B);
    }
    if (!flexarm_eliminate(s->m, k, A, B))
        return 0;
    for (int64_t j = 0; j < s->n; j++)
        for (int64_t i = 0; i < s->m; i++) {
            double g = G[i + j * s->m];
            for (int64_t l = 0; g != 0.0 && l < k; l++)
                J[l + j * k] -= B[i * k + l] * g;
        }
    for (int64_t i = 0; i < s->m; i++)
        memset(J + s->dependent[i] * k, 0, k * sizeof *J);
    return 1;
}
