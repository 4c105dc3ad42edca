/* Gauss-Legendre steps of fourth order with their derivatives, and rest on a reference; gauss_steps.py has
 * the equations.
 *
 * Matrices are row-major but those of the generated function, which are column-major.
 */
#include "machine_code.h"

#define STAGES 2
#define ROOT3 1.7320508075688772
static const double NODE[STAGES] = {0.5 - ROOT3 / 6, 0.5 + ROOT3 / 6};
static const double RATE[STAGES][STAGES] = {{0.25, 0.25 - ROOT3 / 6}, {0.25 + ROOT3 / 6, 0.25}};
static const double PLACE[STAGES][STAGES] = /* RATE squared */
    {{0.0625 + 0.0625 - 3.0 / 36, 0.125 - ROOT3 / 12}, {0.125 + ROOT3 / 12, 0.0625 + 0.0625 - 3.0 / 36}};
static const double LAST[STAGES] = {0.25 + ROOT3 / 12, 0.25 - ROOT3 / 12}; /* (1/2, 1/2) RATE */

struct arm {
    int64_t n, n_u;
    double h;
    struct function *forces; /* y, y', y'' -> force (n), its derivatives (n, n) by the three */
    double *work;            /* 2 n (2 n + 1) + 3 n */
};

static void evaluate(const struct arm *g, const double *y, const double *w, const double *a)
{
    struct function *f = g->forces;
    f->arg[0] = y, f->arg[1] = w, f->arg[2] = a;
    f->evaluate(f->arg, f->res, f->iw, f->w, 0);
}

/* Write the equations of both stages about accelerations a, (2 n,), and state s: J (2 n, 2 n) and R with
   columns [residual | by s | by u], of which the first one or all are written. */
static void equations(
    const struct arm *g, double h, const double *s, const double *u, const double *a, int64_t columns, double *J,
    double *R)
{
    int64_t n = g->n, m = STAGES * n;
    double *y = g->work + m * (m + 1), *w = y + n;
    for (int64_t i = 0; i < STAGES; i++) {
        for (int64_t r = 0; r < n; r++) {
            const double *a0 = a + r, *a1 = a + n + r;
            y[r] = s[r] + h * NODE[i] * s[n + r] + h * h * (PLACE[i][0] * *a0 + PLACE[i][1] * *a1);
            w[r] = s[n + r] + h * (RATE[i][0] * *a0 + RATE[i][1] * *a1);
        }
        evaluate(g, y, w, a + i * n);
        double **out = g->forces->res;
        for (int64_t r = 0; r < n; r++) {
            double *row = J + (i * n + r) * m, *right = R + (i * n + r) * columns;
            right[0] = out[0][r] - (r < g->n_u ? u[r] : 0.0);
            for (int64_t c = 0; c < n; c++) {
                double by_y = out[1][c * n + r], by_w = out[2][c * n + r];
                for (int64_t j = 0; j < STAGES; j++)
                    row[j * n + c] = h * h * PLACE[i][j] * by_y + h * RATE[i][j] * by_w;
                row[i * n + c] += out[3][c * n + r];
                if (columns > 1) {
                    right[1 + c] = by_y;
                    right[1 + n + c] = h * NODE[i] * by_y + by_w;
                }
            }
            for (int64_t c = 1 + 2 * n; c < columns; c++)
                right[c] = c - 1 - 2 * n == r ? -1.0 : 0.0;
        }
    }
}

/* One Newton step of every period about its state s, torque u and accelerations a, with derivatives:
   X (N, 2 n, 1 + n_x + n_u): change of a is -X [1; change of s; change of u];
   s+ = A s + B u + r, A (N, n_x, n_x), B (N, n_x, n_u), r (N, n_x). Returns 0 when it cannot. */
int64_t flexarm_linearize_periods(
    const struct arm *g, int64_t N, const double *s, const double *u, const double *a, double *X, double *A,
    double *B, double *r)
{
    int64_t n = g->n, n_x = 2 * n, n_u = g->n_u, m = STAGES * n, columns = 1 + n_x + n_u;
    double h = g->h, *J = g->work;
    for (int64_t k = 0; k < N; k++, s += n_x, u += n_u, a += m, X += m * columns) {
        equations(g, h, s, u, a, columns, J, X);
        if (!eliminate(m, columns, J, X))
            return 0;
        for (int64_t i = 0; i < n; i++) {
            const double *x0 = X + i * columns, *x1 = X + (n + i) * columns;
            double p0 = h * h * LAST[0], p1 = h * h * LAST[1], v = h / 2;
            double y = s[i] + h * s[n + i] + p0 * (a[i] - x0[0]) + p1 * (a[n + i] - x1[0]);
            double w = s[n + i] + v * (a[i] - x0[0] + a[n + i] - x1[0]);
            double *Ay = A + i * n_x, *Aw = A + (n + i) * n_x, *By = B + i * n_u, *Bw = B + (n + i) * n_u;
            for (int64_t j = 0; j < n_x; j++) {
                Ay[j] = (j == i) + (j == n + i) * h - p0 * x0[1 + j] - p1 * x1[1 + j];
                Aw[j] = (j == n + i) - v * (x0[1 + j] + x1[1 + j]);
                y -= Ay[j] * s[j], w -= Aw[j] * s[j];
            }
            for (int64_t j = 0; j < n_u; j++) {
                By[j] = -p0 * x0[1 + n_x + j] - p1 * x1[1 + n_x + j];
                Bw[j] = -v * (x0[1 + n_x + j] + x1[1 + n_x + j]);
                y -= By[j] * u[j], w -= Bw[j] * u[j];
            }
            r[i] = y, r[n + i] = w;
        }
        A += n_x * n_x, B += n_x * n_u, r += n_x;
    }
    return 1;
}

/* Advance s, (n_x,), by h under torque u; a, (2 n,), is the first guess and becomes the
   accelerations. Returns 0 when Newton's iteration does not settle; s is then unchanged. */
int64_t flexarm_advance_period(
    const struct arm *g, double h, double *s, const double *u, double *a, int64_t iterations, double tolerance)
{
    int64_t n = g->n, m = STAGES * n;
    double *J = g->work, *R = J + m * m, change = INFINITY;
    for (int64_t k = 0; k < iterations && !(change <= tolerance); k++) {
        double size = 1.0;
        equations(g, h, s, u, a, 1, J, R);
        if (!eliminate(m, 1, J, R))
            return 0;
        change = 0.0;
        for (int64_t i = 0; i < m; i++) {
            a[i] -= R[i];
            change = isnan(change) || fabs(R[i]) <= change ? change : fabs(R[i]); /* NaN stays */
            size = fabs(a[i]) <= size ? size : fabs(a[i]);
        }
        change /= size;
    }
    if (!(change <= tolerance))
        return 0;
    for (int64_t i = 0; i < n; i++) {
        s[i] += h * s[n + i] + h * h * (LAST[0] * a[i] + LAST[1] * a[n + i]);
        s[n + i] += h / 2 * (a[i] + a[n + i]);
    }
    return 1;
}

/* States without vibration and their torques for references [theta; theta'; theta''], (count, 3 n_u):
   s (count, n_x), of which the other coordinates are the first guess, and u (count, n_u). Returns 0 when
   Newton's iteration does not settle. */
int64_t flexarm_rest(
    const struct arm *g, int64_t count, const double *reference, double *s, double *u, int64_t iterations,
    double tolerance)
{
    int64_t n = g->n, n_u = g->n_u, m = n - n_u;
    double *J = g->work, *R = J + m * m, *a = g->work + 2 * n * (2 * n + 1) + 2 * n;
    for (int64_t k = 0; k < count; k++, reference += 3 * n_u, s += 2 * n, u += n_u) {
        double change = INFINITY;
        memset(a, 0, n * sizeof *a);
        memset(s + n, 0, n * sizeof *s);
        memcpy(s, reference, n_u * sizeof *s);
        memcpy(s + n, reference + n_u, n_u * sizeof *s);
        memcpy(a, reference + 2 * n_u, n_u * sizeof *a);
        for (int64_t i = 0; !(change <= tolerance); i++) {
            double size = 1.0;
            evaluate(g, s, s + n, a);
            double **out = g->forces->res;
            for (int64_t p = 0; p < m; p++) {
                R[p] = out[0][n_u + p];
                for (int64_t q = 0; q < m; q++)
                    J[p * m + q] = out[1][(n_u + q) * n + n_u + p];
            }
            if (i == iterations || !eliminate(m, 1, J, R))
                return 0;
            change = 0.0;
            for (int64_t p = 0; p < m; p++) {
                s[n_u + p] -= R[p];
                change = isnan(change) || fabs(R[p]) <= change ? change : fabs(R[p]);
                size = fabs(s[n_u + p]) <= size ? size : fabs(s[n_u + p]);
            }
            change /= size;
        }
        evaluate(g, s, s + n, a);
        memcpy(u, g->forces->res[0], n_u * sizeof *u);
    }
    return 1;
}
