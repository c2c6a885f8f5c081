/* FMI 2.0 functions that every FMU has to export, for abilities that these FMUs do not have, and status. */
#include "fmi2.h"

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[])
{
    Instance *instance = c;
    if (!fmi2_allowed(instance, __func__, ANY_PHASE) || !fmi2_present(instance, __func__, categories, nCategories))
        return fmi2Error;
    const char *unknown = log_switch(&instance->core.categories, loggingOn, nCategories, categories);
    if (unknown != NULL)
        return fmi2_refuse(instance, __func__, "category '%s' is unknown; there are " LOG_NAMES, unknown);
    return fmi2OK;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[])
{
    (void)vr, (void)nvr, (void)order, (void)value;
    return fmi2_refuse(c, __func__, "not provided by this FMU");
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    return fmi2_refuse(c, __func__, "no step is pending; this FMU always completes a step");
}

static fmi2Status no_status(fmi2Component c, const char *call)
{
    fmi2_refuse(c, call, "this status is not available");
    return c != NULL ? fmi2Discard : fmi2Error;
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *value)
{
    (void)s, (void)value;
    return no_status(c, __func__);
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value)
{
    Instance *instance = c;
    if (s != fmi2LastSuccessfulTime)
        return no_status(c, __func__);
    if (!fmi2_allowed(instance, __func__, PHASE_STEPPING | PHASE_TERMINATED) ||
        !fmi2_present(instance, __func__, value, 1))
        return fmi2Error;
    *value = instance->core.state.time;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *value)
{
    (void)s, (void)value;
    return no_status(c, __func__);
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value)
{
    if (s != fmi2Terminated)
        return no_status(c, __func__);
    if (!fmi2_allowed(c, __func__, PHASE_STEPPING | PHASE_TERMINATED) || !fmi2_present(c, __func__, value, 1))
        return fmi2Error;
    *value = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String *value)
{
    (void)s, (void)value;
    return no_status(c, __func__);
}
