/* What the layers of all FMI versions share: refusal with a message, and the states of the standard.
 *
 * `fmi.h` of an FMU includes the header of its version, which defines FMI(name), Instance, and includes this one. */
#ifndef MISFIT_LAYER_H
#define MISFIT_LAYER_H

/* Passes `call: message` on to the importer; in the layer of each version. */
void layer_tell(const Instance *instance, FMI(Status) status, unsigned category, const char *call, const char *message);

/* Messages of the core, which are no failures. */
void layer_listen(void *owner, unsigned category, const char *message);

/* Logs `call: message` and gives Error. Without an instance there is nobody to tell. */
FMI(Status) layer_refuse(Instance *instance, const char *call, const char *format, ...);

/* Discard or Error with the core's message, logged in the category of the status. */
FMI(Status) layer_failed(Instance *instance, const char *call, FMI(Status) status);

/* OK, or Error with the core's message when it has failed. */
FMI(Status) layer_outcome(Instance *instance, const char *call, int failed);

/* True when the instance exists and is in one of `phases`; otherwise the reason has been logged. */
int layer_allowed(Instance *instance, const char *call, unsigned phases);

/* True when `array` may be read or written `count` times. */
int layer_present(Instance *instance, const char *call, const void *array, size_t count);

#define BEFORE_START (PHASE_INSTANTIATED | PHASE_INITIALIZATION)
#define EXCHANGING (PHASE_EVENT | PHASE_CONTINUOUS)
#define ANY_PHASE (BEFORE_START | PHASE_STEPPING | EXCHANGING | PHASE_TERMINATED)

#endif
