/* What the layers of all FMI versions do alike: messages, and the ends of the life cycle. */
#include "fmi.h"

#include <stdarg.h>
#include <stdio.h>

static void report(Instance *instance, FMI(Status) status, const char *call, const char *message)
{
    unsigned category = status == FMI(Discard) ? LOG_DISCARD : LOG_ERROR;
    if ((instance->core.categories & category) != 0)
        layer_tell(instance, status, category, call, message);
}

void layer_listen(void *owner, unsigned category, const char *message)
{
    layer_tell(owner, FMI(OK), category, "", message);
}

FMI(Status) layer_refuse(Instance *instance, const char *call, const char *format, ...)
{
    char message[640];
    va_list arguments;
    if (instance == NULL)
        return FMI(Error);
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    report(instance, FMI(Error), call, message);
    return FMI(Error);
}

FMI(Status) layer_failed(Instance *instance, const char *call, FMI(Status) status)
{
    report(instance, status, call, instance->core.message);
    return status;
}

FMI(Status) layer_outcome(Instance *instance, const char *call, int failed)
{
    return failed ? layer_failed(instance, call, FMI(Error)) : FMI(OK);
}

int layer_allowed(Instance *instance, const char *call, unsigned phases)
{
    if (instance == NULL)
        return 0;
    int allowed = ((unsigned)instance->core.state.phase & phases) != 0;
    if (!allowed)
        layer_refuse(instance, call, "not allowed while the FMU is %s", core_phase_name(&instance->core));
    return allowed;
}

int layer_present(Instance *instance, const char *call, const void *array, size_t count)
{
    if (array == NULL && count > 0)
        layer_refuse(instance, call, "null pointer for %zu values", count);
    return array != NULL || count == 0;
}

const char *FMI(GetVersion)(void) { return FMI(Version); }

FMI(Status) FMI(SetDebugLogging)(void *c, FMI(Boolean) loggingOn, size_t nCategories, const FMI(String) categories[])
{
    Instance *instance = c;
    if (!layer_allowed(instance, __func__, ANY_PHASE) || !layer_present(instance, __func__, categories, nCategories))
        return FMI(Error);
    const char *unknown = log_switch(&instance->core.categories, loggingOn, nCategories, categories);
    if (unknown != NULL)
        return layer_refuse(instance, __func__, "category '%s' is unknown; there are " LOG_NAMES, unknown);
    return FMI(OK);
}

FMI(Status) FMI(ExitInitializationMode)(void *c)
{
    Instance *instance = c;
    if (!layer_allowed(instance, __func__, PHASE_INITIALIZATION))
        return FMI(Error);
    return layer_outcome(instance, __func__, core_finish_initialization(&instance->core));
}

FMI(Status) FMI(Terminate)(void *c)
{
    Instance *instance = c;
    if (!layer_allowed(instance, __func__, PHASE_STEPPING | EXCHANGING))
        return FMI(Error);
    instance->core.state.phase = PHASE_TERMINATED;
    return FMI(OK);
}

FMI(Status) FMI(Reset)(void *c)
{
    Instance *instance = c;
    if (!layer_allowed(instance, __func__, ANY_PHASE))
        return FMI(Error);
    core_reset(&instance->core);
    return FMI(OK);
}
