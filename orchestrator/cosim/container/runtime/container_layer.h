/* What the container does alike in all FMI versions; the header of the version, which defines Instance, includes this one. */
#ifndef MISFIT_CONTAINER_LAYER_H
#define MISFIT_CONTAINER_LAYER_H

#define IS(stage) (1u << (stage))
#define ANY (IS(MADE) | IS(INITIALISING) | IS(RUNNING) | IS(OVER))

/* Passes a message on to the importer; in the file of each version. */
void layer_tell(void *owner, int status, const char *message);

/* Logs `call: message` and gives Error. Without an instance there is nobody to tell. */
FMI(Status) layer_refuse(Instance *self, const char *call, const char *format, ...);

/* True when the instance exists and is in one of `stages`; otherwise the reason has been logged. */
int layer_allowed(Instance *self, const char *call, unsigned stages);

/* OK when `done` is 0, else Error with the container's message. */
FMI(Status) layer_answer(Instance *self, const char *call, int done);

/* The same after a step or an evaluation, which leaves components at different times when it fails half way. */
FMI(Status) layer_broken(Instance *self, const char *call, int done);

/* True when there are values for all variables, and all are of one of `kinds`. */
int layer_known(Instance *self, const char *call, const FMI(ValueReference) vr[], size_t nvr, const void *values, int as_long,
                unsigned kinds);

/* The functions for the values of one type, which stands for `kinds`. */
#define GET_AND_SET(Name, kinds)                                                                                             \
    FMI(Status) FMI(Get##Name)(void *c, const FMI(ValueReference) vr[], size_t nvr, FMI(Name) values[] LENGTH)               \
    {                                                                                                                        \
        Instance *self = c;                                                                                                  \
        if (!layer_known(self, __func__, vr, nvr, values, AS_LONG(nvr), kinds))                                              \
            return FMI(Error);                                                                                               \
        for (size_t i = 0; i < nvr; i++) {                                                                                   \
            double found;                                                                                                    \
            if (container_get(self->container, vr[i], &found) != 0)                                                          \
                return layer_answer(self, __func__, -1);                                                                     \
            values[i] = (FMI(Name))found;                                                                                    \
        }                                                                                                                    \
        return FMI(OK);                                                                                                      \
    }                                                                                                                        \
    FMI(Status) FMI(Set##Name)(void *c, const FMI(ValueReference) vr[], size_t nvr, const FMI(Name) values[] LENGTH)         \
    {                                                                                                                        \
        Instance *self = c;                                                                                                  \
        if (!layer_known(self, __func__, vr, nvr, values, AS_LONG(nvr), kinds))                                              \
            return FMI(Error);                                                                                               \
        for (size_t i = 0; i < nvr; i++)                                                                                     \
            if (container_set(self->container, vr[i], (double)values[i]) != 0)                                               \
                return layer_answer(self, __func__, -1);                                                                     \
        return FMI(OK);                                                                                                      \
    }

#endif
