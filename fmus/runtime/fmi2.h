/* What the FMI 2.0 files share: the instance, refusal with a message, and the states of the standard. */
#ifndef MISFIT_FMI2_H
#define MISFIT_FMI2_H

#include "core.h"
#include "fmi2Functions.h"

typedef struct {
    Core core; /* with the categories of messages that are wanted */
    char *name;
    fmi2CallbackFunctions callbacks;
} Instance;

/* Logs `call: message` and gives fmi2Error. Without an instance there is nobody to tell. */
fmi2Status fmi2_refuse(Instance *instance, const char *call, const char *format, ...);

/* fmi2Discard or fmi2Error with the core's message, logged in the category of the status. */
fmi2Status fmi2_failed(Instance *instance, const char *call, fmi2Status status);

/* True when the instance exists and is in one of `phases`; otherwise the reason has been logged. */
int fmi2_allowed(Instance *instance, const char *call, unsigned phases);

/* True when `array` may be read or written `count` times. */
int fmi2_present(Instance *instance, const char *call, const void *array, size_t count);

#define BEFORE_START (PHASE_INSTANTIATED | PHASE_INITIALIZATION)
#define EXCHANGING (PHASE_EVENT | PHASE_CONTINUOUS)
#define ANY_PHASE (BEFORE_START | PHASE_STEPPING | EXCHANGING | PHASE_TERMINATED)

#endif
