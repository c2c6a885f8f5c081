/* FMI 2.0 functions that every FMU has to export, for abilities that these FMUs do not have, and status. */
#include "fmi2.h"

ABSENT(GetRealOutputDerivatives,
       (fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[], fmi2Real value[]), c,
       "not provided by this FMU")
ABSENT(CancelStep, (fmi2Component c), c, "no step is pending; this FMU always completes a step")

static fmi2Status no_status(fmi2Component c, const char *call)
{
    layer_refuse(c, call, "this status is not available");
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
    if (!layer_allowed(instance, __func__, PHASE_STEPPING | PHASE_TERMINATED) ||
        !layer_present(instance, __func__, value, 1))
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
    if (!layer_allowed(c, __func__, PHASE_STEPPING | PHASE_TERMINATED) || !layer_present(c, __func__, value, 1))
        return fmi2Error;
    *value = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String *value)
{
    (void)s, (void)value;
    return no_status(c, __func__);
}
