/* The two ways to make one step, side by side: an explicit method, and an implicit one for stiff phases. */
#ifndef MISFIT_METHOD_H
#define MISFIT_METHOD_H

#include "integrator.h"

typedef struct {
    /* Tries a step from x at t to t_next = t + h: fills work_end with the result and work_error with the estimate of
     * its error. Gives 0, or -1 when the model has no finite derivative on the way; then run->culprit is set. */
    int (*attempt)(Integration *run, double t, double h, double t_next, const double *x);

    /* The solution at t + share h within the step just tried. */
    void (*inside)(const Integration *run, double h, const double *x, double share, double *result);

    /* h times the spectral radius of the Jacobian, estimated from the step just tried; negative when unknown. */
    double (*stiffness)(const Integration *run, double h, const double *x);

    int slope_at_end; /* whether the last stage is the derivative at the end of the step */
} Method;

extern const Method dormand_prince;
extern const Method rosenbrock;

/* Rows of the work space; the first holds the derivative at the start of the step. */
static inline double *work_stage(const Integration *run, size_t i) { return run->work + i * run->n; }
static inline double *work_end(const Integration *run) { return work_stage(run, 9); }
static inline double *work_error(const Integration *run) { return work_stage(run, 10); }
static inline double *work_before(const Integration *run) { return work_stage(run, 11); }
static inline double *work_by_time(const Integration *run) { return work_stage(run, 12); }
static inline double *work_inside(const Integration *run) { return work_stage(run, 13); }
static inline double *work_jacobian(const Integration *run) { return work_stage(run, 14); }
static inline double *work_factors(const Integration *run) { return work_stage(run, 14 + run->n); }

/* Looks for the first event within the step just tried. Gives its share of the step, 2 when there is none and -1 when a
 * relation cannot be evaluated; work_inside holds the state there. */
double event_share(Integration *run, const Method *method, double t, double h, const double *x);

/* Evaluates the derivative into `dx`; -1 when it is not finite. */
int method_slope(Integration *run, double t, const double *x, double *dx);

/* The size that errors of state i are measured by. */
double method_size(const Integration *run, const double *x, size_t i);

#endif
