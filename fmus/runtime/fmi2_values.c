/* FMI 2.0: values of variables, which are all Real, derivatives of inputs, and directional derivatives. */
#include "fmi2.h"

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[])
{
    Instance *instance = c;
    if (!layer_allowed(instance, __func__, ANY_PHASE & ~PHASE_INSTANTIATED))
        return fmi2Error;
    if (!layer_present(instance, __func__, vr, nvr) || !layer_present(instance, __func__, value, nvr))
        return fmi2Error;
    for (size_t i = 0; i < nvr; i++)
        if (core_get(&instance->core, vr[i], &value[i]) != 0)
            return layer_outcome(instance, __func__, 1);
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[])
{
    Instance *instance = c;
    if (!layer_allowed(instance, __func__, ANY_PHASE & ~PHASE_TERMINATED))
        return fmi2Error;
    if (!layer_present(instance, __func__, vr, nvr) || !layer_present(instance, __func__, value, nvr))
        return fmi2Error;
    for (size_t i = 0; i < nvr; i++)
        if (core_set(&instance->core, vr[i], value[i]) != 0)
            return layer_outcome(instance, __func__, 1);
    return fmi2OK;
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[])
{
    Instance *instance = c;
    if (!layer_allowed(instance, __func__, BEFORE_START | PHASE_STEPPING))
        return fmi2Error;
    if (!layer_present(instance, __func__, vr, nvr) || !layer_present(instance, __func__, order, nvr) ||
        !layer_present(instance, __func__, value, nvr))
        return fmi2Error;
    for (size_t i = 0; i < nvr; i++) {
        if (order[i] != 1)
            return layer_refuse(instance, __func__, "order %d is not supported; only first derivatives are", order[i]);
        if (core_set_input_slope(&instance->core, vr[i], value[i]) != 0)
            return layer_outcome(instance, __func__, 1);
    }
    return fmi2OK;
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown,
                                        const fmi2Real dvKnown[], fmi2Real dvUnknown[])
{
    Instance *instance = c;
    if (!layer_allowed(instance, __func__, ANY_PHASE & ~PHASE_INSTANTIATED))
        return fmi2Error;
    if (!layer_present(instance, __func__, vUnknown_ref, nUnknown) ||
        !layer_present(instance, __func__, vKnown_ref, nKnown) || !layer_present(instance, __func__, dvKnown, nKnown) ||
        !layer_present(instance, __func__, dvUnknown, nUnknown))
        return fmi2Error;
    return layer_outcome(instance, __func__, core_directional(&instance->core, vUnknown_ref, nUnknown, vKnown_ref, nKnown,
                                                              dvKnown, dvUnknown));
}

/* No variable has one of the other types, so only an empty list can be right. */
static fmi2Status none(fmi2Component c, const char *call, const fmi2ValueReference *vr, size_t nvr)
{
    if (!layer_allowed(c, call, ANY_PHASE) || !layer_present(c, call, vr, nvr))
        return fmi2Error;
    return nvr == 0 ? fmi2OK : layer_refuse(c, call, "value reference %u is of type Real", vr[0]);
}

#define NO_VARIABLES(TYPE)                                                                                           \
    fmi2Status fmi2Get##TYPE(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2##TYPE value[])         \
    {                                                                                                                \
        (void)value;                                                                                                 \
        return none(c, __func__, vr, nvr);                                                                           \
    }                                                                                                                \
    fmi2Status fmi2Set##TYPE(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2##TYPE value[])   \
    {                                                                                                                \
        (void)value;                                                                                                 \
        return none(c, __func__, vr, nvr);                                                                           \
    }

NO_VARIABLES(Integer)
NO_VARIABLES(Boolean)
NO_VARIABLES(String)
