/* A control period in linearly implicit midpoint steps; implicit_steps.py has the equations.
 *
 * Where loops close, the dependent coordinates are eliminated: with G_d d = -G_i w - g they are X w + y, and
 * what is left is positive definite. Matrices are column-major; of symmetric ones the lower triangle counts.
 */
#include "machine_code.h"

struct period {
    int64_t n, m, free, axes, substeps; /* m rows close loops; free coordinates are solved for, dependent left out */
    double h, friction, slope;          /* s, N m, rad/s */
    const int64_t *axis, *order;        /* actuated axes; free coordinates, then the m dependent ones */
    const double *constant;             /* h^2/4 K + h/2 D, (n, n) */
    struct function *mass, *bias, *rows; /* q -> M; (q, v) -> h; q -> c, G, where there are loops */
    const void *loops;                  /* of the closing */
    int64_t (*close)(const void *, double *, double *);
    void (*dsyr2k)(char *, char *, int *, int *, double *, double *, int *, double *, int *, double *, double *, int *);
    void (*dposv)(char *, int *, int *, double *, int *, double *, int *, int *);
    double *work;
};

/* v is null where a function takes q alone */
static void evaluate(struct function *f, const double *q, const double *v)
{
    f->arg[0] = q;
    if (v)
        f->arg[1] = v;
    f->evaluate(f->arg, f->res, f->iw, f->w, 0);
}

/* G_d [X' y] = -[G_i g] with g = G (2 v + prescribed); rows of XY are rows of X followed by y. */
static int64_t depend(const struct period *s, const double *v, const double *prescribed, double *XY, double *A)
{
    int64_t n_i = s->free, m = s->m, k = n_i + 1;
    const double *G = s->rows->res[1];
    for (int64_t i = 0; i < m; i++) {
        for (int64_t j = 0; j < n_i; j++)
            XY[i * k + j] = -G[i + s->order[j] * m];
        for (int64_t j = 0; j < m; j++)
            A[i * m + j] = G[i + s->order[n_i + j] * m];
        XY[i * k + n_i] = 0.0;
    }
    for (int64_t j = 0; j < s->n; j++) {
        double rate = 2.0 * v[j] + prescribed[j];
        for (int64_t i = 0; i < m; i++)
            XY[i * k + n_i] -= G[i + j * m] * rate;
    }
    return eliminate(m, k, A, XY);
}

/* Add what the dependent coordinates bear to S and r: S += X'W + W'X with W = A_di + A_dd X / 2, and so on. */
static void carry(const struct period *s, const double *M, const double *b, const double *XY, double *S, double *r)
{
    int64_t n_i = s->free, m = s->m, n = s->n, k = n_i + 1;
    double *W = r + n_i; /* (n_i, m), rows of W one after the other */
    for (int64_t i = 0; i < m; i++) {
        int64_t at = s->order[n_i + i];
        double *row = W + i * n_i, rest = b[at];
        for (int64_t j = 0; j < n_i; j++)
            row[j] = M[at + s->order[j] * n];
        for (int64_t p = 0; p < m; p++) {
            double a = M[at + s->order[n_i + p] * n];
            if (a == 0.0)
                continue;
            const double *x = XY + p * k;
            for (int64_t j = 0; j < n_i; j++)
                row[j] += a / 2 * x[j];
            rest -= a * x[n_i]; /* b_d - A_dd y */
        }
        const double *x = XY + i * k;
        for (int64_t j = 0; j < n_i; j++)
            r[j] += x[j] * rest - M[at + s->order[j] * n] * x[n_i]; /* X'(b_d - A_dd y) - A_id y */
    }
    int size = (int)n_i, inner = (int)m, lead = (int)k;
    double one = 1.0;
    s->dsyr2k("L", "N", &size, &inner, &one, (double *)XY, &lead, W, &size, &one, S, &size);
}

/* dv of one step from (q, v); prescribed parts of dv are given and kept. Returns 0 when there is none. */
static int64_t change(const struct period *s, const double *v, const double *u, double *M, double *dv, double *work)
{
    int64_t n = s->n, n_i = s->free, m = s->m, k = n_i + 1;
    const double *bias = s->bias->res[0];
    double *b = work, *S = b + n, *r = S + n_i * n_i, *XY = r + n_i + n_i * m, *A = XY + m * k;
    for (int64_t i = 0; i < n * n; i++)
        M[i] += s->constant[i];
    for (int64_t i = 0; i < n; i++)
        b[i] = -s->h * bias[i];
    for (int64_t a = 0; u && a < s->axes; a++) {
        int64_t i = s->axis[a];
        double ramp = s->friction ? tanh(v[i] / s->slope) : 0.0;
        b[i] += s->h * (u[a] - s->friction * ramp);
        M[i + i * n] += s->h / 2 * s->friction * (1 - ramp * ramp) / s->slope;
    }
    for (int64_t a = 0; !u && a < s->axes; a++)
        for (int64_t i = 0; i < n; i++)
            b[i] -= M[i + s->axis[a] * n] * dv[s->axis[a]];
    for (int64_t j = 0; j < n_i; j++) {
        const double *column = M + s->order[j] * n;
        for (int64_t i = j; i < n_i; i++)
            S[i + j * n_i] = column[s->order[i]];
        r[j] = b[s->order[j]];
    }
    if (m) {
        if (!depend(s, v, dv, XY, A))
            return 0;
        carry(s, M, b, XY, S, r);
    }
    int size = (int)n_i, one = 1, info = 0;
    if (n_i)
        s->dposv("L", &size, &one, S, &size, r, &size, &info);
    for (int64_t j = 0; j < n_i; j++)
        dv[s->order[j]] = r[j];
    for (int64_t i = 0; i < m; i++) {
        double sum = XY[i * k + n_i];
        for (int64_t j = 0; j < n_i; j++)
            sum += XY[i * k + j] * r[j];
        dv[s->order[n_i + i]] = sum;
    }
    return info == 0;
}

/* Advance q and v by a period under torques u, or, when u is null, with dv of the actuated axes prescribed;
   dv is that of the last step. Returns 0 when that cannot be done. */
int64_t flexarm_advance(const struct period *s, double *q, double *v, const double *u, double *dv)
{
    double *middle = s->work, *rest = middle + s->n;
    for (int64_t step = 0; step < s->substeps; step++) {
        for (int64_t i = 0; i < s->n; i++)
            middle[i] = q[i] + s->h / 2 * v[i];
        evaluate(s->mass, middle, 0);
        evaluate(s->bias, middle, v);
        if (s->m)
            evaluate(s->rows, middle, 0);
        for (int64_t i = 0; u && i < s->n; i++)
            dv[i] = 0.0;
        for (int64_t j = 0; !u && j < s->free + s->m; j++)
            dv[s->order[j]] = 0.0;
        if (!change(s, v, u, s->mass->res[0], dv, rest))
            return 0;
        for (int64_t i = 0; i < s->n; i++) {
            q[i] += s->h * (v[i] + dv[i] / 2);
            v[i] += dv[i];
        }
    }
    return s->m ? s->close(s->loops, q, v) : 1;
}
