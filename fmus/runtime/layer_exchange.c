/* Model exchange, in all FMI versions. */
#include "fmi.h"

#include <string.h>

/* True when the call may be made now; in FMI 3.0 its phases are those of co-simulation with event mode too. */
static int exchanging(Instance *instance, const char *call, unsigned phases)
{
    if (!layer_allowed(instance, call, phases))
        return 0;
    int right = FMI_VERSION == 2 || instance->core.state.exchange;
    if (!right)
        layer_refuse(instance, call, "not allowed in co-simulation");
    return right;
}

static int counted(Instance *instance, const char *call, const char *what, size_t count, size_t expected)
{
    if (count != expected)
        layer_refuse(instance, call, "%zu values for %zu %s", count, expected, what);
    return count == expected;
}

/* The same, with an array of all states. */
static int ready(Instance *instance, const char *call, unsigned phases, const double *array, size_t count)
{
    return exchanging(instance, call, phases) && layer_present(instance, call, array, count) &&
           counted(instance, call, "states", count, N_STATES);
}

FMI(Status) FMI(EnterEventMode)(void *c)
{
    Instance *instance = c;
    int stepping = instance != NULL && instance->core.state.event_mode;
    if (!layer_allowed(instance, __func__, stepping ? PHASE_STEPPING | PHASE_EVENT : EXCHANGING))
        return FMI(Error);
    instance->core.state.phase = PHASE_EVENT;
    instance->core.outputs_valid = 0;
    return FMI(OK);
}

FMI(Status) FMI(CompletedIntegratorStep)(void *c, FMI(Boolean) noSetFMUStatePriorToCurrentPoint,
                                         FMI(Boolean) *enterEventMode, FMI(Boolean) *terminateSimulation)
{
    Instance *instance = c;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (!exchanging(instance, __func__, PHASE_CONTINUOUS) || !layer_present(instance, __func__, enterEventMode, 1) ||
        !layer_present(instance, __func__, terminateSimulation, 1))
        return FMI(Error);
    *enterEventMode = *terminateSimulation = FMI(False);
    return layer_outcome(instance, __func__, core_complete_step(&instance->core));
}

FMI(Status) FMI(SetTime)(void *c, double time)
{
    Instance *instance = c;
    if (!exchanging(instance, __func__, EXCHANGING))
        return FMI(Error);
    return layer_outcome(instance, __func__, core_set_time(&instance->core, time));
}

FMI(Status) FMI(SetContinuousStates)(void *c, const double x[], size_t nx)
{
    Instance *instance = c;
    if (!ready(instance, __func__, EXCHANGING, x, nx))
        return FMI(Error);
    return layer_outcome(instance, __func__, core_set_states(&instance->core, x));
}

FMI(Status) FMI(GetContinuousStates)(void *c, double x[], size_t nx)
{
    Instance *instance = c;
    if (!ready(instance, __func__, PHASE_INITIALIZATION | EXCHANGING, x, nx))
        return FMI(Error);
    if (core_evaluate_starts(&instance->core) != 0)
        return layer_outcome(instance, __func__, 1);
    memcpy(x, instance->core.state.x, nx * sizeof *x);
    return FMI(OK);
}

/* A derivative that is no number is for the importer's integrator to avoid, by a shorter step. */
FMI(Status) FMI(GetContinuousStateDerivatives)(void *c, double derivatives[], size_t nx)
{
    Instance *instance = c;
    if (!ready(instance, __func__, PHASE_INITIALIZATION | EXCHANGING, derivatives, nx))
        return FMI(Error);
    if (core_evaluate_outputs(&instance->core) != 0)
        return layer_outcome(instance, __func__, 1);
    memcpy(derivatives, instance->core.dx, nx * sizeof *derivatives);
    if (core_finite_derivatives(&instance->core) != 0)
        return layer_failed(instance, __func__, FMI(Discard));
    return FMI(OK);
}

FMI(Status) FMI(GetNominalsOfContinuousStates)(void *c, double nominals[], size_t nx)
{
    if (!ready(c, __func__, ANY_PHASE & ~PHASE_TERMINATED, nominals, nx))
        return FMI(Error);
    memcpy(nominals, core_nominals, nx * sizeof *nominals);
    return FMI(OK);
}

FMI(Status) FMI(GetEventIndicators)(void *c, double indicators[], size_t ni)
{
    Instance *instance = c;
    if (!exchanging(instance, __func__, PHASE_INITIALIZATION | EXCHANGING) ||
        !layer_present(instance, __func__, indicators, ni) ||
        !counted(instance, __func__, "event indicators", ni, N_INDICATORS))
        return FMI(Error);
    return layer_outcome(instance, __func__, core_evaluate_indicators(&instance->core, indicators));
}
