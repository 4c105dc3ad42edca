/* Loops closed by Newton's iteration, and rates that keep them closed; closure.py has the equations.
 *
 * Matrices are column-major. Functions of the model are code that CasADi generated.
 */
#include "machine_code.h"

struct loops {
    int64_t n, m, iterations;
    double tolerance, longest_step;
    const int64_t *dependent; /* m coordinates */
    struct function *rows;    /* q -> c (m), G (m, n) */
    double *work;             /* m (m + most rows of J) */
};

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
            open = isnan(open) || fabs(c[i]) <= open ? open : fabs(c[i]); /* NaN stays */
        if (open <= s->tolerance)
            break;
        gather(s, G, A);
        memcpy(b, c, s->m * sizeof *b);
        if (k == s->iterations || !eliminate(s->m, 1, A, b))
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
    if (!eliminate(s->m, 1, A, b))
        return 0;
    for (int64_t i = 0; i < s->m; i++)
        v[s->dependent[i]] -= b[i];
    return 1;
}

/* Let rows J (k, n) follow the loops where ``flexarm_close`` has just closed them: dependent rates follow the
   others, and their own columns are zero. Returns 0 when the pose is singular. */
int64_t flexarm_follow_closed(const struct loops *s, int64_t k, double *J)
{
    double *A = s->work, *B = A + s->m * s->m;
    const double *G = s->rows->res[1];
    for (int64_t i = 0; i < s->m; i++) { /* A = G_d', B = J_d' */
        for (int64_t j = 0; j < s->m; j++)
            A[i * s->m + j] = G[j + s->dependent[i] * s->m];
        memcpy(B + i * k, J + s->dependent[i] * k, k * sizeof *B);
    }
    if (!eliminate(s->m, k, A, B))
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

/* The same at any closed pose q. */
int64_t flexarm_follow(const struct loops *s, const double *q, int64_t k, double *J)
{
    s->rows->arg[0] = q;
    s->rows->evaluate(s->rows->arg, s->rows->res, s->rows->iw, s->rows->w, 0);
    return flexarm_follow_closed(s, k, J);
}

/* Let motions W (n, k), row-major, follow the loops where ``flexarm_close`` has just closed them: their dependent
   rows become G_d^-1 (b - G W) with these rows zero; b, (m, k) row-major, is zero where it is null. Returns 0
   when the pose is singular. */
int64_t flexarm_move_closed(const struct loops *s, int64_t k, const double *b, double *W)
{
    double *A = s->work, *B = A + s->m * s->m;
    const double *G = s->rows->res[1];
    for (int64_t i = 0; i < s->m; i++)
        memset(W + s->dependent[i] * k, 0, k * sizeof *W);
    if (b)
        memcpy(B, b, s->m * k * sizeof *B);
    else
        memset(B, 0, s->m * k * sizeof *B);
    for (int64_t j = 0; j < s->n; j++)
        for (int64_t i = 0; i < s->m; i++) {
            double g = G[i + j * s->m];
            for (int64_t l = 0; g != 0.0 && l < k; l++)
                B[i * k + l] -= g * W[j * k + l];
        }
    gather(s, G, A);
    if (!eliminate(s->m, k, A, B))
        return 0;
    for (int64_t i = 0; i < s->m; i++)
        memcpy(W + s->dependent[i] * k, B + i * k, k * sizeof *W);
    return 1;
}
