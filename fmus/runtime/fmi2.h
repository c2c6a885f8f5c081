/* The FMI 2.0 side of what all versions share, see layer.h. */
#ifndef MISFIT_FMI2_H
#define MISFIT_FMI2_H

#include "core.h"
#include "fmi2_names.h"

typedef struct {
    Core core; /* with the categories of messages that are wanted */
    char *name;
    fmi2CallbackFunctions callbacks;
} Instance;

#include "layer.h"

#endif
