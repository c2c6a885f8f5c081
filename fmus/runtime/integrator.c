/* Coefficients and control constants: Hairer, Norsett, Wanner, Solving Ordinary Differential
 * Equations I, section II.5, and the authors' code DOPRI5. */
#include "integrator.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define STAGES 7
#define MAX_STEPS 1000000L

static const double node[STAGES] = {0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0};
static const double stage[STAGES][STAGES - 1] = {
    {0.0},
    {0.2},
    {3.0 / 40, 9.0 / 40},
    {44.0 / 45, -56.0 / 15, 32.0 / 9},
    {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
    {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
    {35.0 / 384, 0.0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84},
};
/* Fifth minus fourth order. */
static const double difference[STAGES] = {
    71.0 / 57600, 0.0, -71.0 / 16695, 71.0 / 1920, -17253.0 / 339200, 22.0 / 525, -1.0 / 40};

static double *slope(const Integration *run, int i) { return run->work + (size_t)i * run->n; }
static double *trial(const Integration *run) { return run->work + STAGES * run->n; }

static int all_finite(Integration *run, const double *dx)
{
    for (size_t i = 0; i < run->n; i++)
        if (!isfinite(dx[i])) {
            run->culprit = i;
            return 0;
        }
    return 1;
}

/* Fills stages 1 to 6 and leaves the fifth-order result in trial(); 0 when a stage is not finite. */
static int try_step(Integration *run, double t, double h, double t_next, const double *x)
{
    double *y = trial(run);
    for (int s = 1; s < STAGES; s++) {
        for (size_t i = 0; i < run->n; i++) {
            double sum = 0.0;
            for (int j = 0; j < s; j++)
                sum += stage[s][j] * slope(run, j)[i];
            y[i] = x[i] + h * sum;
        }
        /* t + h may miss t_end by a rounding; the last slope has to be the one at t_end exactly. */
        double at = node[s] < 1.0 ? t + node[s] * h : t_next;
        if (run->derivatives(run->context, at, y, slope(run, s)) != 0 || !all_finite(run, slope(run, s)))
            return 0;
    }
    return 1;
}

/* Root mean square of the error over its tolerance; the step is good up to 1. */
static double scaled_error(Integration *run, double h, const double *x)
{
    const double *y = trial(run);
    double sum = 0.0, worst = -1.0;
    for (size_t i = 0; i < run->n; i++) {
        double error = 0.0;
        for (int j = 0; j < STAGES; j++)
            error += difference[j] * slope(run, j)[i];
        double size = fmax(run->nominal[i], fmax(fabs(x[i]), fabs(y[i])));
        double scaled = fabs(h * error) / (run->tolerance * size);
        if (scaled > worst) {
            worst = scaled;
            run->culprit = i;
        }
        sum += scaled * scaled;
    }
    return sqrt(sum / (double)run->n);
}

static double bounded(double low, double value, double high) { return fmin(high, fmax(low, value)); }

static void accept(StepMemory *memory, double h, double error, int shortened)
{
    const double beta = 0.04;
    double before = memory->error > 0.0 ? memory->error : 1e-4;
    double shrink = pow(error, 0.2 - 0.75 * beta) / pow(before, beta) / 0.9;
    double next = h / bounded(0.1, shrink, 5.0);
    /* A step cut off by the end of the interval says nothing against the longer one planned. */
    memory->step = shortened ? fmax(memory->step, next) : next;
    memory->error = fmax(error, 1e-4);
}

Outcome integrate(Integration *run, StepMemory *memory, double t, double t_end, double *x, int first_known)
{
    if (run->n == 0)
        return INTEGRATION_DONE;
    run->time = t;
    if (!first_known && run->derivatives(run->context, t, x, slope(run, 0)) != 0) {
        run->culprit = 0;
        return INTEGRATION_NOT_FINITE;
    }
    if (!all_finite(run, slope(run, 0)))
        return INTEGRATION_NOT_FINITE;
    for (long count = 0; t < t_end; count++) {
        double left = t_end - t;
        double h = memory->step > 0.0 ? memory->step : left;
        int last = 1.01 * h >= left;
        if (last)
            h = left;
        double t_next = last ? t_end : t + h;
        int finite = try_step(run, t, h, t_next, x);
        double error = finite ? scaled_error(run, h, x) : HUGE_VAL;
        run->time = t;
        if (error <= 1.0) {
            accept(memory, h, error, last);
            t = t_next;
            memcpy(x, trial(run), run->n * sizeof(double));
            memcpy(slope(run, 0), slope(run, STAGES - 1), run->n * sizeof(double));
        } else {
            memory->step = h / bounded(1.1, finite ? pow(error, 0.17) / 0.9 : 5.0, 5.0);
            if (memory->step < 16.0 * DBL_EPSILON * fmax(fabs(t), left))
                return finite ? INTEGRATION_STEP_TOO_SMALL : INTEGRATION_NOT_FINITE;
        }
        if (count == MAX_STEPS)
            return INTEGRATION_TOO_MANY_STEPS;
    }
    return INTEGRATION_DONE;
}
