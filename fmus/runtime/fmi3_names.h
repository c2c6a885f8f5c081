/* Names of FMI 3.0 for files that serve all versions. Containers have this file too. */
#ifndef MISFIT_FMI3_NAMES_H
#define MISFIT_FMI3_NAMES_H

#include "fmi3Functions.h"

#define FMI_VERSION 3
#define FMI(name) fmi3##name

/* A function that every FMU has to export, for an ability that this one does not have. */
#define ABSENT(name, parameters, c, why)                                                                             \
    FMI(Status) FMI(name) parameters { return layer_refuse(c, __func__, why); }

#endif
