/* The program of a horizon in its torques alone; condensing.py has the equations. Matrices are row-major. */
#include "machine_code.h"

struct horizon {
    int64_t n_x, n_u, N, n_v, n_s;
    const int64_t *block;    /* of each period, (N) */
    const double *unit;      /* of the torques, (n_u) */
    const double *Q, *P, *C; /* (n_x, n_x), (n_x + n_u, n_x + n_u), (n_s, n_x) */
    const double *R, *S;     /* (n_u, n_u) */
    const double *A, *B, *r; /* s+ = A s + B u + r: (N, n_x, n_x), (N, n_x, n_u), (N, n_x) */
    double *G;               /* states per torque, (N, n_x, n_v) */
    double *W;               /* 2 n_x n_v */
};

/* a[j] += sum_k f[k stride] b[k lead + j]; four rows at a time are fastest, rows without weight are left out */
WIDE static void accumulate(
    int64_t count, int64_t terms, const double *restrict f, int64_t stride, const double *restrict b, int64_t lead,
    double *restrict a)
{
    int64_t k = 0;
    for (; k + 3 < terms; k += 4, b += 4 * lead, f += 4 * stride) {
        const double *b1 = b + lead, *b2 = b1 + lead, *b3 = b2 + lead;
        double f0 = f[0], f1 = f[stride], f2 = f[2 * stride], f3 = f[3 * stride];
        if (f0 == 0.0 && f1 == 0.0 && f2 == 0.0 && f3 == 0.0)
            continue;
        for (int64_t j = 0; j < count; j++)
            a[j] += f0 * b[j] + f1 * b1[j] + f2 * b2[j] + f3 * b3[j];
    }
    for (; k < terms; k++, b += lead, f += stride) {
        double f0 = f[0];
        if (f0 == 0.0)
            continue;
        for (int64_t j = 0; j < count; j++)
            a[j] += f0 * b[j];
    }
}

static double dot(int64_t n, const double *a, const double *b)
{
    double sum = 0.0;
    for (int64_t i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

static int ends_block(const struct horizon *p, int64_t k)
{
    return k + 1 == p->N || p->block[k + 1] != p->block[k];
}

/* States per torque, and the rows C G of the periods that end a block, (blocks n_s, n_v). */
static void propagate(const struct horizon *p, double *rows)
{
    int64_t n_x = p->n_x, n_u = p->n_u, n_v = p->n_v;
    for (int64_t k = 0; k < p->N; k++) {
        const double *A = p->A + k * n_x * n_x, *B = p->B + k * n_x * n_u;
        double *G = p->G + k * n_x * n_v;
        int64_t begun = k ? n_u * (p->block[k - 1] + 1) : 0, at = n_u * p->block[k], until = at + n_u;
        for (int64_t i = 0; i < n_x; i++) {
            memset(G + i * n_v, 0, until * sizeof *G);
            if (k)
                accumulate(begun, n_x, A + i * n_x, 1, G - n_x * n_v, n_v, G + i * n_v);
            for (int64_t j = 0; j < n_u; j++)
                G[i * n_v + at + j] += B[i * n_u + j] * p->unit[j];
        }
        for (int64_t i = 0; ends_block(p, k) && i < p->n_s; i++, rows += n_v) {
            memset(rows, 0, n_v * sizeof *rows);
            accumulate(until, n_x, p->C + i * n_x, 1, G, n_v, rows);
        }
    }
}

/* Hessian of the torques, (n_v, n_v), of which the lower triangle holds the constant part when it comes. */
void flexarm_condense(const struct horizon *p, double weight, double *H, double *rows)
{
    int64_t n_x = p->n_x, n_u = p->n_u, n_v = p->n_v, n_a = n_x + n_u;
    double *W = p->W, *next = W + n_x * n_v, *swap;
    const double *G = p->G + (p->N - 1) * n_x * n_v, *P_u = p->P + n_x * n_a;
    propagate(p, rows);
    memset(W, 0, n_x * n_v * sizeof *W);
    for (int64_t i = 0; i < n_x; i++) {
        accumulate(n_v, n_x, p->P + i * n_a, 1, G, n_v, W + i * n_v);
        for (int64_t j = 0; j < n_u; j++)
            W[i * n_v + n_v - n_u + j] += p->P[i * n_a + n_x + j] * p->unit[j];
    }
    for (int64_t i = 0; i < n_u; i++) {
        double *row = H + (n_v - n_u + i) * n_v;
        memset(next, 0, n_v * sizeof *next);
        accumulate(n_v, n_x, P_u + i * n_a, 1, G, n_v, next);
        for (int64_t j = 0; j < n_v; j++)
            row[j] += weight * p->unit[i] * next[j];
    }
    for (int64_t k = p->N - 1; k >= 0; k--) {
        const double *A = p->A + k * n_x * n_x, *B = p->B + k * n_x * n_u;
        int64_t at = n_u * p->block[k], begun = k ? n_u * (p->block[k - 1] + 1) : 0;
        for (int64_t i = 0; i < n_u; i++) {
            double *row = H + (at + i) * n_v;
            memset(next, 0, (at + n_u) * sizeof *next);
            accumulate(at + n_u, n_x, B + i, n_u, W, n_v, next);
            for (int64_t j = 0; j < at + n_u; j++)
                row[j] += weight * p->unit[i] * next[j];
        }
        if (k == 0)
            break;
        G -= n_x * n_v;
        for (int64_t i = 0; i < n_x; i++) {
            memset(next + i * n_v, 0, begun * sizeof *next);
            accumulate(begun, n_x, p->Q + i * n_x, 1, G, n_v, next + i * n_v);
            accumulate(begun, n_x, A + i, n_x, W, n_v, next + i * n_v);
        }
        swap = W, W = next, next = swap;
    }
    for (int64_t i = 0; i < n_v; i++)
        for (int64_t j = 0; j < i; j++)
            H[j * n_v + i] = H[i * n_v + j];
}

/* Without torques of its own: states free (N + 1, n_x) from s_0 under d, outputs C s where blocks end
   (blocks n_s), and the gradient q, (n_v,), of the cost whose pulls are Q s_r, (N + 1, n_x), and R w_r, (N, n_u). */
void flexarm_respond(
    const struct horizon *p, double weight, const double *s_0, const double *d, const double *before,
    const double *pull_s, const double *pull_u, double *free, double *outputs, double *q)
{
    int64_t n_x = p->n_x, n_u = p->n_u, N = p->N, n_a = n_x + n_u;
    double *adjoint = p->W, *next = adjoint + n_x, *swap;
    memcpy(free, s_0, n_x * sizeof *free);
    for (int64_t k = 0; k < N; k++) {
        const double *s = free + k * n_x;
        double *ahead = free + (k + 1) * n_x;
        for (int64_t i = 0; i < n_x; i++)
            ahead[i] = p->r[k * n_x + i] + dot(n_x, p->A + (k * n_x + i) * n_x, s)
                       + dot(n_u, p->B + (k * n_x + i) * n_u, d);
        for (int64_t i = 0; ends_block(p, k) && i < p->n_s; i++)
            *outputs++ = dot(n_x, p->C + i * n_x, ahead);
    }
    const double *end = free + N * n_x;
    memset(q, 0, p->n_v * sizeof *q);
    for (int64_t i = 0; i < n_x; i++)
        adjoint[i] = dot(n_x, p->P + i * n_a, end) - pull_s[N * n_x + i];
    for (int64_t k = N - 1; k >= 0; k--) {
        const double *A = p->A + k * n_x * n_x, *B = p->B + k * n_x * n_u;
        for (int64_t i = 0; i < n_u; i++) {
            double gradient = -pull_u[k * n_u + i];
            if (k == N - 1)
                gradient += dot(n_x, p->P + (n_x + i) * n_a, end);
            if (k == 0)
                gradient -= dot(n_u, p->S + i * n_u, before);
            for (int64_t j = 0; j < n_x; j++)
                gradient += B[j * n_u + i] * adjoint[j];
            q[n_u * p->block[k] + i] += weight * p->unit[i] * gradient;
        }
        if (k == 0)
            break;
        for (int64_t i = 0; i < n_x; i++)
            next[i] = dot(n_x, p->Q + i * n_x, free + k * n_x) - pull_s[k * n_x + i];
        accumulate(n_x, n_x, adjoint, 1, A, n_x, next);
        swap = adjoint, adjoint = next, next = swap;
    }
}

/* Go to the solution: states s and torques u = (those of the blocks v) + d become those of the program, the
   stages' accelerations a follow by X; end, (n_x,), is the state behind the horizon. */
void flexarm_expand(
    const struct horizon *p, const double *v, const double *d, const double *s_0, const double *X, double *s,
    double *u, double *a, double *end)
{
    int64_t n_x = p->n_x, n_u = p->n_u, columns = 1 + n_x + n_u;
    double *now = p->W, *change = now + n_x;
    memcpy(end, s_0, n_x * sizeof *end);
    for (int64_t k = 0; k < p->N; k++, s += n_x, u += n_u, a += n_x, X += n_x * columns) {
        memcpy(now, end, n_x * sizeof *now);
        change[0] = 1.0;
        for (int64_t i = 0; i < n_x; i++) {
            change[1 + i] = now[i] - s[i];
            s[i] = now[i];
        }
        for (int64_t i = 0; i < n_u; i++) {
            double torque = p->unit[i] * v[n_u * p->block[k] + i] + d[i];
            change[1 + n_x + i] = torque - u[i];
            u[i] = torque;
        }
        for (int64_t i = 0; i < n_x; i++) {
            a[i] -= dot(columns, X + i * columns, change);
            end[i] = p->r[k * n_x + i] + dot(n_x, p->A + (k * n_x + i) * n_x, now)
                     + dot(n_u, p->B + (k * n_x + i) * n_u, u);
        }
    }
}
