/* What a served model leaves out of the arm's motion; left_out.py and moving_arm.py have the equations.
 *
 * Matrices of generated functions are column-major, as CasADi stores them; W and what is made of it are
 * row-major.
 */
#include "../steps/joint_algebra.h"

/* sum_i z[place_i] (z[scale_i]) column_i: a bilinear function of z without its zero columns; scale is negative
   where there is no second factor. */
struct bilinear {
    int64_t rows, count;
    const double *columns;
    const int64_t *place, *scale;
};

struct left_out {
    int64_t n_x, n_u, n, n_q, n_c, n_y, n_modes;
    const int64_t *modes;      /* places in x, (n_modes,) */
    const double *reach;       /* how far they may be, (n_modes,) */
    const double *origin, *Phi, *free; /* q = origin + Phi xi; Phi without its dependent rows, (n_q, n) */
    const void *loops;         /* of the two functions below; null without loops */
    int64_t (*close)(const void *, double *, double *);
    int64_t (*move)(const void *, int64_t, const double *, double *);
    struct function *motion;   /* q, v -> M (n_q, n_q), h (n_q,) */
    struct function *drift;    /* q, v -> G' v (n_c,); null without loops */
    struct function *rows;     /* q, v, a -> y (n_y,) */
    const struct bilinear *step;   /* [x; u] -> x+ */
    const struct bilinear *served; /* [x+; u] -> [xi''; y] as served, (n + n_y,) */
    const struct bilinear *forces; /* [x+; u] -> forces on xi, (n,) */
    const double *before;      /* [x; u] */
    double *out;               /* [xi''; y] as it is less as it is served, then u */
    double *work;              /* n_x + n_u + 5 n_q + n_c + n (1 + 2 n_q + n) + most columns */
};

struct room {
    double *z;                        /* [x+; u] */
    double *q, *v, *a, *bent, *load;  /* (n_q,) each; bent is what a has without xi'' */
    double *open, *f;                 /* (n_c,), (n,) */
    double *W, *MW, *mass;            /* (n_q, n), (n_q, n), (n, n) */
    double *factors;
};

static struct room divide(const struct left_out *s)
{
    struct room r;
    r.z = s->work;
    r.q = r.z + s->n_x + s->n_u, r.v = r.q + s->n_q, r.a = r.v + s->n_q, r.bent = r.a + s->n_q;
    r.load = r.bent + s->n_q, r.open = r.load + s->n_q, r.f = r.open + s->n_c;
    r.W = r.f + s->n, r.MW = r.W + s->n_q * s->n, r.mass = r.MW + s->n_q * s->n;
    r.factors = r.mass + s->n * s->n;
    return r;
}

static void value(const struct bilinear *b, const double *z, double *factors, double *out)
{
    for (int64_t i = 0; i < b->count; i++)
        factors[i] = z[b->place[i]] * (b->scale[i] < 0 ? 1.0 : z[b->scale[i]]);
    memset(out, 0, b->rows * sizeof *out);
    accumulate(b->rows, b->count, 1.0, factors, 1, b->columns, b->rows, out);
}

static void evaluate(const struct function *f)
{
    f->evaluate(f->arg, f->res, f->iw, f->w, 0);
}

static int are_finite(int64_t count, const double *numbers)
{
    double sum = 0.0;
    for (int64_t i = 0; i < count; i++)
        sum += 0.0 * numbers[i];
    return sum == 0.0;
}

/* q = origin + Phi xi with the loops closed, W = dq/dxi, v = W xi'; 0 where that cannot be. */
static int64_t place(const struct left_out *s, const struct room *r)
{
    const double *xi = r->z, *xi_dot = r->z + s->n;
    for (int64_t i = 0; i < s->n_q; i++) {
        r->q[i] = s->origin[i];
        for (int64_t j = 0; j < s->n; j++)
            r->q[i] += s->Phi[i * s->n + j] * xi[j];
    }
    memcpy(r->W, s->free, s->n_q * s->n * sizeof *r->W);
    if (s->loops && !(s->close(s->loops, r->q, 0) && s->move(s->loops, s->n, 0, r->W)))
        return 0;
    for (int64_t i = 0; i < s->n_q; i++)
        r->v[i] = dot(s->n, r->W + i * s->n, xi_dot);
    return 1;
}

/* bent, the part of v' that is not W xi''; 0 where the pose is singular. */
static int64_t bend(const struct left_out *s, const struct room *r)
{
    memset(r->bent, 0, s->n_q * sizeof *r->bent);
    if (!s->loops)
        return 1;
    s->drift->arg[0] = r->q, s->drift->arg[1] = r->v;
    evaluate(s->drift);
    for (int64_t i = 0; i < s->n_c; i++)
        r->open[i] = -s->drift->res[0][i];
    return s->move(s->loops, 1, r->open, r->bent);
}

/* f becomes xi'' = (W' M W)^-1 (f - W' (h + M bent)); 0 where the mass is singular. */
WIDE static int64_t accelerate(const struct left_out *s, const struct room *r)
{
    int64_t n = s->n, n_q = s->n_q;
    s->motion->arg[0] = r->q, s->motion->arg[1] = r->v;
    evaluate(s->motion);
    const double *M = s->motion->res[0];
    memcpy(r->load, s->motion->res[1], n_q * sizeof *r->load);
    memset(r->MW, 0, n_q * n * sizeof *r->MW);
    for (int64_t j = 0; j < n_q; j++)
        for (int64_t i = 0; i < n_q; i++) {
            double m = M[i + j * n_q], *restrict to = r->MW + i * n;
            if (m == 0.0)
                continue;
            r->load[i] += m * r->bent[j];
            for (int64_t k = 0; k < n; k++)
                to[k] += m * r->W[j * n + k];
        }
    memset(r->mass, 0, n * n * sizeof *r->mass);
    for (int64_t i = 0; i < n_q; i++)
        for (int64_t j = 0; j < n; j++) {
            double w = r->W[i * n + j], *restrict to = r->mass + j * n;
            if (w == 0.0)
                continue;
            r->f[j] -= w * r->load[i];
            for (int64_t k = 0; k < n; k++)
                to[k] += w * r->MW[i * n + k];
        }
    return eliminate(n, 1, r->mass, r->f);
}

static int64_t nothing(const struct left_out *s)
{
    memset(s->out, 0, (s->n + s->n_y) * sizeof *s->out);
    return 1;
}

/* Work out what is left out at the end of a step from ``before``; nothing where the mean is astray or not
   finite. Returns 0 where the loops do not close or the pose is singular. */
int64_t flexarm_left_out(const struct left_out *s)
{
    const double *u = s->before + s->n_x;
    const struct room room = divide(s), *r = &room;
    memcpy(s->out + s->n + s->n_y, u, s->n_u * sizeof *u);
    if (!are_finite(s->n_x + s->n_u, s->before))
        return nothing(s);
    value(s->step, s->before, r->factors, r->z);
    memcpy(r->z + s->n_x, u, s->n_u * sizeof *u);
    for (int64_t i = 0; i < s->n_modes; i++)
        if (fabs(r->z[s->modes[i]]) > s->reach[i])
            return nothing(s);
    value(s->forces, r->z, r->factors, r->f);
    if (!place(s, r) || !bend(s, r) || !accelerate(s, r))
        return 0;
    for (int64_t i = 0; i < s->n_q; i++)
        r->a[i] = r->bent[i] + dot(s->n, r->W + i * s->n, r->f);
    value(s->served, r->z, r->factors, s->out);
    for (int64_t i = 0; i < s->n; i++)
        s->out[i] = r->f[i] - s->out[i];
    if (s->n_y) {
        s->rows->arg[0] = r->q, s->rows->arg[1] = r->v, s->rows->arg[2] = r->a;
        evaluate(s->rows);
        for (int64_t i = 0; i < s->n_y; i++)
            s->out[s->n + i] = s->rows->res[0][i] - s->out[s->n + i];
    }
    return are_finite(s->n + s->n_y, s->out) && are_finite(s->n_q, r->a) ? 1 : nothing(s);
}
