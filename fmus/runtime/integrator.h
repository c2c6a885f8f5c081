/* Dormand-Prince 5(4) with step-size control, for a fixed number of states. */
#ifndef MISFIT_INTEGRATOR_H
#define MISFIT_INTEGRATOR_H

#include <stddef.h>

/* Evaluates dx at (t, x); returns 0, or not 0 when the model cannot be evaluated there. */
typedef int Derivatives(void *context, double t, const double *x, double *dx);

/* What the controller carries from one call to the next; zero at the start of a run. */
typedef struct {
    double step;  /* s, next step to try */
    double error; /* scaled error of the last accepted step */
} StepMemory;

typedef enum {
    INTEGRATION_DONE,
    INTEGRATION_NOT_FINITE,     /* derivative of state `culprit` is not finite at `time` */
    INTEGRATION_STEP_TOO_SMALL, /* the error of state `culprit` stays too large at `time` */
    INTEGRATION_TOO_MANY_STEPS, /* gave up at `time`, state `culprit` has the largest error */
} Outcome;

typedef struct {
    size_t n;
    Derivatives *derivatives;
    void *context;
    double tolerance;      /* relative; absolute it is tolerance * nominal */
    const double *nominal; /* one per state */
    double *work;          /* INTEGRATOR_WORK(n) doubles; the first n hold dx at the end of the run */
    size_t culprit;
    double time;
} Integration;

#define INTEGRATOR_WORK(n) (9 * (n))

/* Advances x from t to t_end. With `first_known`, work[0..n) already holds dx at (t, x). */
Outcome integrate(Integration *run, StepMemory *memory, double t, double t_end, double *x, int first_known);

#endif
