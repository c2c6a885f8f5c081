/* The container as an FMU for co-simulation, in all versions. */
#include "fmi.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

FMI(Status) layer_refuse(Instance *self, const char *call, const char *format, ...)
{
    char line[1800];
    if (self == NULL)
        return FMI(Error);
    snprintf(line, 200, "%s: ", call);
    size_t used = strlen(line);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(line + used, sizeof line - used, format, arguments);
    va_end(arguments);
    layer_tell(self, FMI(Error), line);
    return FMI(Error);
}

int layer_allowed(Instance *self, const char *call, unsigned stages)
{
    if (self == NULL)
        return 0;
    if (IS(self->container->clock.stage) & stages)
        return 1;
    layer_refuse(self, call, "not allowed now, see the state machine of FMI %d.0", FMI_VERSION);
    return 0;
}

FMI(Status) layer_answer(Instance *self, const char *call, int done)
{
    return done == 0 ? FMI(OK) : layer_refuse(self, call, "%s", self->container->message);
}

FMI(Status) layer_broken(Instance *self, const char *call, int done)
{
    if (done != 0)
        self->container->clock.stage = BROKEN;
    return layer_answer(self, call, done);
}

int layer_known(Instance *self, const char *call, const FMI(ValueReference) vr[], size_t nvr, const void *values, int as_long,
                unsigned kinds)
{
    if (!layer_allowed(self, call, ANY))
        return 0;
    if (!as_long || (nvr > 0 && (vr == NULL || values == NULL)))
        return layer_refuse(self, call, "expected as many values as value references"), 0;
    for (size_t i = 0; i < nvr; i++) {
        if (vr[i] < (uint32_t)misfit_system.n_variables && (kinds & IS(misfit_system.variables[vr[i]].kind)))
            continue;
        layer_refuse(self, call, "there is no variable of this type with the value reference %u", (unsigned)vr[i]);
        return 0;
    }
    return 1;
}

const char *FMI(GetVersion)(void) { return FMI(Version); }

FMI(Status) FMI(SetDebugLogging)(void *c, FMI(Boolean) loggingOn, size_t nCategories, const FMI(String) categories[])
{
    Instance *self = c;
    (void)nCategories, (void)categories;
    if (!layer_allowed(self, __func__, ANY))
        return FMI(Error);
    self->container->talkative = loggingOn;
    return FMI(OK);
}

FMI(Status) FMI(ExitInitializationMode)(void *c)
{
    Instance *self = c;
    if (!layer_allowed(self, __func__, IS(INITIALISING)))
        return FMI(Error);
    return layer_broken(self, __func__, container_leave(self->container));
}

FMI(Status) FMI(Terminate)(void *c)
{
    Instance *self = c;
    if (!layer_allowed(self, __func__, IS(RUNNING)))
        return FMI(Error);
    container_terminate(self->container);
    return FMI(OK);
}

FMI(Status) FMI(Reset)(void *c)
{
    Instance *self = c;
    if (!layer_allowed(self, __func__, ANY | IS(BROKEN)))
        return FMI(Error);
    return layer_broken(self, __func__, container_reset(self->container));
}

FMI(Status) FMI(GetString)(void *c, const FMI(ValueReference) vr[], size_t nvr, FMI(String) values[] LENGTH)
{
    Instance *self = c;
    if (!layer_known(self, __func__, vr, nvr, values, AS_LONG(nvr), IS(TEXT)))
        return FMI(Error);
    for (size_t i = 0; i < nvr; i++)
        if (container_get_text(self->container, vr[i], &values[i]) != 0)
            return layer_answer(self, __func__, -1);
    return FMI(OK);
}

FMI(Status) FMI(SetString)(void *c, const FMI(ValueReference) vr[], size_t nvr, const FMI(String) values[] LENGTH)
{
    Instance *self = c;
    if (!layer_known(self, __func__, vr, nvr, values, AS_LONG(nvr), IS(TEXT)))
        return FMI(Error);
    for (size_t i = 0; i < nvr; i++)
        if (container_set_text(self->container, vr[i], values[i]) != 0)
            return layer_answer(self, __func__, -1);
    return FMI(OK);
}

FMI(Status) FMI(GetFMUState)(void *c, FMI(FMUState) *state)
{
    Instance *self = c;
    if (!layer_allowed(self, __func__, ANY) || state == NULL)
        return FMI(Error);
    return layer_answer(self, __func__, container_save(self->container, (ContainerState **)state));
}

FMI(Status) FMI(SetFMUState)(void *c, FMI(FMUState) state)
{
    Instance *self = c;
    if (!layer_allowed(self, __func__, ANY | IS(BROKEN)) || state == NULL)
        return FMI(Error);
    return layer_broken(self, __func__, container_restore(self->container, state));
}

FMI(Status) FMI(FreeFMUState)(void *c, FMI(FMUState) *state)
{
    Instance *self = c;
    if (self == NULL)
        return FMI(Error);
    if (state != NULL && *state != NULL) {
        container_forget(self->container, *state);
        *state = NULL;
    }
    return FMI(OK);
}

FMI(Status) FMI(SerializedFMUStateSize)(void *c, FMI(FMUState) state, size_t *size)
{
    Instance *self = c;
    if (self == NULL || state == NULL || size == NULL)
        return FMI(Error);
    return layer_answer(self, __func__, container_state_size(self->container, state, size));
}

FMI(Status) FMI(SerializeFMUState)(void *c, FMI(FMUState) state, FMI(Byte) bytes[], size_t size)
{
    Instance *self = c;
    if (self == NULL || state == NULL || bytes == NULL)
        return FMI(Error);
    return layer_answer(self, __func__, container_serialize(self->container, state, (char *)bytes, size));
}

FMI(Status) FMI(DeserializeFMUState)(void *c, const FMI(Byte) bytes[], size_t size, FMI(FMUState) *state)
{
    Instance *self = c;
    ContainerState **made = (ContainerState **)state;
    if (self == NULL || state == NULL || bytes == NULL)
        return FMI(Error);
    return layer_answer(self, __func__, container_deserialize(self->container, (const char *)bytes, size, made));
}
