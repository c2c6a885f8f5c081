/* What the FMI 2.0 files of the container share. */
#ifndef MISFIT_FMI2_CONTAINER_H
#define MISFIT_FMI2_CONTAINER_H

#include "container.h"
#include "fmi2_names.h"

typedef struct {
    Container *container;
    fmi2CallbackFunctions callbacks;
    char *name;
} Instance;

/* A list of values is as long as that of the value references. */
#define LENGTH
#define AS_LONG(nvr) 1

#include "container_layer.h"

#endif
