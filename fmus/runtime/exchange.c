/* Model exchange: the importer sets time and states, and says when a step is complete or an event is handled.
 * The events of co-simulation with event mode are handled here too. */
#include "core.h"

#include <math.h>
#include <string.h>

int core_set_time(Core *core, double time)
{
    if (!isfinite(time))
        return core_fail(core, "time %g s is not a finite number", time);
    core->outputs_valid = core->outputs_valid && core->state.time == time;
    core->starts_valid = core->starts_valid && (!MODEL_SOLVES_START || core->outputs_valid);
    core->state.time = time;
    return 0;
}

int core_set_states(Core *core, const double *x)
{
    for (int i = 0; i < N_STATES; i++)
        if (!isfinite(x[i]))
            return core_fail(core, "'%s' = %g is not a finite number", core_names[VR_STATES + i], x[i]);
    memcpy(core->state.x, x, N_STATES * sizeof(double));
    core->outputs_valid = 0;
    return 0;
}

int core_finite_derivatives(Core *core)
{
    if (core_check_derivatives(core, core->state.time, core->state.x, core->dx) != 0)
        return -1;
    for (int i = 0; i < N_STATES; i++)
        if (!isfinite(core->dx[i]))
            return core_fail(core, "der(%s) = %g at t = %.9g s", core_names[VR_STATES + i], core->dx[i],
                             core->state.time);
    return 0;
}

/* What happened after `time` was a trial that the importer has taken back. */
static void rewind_record(History *history, double time)
{
    while (history->count > 1 && history->time[history->count - 1] > time)
        history->count--;
}

int core_complete_step(Core *core)
{
    double sources[N_DELAYS + 1], longest = 0.0, time = core->state.time;
    if (N_DELAYS == 0)
        return 0;
    if (core_evaluate_sources(core, time, core->state.u, sources) != 0)
        return -1;
    rewind_record(&core->history, time);
    int later = time > core->history.time[core->history.count - 1];
    int failed = later ? history_append(&core->history, time, sources) : history_jump(&core->history, sources);
    if (failed)
        return core_fail(core, "out of memory");
    for (int i = 0; i < N_DELAYS; i++)
        longest = fmax(longest, core->delay[i]);
    history_forget(&core->history, time - longest * (1.0 + 1e-9));
    core->outputs_valid = 0;
    return 0;
}

int core_update_events(Core *core, double *next)
{
    double time = core->state.time;
    int changed;
    if (core_complete_step(core) != 0 || core_evaluate_arguments(core) != 0 ||
        core_settle_relations(core, time, core->state.x, SETTLE_FROM_HERE, &changed) != 0 ||
        core_next_time_event(core, time, next) != 0)
        return -1;
    if (changed && core_count_event(core, time, 1e-9 * (1.0 + fabs(time))) != 0)
        return -1;
    core->outputs_valid = 0;
    core->state.event_pending = 0;
    for (int i = 0; i < N_DELAYS; i++) {
        double rounding = 1e-10 * (fabs(time) + core->delay[i]);
        double jump = history_next_jump(&core->history, (size_t)i, time - core->delay[i] + rounding);
        *next = fmin(*next, jump + core->delay[i]);
    }
    return 0;
}

int core_leave_events(Core *core)
{
    if (core_complete_step(core) != 0)
        return -1;
    core->state.event_time = core->state.time;
    core->state.phase = core->state.exchange ? PHASE_CONTINUOUS : PHASE_STEPPING;
    return 0;
}
