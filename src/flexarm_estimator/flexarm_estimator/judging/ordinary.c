/* Innovations that nothing speaks against: judged and remembered, all sensors of an instant in one call.
 *
 * gate.py, short_term.py, repeats.py and watches/mean_shift.py have the reasons; the same operations in the same order, so
 * that the bits are the same. What is out of the ordinary is left to them, untouched.
 */
#include <math.h>
#include <stdint.h>

struct rules {
    int64_t early;
    double fast, slow, factor, outlier2, quiet; /* of the test of the mean */
    double memory, most, usual_min;             /* of what is usual */
};

struct mean_test {
    int64_t m, count, since;
    double score, onset;
    double *least, *mean, *square, *low, *high;
};

struct memory {
    struct mean_test *test;
    double *reference, *values, *predicted, *still, *said, *step;
    int64_t scanned, repeats, held, zigzags, leaps;
    double since, threshold, biased, jump, limit, usual2, last, fastest;
};

/* The prediction lately: its lowest and highest value in every channel. */
static void watch_swing(struct mean_test *test, const double *nu, const double *y)
{
    for (int64_t i = 0; i < test->m; i++) {
        double predicted = y[i] - nu[i];
        test->low[i] = !test->since || predicted < test->low[i] ? predicted : test->low[i];
        test->high[i] = !test->since || predicted > test->high[i] ? predicted : test->high[i];
    }
    test->since++;
}

static void add(const struct rules *rules, struct mean_test *test, double t, const double *nu, const double *y)
{
    double worst = 0.0;
    int is_early = test->count < rules->early;
    double slow = is_early ? 1.0 / (double)(test->count + 1) : rules->slow;
    for (int64_t i = 0; i < test->m; i++) {
        double usual = test->square[i], value = nu[i], square = value * value;
        if (square > rules->outlier2 * usual && !is_early) {
            square = rules->outlier2 * usual;
            value = copysign(sqrt(square), value);
        }
        double mean = test->mean[i] + rules->fast * (value - test->mean[i]);
        test->mean[i] = mean;
        if (mean * mean > worst * usual)
            worst = mean * mean / usual;
        usual += slow * (square - usual);
        test->square[i] = usual > test->least[i] ? usual : test->least[i];
    }
    test->count += is_early;
    test->score = is_early ? 0.0 : sqrt(rules->factor * worst);
    if (test->score < rules->quiet)
        test->onset = t, test->since = 0;
    else
        watch_swing(test, nu, y);
}

/* Values that go to and fro by more than their noise while the prediction is at rest. */
static void note_zigzag(struct memory *past, const double *nu, const double *y)
{
    int is_at_rest = 1, is_zigzag = 0;
    for (int64_t i = 0; i < past->test->m; i++) {
        double predicted = y[i] - nu[i], step = y[i] - past->said[i], before = past->step[i];
        double noise = 2.0 * past->still[i];
        if (!(fabs(predicted - past->predicted[i]) <= past->still[i]))
            is_at_rest = 0;
        if (step * before < 0.0 && fabs(step) >= noise && fabs(before) >= noise)
            is_zigzag = 1;
        past->reference[i] = nu[i], past->predicted[i] = predicted, past->said[i] = y[i], past->step[i] = step;
    }
    past->zigzags += is_at_rest && is_zigzag;
}

static void remember(
    const struct rules *rules, struct memory *past, double t, const double *nu, const double *y, double z)
{
    note_zigzag(past, nu, y);
    add(rules, past->test, t, nu, y);
    double most = rules->most * past->limit, counted = z < most ? z : most;
    past->usual2 += rules->memory * (counted * counted - past->usual2);
    double usual = sqrt(past->usual2);
    past->limit = past->jump * (usual > rules->usual_min ? usual : rules->usual_min);
    past->last = z;
}

/* An instant: what a step has left of its sensors, one below the other. */
struct instant {
    struct rules rules;
    int64_t sensors;
    struct memory *const *memories;
    double t;
    const double *nu, *nis, *y;
    double *z;
};

static int is_new(const struct memory *past, const double *said)
{
    for (int64_t i = 0; i < past->test->m; i++)
        if (said[i] != past->values[i])
            return 1;
    return isinf(past->since); /* the first */
}

/* Values that are farther from those before than anything can have moved meanwhile. */
static int leaps(const struct memory *past, const double *said, double t)
{
    double reach = past->fastest * fabs(t - past->since);
    if (isinf(past->fastest))
        return 0;
    for (int64_t i = 0; i < past->test->m; i++)
        if (fabs(said[i] - past->values[i]) > reach + 16.0 * past->still[i])
            return 1;
    return 0;
}

/* Compare what was said, one sensor below the other, with the samples before. Returns 0, with nothing changed, if
   a sensor repeats itself or has done so until now, or leaps. */
int64_t flexarm_meet(const struct instant *instant, const double *all)
{
    const double *said = all;
    for (int64_t k = 0; k < instant->sensors; k++) {
        const struct memory *past = instant->memories[k];
        if (past->repeats || !is_new(past, said) || leaps(past, said, instant->t))
            return 0;
        said += past->test->m;
    }
    said = all;
    for (int64_t k = 0; k < instant->sensors; k++) {
        struct memory *past = instant->memories[k];
        for (int64_t i = 0; i < past->test->m; i++)
            past->values[i] = *said++;
        past->scanned++, past->since = instant->t;
    }
    return 1;
}

/* Judge the innovations of an instant, and remember them if all are ordinary; z takes sqrt(nis / m) of every
   sensor. Returns 0, with nothing changed, if one is not. */
int64_t flexarm_take_ordinary(const struct instant *instant)
{
    const double *nu = instant->nu, *nis = instant->nis, *y = instant->y;
    double *z = instant->z;
    for (int64_t k = 0; k < instant->sensors; k++) {
        const struct memory *past = instant->memories[k];
        if (!(nis[k] >= 0.0 && nis[k] <= past->threshold)) /* also when it is NaN */
            return 0;
        z[k] = sqrt(nis[k] / (double)past->test->m);
        if (past->repeats || past->leaps || past->held || past->test->score > past->biased || !(z[k] <= past->limit))
            return 0;
    }
    for (int64_t k = 0; k < instant->sensors; k++) {
        remember(&instant->rules, instant->memories[k], instant->t, nu, y, z[k]);
        nu += instant->memories[k]->test->m;
        y += instant->memories[k]->test->m;
    }
    return 1;
}
