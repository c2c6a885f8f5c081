/* The container as an FMU of version 3 for co-simulation. */
#include "fmi3_container.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define IS(stage) (1u << (stage))
#define BEFORE (IS(MADE) | IS(INITIALISING))
#define ANY (BEFORE | IS(RUNNING) | IS(OVER))

static void tell(void *owner, int status, const char *message)
{
    Instance *self = owner;
    if (self->logger != NULL)
        self->logger(self->environment, (fmi3Status)status, status >= fmi3Error ? "logStatusError" : "logAll", message);
}

fmi3Status container_refuse(Instance *self, const char *call, const char *why)
{
    char line[1800];
    if (self == NULL)
        return fmi3Error;
    snprintf(line, sizeof line, "%s: %s", call, why);
    tell(self, fmi3Error, line);
    return fmi3Error;
}

static int allowed(Instance *self, const char *call, unsigned stages)
{
    if (self == NULL)
        return 0;
    if (IS(self->container->clock.stage) & stages)
        return 1;
    container_refuse(self, call, "not allowed now, see the state machine of FMI 3.0");
    return 0;
}

static fmi3Status answer(Instance *self, const char *call, int done)
{
    return done == 0 ? fmi3OK : container_refuse(self, call, self->container->message);
}

/* A step or evaluation that failed half way leaves components at different times. */
static fmi3Status broken(Instance *self, const char *call, int done)
{
    if (done != 0)
        self->container->clock.stage = BROKEN;
    return answer(self, call, done);
}

const char *fmi3GetVersion(void) { return fmi3Version; }

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
        self->container = container_new(resourcePath, tell, self, loggingOn, why, sizeof why);
    if (self->container != NULL)
        return self;
    container_refuse(self, __func__, why);
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

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories, const fmi3String categories[])
{
    Instance *self = instance;
    (void)nCategories, (void)categories;
    if (!allowed(self, __func__, ANY))
        return fmi3Error;
    self->container->talkative = loggingOn;
    return fmi3OK;
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
{
    Instance *self = instance;
    if (!allowed(self, __func__, IS(MADE)))
        return fmi3Error;
    if (container_set_up(self->container, toleranceDefined ? &tolerance : NULL, startTime,
                         stopTimeDefined ? &stopTime : NULL) != 0)
        return answer(self, __func__, -1);
    return broken(self, __func__, container_enter(self->container));
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    Instance *self = instance;
    if (!allowed(self, __func__, IS(INITIALISING)))
        return fmi3Error;
    return broken(self, __func__, container_leave(self->container));
}

fmi3Status fmi3Terminate(fmi3Instance instance)
{
    Instance *self = instance;
    if (!allowed(self, __func__, IS(RUNNING)))
        return fmi3Error;
    container_terminate(self->container);
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
    Instance *self = instance;
    if (!allowed(self, __func__, ANY | IS(BROKEN)))
        return fmi3Error;
    return broken(self, __func__, container_reset(self->container));
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded,
                      fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime)
{
    Instance *self = instance;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (!allowed(self, __func__, IS(RUNNING)))
        return fmi3Error;
    if (eventHandlingNeeded == NULL || terminateSimulation == NULL || earlyReturn == NULL || lastSuccessfulTime == NULL)
        return container_refuse(self, __func__, "a place for results is missing");
    if (!(communicationStepSize > 0.0))
        return container_refuse(self, __func__, "the step is not a positive time");
    int done = container_advance(self->container, currentCommunicationPoint + communicationStepSize);
    *eventHandlingNeeded = *earlyReturn = fmi3False;
    *terminateSimulation = self->container->clock.ended != 0;
    *lastSuccessfulTime = self->container->clock.time;
    return broken(self, __func__, done);
}

/* Whether variables are there and of a kind; all of them are scalars. */
static int known(Instance *self, const char *call, const fmi3ValueReference vr[], size_t nvr, const void *values, size_t n,
                 int kind)
{
    if (!allowed(self, call, ANY))
        return 0;
    if (n != nvr || (nvr > 0 && (vr == NULL || values == NULL)))
        return container_refuse(self, call, "expected as many values as value references"), 0;
    for (size_t i = 0; i < nvr; i++) {
        char why[80];
        if (vr[i] < (uint32_t)misfit_system.n_variables && misfit_system.variables[vr[i]].kind == kind)
            continue;
        snprintf(why, sizeof why, "there is no variable of this type with the value reference %u", (unsigned)vr[i]);
        return container_refuse(self, call, why), 0;
    }
    return 1;
}

#define GET_AND_SET(Name, kind)                                                                                              \
    fmi3Status fmi3Get##Name(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr, fmi3##Name values[], size_t n) \
    {                                                                                                                        \
        Instance *self = instance;                                                                                           \
        if (!known(self, __func__, vr, nvr, values, n, kind))                                                                \
            return fmi3Error;                                                                                                \
        for (size_t i = 0; i < nvr; i++) {                                                                                   \
            double found;                                                                                                    \
            if (container_get(self->container, vr[i], &found) != 0)                                                          \
                return answer(self, __func__, -1);                                                                           \
            values[i] = (fmi3##Name)found;                                                                                   \
        }                                                                                                                    \
        return fmi3OK;                                                                                                       \
    }                                                                                                                        \
    fmi3Status fmi3Set##Name(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr, const fmi3##Name values[],    \
                             size_t n)                                                                                       \
    {                                                                                                                        \
        Instance *self = instance;                                                                                           \
        if (!known(self, __func__, vr, nvr, values, n, kind))                                                                \
            return fmi3Error;                                                                                                \
        for (size_t i = 0; i < nvr; i++)                                                                                     \
            if (container_set(self->container, vr[i], (double)values[i]) != 0)                                               \
                return answer(self, __func__, -1);                                                                           \
        return fmi3OK;                                                                                                       \
    }

GET_AND_SET(Float64, FLOAT64)
GET_AND_SET(Float32, FLOAT32)
GET_AND_SET(Int8, INT8)
GET_AND_SET(UInt8, UINT8)
GET_AND_SET(Int16, INT16)
GET_AND_SET(UInt16, UINT16)
GET_AND_SET(Int32, INT32)
GET_AND_SET(UInt32, UINT32)
GET_AND_SET(Int64, INT64)
GET_AND_SET(Boolean, BOOLEAN)

fmi3Status fmi3GetString(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr, fmi3String values[], size_t n)
{
    Instance *self = instance;
    if (!known(self, __func__, vr, nvr, values, n, TEXT))
        return fmi3Error;
    for (size_t i = 0; i < nvr; i++)
        if (container_get_text(self->container, vr[i], &values[i]) != 0)
            return answer(self, __func__, -1);
    return fmi3OK;
}

fmi3Status fmi3SetString(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr, const fmi3String values[], size_t n)
{
    Instance *self = instance;
    if (!known(self, __func__, vr, nvr, values, n, TEXT))
        return fmi3Error;
    for (size_t i = 0; i < nvr; i++)
        if (container_set_text(self->container, vr[i], values[i]) != 0)
            return answer(self, __func__, -1);
    return fmi3OK;
}

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *state)
{
    Instance *self = instance;
    if (!allowed(self, __func__, ANY) || state == NULL)
        return fmi3Error;
    return answer(self, __func__, container_save(self->container, (ContainerState **)state));
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState state)
{
    Instance *self = instance;
    if (!allowed(self, __func__, ANY | IS(BROKEN)) || state == NULL)
        return fmi3Error;
    return broken(self, __func__, container_restore(self->container, state));
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *state)
{
    Instance *self = instance;
    if (self == NULL)
        return fmi3Error;
    if (state != NULL && *state != NULL) {
        container_forget(self->container, *state);
        *state = NULL;
    }
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState state, size_t *size)
{
    Instance *self = instance;
    if (self == NULL || state == NULL || size == NULL)
        return fmi3Error;
    return answer(self, __func__, container_state_size(self->container, state, size));
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    Instance *self = instance;
    if (self == NULL || state == NULL || bytes == NULL)
        return fmi3Error;
    return answer(self, __func__, container_serialize(self->container, state, (char *)bytes, size));
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)
{
    Instance *self = instance;
    if (self == NULL || state == NULL || bytes == NULL)
        return fmi3Error;
    return answer(self, __func__, container_deserialize(self->container, (const char *)bytes, size, (ContainerState **)state));
}
