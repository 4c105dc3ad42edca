/* The tip at one state: pose, Jacobian, twist and covariances; tip.py has the equations.
 *
 * Matrices of the model are column-major, as CasADi stores them; what goes out is row-major.
 */
#include "machine_code.h"

enum { AXES = 3, RATES = 6, POSE = 16, BLOCK = RATES * RATES };

static const double SMALL = 1e-8, BLUNT = -0.9; /* as in rotation_log.py */

struct tip {
    int64_t n_q, n, n_x;
    const double *origin, *Phi;        /* q = origin + Phi xi, (n_q,), (n_q, n) */
    struct function *pose, *jacobian;  /* q -> T (4, 4); q -> J (6, n_q) */
    const void *loops;                 /* of the two functions below; null without loops */
    int64_t (*close)(const void *, double *, double *);
    int64_t (*follow)(const void *, int64_t, double *); /* where the loops were closed last */
    double *q, *J_q, *J, *moved;       /* (n_q,), (6, n_q), (6, n) row-major, (n,) */
    const double *x, *P;               /* the state */
    const double *y;                   /* a measured pose, [position; rotation vector] */
    double *placed;                    /* T */
    double *nu;                        /* from there to the measured pose */
    double *record;                    /* [T; twist; cov_pose; cov_twist; x; P] */
    double variance;                   /* of the position */
};

static const double *evaluate(struct function *f, const double *at)
{
    f->arg[0] = at;
    f->evaluate(f->arg, f->res, f->iw, f->w, 0);
    return f->res[0];
}

/* Pose (4, 4); 0 where the loops do not close. */
int64_t flexarm_place_tip(const struct tip *s)
{
    memcpy(s->q, s->origin, s->n_q * sizeof *s->q);
    for (int64_t j = 0; j < s->n; j++)
        for (int64_t i = 0; i < s->n_q; i++)
            s->q[i] += s->Phi[i + j * s->n_q] * s->x[j];
    if (s->loops && !s->close(s->loops, s->q, 0))
        return 0;
    const double *columns = evaluate(s->pose, s->q);
    for (int64_t i = 0; i < POSE; i++)
        s->placed[i] = columns[i / 4 + i % 4 * 4];
    return 1;
}

/* Where xi = gain y + constant, (n, m) row-major and (n,), is worked out into x. */
struct sight {
    const struct tip *tip;
    int64_t m;
    const double *gain, *constant, *y;
    double *x;
};

/* Pose of the tip there; 0 where the loops do not close. */
int64_t flexarm_see_tip(const struct sight *s)
{
    struct tip there = *s->tip;
    there.x = s->x;
    for (int64_t i = 0; i < there.n; i++) {
        s->x[i] = s->constant[i];
        for (int64_t j = 0; j < s->m; j++)
            s->x[i] += s->gain[i * s->m + j] * s->y[j];
    }
    return flexarm_place_tip(&there);
}

/* Pose, and the Jacobian by xi in s->J; 0 where the loops do not close. */
int64_t flexarm_locate_tip(const struct tip *s)
{
    if (!flexarm_place_tip(s))
        return 0;
    memcpy(s->J_q, evaluate(s->jacobian, s->q), RATES * s->n_q * sizeof *s->J_q);
    if (s->loops && !s->follow(s->loops, RATES, s->J_q))
        return 0;
    for (int64_t j = 0; j < s->n; j++) {
        double column[RATES] = {0.0};
        for (int64_t i = 0; i < s->n_q; i++)
            for (int64_t k = 0; k < RATES; k++)
                column[k] += s->J_q[k + i * RATES] * s->Phi[i + j * s->n_q];
        for (int64_t k = 0; k < RATES; k++)
            s->J[k * s->n + j] = column[k];
    }
    return 1;
}

/* Matrix of a rotation vector (Rodrigues), row-major. */
static void turn(const double *phi, double *E)
{
    double x = phi[0], y = phi[1], z = phi[2], angle = sqrt(x * x + y * y + z * z), c = cos(angle);
    double a = angle > SMALL ? sin(angle) / angle : 1.0, b = angle > SMALL ? (1.0 - c) / (angle * angle) : 0.5;
    E[0] = c + b * x * x, E[1] = b * x * y - a * z, E[2] = b * x * z + a * y;
    E[3] = b * x * y + a * z, E[4] = c + b * y * y, E[5] = b * y * z - a * x;
    E[6] = b * x * z - a * y, E[7] = b * y * z + a * x, E[8] = c + b * z * z;
}

/* Jacobian, and the innovation [p - p(x); log(R R(x)')] of the measured pose; 0 where the loops do not close, or
   where that is nearly half a turn, whose axis is found in another way. */
int64_t flexarm_compare_pose(const struct tip *s)
{
    double E[AXES * AXES], M[AXES][AXES] = {{0.0}};
    if (!flexarm_locate_tip(s))
        return 0;
    turn(s->y + AXES, E);
    for (int64_t i = 0; i < AXES; i++)
        for (int64_t j = 0; j < AXES; j++)
            for (int64_t k = 0; k < AXES; k++)
                M[i][j] += E[i * AXES + k] * s->placed[j * 4 + k];
    double cosine = 0.5 * (M[0][0] + M[1][1] + M[2][2] - 1.0);
    if (!(cosine >= BLUNT)) /* also when it is NaN */
        return 0;
    double axis[AXES] = {0.5 * (M[2][1] - M[1][2]), 0.5 * (M[0][2] - M[2][0]), 0.5 * (M[1][0] - M[0][1])};
    double sine = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    double scale = sine < SMALL ? 1.0 : atan2(sine, cosine) / sine;
    for (int64_t k = 0; k < AXES; k++) {
        s->nu[k] = s->y[k] - s->placed[k * 4 + 3];
        s->nu[AXES + k] = scale * axis[k];
    }
    return 1;
}

/* J P J' of a block of P on its diagonal, from ``at`` on; returns the sum of its diagonal. */
static double spread(const struct tip *s, int64_t at, double *cov)
{
    double sum = 0.0, *restrict moved = s->moved;
    int64_t n = s->n;
    for (int64_t k = 0; k < RATES; k++) {
        const double *row = s->J + k * n, *P = s->P + at * s->n_x + at;
        for (int64_t j = 0; j < n; j++)
            moved[j] = 0.0;
        for (int64_t i = 0; i < n; i++, P += s->n_x)
            for (int64_t j = 0; j < n; j++)
                moved[j] += row[i] * P[j];
        for (int64_t l = 0; l <= k; l++) {
            double value = 0.0;
            for (int64_t j = 0; j < n; j++)
                value += moved[j] * s->J[l * n + j];
            cov[k * RATES + l] = cov[l * RATES + k] = value;
        }
        sum += cov[k * RATES + k];
    }
    return sum;
}

/* The whole record, and the variance of the position; 0 where the tip is not finite, or not known. */
int64_t flexarm_describe_tip(struct tip *s)
{
    double *twist = s->record + POSE, *cov_pose = twist + RATES, *cov_twist = cov_pose + BLOCK;
    double *x = cov_twist + BLOCK, *P = x + s->n_x;
    memcpy(x, s->x, s->n_x * sizeof *x);
    memcpy(P, s->P, s->n_x * s->n_x * sizeof *P);
    for (int64_t k = 0; k < POSE + RATES + 2 * BLOCK; k++)
        s->record[k] = NAN; /* what is told where the loops do not close */
    if (!flexarm_locate_tip(s))
        return 0;
    memcpy(s->record, s->placed, POSE * sizeof *s->placed);
    double sum = spread(s, 0, cov_pose) + spread(s, s->n, cov_twist);
    for (int64_t k = 0; k < RATES; k++) {
        twist[k] = 0.0;
        for (int64_t j = 0; j < s->n; j++)
            twist[k] += s->J[k * s->n + j] * s->x[s->n + j];
        sum += twist[k];
    }
    for (int64_t i = 0; i < POSE; i++)
        sum += s->record[i];
    s->variance = cov_pose[0] + cov_pose[RATES + 1] + cov_pose[2 * RATES + 2];
    return isfinite(sum) ? 1 : 0;
}
