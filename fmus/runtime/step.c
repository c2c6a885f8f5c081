/* A communication step: record the sources, cut the step where a delayed jump arrives, integrate. */
#include "core.h"

#include <math.h>
#include <string.h>

static void select_inputs(Core *core, double time)
{
    for (int i = 0; i < N_INPUTS; i++)
        core->u_now[i] = core->state.u[i] + core->state.u_slope[i] * (time - core->step_start);
    for (int i = 0; i < N_DELAYS; i++)
        core->d_now[i] = core->pieces[i].value + core->pieces[i].slope * (time - core->pieces[i].time);
}

static int derivatives(void *context, double time, const double *x, double *dx)
{
    Core *core = context;
    select_inputs(core, time);
    return core_evaluate_derivatives(core, time, x, dx) != 0 ? -1 : core_check_derivatives(core, time, x, dx);
}

static int jacobian(void *context, double time, const double *x, double *by_x, double *by_t)
{
    Core *core = context;
    select_inputs(core, time);
    return core_evaluate_jacobian(core, time, x, by_x, by_t);
}

/* Sources at both ends of the step: the end is needed by delays shorter than the step. */
static int record_sources(Core *core, double end)
{
    double sources[N_DELAYS + 1], u_end[N_INPUTS + 1];
    if (core_evaluate_sources(core, core->step_start, core->state.u, sources) != 0)
        return -1;
    if (history_jump(&core->history, sources) != 0)
        return core_fail(core, "out of memory");
    for (int i = 0; i < N_INPUTS; i++)
        u_end[i] = core->state.u[i] + core->state.u_slope[i] * (end - core->step_start);
    if (core_evaluate_sources(core, end, u_end, sources) != 0)
        return -1;
    if (history_append(&core->history, end, sources) != 0)
        return core_fail(core, "out of memory");
    return 0;
}

/* Where the next jump or kink leaves a delay operator, or `end`. */
static double next_break(const Core *core, double time, double end)
{
    double nearest = end;
    for (int i = 0; i < N_DELAYS; i++) {
        double rounding = 1e-10 * (fabs(end) + core->delay[i]);
        double after = time - core->delay[i] + rounding, before = nearest - core->delay[i] - rounding;
        nearest = fmin(nearest, history_next_break(&core->history, (size_t)i, after, before) + core->delay[i]);
    }
    return nearest;
}

static void select_pieces(Core *core, double middle)
{
    for (int i = 0; i < N_DELAYS; i++) {
        core->pieces[i] = history_line(&core->history, (size_t)i, middle - core->delay[i]);
        core->pieces[i].time += core->delay[i];
    }
}

static int explain(Core *core, Outcome outcome, const Integration *run)
{
    const char *name = core_names[VR_STATES + run->culprit];
    if (outcome == INTEGRATION_NOT_FINITE && core->unsolved)
        return -1;
    if (outcome == INTEGRATION_NOT_FINITE)
        return core_fail(core, "der(%s) is not a finite number at t = %.9g s", name, run->time);
    if (outcome == INTEGRATION_STEP_TOO_SMALL)
        return core_fail(core, "the step became too small for '%s' at t = %.9g s", name, run->time);
    return core_fail(core, "too many internal steps at t = %.9g s; '%s' limits them", run->time, name);
}

static int margin(void *context, double time, const double *x, double *least)
{
    Core *core = context;
    select_inputs(core, time);
    return core_relation_margin(core, time, x, least);
}

/* Where delayed values break or a timed relation changes, or `end`; a clock that ticks there to rounding ticks at the end. */
static int piece_end(Core *core, double time, double step, double end, double *until)
{
    double event;
    if (core_next_time_event(core, time, &event) != 0)
        return -1;
    *until = next_break(core, time, event < end - 1e-9 * step ? event : end);
    return 0;
}

/* Relations after a piece of the step. With event mode they are left to the importer, who is told. */
static int handle_event(Core *core, double time, double step, int found, int *changed)
{
    double before[N_EVENT_VALUES + 1], states[N_STATES + 1];
    memcpy(before, core->state.relations, sizeof before);
    memcpy(states, core->state.x, sizeof states);
    select_inputs(core, time);
    if (core_settle_relations(core, time, core->state.x, SETTLE_FROM_HERE, changed) != 0)
        return -1;
    if (!found && !*changed)
        return 0;
    core->state.steps.step = core->state.steps.error = 0.0; /* the slope has jumped */
    /* Events that are this much closer than communication points leave no time between them. */
    if (core_count_event(core, time, 1e-7 * step) != 0)
        return -1;
    if (core->state.event_mode && core->state.early_return) {
        memcpy(core->state.relations, before, sizeof before);
        memcpy(core->state.x, states, sizeof states);
        core->state.event_pending = 1;
    }
    return 0;
}

/* Integrates up to `end`, or to the first event when steps end there; gives where in `*end`. */
static int advance(Core *core, double *end)
{
    Integration run = {.n = N_STATES, .derivatives = derivatives, .jacobian = jacobian, .context = core,
                       .margin = N_INDICATORS > 0 ? margin : NULL, .tolerance = core->state.tolerance,
                       .nominal = core_nominals, .work = core->integrator_work, .pivots = core->integrator_pivots};
    int known = N_DELAYS == 0 && core->outputs_valid, waits = 0;
    double step = *end - core->step_start;
    if (known)
        memcpy(run.work, core->dx, N_STATES * sizeof(double));
    for (double time = core->step_start; time < *end && !core->state.event_pending;) {
        double until;
        if (piece_end(core, time, step, *end, &until) != 0)
            return -1;
        select_pieces(core, 0.5 * (time + until));
        Outcome outcome = integrate(&run, &core->state.steps, time, until, core->state.x, known);
        if (outcome != INTEGRATION_DONE && outcome != INTEGRATION_EVENT)
            return explain(core, outcome, &run);
        int found = outcome == INTEGRATION_EVENT, changed = 0;
        time = found ? run.time : until;
        /* What is due at the end waits for the inputs that are set there: a controller samples them in the same instant. */
        if (N_EVENT_VALUES > 0 && !found && time >= *end && !core->state.event_mode)
            waits = 1;
        else if (N_EVENT_VALUES > 0 && handle_event(core, time, step, found, &changed) != 0)
            return -1;
        known = N_DELAYS == 0 && !found && !changed && !waits;
        if (core->state.event_pending)
            *end = time;
    }
    /* At a communication point a delayed jump counts from the right, within the step from the left. */
    core->outputs_valid = N_STATES > 0 && known;
    core->algebraics_valid = 0;
    memcpy(core->dx, run.work, N_STATES * sizeof(double));
    return 0;
}

/* The record of a step that an event has cut short. */
static int cut_record(Core *core, double end)
{
    core->history.count--;
    double sources[N_DELAYS + 1];
    select_inputs(core, end);
    if (core_evaluate_sources(core, end, core->u_now, sources) != 0)
        return -1;
    return history_append(&core->history, end, sources) != 0 ? core_fail(core, "out of memory") : 0;
}

static int check_step(Core *core, double time, double step)
{
    double now = core->state.time;
    if (!isfinite(time) || fabs(time - now) > 1e-9 * (fabs(now) + fabs(step)))
        return core_fail(core, "the step starts at t = %.9g s, but the model is at t = %.9g s", time, now);
    if (!isfinite(step) || !(now + step > now))
        return core_fail(core, "step size %g s at t = %.9g s; it must be positive", step, now);
    if (now + step > core->state.stop_time + 1e-5 * step)
        return core_fail(core, "the step to t = %.9g s goes beyond the stop time %.9g s", now + step,
                         core->state.stop_time);
    return 0;
}

int core_step(Core *core, double time, double step)
{
    State before = core->state;
    size_t recorded = core->history.count;
    if (check_step(core, time, step) != 0)
        return -1;
    /* The caller's clock counts: adding up steps here would drift away from it. */
    double planned = time + step, end = planned;
    core->step_start = core->state.time;
    core->state.event_pending = 0;
    if ((N_EVENT_VALUES > 0 && core_evaluate_outputs(core) != 0) ||
        (N_DELAYS > 0 && record_sources(core, planned) != 0) || advance(core, &end) != 0 ||
        (N_DELAYS > 0 && end < planned && cut_record(core, end) != 0)) {
        core->state = before;
        core->history.count = recorded;
        core->outputs_valid = 0;
        return -1;
    }
    double longest = 0.0;
    for (int i = 0; i < N_DELAYS; i++)
        longest = fmax(longest, core->delay[i]);
    history_forget(&core->history, end - longest * (1.0 + 1e-9));
    for (int i = 0; i < N_INPUTS; i++) {
        core->state.u[i] += core->state.u_slope[i] * (end - core->step_start);
        core->state.u_slope[i] = 0.0;
    }
    core->state.time = end;
    return 0;
}
