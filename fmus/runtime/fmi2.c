/* FMI 2.0: life cycle, and steps of co-simulation. */
#include "fmi2.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void emit(const fmi2CallbackFunctions *callbacks, const char *name, fmi2Status status, unsigned category,
                 const char *call, const char *message)
{
    char text[1300];
    int written = snprintf(text, 200, "%s%s", call, *call != '\0' ? ": " : "");
    size_t length = written < 0 ? 0 : (size_t)written;
    /* The standard reads the message as a format with #references#: both signs count when doubled. */
    for (; *message != '\0' && length + 3 < sizeof text; message++) {
        if (*message == '%' || *message == '#')
            text[length++] = *message;
        text[length++] = *message;
    }
    text[length] = '\0';
    if (callbacks->logger != NULL)
        callbacks->logger(callbacks->componentEnvironment, name, status, log_name(category), text);
}

void layer_tell(const Instance *instance, fmi2Status status, unsigned category, const char *call, const char *message)
{
    emit(&instance->callbacks, instance->name, status, category, call, message);
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn)
{
    (void)fmuResourceLocation, (void)visible;
    const char *problem = NULL;
    if (functions == NULL)
        return NULL;
    if (instanceName == NULL || *instanceName == '\0')
        problem = "the instance name is missing";
    else if (fmuType != fmi2CoSimulation && fmuType != fmi2ModelExchange)
        problem = "this FMU knows co-simulation and model exchange only";
    else if (fmuGUID == NULL || strcmp(fmuGUID, MODEL_GUID) != 0)
        problem = "the GUID is not that of this FMU, " MODEL_GUID;
    Instance *instance = problem == NULL ? calloc(1, sizeof *instance) : NULL;
    if (instance != NULL)
        instance->name = malloc(strlen(instanceName) + 1);
    if (instance == NULL || instance->name == NULL) {
        emit(functions, instanceName != NULL ? instanceName : "", fmi2Error, LOG_ERROR, __func__,
             problem != NULL ? problem : "out of memory");
        free(instance);
        return NULL;
    }
    strcpy(instance->name, instanceName);
    instance->callbacks = *functions;
    instance->core.categories = loggingOn ? LOG_ALL : LOG_INITIALLY;
    instance->core.listener = layer_listen;
    instance->core.owner = instance;
    instance->core.state.exchange = fmuType == fmi2ModelExchange;
    core_reset(&instance->core);
    return instance;
}

void fmi2FreeInstance(fmi2Component c)
{
    Instance *instance = c;
    if (instance == NULL)
        return;
    core_release(&instance->core);
    free(instance->name);
    free(instance);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime)
{
    Instance *instance = c;
    if (!layer_allowed(instance, __func__, PHASE_INSTANTIATED))
        return fmi2Error;
    return layer_outcome(instance, __func__,
                         core_set_up(&instance->core, toleranceDefined ? &tolerance : NULL, startTime,
                                     stopTimeDefined ? &stopTime : NULL));
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    Instance *instance = c;
    if (!layer_allowed(instance, __func__, PHASE_INSTANTIATED))
        return fmi2Error;
    instance->core.state.phase = PHASE_INITIALIZATION;
    instance->core.outputs_valid = 0;
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    Instance *instance = c;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (!layer_allowed(instance, __func__, PHASE_STEPPING))
        return fmi2Error;
    return layer_outcome(instance, __func__,
                         core_step(&instance->core, currentCommunicationPoint, communicationStepSize));
}
