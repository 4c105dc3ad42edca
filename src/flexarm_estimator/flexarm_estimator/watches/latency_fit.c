/* The tip where it was for every candidate delay, and what a frame says of them; latency_fit.py has the sums. */
#include "machine_code.h"

enum { AXES = 3, NODES = 4 };

struct latency_fit {
    int64_t count;
    const double *candidates; /* growing, (count,) */
    double *sum, *squares;    /* (count, 3), (count,) */
    const double *t, *p;      /* instants, (size,), at least four, and where the tip was: an axis is a row with */
    int64_t size, lead;       /* room for lead */
    double stamp, y[AXES];    /* of a frame, and where it saw the tip */
};

/* Weights of four instants in the cubic polynomial through them. */
static void weigh(const double *t, double at, double *weight)
{
    for (int64_t i = 0; i < NODES; i++) {
        double product = 1.0, scale = 1.0;
        for (int64_t j = 0; j < NODES; j++) {
            product *= j == i ? 1.0 : at - t[j];
            scale *= j == i ? 1.0 : t[i] - t[j];
        }
        weight[i] = product / scale;
    }
}

/* Take a frame; the instants cover all candidates. */
void flexarm_compare_frame(const struct latency_fit *s)
{
    int64_t first = 0;
    for (int64_t i = s->count - 1; i >= 0; i--) { /* later and later */
        double at = s->stamp - s->candidates[i], square = 0.0, weight[NODES];
        while (first < s->size - NODES && s->t[first + 2] < at)
            first++;
        weigh(s->t + first, at, weight);
        for (int64_t axis = 0; axis < AXES; axis++) {
            const double *position = s->p + axis * s->lead + first;
            double residual = s->y[axis];
            for (int64_t j = 0; j < NODES; j++)
                residual -= weight[j] * position[j];
            s->sum[i * AXES + axis] += residual;
            square += residual * residual;
        }
        s->squares[i] += square;
    }
}
