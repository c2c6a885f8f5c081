/* The container as an FMU of version 2 for co-simulation. */
#include "container.h"

#include "fmi2Functions.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    Container *container;
    fmi2CallbackFunctions callbacks;
    char *name;
} Instance;

#define IS(stage) (1u << (stage))
#define BEFORE (IS(MADE) | IS(INITIALISING))
#define ANY (BEFORE | IS(RUNNING) | IS(OVER))

static void tell(void *owner, int status, const char *message)
{
    Instance *self = owner;
    if (self->callbacks.logger != NULL)
        self->callbacks.logger(self->callbacks.componentEnvironment, self->name, (fmi2Status)status,
                               status >= fmi2Error ? "logStatusError" : "logAll", "%s", message);
}

static fmi2Status refuse(Instance *self, const char *call, const char *why)
{
    char line[1800];
    if (self == NULL)
        return fmi2Error;
    snprintf(line, sizeof line, "%s: %s", call, why);
    tell(self, fmi2Error, line);
    return fmi2Error;
}

static int allowed(Instance *self, const char *call, unsigned stages)
{
    if (self == NULL)
        return 0;
    if (IS(self->container->clock.stage) & stages)
        return 1;
    refuse(self, call, "not allowed now, see the state machine of FMI 2.0");
    return 0;
}

static fmi2Status answer(Instance *self, const char *call, int done)
{
    return done == 0 ? fmi2OK : refuse(self, call, self->container->message);
}

/* A step or evaluation that failed half way leaves components at different times. */
static fmi2Status broken(Instance *self, const char *call, int done)
{
    if (done != 0)
        self->container->clock.stage = BROKEN;
    return answer(self, call, done);
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

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
        self->container = container_new(fmuResourceLocation, tell, self, loggingOn, why, sizeof why);
    if (self->container != NULL)
        return self;
    refuse(self, __func__, why);
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

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories, const fmi2String categories[])
{
    Instance *self = c;
    (void)nCategories, (void)categories;
    if (!allowed(self, __func__, ANY))
        return fmi2Error;
    self->container->talkative = loggingOn;
    return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime)
{
    Instance *self = c;
    if (!allowed(self, __func__, IS(MADE)))
        return fmi2Error;
    return answer(self, __func__, container_set_up(self->container, toleranceDefined ? &tolerance : NULL, startTime,
                                                   stopTimeDefined ? &stopTime : NULL));
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    Instance *self = c;
    if (!allowed(self, __func__, IS(MADE)))
        return fmi2Error;
    return broken(self, __func__, container_enter(self->container));
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    Instance *self = c;
    if (!allowed(self, __func__, IS(INITIALISING)))
        return fmi2Error;
    return broken(self, __func__, container_leave(self->container));
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    Instance *self = c;
    if (!allowed(self, __func__, IS(RUNNING)))
        return fmi2Error;
    container_terminate(self->container);
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c)
{
    Instance *self = c;
    if (!allowed(self, __func__, ANY | IS(BROKEN)))
        return fmi2Error;
    return broken(self, __func__, container_reset(self->container));
}

/* Numbers of variables that are of one of the kinds. */
static int known(Instance *self, const char *call, const fmi2ValueReference vr[], size_t nvr, const void *values, unsigned kinds)
{
    if (!allowed(self, call, ANY))
        return 0;
    if (nvr > 0 && (vr == NULL || values == NULL))
        return refuse(self, call, "an array is missing"), 0;
    for (size_t i = 0; i < nvr; i++) {
        char why[80];
        if (vr[i] < (uint32_t)misfit_system.n_variables && (kinds & IS(misfit_system.variables[vr[i]].kind)))
            continue;
        snprintf(why, sizeof why, "there is no variable of this type with the value reference %u", vr[i]);
        return refuse(self, call, why), 0;
    }
    return 1;
}

#define REALS (IS(FLOAT64) | IS(FLOAT32))
#define INTEGERS (IS(INT8) | IS(UINT8) | IS(INT16) | IS(UINT16) | IS(INT32) | IS(INT64))
#define GET_AND_SET(Name, Type, kinds)                                                                                       \
    fmi2Status fmi2Get##Name(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2##Name value[])                 \
    {                                                                                                                        \
        Instance *self = c;                                                                                                  \
        if (!known(self, __func__, vr, nvr, value, kinds))                                                                   \
            return fmi2Error;                                                                                                \
        for (size_t i = 0; i < nvr; i++) {                                                                                   \
            double found;                                                                                                    \
            if (container_get(self->container, vr[i], &found) != 0)                                                          \
                return answer(self, __func__, -1);                                                                           \
            value[i] = (Type)found;                                                                                          \
        }                                                                                                                    \
        return fmi2OK;                                                                                                       \
    }                                                                                                                        \
    fmi2Status fmi2Set##Name(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2##Name value[])           \
    {                                                                                                                        \
        Instance *self = c;                                                                                                  \
        if (!known(self, __func__, vr, nvr, value, kinds))                                                                   \
            return fmi2Error;                                                                                                \
        for (size_t i = 0; i < nvr; i++)                                                                                     \
            if (container_set(self->container, vr[i], (double)value[i]) != 0)                                                \
                return answer(self, __func__, -1);                                                                           \
        return fmi2OK;                                                                                                       \
    }

GET_AND_SET(Real, fmi2Real, REALS)
GET_AND_SET(Integer, fmi2Integer, INTEGERS)
GET_AND_SET(Boolean, fmi2Boolean, IS(BOOLEAN))

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2String value[])
{
    Instance *self = c;
    if (!known(self, __func__, vr, nvr, value, IS(TEXT)))
        return fmi2Error;
    for (size_t i = 0; i < nvr; i++)
        if (container_get_text(self->container, vr[i], &value[i]) != 0)
            return answer(self, __func__, -1);
    return fmi2OK;
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2String value[])
{
    Instance *self = c;
    if (!known(self, __func__, vr, nvr, value, IS(TEXT)))
        return fmi2Error;
    for (size_t i = 0; i < nvr; i++)
        if (container_set_text(self->container, vr[i], value[i]) != 0)
            return answer(self, __func__, -1);
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    Instance *self = c;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (!allowed(self, __func__, IS(RUNNING)))
        return fmi2Error;
    if (!(communicationStepSize > 0.0))
        return refuse(self, __func__, "the step is not a positive time");
    if (container_advance(self->container, currentCommunicationPoint + communicationStepSize) != 0)
        return broken(self, __func__, -1);
    return self->container->clock.ended ? fmi2Discard : fmi2OK;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    Instance *self = c;
    if (!allowed(self, __func__, ANY) || state == NULL)
        return fmi2Error;
    return answer(self, __func__, container_save(self->container, (ContainerState **)state));
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    Instance *self = c;
    if (!allowed(self, __func__, ANY | IS(BROKEN)) || state == NULL)
        return fmi2Error;
    return broken(self, __func__, container_restore(self->container, state));
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    Instance *self = c;
    if (self == NULL)
        return fmi2Error;
    if (state != NULL && *state != NULL) {
        container_forget(self->container, *state);
        *state = NULL;
    }
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    Instance *self = c;
    if (self == NULL || state == NULL || size == NULL)
        return fmi2Error;
    return answer(self, __func__, container_state_size(self->container, state, size));
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    Instance *self = c;
    if (self == NULL || state == NULL || bytes == NULL)
        return fmi2Error;
    return answer(self, __func__, container_serialize(self->container, state, bytes, size));
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    Instance *self = c;
    if (self == NULL || state == NULL || bytes == NULL)
        return fmi2Error;
    return answer(self, __func__, container_deserialize(self->container, bytes, size, (ContainerState **)state));
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[], size_t nUnknowns,
                                        const fmi2ValueReference knowns[], size_t nKnowns, const fmi2Real seed[],
                                        fmi2Real result[])
{
    (void)unknowns, (void)nUnknowns, (void)knowns, (void)nKnowns, (void)seed, (void)result;
    return refuse(c, __func__, "not provided by this FMU");
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[],
                                       const fmi2Real value[])
{
    (void)vr, (void)nvr, (void)order, (void)value;
    return refuse(c, __func__, "not provided by this FMU");
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[],
                                        fmi2Real value[])
{
    (void)vr, (void)nvr, (void)order, (void)value;
    return refuse(c, __func__, "not provided by this FMU");
}

fmi2Status fmi2CancelStep(fmi2Component c) { return refuse(c, __func__, "no step is pending"); }

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *value)
{
    (void)s, (void)value;
    return refuse(c, __func__, "this status is not available");
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value)
{
    Instance *self = c;
    if (self == NULL || s != fmi2LastSuccessfulTime || value == NULL)
        return refuse(self, __func__, "this status is not available");
    *value = self->container->clock.time;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *value)
{
    (void)s, (void)value;
    return refuse(c, __func__, "this status is not available");
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value)
{
    Instance *self = c;
    if (self == NULL || s != fmi2Terminated || value == NULL)
        return refuse(self, __func__, "this status is not available");
    *value = self->container->clock.ended;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String *value)
{
    (void)s, (void)value;
    return refuse(c, __func__, "this status is not available");
}
