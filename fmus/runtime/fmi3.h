/* What the FMI 3.0 files share: the instance, refusal with a message, and the states of the standard. */
#ifndef MISFIT_FMI3_H
#define MISFIT_FMI3_H

#include "core.h"
#include "fmi3Functions.h"

/* Who gets the messages. */
typedef struct {
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback logger;
} Importer;

typedef struct {
    Core core; /* with the categories of messages that are wanted */
    Importer importer;
} Instance;

/* Logs `call: message` where there is no instance yet. */
void fmi3_tell(const Importer *importer, fmi3Status status, unsigned category, const char *call, const char *message);

/* Logs `call: message` and gives fmi3Error. Without an instance there is nobody to tell. */
fmi3Status fmi3_refuse(Instance *instance, const char *call, const char *format, ...);

/* fmi3Discard or fmi3Error with the core's message, logged in the category of the status. */
fmi3Status fmi3_failed(Instance *instance, const char *call, fmi3Status status);

/* fmi3OK, or the core's message when it has failed. */
fmi3Status fmi3_outcome(Instance *instance, const char *call, int failed);

/* True when the instance exists and is in one of `phases`; otherwise the reason has been logged. */
int fmi3_allowed(Instance *instance, const char *call, unsigned phases);

/* True when `array` may be read or written `count` times. */
int fmi3_present(Instance *instance, const char *call, const void *array, size_t count);

/* Number of elements of the variable with this value reference; 0 where there is none. */
size_t fmi3_size(fmi3ValueReference reference);

/* True when the references are known and their variables have `n_values` elements in all. */
int fmi3_matching(Instance *instance, const char *call, const fmi3ValueReference *references, size_t n_references,
                  size_t n_values);

#define BEFORE_START (PHASE_INSTANTIATED | PHASE_INITIALIZATION)
#define EXCHANGING (PHASE_EVENT | PHASE_CONTINUOUS)
#define ANY_PHASE (BEFORE_START | PHASE_STEPPING | EXCHANGING | PHASE_TERMINATED)

#endif
