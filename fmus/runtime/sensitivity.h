/* What derivatives are chained through: the change of every variable, or (in reverse) its weight. */
#ifndef MISFIT_SENSITIVITY_H
#define MISFIT_SENSITIVITY_H

#include "core.h"

typedef struct {
    double time;
    double u[N_INPUTS + 1];
    double x[N_STATES + 1];
    double p[N_PARAMETERS + 1];
    double d[N_DELAYS + 1];
    double dx[N_STATES + 1];
    double z[N_ALGEBRAICS + 1];
    double dependents[N_DEPENDENTS + 1];
    double indicators[N_INDICATORS + 1];
} Sensitivity;

/* The place of a variable, by its value reference, which is not beyond VR_LAST. */
double *sensitivity_of(Sensitivity *all, unsigned int reference);

#endif
