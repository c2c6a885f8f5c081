/* What the FMI 3.0 files of the container share. */
#ifndef MISFIT_FMI3_CONTAINER_H
#define MISFIT_FMI3_CONTAINER_H

#include "container.h"
#include "fmi3_names.h"

typedef struct {
    Container *container;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback logger;
} Instance;

/* A list of values says how long it is. */
#define LENGTH , size_t n
#define AS_LONG(nvr) (n == (nvr))

#include "container_layer.h"

#endif
