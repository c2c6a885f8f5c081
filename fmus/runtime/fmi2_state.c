/* FMI 2.0: getting, setting and serialising the complete state of an instance. */
#include "fmi2.h"

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    Instance *instance = c;
    if (!fmi2_allowed(instance, __func__, ANY_PHASE) || !fmi2_present(instance, __func__, FMUstate, 1))
        return fmi2Error;
    Snapshot *snapshot = core_snapshot(&instance->core, *FMUstate);
    if (snapshot == NULL)
        return fmi2_refuse(instance, __func__, "%s", instance->core.message);
    *FMUstate = snapshot;
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate)
{
    Instance *instance = c;
    if (!fmi2_allowed(instance, __func__, ANY_PHASE) || !fmi2_present(instance, __func__, FMUstate, 1))
        return fmi2Error;
    if (core_restore(&instance->core, FMUstate) != 0)
        return fmi2_refuse(instance, __func__, "%s", instance->core.message);
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    Instance *instance = c;
    if (!fmi2_allowed(instance, __func__, ANY_PHASE) || !fmi2_present(instance, __func__, FMUstate, 1))
        return fmi2Error;
    if (core_free_snapshot(&instance->core, *FMUstate) != 0)
        return fmi2_failed(instance, __func__, fmi2Error);
    *FMUstate = NULL;
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size)
{
    Instance *instance = c;
    if (!fmi2_allowed(instance, __func__, ANY_PHASE) || !fmi2_present(instance, __func__, FMUstate, 1) ||
        !fmi2_present(instance, __func__, size, 1))
        return fmi2Error;
    if (!core_owns(&instance->core, FMUstate))
        return fmi2_failed(instance, __func__, fmi2Error);
    *size = core_serialized_size(FMUstate);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size)
{
    Instance *instance = c;
    if (!fmi2_allowed(instance, __func__, ANY_PHASE) || !fmi2_present(instance, __func__, FMUstate, 1) ||
        !fmi2_present(instance, __func__, serializedState, size))
        return fmi2Error;
    if (!core_owns(&instance->core, FMUstate))
        return fmi2_failed(instance, __func__, fmi2Error);
    size_t needed = core_serialized_size(FMUstate);
    if (size < needed)
        return fmi2_refuse(instance, __func__, "%zu bytes are too few; this state needs %zu", size, needed);
    core_serialize(FMUstate, serializedState);
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size,
                                   fmi2FMUstate *FMUstate)
{
    Instance *instance = c;
    if (!fmi2_allowed(instance, __func__, ANY_PHASE) || !fmi2_present(instance, __func__, FMUstate, 1) ||
        !fmi2_present(instance, __func__, serializedState, size))
        return fmi2Error;
    Snapshot *snapshot = core_deserialize(&instance->core, serializedState, size);
    if (snapshot == NULL)
        return fmi2_refuse(instance, __func__, "%s", instance->core.message);
    *FMUstate = snapshot;
    return fmi2OK;
}
