/* FMI 3.0 model exchange, what differs from FMI 2.0. */
#include "fmi3.h"

#include <math.h>

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
                                    fmi3Boolean *terminateSimulation, fmi3Boolean *nominalsOfContinuousStatesChanged,
                                    fmi3Boolean *valuesOfContinuousStatesChanged, fmi3Boolean *nextEventTimeDefined,
                                    fmi3Float64 *nextEventTime)
{
    Instance *self = instance;
    if (!layer_allowed(self, __func__, PHASE_EVENT) || !layer_present(self, __func__, discreteStatesNeedUpdate, 1) ||
        !layer_present(self, __func__, terminateSimulation, 1) ||
        !layer_present(self, __func__, nominalsOfContinuousStatesChanged, 1) ||
        !layer_present(self, __func__, valuesOfContinuousStatesChanged, 1) ||
        !layer_present(self, __func__, nextEventTimeDefined, 1) || !layer_present(self, __func__, nextEventTime, 1))
        return fmi3Error;
    self->core.states_reset = 0;
    int failed = core_update_events(&self->core, nextEventTime);
    *discreteStatesNeedUpdate = *terminateSimulation = fmi3False;
    *nominalsOfContinuousStatesChanged = fmi3False;
    *valuesOfContinuousStatesChanged = self->core.states_reset != 0;
    *nextEventTimeDefined = *nextEventTime < HUGE_VAL;
    return layer_outcome(self, __func__, failed);
}

static fmi3Status leave_event_mode(Instance *self, const char *call, int right_interface)
{
    if (!layer_allowed(self, call, PHASE_EVENT))
        return fmi3Error;
    if (!right_interface)
        return layer_refuse(self, call, "not allowed in %s", self->core.state.exchange ? "model exchange" : "co-simulation");
    return layer_outcome(self, call, core_leave_events(&self->core));
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance)
{
    Instance *self = instance;
    return leave_event_mode(self, __func__, self != NULL && self->core.state.exchange);
}

fmi3Status fmi3EnterStepMode(fmi3Instance instance)
{
    Instance *self = instance;
    return leave_event_mode(self, __func__, self != NULL && !self->core.state.exchange);
}

static fmi3Status give_count(Instance *instance, const char *call, size_t count, size_t *target)
{
    if (!layer_allowed(instance, call, ANY_PHASE) || !layer_present(instance, call, target, 1))
        return fmi3Error;
    *target = count;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *nEventIndicators)
{
    return give_count(instance, __func__, N_INDICATORS, nEventIndicators);
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *nContinuousStates)
{
    return give_count(instance, __func__, N_STATES, nContinuousStates);
}
