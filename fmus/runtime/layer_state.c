/* Getting, setting and serialising the complete state of an instance, in all FMI versions. */
#include "fmi.h"

static FMI(Status) give(Instance *instance, const char *call, Snapshot *snapshot, FMI(FMUState) *target)
{
    if (snapshot != NULL)
        *target = snapshot;
    return layer_outcome(instance, call, snapshot == NULL);
}

FMI(Status) FMI(GetFMUState)(void *c, FMI(FMUState) *state)
{
    Instance *instance = c;
    if (!layer_allowed(instance, __func__, ANY_PHASE) || !layer_present(instance, __func__, state, 1))
        return FMI(Error);
    return give(instance, __func__, core_snapshot(&instance->core, *state), state);
}

FMI(Status) FMI(SetFMUState)(void *c, FMI(FMUState) state)
{
    Instance *instance = c;
    if (!layer_allowed(instance, __func__, ANY_PHASE) || !layer_present(instance, __func__, state, 1))
        return FMI(Error);
    return layer_outcome(instance, __func__, core_restore(&instance->core, state));
}

FMI(Status) FMI(FreeFMUState)(void *c, FMI(FMUState) *state)
{
    Instance *instance = c;
    if (!layer_allowed(instance, __func__, ANY_PHASE) || !layer_present(instance, __func__, state, 1))
        return FMI(Error);
    if (core_free_snapshot(&instance->core, *state) != 0)
        return layer_failed(instance, __func__, FMI(Error));
    *state = NULL;
    return FMI(OK);
}

FMI(Status) FMI(SerializedFMUStateSize)(void *c, FMI(FMUState) state, size_t *size)
{
    Instance *instance = c;
    if (!layer_allowed(instance, __func__, ANY_PHASE) || !layer_present(instance, __func__, state, 1) ||
        !layer_present(instance, __func__, size, 1))
        return FMI(Error);
    if (!core_owns(&instance->core, state))
        return layer_failed(instance, __func__, FMI(Error));
    *size = core_serialized_size(state);
    return FMI(OK);
}

FMI(Status) FMI(SerializeFMUState)(void *c, FMI(FMUState) state, FMI(Byte) bytes[], size_t size)
{
    Instance *instance = c;
    if (!layer_allowed(instance, __func__, ANY_PHASE) || !layer_present(instance, __func__, state, 1) ||
        !layer_present(instance, __func__, bytes, size))
        return FMI(Error);
    if (!core_owns(&instance->core, state))
        return layer_failed(instance, __func__, FMI(Error));
    size_t needed = core_serialized_size(state);
    if (size < needed)
        return layer_refuse(instance, __func__, "%zu bytes are too few; this state needs %zu", size, needed);
    core_serialize(state, (char *)bytes);
    return FMI(OK);
}

FMI(Status) FMI(DeserializeFMUState)(void *c, const FMI(Byte) bytes[], size_t size, FMI(FMUState) *state)
{
    Instance *instance = c;
    if (!layer_allowed(instance, __func__, ANY_PHASE) || !layer_present(instance, __func__, state, 1) ||
        !layer_present(instance, __func__, bytes, size))
        return FMI(Error);
    return give(instance, __func__, core_deserialize(&instance->core, (const char *)bytes, size), state);
}
