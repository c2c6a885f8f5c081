/* A linear controller, driven like an FMU of version 2. Value references: inputs, outputs, elements of the state. */
#ifndef MISFIT_LINEAR_H
#define MISFIT_LINEAR_H

#include "system.h"

#include <stddef.h>

void *linear_new(const LinearData *data);
void linear_free(void *instance);
int linear_get(void *instance, const uint32_t *references, size_t n, double *values);
int linear_set(void *instance, const uint32_t *references, size_t n, const double *values);
int linear_step(void *instance, double time, double size, int forward);

/* State and inputs, one after the other. */
size_t linear_state_size(const void *instance);
double *linear_state(void *instance);

#endif
