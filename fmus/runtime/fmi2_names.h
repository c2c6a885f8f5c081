/* Names of FMI 2.0 for files that serve all versions: those of FMI 3.0, without the prefix. Containers have this file too. */
#ifndef MISFIT_FMI2_NAMES_H
#define MISFIT_FMI2_NAMES_H

#include "fmi2Functions.h"

#define FMI_VERSION 2
#define FMI(name) FMI2(name)
#define FMI2(name) fmi2##name
#define Float64 Real
#define GetContinuousStateDerivatives GetDerivatives
#define FMUState FMUstate
#define GetFMUState GetFMUstate
#define SetFMUState SetFMUstate
#define FreeFMUState FreeFMUstate
#define SerializedFMUStateSize SerializedFMUstateSize
#define SerializeFMUState SerializeFMUstate
#define DeserializeFMUState DeSerializeFMUstate

/* A function that every FMU has to export, for an ability that this one does not have. */
#define ABSENT(name, parameters, c, why)                                                                             \
    FMI(Status) FMI(name) parameters { return layer_refuse(c, __func__, why); }

#endif
