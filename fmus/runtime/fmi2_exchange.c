/* FMI 2.0 model exchange, what differs from FMI 3.0. */
#include "fmi2.h"

#include <math.h>
#include <string.h>

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    Instance *instance = c;
    double next;
    if (!layer_allowed(instance, __func__, PHASE_EVENT) || !layer_present(instance, __func__, info, 1))
        return fmi2Error;
    instance->core.states_reset = 0;
    int failed = core_update_events(&instance->core, &next);
    memset(info, 0, sizeof *info);
    info->valuesOfContinuousStatesChanged = instance->core.states_reset;
    info->nextEventTimeDefined = next < HUGE_VAL;
    info->nextEventTime = info->nextEventTimeDefined ? next : 0.0;
    return layer_outcome(instance, __func__, failed);
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    Instance *instance = c;
    if (!layer_allowed(instance, __func__, PHASE_EVENT))
        return fmi2Error;
    return layer_outcome(instance, __func__, core_leave_events(&instance->core));
}
