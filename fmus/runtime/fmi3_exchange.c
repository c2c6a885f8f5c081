/* FMI 3.0 model exchange. */
#include "fmi3.h"

#include <math.h>
#include <string.h>

/* True when the call may be made now, in model exchange. */
static int exchanging(Instance *instance, const char *call, unsigned phases)
{
    if (!fmi3_allowed(instance, call, phases))
        return 0;
    if (!instance->core.state.exchange)
        fmi3_refuse(instance, call, "not allowed in co-simulation");
    return instance->core.state.exchange;
}

/* The same, with an array of all states. */
static int ready(Instance *instance, const char *call, unsigned phases, const double *array, size_t count)
{
    if (!exchanging(instance, call, phases) || !fmi3_present(instance, call, array, count))
        return 0;
    if (count != N_STATES)
        fmi3_refuse(instance, call, "%zu values for %d states", count, N_STATES);
    return count == N_STATES;
}

fmi3Status fmi3EnterEventMode(fmi3Instance instance)
{
    Instance *self = instance;
    int stepping = self != NULL && self->core.state.event_mode;
    if (!fmi3_allowed(self, __func__, stepping ? PHASE_STEPPING | PHASE_EVENT : EXCHANGING))
        return fmi3Error;
    self->core.state.phase = PHASE_EVENT;
    self->core.outputs_valid = 0;
    return fmi3OK;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
                                    fmi3Boolean *terminateSimulation, fmi3Boolean *nominalsOfContinuousStatesChanged,
                                    fmi3Boolean *valuesOfContinuousStatesChanged, fmi3Boolean *nextEventTimeDefined,
                                    fmi3Float64 *nextEventTime)
{
    Instance *self = instance;
    if (!fmi3_allowed(self, __func__, PHASE_EVENT) || !fmi3_present(self, __func__, discreteStatesNeedUpdate, 1) ||
        !fmi3_present(self, __func__, terminateSimulation, 1) ||
        !fmi3_present(self, __func__, nominalsOfContinuousStatesChanged, 1) ||
        !fmi3_present(self, __func__, valuesOfContinuousStatesChanged, 1) ||
        !fmi3_present(self, __func__, nextEventTimeDefined, 1) || !fmi3_present(self, __func__, nextEventTime, 1))
        return fmi3Error;
    self->core.states_reset = 0;
    int failed = core_update_events(&self->core, nextEventTime);
    *discreteStatesNeedUpdate = *terminateSimulation = fmi3False;
    *nominalsOfContinuousStatesChanged = fmi3False;
    *valuesOfContinuousStatesChanged = self->core.states_reset != 0;
    *nextEventTimeDefined = *nextEventTime < HUGE_VAL;
    return fmi3_outcome(self, __func__, failed);
}

static fmi3Status leave_event_mode(Instance *self, const char *call, int right_interface)
{
    if (!fmi3_allowed(self, call, PHASE_EVENT))
        return fmi3Error;
    if (!right_interface)
        return fmi3_refuse(self, call, "not allowed in %s", self->core.state.exchange ? "model exchange" : "co-simulation");
    return fmi3_outcome(self, call, core_leave_events(&self->core));
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

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation)
{
    Instance *self = instance;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (!exchanging(self, __func__, PHASE_CONTINUOUS) || !fmi3_present(self, __func__, enterEventMode, 1) ||
        !fmi3_present(self, __func__, terminateSimulation, 1))
        return fmi3Error;
    *enterEventMode = *terminateSimulation = fmi3False;
    return fmi3_outcome(self, __func__, core_complete_step(&self->core));
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time)
{
    Instance *self = instance;
    if (!exchanging(self, __func__, EXCHANGING))
        return fmi3Error;
    return fmi3_outcome(self, __func__, core_set_time(&self->core, time));
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 continuousStates[],
                                   size_t nContinuousStates)
{
    Instance *self = instance;
    if (!ready(self, __func__, EXCHANGING, continuousStates, nContinuousStates))
        return fmi3Error;
    return fmi3_outcome(self, __func__, core_set_states(&self->core, continuousStates));
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 continuousStates[], size_t nContinuousStates)
{
    Instance *self = instance;
    if (!ready(self, __func__, PHASE_INITIALIZATION | EXCHANGING, continuousStates, nContinuousStates))
        return fmi3Error;
    if (core_evaluate_starts(&self->core) != 0)
        return fmi3_outcome(self, __func__, 1);
    memcpy(continuousStates, self->core.state.x, nContinuousStates * sizeof(double));
    return fmi3OK;
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[],
                                             size_t nContinuousStates)
{
    Instance *self = instance;
    if (!ready(self, __func__, PHASE_INITIALIZATION | EXCHANGING, derivatives, nContinuousStates))
        return fmi3Error;
    if (core_evaluate_outputs(&self->core) != 0)
        return fmi3_outcome(self, __func__, 1);
    memcpy(derivatives, self->core.dx, nContinuousStates * sizeof(double));
    if (core_finite_derivatives(&self->core) != 0)
        return fmi3_failed(self, __func__, fmi3Discard);
    return fmi3OK;
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[], size_t nContinuousStates)
{
    if (!ready(instance, __func__, ANY_PHASE & ~PHASE_TERMINATED, nominals, nContinuousStates))
        return fmi3Error;
    memcpy(nominals, core_nominals, nContinuousStates * sizeof(double));
    return fmi3OK;
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 eventIndicators[], size_t nEventIndicators)
{
    Instance *self = instance;
    if (!exchanging(self, __func__, PHASE_INITIALIZATION | EXCHANGING) ||
        !fmi3_present(self, __func__, eventIndicators, nEventIndicators))
        return fmi3Error;
    if (nEventIndicators != N_INDICATORS)
        return fmi3_refuse(self, __func__, "%zu values for %d event indicators", nEventIndicators, N_INDICATORS);
    return fmi3_outcome(self, __func__, core_evaluate_indicators(&self->core, eventIndicators));
}

static fmi3Status give_count(Instance *instance, const char *call, size_t count, size_t *target)
{
    if (!fmi3_allowed(instance, call, ANY_PHASE) || !fmi3_present(instance, call, target, 1))
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
