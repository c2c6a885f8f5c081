/* FMI 3.0: life cycle, and steps of co-simulation. */
#include "fmi3.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

fmi3Status fmi3_refuse(Instance *instance, const char *call, const char *format, ...)
{
    char text[800];
    va_list arguments;
    if (instance == NULL || instance->logger == NULL)
        return fmi3Error;
    int length = snprintf(text, 200, "%s: ", call);
    va_start(arguments, format);
    vsnprintf(text + length, sizeof text - (size_t)length, format, arguments);
    va_end(arguments);
    instance->logger(instance->environment, fmi3Error, "logStatusError", text);
    return fmi3Error;
}

fmi3Status fmi3_outcome(Instance *instance, const char *call, int failed)
{
    return failed ? fmi3_refuse(instance, call, "%s", instance->core.message) : fmi3OK;
}

int fmi3_allowed(Instance *instance, const char *call, unsigned phases)
{
    if (instance == NULL)
        return 0;
    int allowed = ((unsigned)instance->core.state.phase & phases) != 0;
    if (!allowed)
        fmi3_refuse(instance, call, "not allowed while the FMU is %s", core_phase_name(&instance->core));
    return allowed;
}

int fmi3_present(Instance *instance, const char *call, const void *array, size_t count)
{
    if (array == NULL && count > 0)
        fmi3_refuse(instance, call, "null pointer for %zu values", count);
    return array != NULL || count == 0;
}

const char *fmi3GetVersion(void) { return fmi3Version; }

static fmi3Instance create(Instance *draft, const char *call, const char *name, const char *token)
{
    if (name == NULL || *name == '\0') {
        fmi3_refuse(draft, call, "the instance name is missing");
        return NULL;
    }
    if (token == NULL || strcmp(token, MODEL_GUID) != 0) {
        fmi3_refuse(draft, call, "the instantiation token is not that of this FMU, " MODEL_GUID);
        return NULL;
    }
    Instance *instance = malloc(sizeof *instance);
    if (instance == NULL) {
        fmi3_refuse(draft, call, "out of memory");
        return NULL;
    }
    *instance = *draft;
    core_reset(&instance->core);
    return instance;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
                                          fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage)
{
    Instance draft = {.core.state.exchange = 1, .environment = instanceEnvironment, .logger = logMessage};
    (void)resourcePath, (void)visible, (void)loggingOn;
    return create(&draft, __func__, instanceName, instantiationToken);
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken,
                                         fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                         fmi3Boolean eventModeUsed, fmi3Boolean earlyReturnAllowed,
                                         const fmi3ValueReference requiredIntermediateVariables[],
                                         size_t nRequiredIntermediateVariables,
                                         fmi3InstanceEnvironment instanceEnvironment,
                                         fmi3LogMessageCallback logMessage,
                                         fmi3IntermediateUpdateCallback intermediateUpdate)
{
    Instance draft = {.core.state.event_mode = eventModeUsed, .core.state.early_return = earlyReturnAllowed,
                      .environment = instanceEnvironment, .logger = logMessage};
    (void)resourcePath, (void)visible, (void)loggingOn;
    (void)requiredIntermediateVariables, (void)nRequiredIntermediateVariables, (void)intermediateUpdate;
    if (eventModeUsed && N_RELATIONS == 0) {
        fmi3_refuse(&draft, __func__, "this FMU has no event mode in co-simulation");
        return NULL;
    }
    return create(&draft, __func__, instanceName, instantiationToken);
}

void fmi3FreeInstance(fmi3Instance instance)
{
    Instance *self = instance;
    if (self == NULL)
        return;
    core_release(&self->core);
    free(self);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
{
    Instance *self = instance;
    if (!fmi3_allowed(self, __func__, PHASE_INSTANTIATED))
        return fmi3Error;
    if (core_set_up(&self->core, toleranceDefined ? &tolerance : NULL, startTime,
                    stopTimeDefined ? &stopTime : NULL) != 0)
        return fmi3_outcome(self, __func__, 1);
    self->core.state.phase = PHASE_INITIALIZATION;
    self->core.outputs_valid = 0;
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    Instance *self = instance;
    if (!fmi3_allowed(self, __func__, PHASE_INITIALIZATION))
        return fmi3Error;
    return fmi3_outcome(self, __func__, core_finish_initialization(&self->core));
}

fmi3Status fmi3Terminate(fmi3Instance instance)
{
    Instance *self = instance;
    if (!fmi3_allowed(self, __func__, PHASE_STEPPING | EXCHANGING))
        return fmi3Error;
    self->core.state.phase = PHASE_TERMINATED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
    Instance *self = instance;
    if (!fmi3_allowed(self, __func__, ANY_PHASE))
        return fmi3Error;
    core_reset(&self->core);
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint,
                      fmi3Float64 communicationStepSize, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                      fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn,
                      fmi3Float64 *lastSuccessfulTime)
{
    Instance *self = instance;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (!fmi3_allowed(self, __func__, PHASE_STEPPING) || !fmi3_present(self, __func__, eventHandlingNeeded, 1) ||
        !fmi3_present(self, __func__, terminateSimulation, 1) || !fmi3_present(self, __func__, earlyReturn, 1) ||
        !fmi3_present(self, __func__, lastSuccessfulTime, 1))
        return fmi3Error;
    int failed = core_step(&self->core, currentCommunicationPoint, communicationStepSize);
    double planned = currentCommunicationPoint + communicationStepSize;
    *eventHandlingNeeded = self->core.state.event_pending;
    *earlyReturn = self->core.state.event_pending && self->core.state.time < planned;
    *terminateSimulation = fmi3False;
    *lastSuccessfulTime = self->core.state.time;
    return fmi3_outcome(self, __func__, failed);
}
