/* FMI 3.0: getting, setting and serialising the complete state of an instance. */
#include "fmi3.h"

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    Instance *self = instance;
    if (!fmi3_allowed(self, __func__, ANY_PHASE) || !fmi3_present(self, __func__, FMUState, 1))
        return fmi3Error;
    Snapshot *snapshot = core_snapshot(&self->core, *FMUState);
    if (snapshot != NULL)
        *FMUState = snapshot;
    return fmi3_outcome(self, __func__, snapshot == NULL);
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState)
{
    Instance *self = instance;
    if (!fmi3_allowed(self, __func__, ANY_PHASE) || !fmi3_present(self, __func__, FMUState, 1))
        return fmi3Error;
    return fmi3_outcome(self, __func__, core_restore(&self->core, FMUState));
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    Instance *self = instance;
    if (!fmi3_allowed(self, __func__, ANY_PHASE) || !fmi3_present(self, __func__, FMUState, 1))
        return fmi3Error;
    if (core_free_snapshot(&self->core, *FMUState) != 0)
        return fmi3_failed(self, __func__, fmi3Error);
    *FMUState = NULL;
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size)
{
    Instance *self = instance;
    if (!fmi3_allowed(self, __func__, ANY_PHASE) || !fmi3_present(self, __func__, FMUState, 1) ||
        !fmi3_present(self, __func__, size, 1))
        return fmi3Error;
    if (!core_owns(&self->core, FMUState))
        return fmi3_failed(self, __func__, fmi3Error);
    *size = core_serialized_size(FMUState);
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[],
                                 size_t size)
{
    Instance *self = instance;
    if (!fmi3_allowed(self, __func__, ANY_PHASE) || !fmi3_present(self, __func__, FMUState, 1) ||
        !fmi3_present(self, __func__, serializedState, size))
        return fmi3Error;
    if (!core_owns(&self->core, FMUState))
        return fmi3_failed(self, __func__, fmi3Error);
    size_t needed = core_serialized_size(FMUState);
    if (size < needed)
        return fmi3_refuse(self, __func__, "%zu bytes are too few; this state needs %zu", size, needed);
    core_serialize(FMUState, (char *)serializedState);
    return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size,
                                   fmi3FMUState *FMUState)
{
    Instance *self = instance;
    if (!fmi3_allowed(self, __func__, ANY_PHASE) || !fmi3_present(self, __func__, FMUState, 1) ||
        !fmi3_present(self, __func__, serializedState, size))
        return fmi3Error;
    Snapshot *snapshot = core_deserialize(&self->core, (const char *)serializedState, size);
    if (snapshot != NULL)
        *FMUState = snapshot;
    return fmi3_outcome(self, __func__, snapshot == NULL);
}
