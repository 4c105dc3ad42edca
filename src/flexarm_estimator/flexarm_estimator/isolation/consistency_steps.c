/* One step of a consistency run: the joint step of all data side by side; consistency_run.py has the equations.
 *
 * What comes from NumPy is row-major: a row of data is a column here. Of what is left out the noise is raised.
 */
#include "../joint_algebra.h"

struct run {
    int64_t n, m, columns, hypotheses, inputs;
    double excluded;           /* factor of the noise of a row that is left out */
    double largest;            /* squared sigmas that a datum counts at most */
    const double *Y, *u;       /* (k, m, columns), (k, inputs) */
    const uint8_t *leave_out;  /* (k, m) */
    double *X, *P;             /* (n, columns), (n, n): of the step before, then of this */
    double *Z, *diagonals, *predicted, *variance, *running; /* (k, m, columns), (k, m) three times, (hypotheses,) */
    double *work;              /* lead (lead + n + columns), lead = m + n */
};

/* The matrices of a step: T (lead, n) column by column; V (lead, inputs) and noise (lead, lead) row by row. */
struct matrices {
    const double *T, *V, *noise;
};

/* J = T P T' + noise, lower triangle, and mean = T X + V u, whose rows are the data of one row of T. */
static void predict(
    const struct run *s, const struct matrices *step, const double *u, double *J, double *mean, double *moved)
{
    int64_t n = s->n, lead = s->m + n, c = s->columns;
    for (int64_t i = 0; i < lead; i++) { /* a column of moved is row i of T P */
        double *row = moved + i * n, *data = mean + i * c;
        memset(row, 0, n * sizeof *row);
        accumulate(n, n, 1.0, step->T + i, lead, s->P, n, row);
        memset(data, 0, c * sizeof *data);
        accumulate(c, n, 1.0, step->T + i, lead, s->X, c, data);
        double drive = dot(s->inputs, step->V + i * s->inputs, u);
        for (int64_t j = 0; j < s->hypotheses; j++)
            data[j] += drive;
    }
    for (int64_t j = 0; j < lead; j++) {
        double *column = J + j * lead + j;
        memcpy(column, step->noise + j * lead + j, (lead - j) * sizeof *column);
        accumulate(lead - j, n, 1.0, moved + j * n, 1, step->T + j, lead, column);
    }
}

/* z = L_y^-1 (Y - mean): forward, all data of a row at once; nothing is new where a row is left out. */
static void whiten(
    const struct run *s, const double *J, const double *Y, const uint8_t *out, const double *mean, double *Z)
{
    int64_t m = s->m, lead = m + s->n, c = s->columns;
    for (int64_t i = 0; i < m; i++) {
        double *z = Z + i * c;
        for (int64_t j = 0; j < c; j++)
            z[j] = out[i] ? 0.0 : Y[i * c + j] - mean[i * c + j];
        accumulate(c, i, -1.0, J + i, lead, Z, c, z);
        for (int64_t j = 0; j < c; j++)
            z[j] /= J[i + i * lead];
        for (int64_t j = 0; j < s->hypotheses; j++)
            s->running[j] += fmin(z[j] * z[j], s->largest);
    }
}

/* X+ = mean_x + L_xy z, P+ = L_x L_x' */
static void condition(const struct run *s, const double *J, const double *mean, const double *Z)
{
    int64_t n = s->n, m = s->m, lead = m + n, c = s->columns;
    for (int64_t i = 0; i < n; i++) {
        double *x = s->X + i * c;
        memcpy(x, mean + (m + i) * c, c * sizeof *x);
        accumulate(c, m, 1.0, J + m + i, lead, Z, c, x);
    }
    const double *L_x = J + m + m * lead;
    for (int64_t j = 0; j < n; j++) {
        double *column = s->P + j * n;
        memset(column + j, 0, (n - j) * sizeof *column);
        accumulate(n - j, j + 1, 1.0, L_x + j, lead, L_x + j, lead, column + j);
        for (int64_t i = j + 1; i < n; i++)
            s->P[j + i * n] = column[i];
    }
}

/* Compute step k; returns 0 when rounding forbids it. */
int64_t flexarm_consistency_step(const struct run *s, int64_t k, const struct matrices *step)
{
    int64_t m = s->m, lead = m + s->n, c = s->columns;
    double *J = s->work, *moved = J + lead * lead, *mean = moved + lead * s->n;
    const uint8_t *out = s->leave_out + k * m;
    predict(s, step, s->u + k * s->inputs, J, mean, moved);
    for (int64_t i = 0; i < m; i++) {
        double *variance = J + i + i * lead;
        s->variance[k * m + i] = *variance;
        s->predicted[k * m + i] = mean[i * c];
        *variance *= out[i] ? s->excluded : 1.0;
    }
    if (!factorise(lead, lead, J))
        return 0;
    whiten(s, J, s->Y + k * m * c, out, mean, s->Z + k * m * c);
    for (int64_t i = 0; i < m; i++)
        s->diagonals[k * m + i] = J[i + i * lead];
    condition(s, J, mean, s->Z + k * m * c);
    return 1;
}
