/* FMI 3.0: access to variables of types that these models do not have; only an empty list can be right. */
#include "fmi3.h"

static fmi3Status none(Instance *instance, const char *call, const fmi3ValueReference *references, size_t count)
{
    if (!layer_allowed(instance, call, ANY_PHASE) || !layer_present(instance, call, references, count))
        return fmi3Error;
    if (count > 0)
        return layer_refuse(instance, call, "value reference %u is of type Float64", (unsigned)references[0]);
    return fmi3OK;
}

/* The standard has a pair of functions for each type, alike but for the type. */
#define NO_VARIABLES(TYPE)                                                                                           \
    fmi3Status fmi3Get##TYPE(fmi3Instance instance, const fmi3ValueReference valueReferences[],                      \
                             size_t nValueReferences, fmi3##TYPE values[], size_t nValues)                           \
    {                                                                                                                \
        (void)values, (void)nValues;                                                                                 \
        return none(instance, __func__, valueReferences, nValueReferences);                                          \
    }                                                                                                                \
    fmi3Status fmi3Set##TYPE(fmi3Instance instance, const fmi3ValueReference valueReferences[],                      \
                             size_t nValueReferences, const fmi3##TYPE values[], size_t nValues)                     \
    {                                                                                                                \
        (void)values, (void)nValues;                                                                                 \
        return none(instance, __func__, valueReferences, nValueReferences);                                          \
    }

NO_VARIABLES(Float32)
NO_VARIABLES(Int8)
NO_VARIABLES(UInt8)
NO_VARIABLES(Int16)
NO_VARIABLES(UInt16)
NO_VARIABLES(Int32)
NO_VARIABLES(UInt32)
NO_VARIABLES(Int64)
NO_VARIABLES(UInt64)
NO_VARIABLES(Boolean)
NO_VARIABLES(String)

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         size_t valueSizes[], fmi3Binary values[], size_t nValues)
{
    (void)valueSizes, (void)values, (void)nValues;
    return none(instance, __func__, valueReferences, nValueReferences);
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         const size_t valueSizes[], const fmi3Binary values[], size_t nValues)
{
    (void)valueSizes, (void)values, (void)nValues;
    return none(instance, __func__, valueReferences, nValueReferences);
}

fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        fmi3Clock values[])
{
    (void)values;
    return none(instance, __func__, valueReferences, nValueReferences);
}

fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        const fmi3Clock values[])
{
    (void)values;
    return none(instance, __func__, valueReferences, nValueReferences);
}
