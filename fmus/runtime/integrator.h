/* Error-controlled integration for a fixed number of states: explicit where it can be, implicit where it must be. */
#ifndef MISFIT_INTEGRATOR_H
#define MISFIT_INTEGRATOR_H

#include <stddef.h>

/* Evaluates dx at (t, x); returns 0, or not 0 when the model cannot be evaluated there. */
typedef int Derivatives(void *context, double t, const double *x, double *dx);

/* Evaluates the partial derivatives of dx: by x, n x n and column by column, and by t. */
typedef int Jacobian(void *context, double t, const double *x, double *by_x, double *by_t);

/* Evaluates how far all relations keep their present side at (t, x): the least of them, zero or less once one has
 * changed. */
typedef int Margin(void *context, double t, const double *x, double *margin);

typedef enum { INTEGRATION_AUTOMATIC, INTEGRATION_EXPLICIT, INTEGRATION_IMPLICIT } Choice;

/* What the controller carries from one call to the next; zero at the start of a run. */
typedef struct {
    double step;  /* s, next step to try */
    double error; /* scaled error of the last accepted step */
    int implicit; /* the method in use */
    int evidence; /* how much the last steps speak for the other method */
} StepMemory;

typedef enum {
    INTEGRATION_DONE,
    INTEGRATION_EVENT,          /* a relation has just changed, at `time`; x and the derivative are those there */
    INTEGRATION_NOT_FINITE,     /* derivative of state `culprit` is not finite at `time` */
    INTEGRATION_STEP_TOO_SMALL, /* the error of state `culprit` stays too large at `time` */
    INTEGRATION_TOO_MANY_STEPS, /* gave up at `time`, state `culprit` has the largest error */
} Outcome;

typedef struct {
    size_t n;
    Derivatives *derivatives;
    Jacobian *jacobian;
    Margin *margin; /* NULL when nothing switches */
    void *context;
    Choice choice;
    double tolerance;      /* relative; absolute it is tolerance * nominal */
    const double *nominal; /* one per state */
    double *work;          /* INTEGRATOR_WORK(n) doubles; the first n hold dx at the end of the run */
    size_t *pivots;        /* n */
    int jacobian_known;    /* at the start of the present step */
    size_t culprit;
    double time;
} Integration;

#define INTEGRATOR_WORK(n) ((14 + 2 * (n)) * (n))

/* Advances x from t to t_end, or to the first event. With `first_known`, work[0..n) already holds dx at (t, x). */
Outcome integrate(Integration *run, StepMemory *memory, double t, double t_end, double *x, int first_known);

#endif
