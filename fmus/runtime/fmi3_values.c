/* FMI 3.0: values of variables, which are all Float64 scalars, and directional derivatives. */
#include "fmi3.h"

static int matching(Instance *instance, const char *call, size_t references, size_t values)
{
    if (references != values)
        fmi3_refuse(instance, call, "%zu values for %zu scalar variables", values, references);
    return references == values;
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Float64 values[], size_t nValues)
{
    Instance *self = instance;
    if (!fmi3_allowed(self, __func__, ANY_PHASE & ~PHASE_INSTANTIATED) ||
        !fmi3_present(self, __func__, valueReferences, nValueReferences) ||
        !fmi3_present(self, __func__, values, nValues) || !matching(self, __func__, nValueReferences, nValues))
        return fmi3Error;
    for (size_t i = 0; i < nValues; i++)
        if (core_get(&self->core, valueReferences[i], &values[i]) != 0)
            return fmi3_outcome(self, __func__, 1);
    return fmi3OK;
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Float64 values[], size_t nValues)
{
    Instance *self = instance;
    if (!fmi3_allowed(self, __func__, ANY_PHASE & ~PHASE_TERMINATED) ||
        !fmi3_present(self, __func__, valueReferences, nValueReferences) ||
        !fmi3_present(self, __func__, values, nValues) || !matching(self, __func__, nValueReferences, nValues))
        return fmi3Error;
    for (size_t i = 0; i < nValues; i++)
        if (core_set(&self->core, valueReferences[i], values[i]) != 0)
            return fmi3_outcome(self, __func__, 1);
    return fmi3OK;
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                        const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                        size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity)
{
    Instance *self = instance;
    if (!fmi3_allowed(self, __func__, ANY_PHASE & ~PHASE_INSTANTIATED) ||
        !fmi3_present(self, __func__, unknowns, nUnknowns) || !fmi3_present(self, __func__, knowns, nKnowns) ||
        !fmi3_present(self, __func__, seed, nSeed) || !fmi3_present(self, __func__, sensitivity, nSensitivity) ||
        !matching(self, __func__, nKnowns, nSeed) || !matching(self, __func__, nUnknowns, nSensitivity))
        return fmi3Error;
    return fmi3_outcome(self, __func__,
                        core_directional(&self->core, unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity));
}
