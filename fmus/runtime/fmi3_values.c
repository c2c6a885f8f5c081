/* FMI 3.0: values of variables, which are all Float64, scalars and arrays, and directional derivatives. */
#include "fmi3.h"
#include "model_arrays.h"

#include <stdlib.h>

static const unsigned short sizes[] = MODEL_SIZES;

size_t fmi3_size(fmi3ValueReference reference) { return reference <= VR_LAST ? sizes[reference] : 0; }

int fmi3_matching(Instance *instance, const char *call, const fmi3ValueReference *references, size_t n_references,
                  size_t n_values)
{
    size_t needed = 0;
    for (size_t i = 0; i < n_references; i++) {
        size_t size = fmi3_size(references[i]);
        if (size == 0) {
            layer_refuse(instance, call, "value reference %u is unknown", (unsigned)references[i]);
            return 0;
        }
        needed += size;
    }
    if (needed != n_values)
        layer_refuse(instance, call, "%zu values for variables with %zu elements", n_values, needed);
    return needed == n_values;
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Float64 values[], size_t nValues)
{
    Instance *self = instance;
    if (!layer_allowed(self, __func__, ANY_PHASE & ~PHASE_INSTANTIATED) ||
        !layer_present(self, __func__, valueReferences, nValueReferences) ||
        !layer_present(self, __func__, values, nValues) ||
        !fmi3_matching(self, __func__, valueReferences, nValueReferences, nValues))
        return fmi3Error;
    for (size_t i = 0; i < nValueReferences; i++)
        for (size_t k = 0; k < sizes[valueReferences[i]]; k++)
            if (core_get(&self->core, valueReferences[i] + (unsigned)k, values++) != 0)
                return layer_outcome(self, __func__, 1);
    return fmi3OK;
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Float64 values[], size_t nValues)
{
    Instance *self = instance;
    if (!layer_allowed(self, __func__, ANY_PHASE & ~PHASE_TERMINATED) ||
        !layer_present(self, __func__, valueReferences, nValueReferences) ||
        !layer_present(self, __func__, values, nValues) ||
        !fmi3_matching(self, __func__, valueReferences, nValueReferences, nValues))
        return fmi3Error;
    for (size_t i = 0; i < nValueReferences; i++)
        for (size_t k = 0; k < sizes[valueReferences[i]]; k++)
            if (core_set(&self->core, valueReferences[i] + (unsigned)k, *values++) != 0)
                return layer_outcome(self, __func__, 1);
    return fmi3OK;
}

/* The references of all elements, one after the other. */
static void list_elements(const fmi3ValueReference *references, size_t count, unsigned *elements)
{
    for (size_t i = 0; i < count; i++)
        for (size_t k = 0; k < sizes[references[i]]; k++)
            *elements++ = references[i] + (unsigned)k;
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                        const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                        size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity)
{
    Instance *self = instance;
    if (!layer_allowed(self, __func__, ANY_PHASE & ~PHASE_INSTANTIATED) ||
        !layer_present(self, __func__, unknowns, nUnknowns) || !layer_present(self, __func__, knowns, nKnowns) ||
        !layer_present(self, __func__, seed, nSeed) || !layer_present(self, __func__, sensitivity, nSensitivity) ||
        !fmi3_matching(self, __func__, knowns, nKnowns, nSeed) ||
        !fmi3_matching(self, __func__, unknowns, nUnknowns, nSensitivity))
        return fmi3Error;
    unsigned *elements = malloc((nSeed + nSensitivity + 1) * sizeof *elements);
    if (elements == NULL)
        return layer_refuse(self, __func__, "out of memory");
    list_elements(knowns, nKnowns, elements);
    list_elements(unknowns, nUnknowns, elements + nSeed);
    int failed = core_directional(&self->core, elements + nSeed, nSensitivity, elements, nSeed, seed, sensitivity);
    free(elements);
    return layer_outcome(self, __func__, failed);
}
