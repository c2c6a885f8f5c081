/* FMI 2.0 model exchange. */
#include "fmi2.h"

#include <math.h>
#include <string.h>

/* True when the call may be made now, with an array of all states. */
static int ready(Instance *instance, const char *call, unsigned phases, const double *array, size_t count)
{
    if (!fmi2_allowed(instance, call, phases) || !fmi2_present(instance, call, array, count))
        return 0;
    if (count != N_STATES)
        fmi2_refuse(instance, call, "%zu values for %d states", count, N_STATES);
    return count == N_STATES;
}

static fmi2Status outcome(Instance *instance, const char *call, int failed)
{
    return failed ? fmi2_refuse(instance, call, "%s", instance->core.message) : fmi2OK;
}

fmi2Status fmi2EnterEventMode(fmi2Component c)
{
    Instance *instance = c;
    if (!fmi2_allowed(instance, __func__, EXCHANGING))
        return fmi2Error;
    instance->core.state.phase = PHASE_EVENT;
    instance->core.outputs_valid = 0;
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    Instance *instance = c;
    double next;
    if (!fmi2_allowed(instance, __func__, PHASE_EVENT) || !fmi2_present(instance, __func__, info, 1))
        return fmi2Error;
    instance->core.states_reset = 0;
    int failed = core_update_events(&instance->core, &next);
    memset(info, 0, sizeof *info);
    info->valuesOfContinuousStatesChanged = instance->core.states_reset;
    info->nextEventTimeDefined = next < HUGE_VAL;
    info->nextEventTime = info->nextEventTimeDefined ? next : 0.0;
    return outcome(instance, __func__, failed);
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    Instance *instance = c;
    if (!fmi2_allowed(instance, __func__, PHASE_EVENT))
        return fmi2Error;
    return outcome(instance, __func__, core_leave_events(&instance->core));
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi2Boolean *enterEventMode, fmi2Boolean *terminateSimulation)
{
    Instance *instance = c;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (!fmi2_allowed(instance, __func__, PHASE_CONTINUOUS) || !fmi2_present(instance, __func__, enterEventMode, 1) ||
        !fmi2_present(instance, __func__, terminateSimulation, 1))
        return fmi2Error;
    *enterEventMode = *terminateSimulation = fmi2False;
    return outcome(instance, __func__, core_complete_step(&instance->core));
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    Instance *instance = c;
    if (!fmi2_allowed(instance, __func__, EXCHANGING))
        return fmi2Error;
    return outcome(instance, __func__, core_set_time(&instance->core, time));
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t nx)
{
    Instance *instance = c;
    if (!ready(instance, __func__, EXCHANGING, x, nx))
        return fmi2Error;
    return outcome(instance, __func__, core_set_states(&instance->core, x));
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t nx)
{
    Instance *instance = c;
    if (!ready(instance, __func__, PHASE_INITIALIZATION | EXCHANGING, x, nx))
        return fmi2Error;
    if (core_evaluate_starts(&instance->core) != 0)
        return outcome(instance, __func__, 1);
    memcpy(x, instance->core.state.x, nx * sizeof *x);
    return fmi2OK;
}

/* A derivative that is no number is for the importer's integrator to avoid, by a shorter step. */
fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t nx)
{
    Instance *instance = c;
    if (!ready(instance, __func__, PHASE_INITIALIZATION | EXCHANGING, derivatives, nx))
        return fmi2Error;
    if (core_evaluate_outputs(&instance->core) != 0)
        return outcome(instance, __func__, 1);
    memcpy(derivatives, instance->core.dx, nx * sizeof *derivatives);
    if (core_finite_derivatives(&instance->core) != 0)
        return fmi2_failed(instance, __func__, fmi2Discard);
    return fmi2OK;
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real nominals[], size_t nx)
{
    if (!ready(c, __func__, ANY_PHASE & ~PHASE_TERMINATED, nominals, nx))
        return fmi2Error;
    memcpy(nominals, core_nominals, nx * sizeof *nominals);
    return fmi2OK;
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real eventIndicators[], size_t ni)
{
    Instance *instance = c;
    if (!fmi2_allowed(instance, __func__, PHASE_INITIALIZATION | EXCHANGING) ||
        !fmi2_present(instance, __func__, eventIndicators, ni))
        return fmi2Error;
    if (ni != N_INDICATORS)
        return fmi2_refuse(instance, __func__, "%zu values for %d event indicators", ni, N_INDICATORS);
    return outcome(instance, __func__, core_evaluate_indicators(&instance->core, eventIndicators));
}
