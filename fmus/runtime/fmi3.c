/* FMI 3.0: life cycle, and steps of co-simulation. */
#include "fmi3.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void fmi3_tell(const Importer *importer, fmi3Status status, unsigned category, const char *call, const char *message)
{
    char text[800];
    snprintf(text, sizeof text, "%s%s%s", call, *call != '\0' ? ": " : "", message);
    if (importer->logger != NULL)
        importer->logger(importer->environment, status, log_name(category), text);
}

/* Messages of the core, which are no failures. */
static void listen(void *owner, unsigned category, const char *message)
{
    const Instance *instance = owner;
    fmi3_tell(&instance->importer, fmi3OK, category, "", message);
}

static void refuse(Instance *instance, fmi3Status status, const char *call, const char *message)
{
    unsigned category = status == fmi3Discard ? LOG_DISCARD : LOG_ERROR;
    if ((instance->core.categories & category) != 0)
        fmi3_tell(&instance->importer, status, category, call, message);
}

fmi3Status fmi3_refuse(Instance *instance, const char *call, const char *format, ...)
{
    char message[640];
    va_list arguments;
    if (instance == NULL)
        return fmi3Error;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    refuse(instance, fmi3Error, call, message);
    return fmi3Error;
}

fmi3Status fmi3_failed(Instance *instance, const char *call, fmi3Status status)
{
    refuse(instance, status, call, instance->core.message);
    return status;
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

static Instance *create(const Importer *importer, const char *call, const char *name, const char *token, int logging)
{
    const char *problem = NULL;
    if (name == NULL || *name == '\0')
        problem = "the instance name is missing";
    else if (token == NULL || strcmp(token, MODEL_GUID) != 0)
        problem = "the instantiation token is not that of this FMU, " MODEL_GUID;
    Instance *instance = problem == NULL ? calloc(1, sizeof *instance) : NULL;
    if (instance == NULL) {
        fmi3_tell(importer, fmi3Error, LOG_ERROR, call, problem != NULL ? problem : "out of memory");
        return NULL;
    }
    instance->importer = *importer;
    instance->core.categories = logging ? LOG_ALL : LOG_INITIALLY;
    instance->core.listener = listen;
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
        fmi3_tell(&importer, fmi3Error, LOG_ERROR, __func__, "this FMU has no event mode in co-simulation");
        return NULL;
    }
    Instance *instance = create(&importer, __func__, instanceName, instantiationToken, loggingOn);
    if (instance != NULL) {
        instance->core.state.event_mode = eventModeUsed;
        instance->core.state.early_return = earlyReturnAllowed;
    }
    return instance;
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
