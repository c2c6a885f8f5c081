/* What the FMI 3.0 files of the container share. */
#ifndef MISFIT_FMI3_CONTAINER_H
#define MISFIT_FMI3_CONTAINER_H

#include "container.h"

#include "fmi3Functions.h"

typedef struct {
    Container *container;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback logger;
} Instance;

/* Logs `call: why` and gives fmi3Error. */
fmi3Status container_refuse(Instance *self, const char *call, const char *why);

#endif
