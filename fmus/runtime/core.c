#include "core.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

const char *const core_names[] = MODEL_VARIABLE_NAMES;
const double core_nominals[] = MODEL_NOMINALS;
static const double input_starts[] = MODEL_INPUT_STARTS;
static const double parameter_starts[] = MODEL_PARAMETER_STARTS;
static const int copies[] = MODEL_COPIES; /* of algebraic variables: the value reference that each repeats, or -1 */

int core_fail(Core *core, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(core->message, sizeof core->message, format, arguments);
    va_end(arguments);
    return -1;
}

void core_tell(Core *core, unsigned category, const char *format, ...)
{
    char text[512];
    va_list arguments;
    if ((core->categories & category) == 0 || core->listener == NULL)
        return;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    core->listener(core->owner, category, text);
}

static void invalidate(Core *core)
{
    core->starts_valid = core->outputs_valid = core->dependents_valid = 0;
}

void core_reset(Core *core)
{
    int exchange = core->state.exchange, event_mode = core->state.event_mode;
    int early_return = core->state.early_return;
    history_clear(&core->history);
    core->history.width = N_DELAYS;
    memset(&core->state, 0, sizeof core->state);
    core->state.exchange = exchange;
    core->state.event_mode = event_mode;
    core->state.early_return = early_return;
    core->state.phase = PHASE_INSTANTIATED;
    core->state.stop_time = HUGE_VAL;
    core->state.tolerance = MODEL_TOLERANCE;
    memcpy(core->state.u, input_starts, sizeof core->state.u);
    memcpy(core->state.p, parameter_starts, sizeof core->state.p);
    invalidate(core);
}

void core_release(Core *core)
{
    while (core->snapshots != NULL)
        core_free_snapshot(core, core->snapshots);
    history_clear(&core->history);
}

const char *core_phase_name(const Core *core)
{
    switch (core->state.phase) {
    case PHASE_INSTANTIATED: return "instantiated";
    case PHASE_INITIALIZATION: return "in initialization mode";
    case PHASE_STEPPING: return "stepping";
    case PHASE_EVENT: return "in event mode";
    case PHASE_CONTINUOUS: return "in continuous-time mode";
    default: return "terminated";
    }
}

int core_set_up(Core *core, const double *tolerance, double start_time, const double *stop_time)
{
    if (tolerance != NULL && !(*tolerance > 0.0 && *tolerance < 1.0))
        return core_fail(core, "tolerance %g is not between 0 and 1", *tolerance);
    if (!isfinite(start_time))
        return core_fail(core, "start time %g is not a finite number", start_time);
    if (stop_time != NULL && !(*stop_time > start_time))
        return core_fail(core, "stop time %g s is not after start time %g s", *stop_time, start_time);
    core->state.tolerance = tolerance != NULL ? *tolerance : MODEL_TOLERANCE;
    core->state.time = start_time;
    core->starts_valid = core->outputs_valid = 0;
    core->state.stop_time = stop_time != NULL ? *stop_time : HUGE_VAL;
    return 0;
}

static int unknown(Core *core, unsigned int reference)
{
    return core_fail(core, "value reference %u is unknown; this model has 0 to %u", reference, (unsigned)VR_LAST);
}

static int get_indicator(Core *core, unsigned int i, double *value)
{
    double indicators[N_INDICATORS + 1];
    if (core_evaluate_outputs(core) != 0 || core_evaluate_indicators(core, indicators) != 0)
        return -1;
    *value = indicators[i];
    return 0;
}

static int get_algebraic(Core *core, unsigned int i, double *value)
{
    if (copies[i] >= 0)
        return core_get(core, (unsigned int)copies[i], value);
    if (core_evaluate_algebraics(core) != 0)
        return -1;
    *value = core->z[i];
    return 0;
}

int core_get(Core *core, unsigned int reference, double *value)
{
    if (reference < VR_STATES)
        *value = core->state.u[reference];
    else if (reference < VR_DERIVATIVES) {
        if (core_evaluate_starts(core) != 0)
            return -1;
        *value = core->state.x[reference - VR_STATES];
    } else if (reference < VR_ALGEBRAICS) {
        if (core_evaluate_outputs(core) != 0 ||
            core_check_derivatives(core, core->state.time, core->state.x, core->dx) != 0)
            return -1;
        *value = core->dx[reference - VR_DERIVATIVES];
    } else if (reference < VR_PARAMETERS)
        return get_algebraic(core, reference - VR_ALGEBRAICS, value);
    else if (reference < VR_DEPENDENTS)
        *value = core->state.p[reference - VR_PARAMETERS];
    else if (reference < VR_TIME) {
        if (core_evaluate_dependents(core) != 0)
            return -1;
        *value = core->dependents[reference - VR_DEPENDENTS];
    } else if (reference == VR_TIME)
        *value = core->state.time;
    else if (reference <= VR_LAST)
        return get_indicator(core, reference - VR_INDICATORS, value);
    else
        return unknown(core, reference);
    return 0;
}

static int set_start(Core *core, unsigned int reference, double value)
{
    if (core->state.phase > PHASE_INITIALIZATION)
        return core_fail(core, "state '%s' can be set before and during initialization only", core_names[reference]);
    core->state.start[reference - VR_STATES] = value;
    core->state.start_given[reference - VR_STATES] = 1;
    core->starts_valid = core->outputs_valid = 0;
    return 0;
}

int core_set(Core *core, unsigned int reference, double value)
{
    if (reference > VR_LAST)
        return unknown(core, reference);
    if (!isfinite(value))
        return core_fail(core, "'%s' = %g is not a finite number", core_names[reference], value);
    if (reference < VR_STATES) {
        core->outputs_valid = core->outputs_valid && core->state.u[reference] == value;
        core->starts_valid = core->starts_valid && (!MODEL_SOLVES_START || core->outputs_valid);
        core->state.u[reference] = value;
    } else if (reference < VR_DERIVATIVES)
        return set_start(core, reference, value);
    else if (reference >= VR_PARAMETERS && reference < VR_DEPENDENTS) {
        core->state.p[reference - VR_PARAMETERS] = value;
        invalidate(core);
    } else
        return core_fail(core, "'%s' is computed by the model and cannot be set", core_names[reference]);
    return 0;
}

int core_set_input_slope(Core *core, unsigned int reference, double slope)
{
    if (reference > VR_LAST)
        return unknown(core, reference);
    if (reference >= VR_STATES)
        return core_fail(core, "'%s' is not an input", core_names[reference]);
    if (!isfinite(slope))
        return core_fail(core, "the derivative %g of '%s' is not a finite number", slope, core_names[reference]);
    core->state.u_slope[reference] = slope;
    return 0;
}

int core_finish_initialization(Core *core)
{
    double sources[N_DELAYS + 1];
    if (core_evaluate_starts(core) != 0)
        return -1;
    for (int i = 0; i < N_STATES; i++)
        if (!isfinite(core->state.x[i]))
            return core_fail(core, "start value of '%s' is %g", core_names[VR_STATES + i], core->state.x[i]);
    if (N_DELAYS > 0) {
        if (core_evaluate_sources(core, core->state.time, core->state.u, sources) != 0)
            return -1;
        if (history_append(&core->history, core->state.time, sources) != 0)
            return core_fail(core, "out of memory");
    }
    if (N_EVENT_VALUES > 0 && core_evaluate_outputs(core) != 0)
        return -1;
    core->state.last_event = -HUGE_VAL;
    core->state.phase = core->state.exchange || core->state.event_mode ? PHASE_EVENT : PHASE_STEPPING;
    return 0;
}
