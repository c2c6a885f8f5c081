/* The container as an FMU of version 2 for co-simulation. */
#include "fmi2_container.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void layer_tell(void *owner, int status, const char *message)
{
    Instance *self = owner;
    if (self->callbacks.logger != NULL)
        self->callbacks.logger(self->callbacks.componentEnvironment, self->name, (fmi2Status)status,
                               status >= fmi2Error ? "logStatusError" : "logAll", "%s", message);
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID, fmi2String fmuResourceLocation,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean loggingOn)
{
    char why[1600] = "";
    (void)visible;
    Instance *self = functions != NULL ? calloc(1, sizeof *self) : NULL;
    if (self == NULL)
        return NULL;
    self->callbacks = *functions;
    self->name = malloc(strlen(instanceName != NULL ? instanceName : "") + 1);
    if (self->name != NULL)
        strcpy(self->name, instanceName != NULL ? instanceName : "");
    if (fmuType != fmi2CoSimulation)
        snprintf(why, sizeof why, "this FMU knows co-simulation only");
    else if (fmuGUID == NULL || strcmp(fmuGUID, misfit_system.guid) != 0)
        snprintf(why, sizeof why, "the GUID is not that of this FMU, %s", misfit_system.guid);
    else if (fmuResourceLocation == NULL || *fmuResourceLocation == '\0')
        snprintf(why, sizeof why, "the resource location is missing, where the components of this FMU are");
    else if (self->name != NULL)
        self->container = container_new(fmuResourceLocation, layer_tell, self, loggingOn, why, sizeof why);
    if (self->container != NULL)
        return self;
    layer_refuse(self, __func__, "%s", why);
    free(self->name);
    free(self);
    return NULL;
}

void fmi2FreeInstance(fmi2Component c)
{
    Instance *self = c;
    if (self == NULL)
        return;
    container_free(self->container);
    free(self->name);
    free(self);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime)
{
    Instance *self = c;
    if (!layer_allowed(self, __func__, IS(MADE)))
        return fmi2Error;
    return layer_answer(self, __func__,
                        container_set_up(self->container, toleranceDefined ? &tolerance : NULL, startTime,
                                         stopTimeDefined ? &stopTime : NULL));
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    Instance *self = c;
    if (!layer_allowed(self, __func__, IS(MADE)))
        return fmi2Error;
    return layer_broken(self, __func__, container_enter(self->container));
}

#define REALS (IS(FLOAT64) | IS(FLOAT32))
#define INTEGERS (IS(INT8) | IS(UINT8) | IS(INT16) | IS(UINT16) | IS(INT32) | IS(INT64))

GET_AND_SET(Real, REALS)
GET_AND_SET(Integer, INTEGERS)
GET_AND_SET(Boolean, IS(BOOLEAN))

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    Instance *self = c;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (!layer_allowed(self, __func__, IS(RUNNING)))
        return fmi2Error;
    if (!(communicationStepSize > 0.0))
        return layer_refuse(self, __func__, "the step is not a positive time");
    if (container_advance(self->container, currentCommunicationPoint + communicationStepSize) != 0)
        return layer_broken(self, __func__, -1);
    return self->container->clock.ended ? fmi2Discard : fmi2OK;
}

ABSENT(GetDirectionalDerivative,
       (fmi2Component c, const fmi2ValueReference unknowns[], size_t nUnknowns, const fmi2ValueReference knowns[],
        size_t nKnowns, const fmi2Real seed[], fmi2Real result[]), c, "not provided by this FMU")
ABSENT(SetRealInputDerivatives,
       (fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[], const fmi2Real value[]), c,
       "not provided by this FMU")
ABSENT(GetRealOutputDerivatives,
       (fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[], fmi2Real value[]), c,
       "not provided by this FMU")
ABSENT(CancelStep, (fmi2Component c), c, "no step is pending")
ABSENT(GetStatus, (fmi2Component c, const fmi2StatusKind s, fmi2Status *value), c, "this status is not available")
ABSENT(GetIntegerStatus, (fmi2Component c, const fmi2StatusKind s, fmi2Integer *value), c, "this status is not available")
ABSENT(GetStringStatus, (fmi2Component c, const fmi2StatusKind s, fmi2String *value), c, "this status is not available")

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value)
{
    Instance *self = c;
    if (self == NULL || s != fmi2LastSuccessfulTime || value == NULL)
        return layer_refuse(self, __func__, "this status is not available");
    *value = self->container->clock.time;
    return fmi2OK;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value)
{
    Instance *self = c;
    if (self == NULL || s != fmi2Terminated || value == NULL)
        return layer_refuse(self, __func__, "this status is not available");
    *value = self->container->clock.ended;
    return fmi2OK;
}
