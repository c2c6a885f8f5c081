/* The container as an FMU of version 3 for co-simulation. */
#include "fmi3_container.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void layer_tell(void *owner, int status, const char *message)
{
    Instance *self = owner;
    if (self->logger != NULL)
        self->logger(self->environment, (fmi3Status)status, status >= fmi3Error ? "logStatusError" : "logAll", message);
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
                                         fmi3Boolean visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed,
                                         fmi3Boolean earlyReturnAllowed,
                                         const fmi3ValueReference requiredIntermediateVariables[],
                                         size_t nRequiredIntermediateVariables, fmi3InstanceEnvironment instanceEnvironment,
                                         fmi3LogMessageCallback logMessage, fmi3IntermediateUpdateCallback intermediateUpdate)
{
    char why[1600] = "";
    (void)instanceName, (void)visible, (void)earlyReturnAllowed, (void)requiredIntermediateVariables;
    (void)nRequiredIntermediateVariables, (void)intermediateUpdate;
    Instance *self = calloc(1, sizeof *self);
    if (self == NULL)
        return NULL;
    self->environment = instanceEnvironment;
    self->logger = logMessage;
    if (eventModeUsed)
        snprintf(why, sizeof why, "this FMU has no event mode");
    else if (instantiationToken == NULL || strcmp(instantiationToken, misfit_system.guid) != 0)
        snprintf(why, sizeof why, "the instantiation token is not that of this FMU, %s", misfit_system.guid);
    else if (resourcePath == NULL || *resourcePath == '\0')
        snprintf(why, sizeof why, "the resource path is missing, where the components of this FMU are");
    else
        self->container = container_new(resourcePath, layer_tell, self, loggingOn, why, sizeof why);
    if (self->container != NULL)
        return self;
    layer_refuse(self, __func__, "%s", why);
    free(self);
    return NULL;
}

void fmi3FreeInstance(fmi3Instance instance)
{
    Instance *self = instance;
    if (self == NULL)
        return;
    container_free(self->container);
    free(self);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
{
    Instance *self = instance;
    if (!layer_allowed(self, __func__, IS(MADE)))
        return fmi3Error;
    if (container_set_up(self->container, toleranceDefined ? &tolerance : NULL, startTime,
                         stopTimeDefined ? &stopTime : NULL) != 0)
        return layer_answer(self, __func__, -1);
    return layer_broken(self, __func__, container_enter(self->container));
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded,
                      fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime)
{
    Instance *self = instance;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (!layer_allowed(self, __func__, IS(RUNNING)))
        return fmi3Error;
    if (eventHandlingNeeded == NULL || terminateSimulation == NULL || earlyReturn == NULL || lastSuccessfulTime == NULL)
        return layer_refuse(self, __func__, "a place for results is missing");
    if (!(communicationStepSize > 0.0))
        return layer_refuse(self, __func__, "the step is not a positive time");
    int done = container_advance(self->container, currentCommunicationPoint + communicationStepSize);
    *eventHandlingNeeded = *earlyReturn = fmi3False;
    *terminateSimulation = self->container->clock.ended != 0;
    *lastSuccessfulTime = self->container->clock.time;
    return layer_broken(self, __func__, done);
}

GET_AND_SET(Float64, IS(FLOAT64))
GET_AND_SET(Float32, IS(FLOAT32))
GET_AND_SET(Int8, IS(INT8))
GET_AND_SET(UInt8, IS(UINT8))
GET_AND_SET(Int16, IS(INT16))
GET_AND_SET(UInt16, IS(UINT16))
GET_AND_SET(Int32, IS(INT32))
GET_AND_SET(UInt32, IS(UINT32))
GET_AND_SET(Int64, IS(INT64))
GET_AND_SET(Boolean, IS(BOOLEAN))
