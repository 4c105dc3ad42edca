/* Steps of a consistency run: the joint steps of all data side by side; consistency_run.py has the equations.
 *
 * What comes from NumPy is row-major: a row of data is a column here. Of what is left out the noise is raised.
 */
#include "../steps/joint_algebra.h"

struct run {
    int64_t steps, n, m, columns, hypotheses, inputs;
    int64_t kept;              /* steps of which z is kept: all, or the newest alone */
    double excluded;           /* factor of the noise of a row that is left out */
    double largest;            /* squared sigmas that a datum counts at most */
    const double *y;           /* what was said, NaN where nothing, (steps, m) */
    const uint8_t *leave_out;  /* (steps, m) */
    const int64_t *source;     /* of every row under every hypothesis, (m, hypotheses) */
    const double *sign;        /* the same */
    const double *offsets;     /* a constant and half of a ramp for every row, (m, 2); those columns come last */
    double *block;             /* of the arrays of struct room, one behind the other in its order */
};

struct room {
    double *u;                 /* (steps, inputs) */
    double *X, *P;             /* (n, columns), (n, n): of the step before, then of this */
    double *x;                 /* of the hypothesis that explains best so far, (n,) */
    double *Z;                 /* (kept, m, columns) */
    double *predicted, *variance; /* (steps, m) twice */
    double *misfit, *log_det;  /* sums by halves of the window, (2, hypotheses), (2,) */
    double *squares, *used;    /* sum of squared innovations over their variance, number of them, (m,) twice */
    double *work;              /* lead (lead + n + columns), lead = m + n */
};

/* The matrices of a step: T (lead, n) column by column; V (lead, inputs) and noise (lead, lead) row by row. */
struct matrices {
    const double *T, *V, *noise;
};

static struct room enter(const struct run *s)
{
    struct room r;
    r.u = s->block;
    r.X = r.u + s->steps * s->inputs;
    r.P = r.X + s->n * s->columns;
    r.x = r.P + s->n * s->n;
    r.Z = r.x + s->n;
    r.predicted = r.Z + s->kept * s->m * s->columns;
    r.variance = r.predicted + s->steps * s->m;
    r.misfit = r.variance + s->steps * s->m;
    r.log_det = r.misfit + 2 * s->hypotheses;
    r.squares = r.log_det + 2;
    r.used = r.squares + s->m;
    r.work = r.used + s->m;
    return r;
}

/* J = T P T' + noise, lower triangle */
static void spread(const struct run *s, const struct matrices *step, const double *P, double *J, double *moved)
{
    int64_t n = s->n, lead = s->m + n;
    for (int64_t i = 0; i < lead; i++) { /* a column of moved is row i of T P */
        double *row = moved + i * n;
        memset(row, 0, n * sizeof *row);
        accumulate(n, n, 1.0, step->T + i, lead, P, n, row);
    }
    for (int64_t j = 0; j < lead; j++) {
        double *column = J + j * lead + j;
        memcpy(column, step->noise + j * lead + j, (lead - j) * sizeof *column);
        accumulate(lead - j, n, 1.0, moved + j * n, 1, step->T + j, lead, column);
    }
}

/* mean = T X + V u, whose rows are the data of one row of T */
static void move(const struct run *s, const struct matrices *step, const double *u, const double *X, double *mean)
{
    int64_t n = s->n, lead = s->m + n, c = s->columns;
    for (int64_t i = 0; i < lead; i++) {
        double *data = mean + i * c, drive = dot(s->inputs, step->V + i * s->inputs, u);
        memset(data, 0, c * sizeof *data);
        accumulate(c, n, 1.0, step->T + i, lead, X, c, data);
        for (int64_t j = 0; j < s->hypotheses; j++)
            data[j] += drive;
    }
}

/* Row i of the data of step k: what it would have said were a hypothesis true, then the offsets. */
static void arrange(const struct run *s, int64_t k, int64_t i, double *data)
{
    const double *y = s->y + k * s->m, *sign = s->sign + i * s->hypotheses;
    const int64_t *source = s->source + i * s->hypotheses;
    for (int64_t j = 0; j < s->hypotheses; j++)
        data[j] = isnan(y[source[j]]) ? 0.0 : sign[j] * y[source[j]];
    if (s->columns == s->hypotheses)
        return;
    memset(data + s->hypotheses, 0, (s->columns - s->hypotheses) * sizeof *data);
    double *offset = data + s->hypotheses + 2 * i;
    offset[0] = s->offsets[2 * i];
    offset[1] = s->offsets[2 * i + 1] * (2.0 * (double)k / (double)(s->steps - 1) - 1.0);
}

/* z = L_y^-1 (Y - mean): forward, all data of a row at once; nothing is new where a row is left out. */
static void whiten(const struct run *s, int64_t k, const double *J, const double *mean, double *Z, double *misfit)
{
    int64_t m = s->m, lead = m + s->n, c = s->columns;
    for (int64_t i = 0; i < m; i++) {
        double *z = Z + i * c, scale = 1.0 / J[i + i * lead];
        if (s->leave_out[k * m + i])
            memset(z, 0, c * sizeof *z);
        else {
            arrange(s, k, i, z);
            for (int64_t j = 0; j < c; j++)
                z[j] -= mean[i * c + j];
        }
        accumulate(c, i, -1.0, J + i, lead, Z, c, z);
        for (int64_t j = 0; j < c; j++)
            z[j] *= scale;
        for (int64_t j = 0; j < s->hypotheses; j++) {
            double square = z[j] * z[j];
            misfit[j] += square < s->largest ? square : s->largest;
        }
    }
}

/* X+ = mean_x + L_xy z, P+ = L_x L_x' */
static void condition(const struct run *s, const struct room *r, const double *J, const double *mean, const double *Z)
{
    int64_t n = s->n, m = s->m, lead = m + n, c = s->columns;
    for (int64_t i = 0; i < n; i++) {
        double *x = r->X + i * c;
        memcpy(x, mean + (m + i) * c, c * sizeof *x);
        accumulate(c, m, 1.0, J + m + i, lead, Z, c, x);
    }
    const double *L_x = J + m + m * lead;
    for (int64_t j = 0; j < n; j++) {
        double *column = r->P + j * n;
        memset(column + j, 0, (n - j) * sizeof *column);
        accumulate(n - j, j + 1, 1.0, L_x + j, lead, L_x + j, lead, column + j);
        for (int64_t i = j + 1; i < n; i++)
            r->P[j + i * n] = column[i];
    }
}

/* Note what is predicted for row i of step k, and how it is met. */
static void compare(const struct run *s, const struct room *r, int64_t k, int64_t i, double predicted, double variance)
{
    int64_t at = k * s->m + i;
    r->predicted[at] = predicted;
    r->variance[at] = variance;
    if (!s->leave_out[at]) {
        r->squares[i] += (s->y[at] - predicted) * (s->y[at] - predicted) / variance;
        r->used[i] += 1.0;
    }
}

/* Compute step k; returns 0 when rounding forbids it. */
static int64_t compute(const struct run *s, const struct room *r, int64_t k, const struct matrices *step)
{
    int64_t m = s->m, lead = m + s->n, half = k >= (s->steps + 1) / 2;
    double *J = r->work, *moved = J + lead * lead, *mean = moved + lead * s->n;
    double *Z = r->Z + (s->kept == s->steps ? k * m * s->columns : 0), log_det = 0.0;
    spread(s, step, r->P, J, moved);
    move(s, step, r->u + k * s->inputs, r->X, mean);
    for (int64_t i = 0; i < m; i++) {
        compare(s, r, k, i, mean[i * s->columns], J[i + i * lead]);
        J[i + i * lead] *= s->leave_out[k * m + i] ? s->excluded : 1.0;
    }
    if (!factorise(lead, lead, J))
        return 0;
    for (int64_t i = 0; i < m; i++) {
        double usual = s->leave_out[k * m + i] ? log(s->excluded * r->variance[k * m + i]) : 0.0;
        log_det += 2.0 * log(J[i + i * lead]) - usual;
    }
    r->log_det[half] += log_det;
    whiten(s, k, J, mean, Z, r->misfit + half * s->hypotheses);
    condition(s, r, J, mean, Z);
    return 1;
}

/* x of the hypothesis that explains best so far */
static void pick_best(const struct run *s, const struct room *r)
{
    int64_t best = 0, count = s->hypotheses;
    for (int64_t j = 1; j < count; j++)
        if (r->misfit[j] + r->misfit[count + j] < r->misfit[best] + r->misfit[count + best])
            best = j;
    for (int64_t i = 0; i < s->n; i++)
        r->x[i] = r->X[i * s->columns + best];
}

/* Compute some steps with the same matrices; returns 0 when rounding forbids it. */
int64_t flexarm_consistency_steps(const struct run *s, int64_t first, int64_t count, const struct matrices *step)
{
    struct room r = enter(s);
    for (int64_t k = first; k < first + count; k++)
        if (!compute(s, &r, k, step))
            return 0;
    pick_best(s, &r);
    return 1;
}

/* The largest mean square of a row of innovations over their variance; the largest gain of a hypothesis. */
void flexarm_consistency_extremes(const struct run *s, double *found)
{
    struct room r = enter(s);
    double used = 0.0, well = r.misfit[0] + r.misfit[s->hypotheses], marginal = 0.0, most = -INFINITY;
    for (int64_t i = 0; i < s->m; i++) {
        used += r.used[i];
        marginal = fmax(marginal, r.squares[i] / fmax(r.used[i], 1.0));
    }
    for (int64_t j = 1; j < s->hypotheses; j++) {
        double misfit = r.misfit[j] + r.misfit[s->hypotheses + j];
        most = fmax(most, (well - misfit) / fmax(misfit / fmax(used, 1.0), 1.0));
    }
    found[0] = marginal, found[1] = most;
}

/* Leave out, (k, m), what was not said, NaN, and all that a row said that repeats its last value too often, of
   which there are repeated, (m,), zeros before; heard, (m,): rows of which something is left. */
void flexarm_survey(
    int64_t k, int64_t m, double most, const double *restrict y, uint8_t *restrict leave_out,
    uint8_t *restrict heard, double *restrict repeated)
{
    for (int64_t at = m; at < k * m; at += m)
        for (int64_t i = 0; i < m; i++)
            repeated[i] += y[at + i] == y[at + i - m] ? 1.0 : 0.0;
    memset(heard, 0, m);
    for (int64_t at = 0; at < k * m; at += m)
        for (int64_t i = 0; i < m; i++) {
            uint8_t out = leave_out[at + i] | (y[at + i] != y[at + i]) | (repeated[i] > most);
            leave_out[at + i] = out;
            heard[i] |= !out;
        }
}
