/* FMI 3.0: life cycle, and steps of co-simulation. */
#include "fmi3.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void tell(const Importer *importer, fmi3Status status, unsigned category, const char *call, const char *message)
{
    char text[800];
    snprintf(text, sizeof text, "%s%s%s", call, *call != '\0' ? ": " : "", message);
    if (importer->logger != NULL)
        importer->logger(importer->environment, status, log_name(category), text);
}

void layer_tell(const Instance *instance, fmi3Status status, unsigned category, const char *call, const char *message)
{
    tell(&instance->importer, status, category, call, message);
}

static Instance *create(const Importer *importer, const char *call, const char *name, const char *token, int logging)
{
    const char *problem = NULL;
    if (name == NULL || *name == '\0')
        problem = "the instance name is missing";
    else if (token == NULL || strcmp(token, MODEL_GUID) != 0)
        problem = "the instantiation token is not that of this FMU, " MODEL_GUID;
    Instance *instance = problem == NULL ? calloc(1, sizeof *instance) : NULL;
    if (instance == NULL) {
        tell(importer, fmi3Error, LOG_ERROR, call, problem != NULL ? problem : "out of memory");
        return NULL;
    }
    instance->importer = *importer;
    instance->core.categories = logging ? LOG_ALL : LOG_INITIALLY;
    instance->core.listener = layer_listen;
    instance->core.owner = instance;
    core_reset(&instance->core);
    return instance;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
                                          fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage)
{
    Importer importer = {instanceEnvironment, logMessage};
    (void)resourcePath, (void)visible;
    Instance *instance = create(&importer, __func__, instanceName, instantiationToken, loggingOn);
    if (instance != NULL)
        instance->core.state.exchange = 1;
    return instance;
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
    Importer importer = {instanceEnvironment, logMessage};
    (void)resourcePath, (void)visible;
    (void)requiredIntermediateVariables, (void)nRequiredIntermediateVariables, (void)intermediateUpdate;
    if (eventModeUsed && N_EVENT_VALUES == 0) {
        tell(&importer, fmi3Error, LOG_ERROR, __func__, "this FMU has no event mode in co-simulation");
        return NULL;
    }
    Instance *instance = create(&importer, __func__, instanceName, instantiationToken, loggingOn);
    if (instance != NULL) {
        instance->core.state.event_mode = eventModeUsed;
        instance->core.state.early_return = earlyReturnAllowed;
    }
    return instance;
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken,
                                               fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                               fmi3InstanceEnvironment instanceEnvironment,
                                               fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate,
                                               fmi3LockPreemptionCallback lockPreemption,
                                               fmi3UnlockPreemptionCallback unlockPreemption)
{
    (void)instanceName, (void)instantiationToken, (void)resourcePath, (void)visible, (void)loggingOn;
    (void)clockUpdate, (void)lockPreemption, (void)unlockPreemption;
    Importer importer = {instanceEnvironment, logMessage};
    tell(&importer, fmi3Error, LOG_ERROR, __func__, "this FMU supports co-simulation and model exchange only");
    return NULL;
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
    if (!layer_allowed(self, __func__, PHASE_INSTANTIATED))
        return fmi3Error;
    if (core_set_up(&self->core, toleranceDefined ? &tolerance : NULL, startTime,
                    stopTimeDefined ? &stopTime : NULL) != 0)
        return layer_outcome(self, __func__, 1);
    self->core.state.phase = PHASE_INITIALIZATION;
    self->core.outputs_valid = 0;
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint,
                      fmi3Float64 communicationStepSize, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                      fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn,
                      fmi3Float64 *lastSuccessfulTime)
{
    Instance *self = instance;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (!layer_allowed(self, __func__, PHASE_STEPPING) || !layer_present(self, __func__, eventHandlingNeeded, 1) ||
        !layer_present(self, __func__, terminateSimulation, 1) || !layer_present(self, __func__, earlyReturn, 1) ||
        !layer_present(self, __func__, lastSuccessfulTime, 1))
        return fmi3Error;
    int failed = core_step(&self->core, currentCommunicationPoint, communicationStepSize);
    double planned = currentCommunicationPoint + communicationStepSize;
    *eventHandlingNeeded = self->core.state.event_pending;
    *earlyReturn = self->core.state.event_pending && self->core.state.time < planned;
    *terminateSimulation = fmi3False;
    *lastSuccessfulTime = self->core.state.time;
    return layer_outcome(self, __func__, failed);
}
