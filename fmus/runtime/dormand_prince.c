/* Dormand-Prince 5(4), explicit, with continuous output of order 4. Coefficients: Hairer, Norsett, Wanner, Solving
 * Ordinary Differential Equations I, section II.5, and the authors' code DOPRI5. */
#include "method.h"

#include <math.h>
#include <string.h>

#define STAGES 7

/* Highest term of the continuous output. */
static const double bend[STAGES] = {-12715105075.0 / 11282082432.0, 0.0, 87487479700.0 / 32700410799.0,
                                    -10690763975.0 / 1880347072.0, 701980252875.0 / 199316789632.0,
                                    -1453857185.0 / 822651844.0, 69997945.0 / 29380423.0};

static double sum(const Integration *run, const double *weights, size_t i)
{
    double total = 0.0;
    for (size_t j = 0; j < STAGES; j++)
        total += weights[j] * work_stage(run, j)[i];
    return total;
}

/* Written out, since these few sums are most of what a step costs beside the model. */
#define COMBINE(...)                                                                                                   \
    for (size_t i = 0; i < run->n; i++)                                                                                \
        y[i] = x[i] + h * (__VA_ARGS__);

static int attempt(Integration *run, double t, double h, double t_next, const double *x)
{
    double *y = work_end(run), *k0 = work_stage(run, 0), *k1 = work_stage(run, 1), *k2 = work_stage(run, 2);
    double *k3 = work_stage(run, 3), *k4 = work_stage(run, 4), *k5 = work_stage(run, 5), *k6 = work_stage(run, 6);
    COMBINE(0.2 * k0[i])
    if (method_slope(run, t + 0.2 * h, y, k1) != 0)
        return -1;
    COMBINE(3.0 / 40 * k0[i] + 9.0 / 40 * k1[i])
    if (method_slope(run, t + 0.3 * h, y, k2) != 0)
        return -1;
    COMBINE(44.0 / 45 * k0[i] - 56.0 / 15 * k1[i] + 32.0 / 9 * k2[i])
    if (method_slope(run, t + 0.8 * h, y, k3) != 0)
        return -1;
    COMBINE(19372.0 / 6561 * k0[i] - 25360.0 / 2187 * k1[i] + 64448.0 / 6561 * k2[i] - 212.0 / 729 * k3[i])
    if (method_slope(run, t + 8.0 / 9.0 * h, y, k4) != 0)
        return -1;
    COMBINE(9017.0 / 3168 * k0[i] - 355.0 / 33 * k1[i] + 46732.0 / 5247 * k2[i] + 49.0 / 176 * k3[i] -
            5103.0 / 18656 * k4[i])
    memcpy(work_before(run), y, run->n * sizeof(double));
    /* t + h may miss t_next by a rounding; the last slope has to be the one there exactly. */
    if (method_slope(run, t_next, y, k5) != 0)
        return -1;
    COMBINE(35.0 / 384 * k0[i] + 500.0 / 1113 * k2[i] + 125.0 / 192 * k3[i] - 2187.0 / 6784 * k4[i] + 11.0 / 84 * k5[i])
    if (method_slope(run, t_next, y, k6) != 0)
        return -1;
    for (size_t i = 0; i < run->n; i++) /* fifth minus fourth order */
        work_error(run)[i] = h * (71.0 / 57600 * k0[i] - 71.0 / 16695 * k2[i] + 71.0 / 1920 * k3[i] -
                                  17253.0 / 339200 * k4[i] + 22.0 / 525 * k5[i] - 1.0 / 40 * k6[i]);
    return 0;
}

static void inside(const Integration *run, double h, const double *x, double share, double *result)
{
    double rest = 1.0 - share;
    for (size_t i = 0; i < run->n; i++) {
        double rise = work_end(run)[i] - x[i];
        double first = h * work_stage(run, 0)[i] - rise;
        double last = rise - h * work_stage(run, STAGES - 1)[i] - first;
        result[i] = x[i] + share * (rise + rest * (first + share * (last + rest * h * sum(run, bend, i))));
    }
}

/* The last two stages are evaluated at the same time: Hairer, Wanner, volume II, section IV.2. */
static double stiffness(const Integration *run, double h, const double *x)
{
    double slopes = 0.0, states = 0.0;
    for (size_t i = 0; i < run->n; i++) {
        double size = method_size(run, x, i);
        double slope = (work_stage(run, STAGES - 1)[i] - work_stage(run, STAGES - 2)[i]) / size;
        double state = (work_end(run)[i] - work_before(run)[i]) / size;
        slopes += slope * slope;
        states += state * state;
    }
    return states > 1e-28 ? h * sqrt(slopes / states) : -1.0; /* below that it is rounding */
}

const Method dormand_prince = {attempt, inside, stiffness, 1};
