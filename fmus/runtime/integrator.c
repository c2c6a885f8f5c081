/* Step-size control after Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, sections II.4 and II.5,
 * and the choice between the two methods. */
#include "method.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define MAX_STEPS 1000000L

#define ENOUGH_EVIDENCE 20

double method_size(const Integration *run, const double *x, size_t i)
{
    return fmax(run->nominal[i], fmax(fabs(x[i]), fabs(work_end(run)[i])));
}

static int all_finite(Integration *run, const double *dx)
{
    for (size_t i = 0; i < run->n; i++)
        if (!isfinite(dx[i])) {
            run->culprit = i;
            return 0;
        }
    return 1;
}

int method_slope(Integration *run, double t, const double *x, double *dx)
{
    return run->derivatives(run->context, t, x, dx) == 0 && all_finite(run, dx) ? 0 : -1;
}

/* Root mean square of the error over its tolerance; the step is good up to 1. */
static double scaled_error(Integration *run, const double *x)
{
    double sum = 0.0, worst = -1.0;
    for (size_t i = 0; i < run->n; i++) {
        double scaled = fabs(work_error(run)[i]) / (run->tolerance * method_size(run, x, i));
        if (scaled > worst) {
            worst = scaled;
            run->culprit = i;
        }
        sum += scaled * scaled;
    }
    return sqrt(sum / (double)run->n);
}

static double bounded(double low, double value, double high) { return fmin(high, fmax(low, value)); }

/* A first step for which the second derivative, from an Euler step, stays within the tolerance; section II.4. */
static double first_step(Integration *run, double t, const double *x, double most)
{
    double *y = work_end(run), *there = work_stage(run, 1), states = 0.0, slopes = 0.0, bends = 0.0;
    for (size_t i = 0; i < run->n; i++) {
        y[i] = x[i];
        double weight = 1.0 / (run->tolerance * method_size(run, x, i));
        states += pow(weight * x[i], 2.0);
        slopes += pow(weight * work_stage(run, 0)[i], 2.0);
    }
    double h = states > 1e-10 && slopes > 1e-10 ? 0.01 * sqrt(states / slopes) : 1e-6;
    h = fmin(h, most);
    for (size_t i = 0; i < run->n; i++)
        y[i] = x[i] + h * work_stage(run, 0)[i];
    if (method_slope(run, t + h, y, there) != 0)
        return h;
    for (size_t i = 0; i < run->n; i++) {
        double weight = 1.0 / (run->tolerance * method_size(run, x, i));
        bends += pow(weight * (there[i] - work_stage(run, 0)[i]) / h, 2.0);
    }
    double largest = sqrt(fmax(slopes, bends) / (double)run->n);
    double second = largest > 1e-15 ? pow(0.01 / largest, 0.2) : fmax(1e-6, 1e-3 * h);
    return fmin(most, fmin(100.0 * h, second));
}

/* Where accuracy limits the steps of the explicit method, h rho is near (tolerance / 3e-4)^(1/5); far above it something
 * else does. The method becomes unstable at 3.3, but loses order before that. */
static double stiff_above(const Integration *run)
{
    return bounded(1.0, 4.0 * pow(run->tolerance / 3e-4, 0.2), 3.0);
}

/* A step that the end of the interval has cut off says nothing against the explicit method. */
static void weigh_methods(const Integration *run, StepMemory *memory, const Method *method, double h, const double *x,
                          int shortened)
{
    if (run->choice != INTEGRATION_AUTOMATIC || (shortened && !memory->implicit))
        return;
    double stiffness = method->stiffness(run, h, x);
    if (stiffness < 0.0)
        return;
    int other = memory->implicit ? stiffness < 0.5 * stiff_above(run) : stiffness > stiff_above(run);
    memory->evidence = other ? memory->evidence + 2 : memory->evidence > 0 ? memory->evidence - 1 : 0;
    if (memory->evidence >= ENOUGH_EVIDENCE) {
        memory->implicit = !memory->implicit;
        memory->evidence = 0;
    }
}

static void plan_next(StepMemory *memory, double h, double error, int shortened)
{
    const double beta = 0.04;
    double before = memory->error > 0.0 ? memory->error : 1e-4;
    double shrink = pow(error, 0.2 - 0.75 * beta) / pow(before, beta) / 0.9;
    double next = h / bounded(0.1, shrink, 5.0);
    /* A step cut off by the end of the interval says nothing against the longer one planned. */
    memory->step = shortened ? fmax(memory->step, next) : next;
    memory->error = fmax(error, 1e-4);
}

/* Makes the step just tried the past, with the derivative at its end as the first of the next one. */
static int accept(Integration *run, const Method *method, double t_next, double *x)
{
    memcpy(x, work_end(run), run->n * sizeof(double));
    run->jacobian_known = 0;
    run->time = t_next;
    if (!method->slope_at_end)
        return method_slope(run, t_next, x, work_stage(run, 0));
    memcpy(work_stage(run, 0), work_stage(run, 6), run->n * sizeof(double));
    return 0;
}

/* The way to an event: a full step to a point just before it, then a short one across it, within which the continuous
 * output is as good as exact. */
typedef struct {
    enum { FAR, BEFORE, ACROSS } stage;
    double limit; /* s, on the next step */
    double gap;   /* s, from the point before the event to the event */
} Approach;

typedef enum { STEP_STANDS, STEP_REPEATS, STEP_ENDS_IN_EVENT } Verdict;

static Verdict look_for_event(Approach *approach, double share, double h, double t)
{
    double distance = share * h;
    if (share > 1.0) {
        approach->limit = approach->stage == BEFORE ? 3.0 * approach->gap : HUGE_VAL;
        approach->stage = approach->stage == BEFORE ? ACROSS : FAR;
        return STEP_STANDS;
    }
    if (approach->stage == ACROSS || distance <= 1e-12 * fmax(fabs(t), h))
        return STEP_ENDS_IN_EVENT;
    approach->stage = BEFORE;
    approach->gap = 0.01 * distance;
    approach->limit = distance - approach->gap;
    return STEP_REPEATS;
}

static const Method *chosen(const Integration *run, const StepMemory *memory)
{
    int implicit = run->choice == INTEGRATION_AUTOMATIC ? memory->implicit : run->choice == INTEGRATION_IMPLICIT;
    return implicit ? &rosenbrock : &dormand_prince;
}

Outcome integrate(Integration *run, StepMemory *memory, double t, double t_end, double *x, int first_known)
{
    Approach approach = {.stage = FAR, .limit = HUGE_VAL};
    if (run->n == 0)
        return INTEGRATION_DONE;
    run->time = t;
    run->jacobian_known = 0;
    run->culprit = 0;
    if (first_known ? !all_finite(run, work_stage(run, 0)) : method_slope(run, t, x, work_stage(run, 0)) != 0)
        return INTEGRATION_NOT_FINITE;
    if (!(memory->step > 0.0))
        memory->step = first_step(run, t, x, t_end - t);
    for (long count = 0; t < t_end; count++) {
        double left = t_end - t, h = fmin(memory->step, approach.limit);
        int last = 1.01 * h >= left, shortened = last || h < memory->step;
        double t_next = last ? t_end : t + h;
        const Method *method = chosen(run, memory);
        h = last ? left : h;
        run->time = t;
        int finite = method->attempt(run, t, h, t_next, x) == 0;
        double error = finite ? scaled_error(run, x) : HUGE_VAL;
        double share = run->margin != NULL && error <= 1.0 ? event_share(run, method, t, h, x) : 2.0;
        if (error <= 1.0 && share >= 0.0) {
            Verdict verdict = look_for_event(&approach, share, h, t);
            if (verdict == STEP_REPEATS)
                continue;
            if (verdict == STEP_ENDS_IN_EVENT) {
                memcpy(x, work_inside(run), run->n * sizeof(double));
                run->time = t + share * h;
                return INTEGRATION_EVENT;
            }
            plan_next(memory, h, error, shortened);
            weigh_methods(run, memory, method, h, x, shortened);
            if (accept(run, method, t_next, x) != 0)
                return INTEGRATION_NOT_FINITE;
            t = t_next;
        } else {
            memory->step = h / (finite && isfinite(error) ? bounded(1.1, pow(error, 0.17) / 0.9, 5.0) : 5.0);
            if (memory->step < fmax(16.0 * DBL_EPSILON * fabs(t), 1e-25 * left))
                return finite ? INTEGRATION_STEP_TOO_SMALL : INTEGRATION_NOT_FINITE;
        }
        if (count == MAX_STEPS)
            return INTEGRATION_TOO_MANY_STEPS;
    }
    return INTEGRATION_DONE;
}
