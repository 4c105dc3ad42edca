/* Dual active-set method for the program of changing_program.py, which has the equations. Row-major. One file,
 * however long: a library is built of one, and kept under the hash of it. */
#include "machine_code.h"

#define SOLVED 1
#define CAPPED 0
#define INFEASIBLE -1
#define NOT_FINITE -2
#define FLAT 1e-10 /* share of a direction's largest slope that is rounding */
#define DEPENDENT 1e-12 /* share of a new row that is not spanned by the active ones, squared */

/* Limits are numbered: unknowns (n), rates (n_v), outputs above (n_y), outputs below (n_y), n_y = n_b n_o. */
struct program {
    int64_t n_u, n_b, n_o;
    const double *L;       /* H = L L', (n_v, n_v) lower */
    const double *outputs; /* rows, (n_y, n_v) */
    const double *l, *u;   /* of all limits */
    double price, tolerance;
    int64_t *active;       /* limits that bind, (n + 1), and their sides, (n + 1): kept from solve to solve */
    double *work;          /* 3 (n + 1) (n + 1) + 5 (n + 1) + 2 n_y */
};

/* What the iteration works with: k active limits with rows M = side L^-1 a, distances d, products M M'. */
struct state {
    int64_t n, n_v, n_y, k, *active, *side;
    double *M, *G, *F, *d, *lambda, *wanted, *x_free, *x, *y_free, *y;
};

WIDE static double dot(int64_t n, const double *restrict a, const double *restrict b)
{
    double s0 = 0.0, s1 = 0.0, s2 = 0.0, s3 = 0.0;
    int64_t i = 0;
    for (; i + 3 < n; i += 4) {
        s0 += a[i] * b[i];
        s1 += a[i + 1] * b[i + 1];
        s2 += a[i + 2] * b[i + 2];
        s3 += a[i + 3] * b[i + 3];
    }
    for (; i < n; i++)
        s0 += a[i] * b[i];
    return (s0 + s1) + (s2 + s3);
}

WIDE static void add(int64_t n, double factor, const double *restrict a, double *restrict b)
{
    for (int64_t i = 0; i < n; i++)
        b[i] += factor * a[i];
}

/* z = L^-1 z from its entry first on; entries of slacks stay */
static void forward(const struct program *p, int64_t n_v, int64_t first, double *z)
{
    for (int64_t i = first; i < n_v; i++)
        z[i] = (z[i] - dot(i - first, p->L + i * n_v + first, z + first)) / p->L[i * n_v + i];
}

/* z = L^-T z; entries of slacks stay */
static void backward(const struct program *p, int64_t n_v, double *z)
{
    for (int64_t i = n_v - 1; i >= 0; i--) {
        z[i] /= p->L[i * n_v + i];
        add(i, -z[i], p->L + i * n_v, z);
    }
}

/* Write row a of a limit, (n,); returns its first entry that may not be zero. */
static int64_t write_row(const struct program *p, const struct state *s, int64_t limit, double *a)
{
    int64_t n = s->n, n_v = s->n_v, n_u = p->n_u;
    memset(a, 0, n * sizeof *a);
    if (limit < n) {
        a[limit] = 1.0;
        return limit;
    }
    limit -= n;
    if (limit < n_v) {
        a[limit] = 1.0;
        if (limit < n_u)
            return limit;
        a[limit - n_u] = -1.0;
        return limit - n_u;
    }
    limit -= n_v;
    int64_t row = limit % s->n_y;
    memcpy(a, p->outputs + row * n_v, n_v * sizeof *a);
    a[n_v + row % p->n_o] = limit < s->n_y ? -1.0 : 1.0;
    return 0;
}

/* Value of a limit at x, whose outputs are in y. */
static double value(const struct program *p, const struct state *s, int64_t limit, const double *x, const double *y)
{
    int64_t n = s->n, n_v = s->n_v, n_u = p->n_u;
    if (limit < n)
        return x[limit];
    limit -= n;
    if (limit < n_v)
        return x[limit] - (limit < n_u ? 0.0 : x[limit - n_u]);
    limit -= n_v;
    int64_t row = limit % s->n_y;
    return y[row] + (limit < s->n_y ? -1.0 : 1.0) * x[n_v + row % p->n_o];
}

static void evaluate_outputs(const struct program *p, const struct state *s, const double *x, double *y)
{
    for (int64_t b = 0; b < p->n_b; b++) /* block b feels the torques until b */
        for (int64_t i = b * p->n_o; i < (b + 1) * p->n_o; i++)
            y[i] = dot((b + 1) * p->n_u, p->outputs + i * s->n_v, x);
}

/* Continue the factor F of G = F diag F' from row first on: unit lower F, its diagonal the pivots. Returns the
   first row that depends on those before it, or k. */
static int64_t factorise(const struct state *s, int64_t first)
{
    int64_t n = s->n + 1; /* products of one row more than there are unknowns */
    for (int64_t i = first; i < s->k; i++) {
        double *row = s->F + i * n, pivot = s->G[i * n + i];
        for (int64_t j = 0; j < i; j++) { /* row holds F diag until its end */
            double sum = s->G[i * n + j];
            for (int64_t m = 0; m < j; m++)
                sum -= row[m] * s->F[j * n + m];
            row[j] = sum;
        }
        for (int64_t j = 0; j < i; j++) {
            double scaled = row[j] / s->F[j * n + j];
            pivot -= scaled * row[j];
            row[j] = scaled;
        }
        row[i] = pivot;
        if (!(pivot > DEPENDENT * s->G[i * n + i])) /* also when it is NaN */
            return i;
    }
    return s->k;
}

static int64_t activate(const struct program *p, struct state *s, int64_t limit, int64_t side)
{
    int64_t n = s->n, k = s->k++;
    double *m = s->M + k * n, bound = side > 0 ? p->u[limit] : p->l[limit];
    forward(p, s->n_v, write_row(p, s, limit, m), m);
    if (side < 0)
        for (int64_t i = 0; i < n; i++)
            m[i] = -m[i];
    for (int64_t j = 0; j <= k; j++)
        s->G[k * (n + 1) + j] = dot(n, m, s->M + j * n);
    s->d[k] = side * (bound - value(p, s, limit, s->x_free, s->y_free));
    s->active[k] = limit, s->side[k] = side, s->lambda[k] = 0.0;
    return factorise(s, k);
}

static int64_t release(struct state *s, int64_t at)
{
    int64_t n = s->n, wide = n + 1, behind = s->k - at - 1;
    s->k--;
    memmove(s->M + at * n, s->M + (at + 1) * n, behind * n * sizeof *s->M);
    memmove(s->d + at, s->d + at + 1, behind * sizeof *s->d);
    memmove(s->lambda + at, s->lambda + at + 1, behind * sizeof *s->lambda);
    memmove(s->active + at, s->active + at + 1, behind * sizeof *s->active);
    memmove(s->side + at, s->side + at + 1, behind * sizeof *s->side);
    for (int64_t i = at; i < s->k; i++) {
        memmove(s->G + i * wide, s->G + (i + 1) * wide, at * sizeof *s->G);
        memmove(s->G + i * wide + at, s->G + (i + 1) * wide + at + 1, (i + 1 - at) * sizeof *s->G);
    }
    return factorise(s, at);
}

/* z = G^-1 z for the first k rows */
static void solve_products(const struct state *s, int64_t k, double *z)
{
    int64_t n = s->n + 1;
    for (int64_t i = 0; i < k; i++)
        z[i] -= dot(i, s->F + i * n, z);
    for (int64_t i = 0; i < k; i++)
        z[i] /= s->F[i * n + i];
    for (int64_t i = k - 1; i >= 0; i--)
        add(i, -z[i], s->F + i * n, z);
}

/* Go along lambda + step (wanted - lambda), or along wanted, until a multiplier vanishes; returns its place, -1
   when none does. */
static int64_t block(struct state *s, int is_direction)
{
    int64_t at = -1;
    double step = INFINITY, flat = 0.0;
    for (int64_t i = 0; is_direction && i < s->k; i++)
        flat = fabs(s->wanted[i]) * FLAT > flat ? fabs(s->wanted[i]) * FLAT : flat;
    for (int64_t i = 0; i < s->k; i++) {
        double slope = is_direction ? s->wanted[i] : s->wanted[i] - s->lambda[i];
        if ((is_direction || s->wanted[i] < 0.0) && slope < -flat && -s->lambda[i] / slope < step)
            step = -s->lambda[i] / slope, at = i;
    }
    for (int64_t i = 0; at >= 0 && i < s->k; i++)
        s->lambda[i] += step * (is_direction ? s->wanted[i] : s->wanted[i] - s->lambda[i]);
    return at;
}

/* Find the most exceeded limit; returns by how much it is exceeded. */
static double worst(const struct program *p, struct state *s, int64_t *limit, int64_t *side)
{
    int64_t count = s->n + s->n_v + 2 * s->n_y;
    double most = -INFINITY;
    evaluate_outputs(p, s, s->x, s->y);
    for (int64_t i = 0; i < count; i++) {
        double z = value(p, s, i, s->x, s->y), above = z - p->u[i], below = p->l[i] - z;
        if (!(above <= most))
            most = above, *limit = i, *side = 1;
        if (!(below <= most))
            most = below, *limit = i, *side = -1;
    }
    return most;
}

static void place(const struct program *p, struct state *s)
{
    int64_t n_v = s->n_v = p->n_u * p->n_b, n = s->n = n_v + p->n_o, n_y = s->n_y = p->n_b * p->n_o;
    double *w = p->work;
    s->active = p->active, s->side = p->active + n + 1;
    s->M = w, w += (n + 1) * n, s->G = w, w += (n + 1) * (n + 1), s->F = w, w += (n + 1) * (n + 1);
    s->d = w, w += n + 1, s->lambda = w, w += n + 1, s->wanted = w, w += n + 1;
    s->x_free = w, w += n, s->x = w, w += n, s->y = w, w += n_y, s->y_free = w;
}

/* Minimise for the gradient q, (n_v,), from the ``count`` limits in ``active`` on; x, (n,),
   is the answer and iterations the number of changes. Returns one of the words above. */
int64_t flexarm_solve_program(
    const struct program *p, const double *q, int64_t cap, int64_t *count, int64_t *iterations, double *x)
{
    struct state s;
    int64_t limit = 0, side = 1, at;
    place(p, &s);
    int64_t warm = *count <= s.n ? *count : 0;
    for (int64_t i = 0; i < s.n_v; i++)
        s.x_free[i] = -q[i];
    forward(p, s.n_v, 0, s.x_free);
    backward(p, s.n_v, s.x_free);
    for (int64_t i = s.n_v; i < s.n; i++)
        s.x_free[i] = -p->price;
    evaluate_outputs(p, &s, s.x_free, s.y_free);
    s.k = 0;
    for (int64_t i = 0; i < warm; i++)
        if (activate(p, &s, s.active[i], s.side[i]) < s.k)
            s.k--; /* depends on the others now */
    for (*iterations = 0; *iterations < cap; ++*iterations) {
        for (int64_t i = 0; i < s.k; i++)
            s.wanted[i] = -s.d[i];
        solve_products(&s, s.k, s.wanted);
        at = block(&s, 0);
        if (at >= 0) {
            if (release(&s, at) < s.k)
                return CAPPED;
            continue;
        }
        memcpy(s.lambda, s.wanted, s.k * sizeof *s.lambda);
        memset(s.x, 0, s.n * sizeof *s.x);
        for (int64_t i = 0; i < s.k; i++)
            add(s.n, -s.lambda[i], s.M + i * s.n, s.x);
        backward(p, s.n_v, s.x);
        add(s.n, 1.0, s.x_free, s.x);
        double most = worst(p, &s, &limit, &side), sum = 0.0;
        *count = s.k;
        for (int64_t i = 0; i < s.n; i++)
            sum += s.x[i];
        for (int64_t i = 0; i < s.n_y; i++)
            sum += s.y[i];
        if (!isfinite(sum))
            return NOT_FINITE;
        if (most <= p->tolerance) {
            memcpy(x, s.x, s.n * sizeof *x);
            return SOLVED;
        }
        if (s.k > s.n)
            return CAPPED;
        if (activate(p, &s, limit, side) == s.k)
            continue;
        for (int64_t i = 0; i + 1 < s.k; i++) /* the new row depends on the others: M' wanted = 0 */
            s.wanted[i] = -s.G[(s.k - 1) * (s.n + 1) + i];
        solve_products(&s, s.k - 1, s.wanted);
        s.wanted[s.k - 1] = 1.0;
        at = block(&s, 1);
        if (at < 0)
            return INFEASIBLE;
        if (release(&s, at) < s.k)
            return CAPPED;
    }
    return CAPPED;
}
