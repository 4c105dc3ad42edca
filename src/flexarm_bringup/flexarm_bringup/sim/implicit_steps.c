/* A control period in linearly implicit midpoint steps; implicit_steps.py has the equations.
 *
 * Where loops close, the dependent coordinates are eliminated: with G_d d = -G_i w - g they are X w + y, and
 * what is left is positive definite. Matrices are column-major; of symmetric ones the lower triangle counts.
 */
#include "machine_code.h"

/* Where a dense matrix may hold something: its places there, and the rows and columns it is taken to. */
struct entries {
    int64_t count;
    const int64_t *from, *row, *column;
};

/* The same for places in a row: the first here and there, and how many they are. */
struct runs {
    int64_t count;
    const int64_t *from, *to, *length;
};

struct period {
    int64_t n, m, free, heavy, axes, substeps, passes; /* m rows close loops; free coordinates are solved for, dependent
                                                  left out; only the first heavy ones of those bear anything */
    double h, friction, slope, fast;     /* s, N m, rad/s, rad/s */
    const int64_t *axis;                 /* actuated axes */
    int64_t *grip;                       /* how the friction of each is taken in this step: see friction.py */
    const int64_t *order;                /* free coordinates, the m dependent ones, the others */
    const double *constant;              /* h^2/4 K + h/2 D, (n, n), symmetric */
    int64_t gaps;                        /* springs with play: where they are, half of it, their springs in contact */
    const int64_t *gap;
    const double *half, *stiffness, *damping;
    struct runs inside;                  /* of M + constant: the lower triangle of the free coordinates */
    struct entries across, among, led;   /* dependent by free; dependent by dependent; all by prescribed */
    struct entries loop;                 /* of G; its columns are counted in the order */
    struct function *mass, *bias, *rows; /* q -> M; (q, v) -> h; q -> c, G, where there are loops */
    const void *loops;                   /* of the closing */
    int64_t (*close)(const void *, double *, double *);
    void (*dsyr2k)(char *, char *, int *, int *, double *, double *, int *, double *, int *, double *, double *, int *);
    void (*dposv)(char *, int *, int *, double *, int *, double *, int *, int *);
    void (*dpotrs)(char *, int *, int *, double *, int *, double *, int *, int *);
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
    memset(XY, 0, m * k * sizeof *XY);
    memset(A, 0, m * m * sizeof *A);
    for (int64_t e = 0; e < s->loop.count; e++) {
        int64_t i = s->loop.row[e], at = s->loop.column[e], j = s->order[at];
        double g = s->rows->res[1][s->loop.from[e]];
        if (at < n_i)
            XY[i * k + at] = -g;
        else if (at < n_i + m)
            A[i * m + at - n_i] = g;
        XY[i * k + n_i] -= g * (2.0 * v[j] + prescribed[j]);
    }
    return eliminate(m, k, A, XY);
}

static void add_row(int64_t count, double factor, const double *restrict row, double *restrict sum)
{
    for (int64_t j = 0; j < count; j++)
        sum[j] += factor * row[j];
}

/* Add what the dependent coordinates bear to S and r: S += X'W + W'X with W = A_di + A_dd X / 2, and so on. */
static void carry(const struct period *s, const double *M, const double *b, const double *XY, double *S, double *r)
{
    int64_t n_i = s->free, k = n_i + 1;
    double *W = r + n_i, *rest = W + s->heavy * n_i; /* (n_i, heavy), rows of W one after the other; (heavy) */
    memset(W, 0, s->heavy * n_i * sizeof *W);
    for (int64_t i = 0; i < s->heavy; i++)
        rest[i] = b[s->order[n_i + i]];
    for (int64_t e = 0; e < s->across.count; e++) {
        int64_t i = s->across.row[e], j = s->across.column[e];
        double a = M[s->across.from[e]] + s->constant[s->across.from[e]];
        W[i * n_i + j] = a;
        r[j] -= a * XY[i * k + n_i]; /* A_id y */
    }
    for (int64_t e = 0; e < s->among.count; e++) {
        int64_t i = s->among.row[e], p = s->among.column[e];
        double a = M[s->among.from[e]] + s->constant[s->among.from[e]];
        add_row(n_i, a / 2, XY + p * k, W + i * n_i);
        rest[i] -= a * XY[p * k + n_i]; /* b_d - A_dd y */
    }
    for (int64_t i = 0; i < s->heavy; i++)
        add_row(n_i, rest[i], XY + i * k, r); /* X'(b_d - A_dd y) */
    int size = (int)n_i, inner = (int)s->heavy, lead = (int)k;
    double one = 1.0;
    if (n_i) /* ldb of nothing is refused */
        s->dsyr2k("L", "N", &size, &inner, &one, (double *)XY, &lead, W, &size, &one, S, &size);
}

/* Take what springs without play bear too much out of M and b; backlash.py has the equations. */
static void release(const struct period *s, const double *middle, const double *mean, const double *guess, double *M,
                    double *b)
{
    for (int64_t g = 0; g < s->gaps; g++) {
        int64_t i = s->gap[g];
        double k = s->stiffness[g], d = s->damping[g], side = middle[i] < 0.0 ? -1.0 : 1.0;
        double depth = side * middle[i] - s->half[g];
        if (depth > 0.0 && k * depth + d * side * mean[i] > 0.0) {
            b[i] += s->h * (side * k * s->half[g]);
        } else {
            double bears = s->h * s->h / 4 * k + s->h / 2 * d;
            b[i] += s->h * (k * middle[i] + d * mean[i]) - bears * guess[i];
            M[i + i * s->n] -= bears;
        }
    }
}

/* Friction of an axis at velocity v over a step: force + rise dv, by its grip. */
static void rub(const struct period *s, double v, int64_t grip, double *force, double *rise)
{
    double ramp = tanh(v / s->slope), chord = v ? s->friction * ramp / v : s->friction / s->slope;
    *force = s->friction * ramp;
    *rise = grip == 0 ? s->friction * (1 - ramp * ramp) / s->slope / 2 : grip == 1 ? chord : chord / 2;
}

/* Take another grip where friction would push an axis over a step; returns whether there is one. */
static int64_t tighten(const struct period *s, const double *v, const double *dv)
{
    int64_t found = 0;
    for (int64_t a = 0; a < s->axes; a++) {
        int64_t i = s->axis[a];
        double force, rise;
        rub(s, v[i], s->grip[a], &force, &rise);
        if (s->grip[a] < 2 && (force + rise * dv[i]) * (v[i] + dv[i] / 2) < 0.0) {
            s->grip[a]++;
            found = 1;
        }
    }
    return found;
}

/* dv of one step from (q, v), all functions being those where a guess of dv leads; prescribed parts of dv are given
   and kept. Returns 0 when there is none. */
static int64_t change(const struct period *s, const double *v, const double *guess, const double *u, double *M,
                      double *dv, double *work)
{
    int64_t n = s->n, n_i = s->free, m = s->m, k = n_i + 1;
    const double *bias = s->bias->res[0];
    double *b = work, *S = b + n, *XY = S + n_i * n_i, *A = XY + m * k, *r = A + m * m;
    for (int64_t i = 0; i < n; i++)
        b[i] = -s->h * bias[i];
    for (int64_t j = 0; j < n; j++)
        if (guess[j]) /* what the bias has of it already */
            add_row(n, guess[j], s->constant + j * n, b);
    for (int64_t a = 0; u && a < s->axes; a++) {
        int64_t i = s->axis[a];
        double force = 0.0, rise = 0.0;
        if (s->friction)
            rub(s, v[i], s->grip[a], &force, &rise);
        b[i] += s->h * (u[a] - force);
        M[i + i * n] += s->h * rise;
    }
    release(s, s->work, s->work + n, guess, M, b);
    for (int64_t e = 0; e < s->led.count; e++) {
        double a = M[s->led.from[e]] + s->constant[s->led.from[e]];
        b[s->led.row[e]] -= a * dv[s->led.column[e]];
    }
    memset(S, 0, n_i * n_i * sizeof *S);
    for (int64_t e = 0; e < s->inside.count; e++) {
        const double *some = M + s->inside.from[e], *constant = s->constant + s->inside.from[e];
        double *to = S + s->inside.to[e];
        for (int64_t i = 0; i < s->inside.length[e]; i++)
            to[i] = some[i] + constant[i];
    }
    for (int64_t j = 0; j < n_i; j++)
        r[j] = b[s->order[j]];
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

/* Correct dv of an open arm: inertia and bias are those where dv leads, by the factors that dposv has left. Of the
   matrix M that friction and play have changed, the diagonal is given as it was. */
static int64_t correct(const struct period *s, const double *q, const double *v, double *middle, double *mean,
                       const double *guess, const double *diagonal, double *dv, double *work)
{
    int64_t n = s->n, n_i = s->free;
    const double *bias = s->bias->res[0];
    double *M = s->mass->res[0];
    double *b = work, *S = b + n, *r = S + n_i * n_i;
    for (int64_t i = 0; i < n; i++) {
        b[i] = s->h * bias[i];
        M[i + i * n] = diagonal[i];
        mean[i] = v[i] + dv[i] / 2;
        middle[i] = q[i] + s->h / 2 * mean[i];
    }
    for (int64_t j = 0; j < n; j++) {
        add_row(n, dv[j], M + j * n, b);
        add_row(n, dv[j] - guess[j], s->constant + j * n, b); /* what the bias has of it now */
    }
    evaluate(s->mass, middle, 0);
    evaluate(s->bias, middle, mean);
    for (int64_t j = 0; j < n; j++)
        add_row(n, -dv[j], M + j * n, b);
    for (int64_t i = 0; i < n; i++)
        b[i] -= s->h * bias[i];
    for (int64_t j = 0; j < n_i; j++)
        r[j] = b[s->order[j]];
    int size = (int)n_i, one = 1, info = 0;
    if (n_i)
        s->dpotrs("L", &size, &one, S, &size, r, &size, &info);
    for (int64_t j = 0; j < n_i; j++)
        dv[s->order[j]] += r[j];
    return info == 0;
}

/* Whether an open arm moves so fast that a step is to be corrected. */
static int64_t is_fast(const struct period *s, const double *v)
{
    for (int64_t i = 0; !s->m && i < s->n; i++)
        if (v[i] > s->fast || v[i] < -s->fast)
            return 1;
    return 0;
}

/* Advance q and v by a period under torques u, or, when u is null, with dv of the actuated axes prescribed;
   dv is that of the last step. Returns 0 when that cannot be done. */
int64_t flexarm_advance(const struct period *s, double *q, double *v, const double *u, double *dv)
{
    double *middle = s->work, *mean = middle + s->n, *guess = mean + s->n, *diagonal = guess + s->n;
    double *rest = diagonal + s->n;
    for (int64_t step = 0; step < s->substeps; step++) {
        memset(guess, 0, s->n * sizeof *guess);
        memset(s->grip, 0, s->axes * sizeof *s->grip);
        for (int64_t pass = 0; pass < s->passes;) {
            for (int64_t i = 0; i < s->n; i++) {
                mean[i] = v[i] + guess[i] / 2;
                middle[i] = q[i] + s->h / 2 * mean[i];
            }
            evaluate(s->mass, middle, 0);
            evaluate(s->bias, middle, mean);
            for (int64_t i = 0; i < s->n; i++)
                diagonal[i] = s->mass->res[0][i + i * s->n];
            if (s->m)
                evaluate(s->rows, middle, 0);
            for (int64_t i = 0; u && i < s->n; i++)
                dv[i] = 0.0;
            for (int64_t j = 0; !u && j < s->free + s->m; j++)
                dv[s->order[j]] = 0.0;
            if (!change(s, v, guess, u, s->mass->res[0], dv, rest))
                return 0;
            if (is_fast(s, v) && !correct(s, q, v, middle, mean, guess, diagonal, dv, rest))
                return 0;
            if (u && s->friction && tighten(s, v, dv))
                continue; /* the same pass again */
            pass++;
            memcpy(guess, dv, s->n * sizeof *guess);
        }
        for (int64_t i = 0; i < s->n; i++) {
            q[i] += s->h * (v[i] + dv[i] / 2);
            v[i] += dv[i];
        }
    }
    return s->m ? s->close(s->loops, q, v) : 1;
}
