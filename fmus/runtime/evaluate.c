/* Calls of the generated functions, repeated only when something they depend on has changed. */
#include "core.h"

#include <math.h>
#include <string.h>

int core_call(Core *core, ModelFunction *function, const char *what)
{
    if (function(core->arg, core->res, core->iw, core->w, 0) != 0)
        return core_fail(core, "the %s could not be evaluated at t = %.9g s", what, core->state.time);
    return 0;
}

static int solve_starts(Core *core)
{
    core->arg[0] = &core->state.time;
    core->arg[1] = core->state.u;
    core->arg[2] = core->state.p;
    core->arg[3] = core->proposed;
    core->res[0] = core->state.x;
    if (core_call(core, model_consistent, "start values") != 0)
        return -1;
    for (int i = 0; i < N_STATES; i++)
        if (!isfinite(core->state.x[i]))
            return core_fail(core, "no start value of '%s' was found that satisfies the initial equations; give start "
                             "values nearer to a solution", core_names[VR_STATES + i]);
    return 0;
}

int core_evaluate_starts(Core *core)
{
    /* After initialization x is the solution, whatever happens to the parameters. */
    if (core->starts_valid || core->state.phase > PHASE_INITIALIZATION)
        return 0;
    core->arg[0] = core->state.p;
    core->res[0] = core->proposed;
    if (core_call(core, model_initial, "start values") != 0)
        return -1;
    for (int i = 0; i < N_STATES; i++)
        if (core->state.start_given[i])
            core->proposed[i] = core->state.start[i];
    memcpy(core->state.x, core->proposed, N_STATES * sizeof(double));
    if (MODEL_SOLVES_START && solve_starts(core) != 0)
        return -1;
    core->starts_valid = 1;
    return 0;
}

int core_evaluate_dependents(Core *core)
{
    if (core->dependents_valid)
        return 0;
    core->arg[0] = core->state.p;
    core->res[0] = core->dependents;
    if (core_call(core, model_dependent, "dependent parameters") != 0)
        return -1;
    core->dependents_valid = 1;
    return 0;
}

int core_evaluate_sources(Core *core, double time, const double *u, double *sources)
{
    core->arg[0] = &time;
    core->arg[1] = u;
    core->arg[2] = core->state.p;
    core->res[0] = sources;
    core->res[1] = core->delay;
    if (core_call(core, model_history, "delayed values") != 0)
        return -1;
    for (int i = 0; i < N_DELAYS; i++) {
        if (!(core->delay[i] >= 0.0 && core->delay[i] < HUGE_VAL))
            return core_fail(core, "delay operator %d: delay %g s at t = %.9g s; it must be zero or positive", i + 1,
                             core->delay[i], time);
        if (!isfinite(sources[i]))
            return core_fail(core, "delay operator %d: its argument is %g at t = %.9g s", i + 1, sources[i], time);
    }
    return 0;
}

int core_evaluate_derivatives(Core *core, double time, const double *x, double *dx)
{
    core_pass(core, &time, x);
    core->res[0] = dx;
    return core_call(core, model_derivatives, "model equations");
}

int core_evaluate_jacobian(Core *core, double time, const double *x, double *by_x, double *by_t)
{
    static const double one = 1.0, none[N_STATES + N_PARAMETERS + N_EVENT_VALUES + 1];
    double d_slope[N_DELAYS + 1];
    for (int i = 0; i < N_DELAYS; i++)
        d_slope[i] = core->pieces[i].slope;
    core_pass(core, &time, x);
    core->res[0] = by_x;
    if (core_call(core, model_jacobian, "Jacobian of the model equations") != 0)
        return -1;
    core->arg[6] = &one;
    core->arg[7] = none;
    core->arg[8] = core->state.u_slope;
    core->arg[9] = d_slope;
    core->arg[10] = none;
    core->arg[11] = none;
    core->res[0] = by_t;
    core->res[1] = NULL;
    return core_call(core, model_rhs_tangent, "time derivatives of the model equations");
}

/* One delayed value: where a jump arrives just now, from the right at communication points and events, but from
 * the left where an importer's integrator arrives at the end of a step. */
static double delayed_value(const Core *core, int i, double now, DelaySensitivity *sensitivity)
{
    const History *history = &core->history;
    double time = core->state.time, delay = core->delay[i], then = time - delay;
    double rounding = 1e-10 * (fabs(time) + delay);
    int arriving = core->state.phase == PHASE_CONTINUOUS && time > core->state.event_time;
    *sensitivity = (DelaySensitivity){.source = 1.0};
    if (history->count == 0 || delay <= rounding)
        return now;
    Line line = history_line(history, (size_t)i, arriving ? then - rounding : then + rounding);
    double last = history->time[history->count - 1];
    if (then <= last + rounding) {
        *sensitivity = (DelaySensitivity){.time = line.slope, .delay = -line.slope};
        return line.value + line.slope * (then - line.time);
    }
    /* Within a step that is not complete yet: straight from its beginning to the present. */
    double share = (then - last) / (time - last), slope = (now - line.value) / (time - last);
    *sensitivity = (DelaySensitivity){share, slope * delay / (time - last), -slope};
    return line.value + share * (now - line.value);
}

static int delayed_values(Core *core)
{
    double now[N_DELAYS + 1];
    if (core_evaluate_sources(core, core->state.time, core->state.u, now) != 0)
        return -1;
    for (int i = 0; i < N_DELAYS; i++)
        core->d_now[i] = delayed_value(core, i, now[i], &core->d_sensitivity[i]);
    return 0;
}

int core_evaluate_arguments(Core *core)
{
    if (core_evaluate_starts(core) != 0 || (N_DELAYS > 0 && delayed_values(core) != 0))
        return -1;
    memcpy(core->u_now, core->state.u, sizeof core->u_now);
    return 0;
}

/* Before a run and at communication points relations follow the values; in model exchange they wait for an event. */
static int settle(Core *core)
{
    int changed, starting = core->state.phase <= PHASE_INITIALIZATION;
    if (N_EVENT_VALUES == 0 || (!starting && (core->state.phase != PHASE_STEPPING || core->state.event_mode)))
        return 0;
    if (core_settle_relations(core, core->state.time, core->state.x, starting ? SETTLE_FRESH : SETTLE_FROM_HERE, &changed) != 0)
        return -1;
    if (changed)
        core->state.steps.step = core->state.steps.error = 0.0; /* the slope has jumped */
    return 0;
}

int core_evaluate_outputs(Core *core)
{
    if (core->outputs_valid)
        return 0;
    if (core_evaluate_arguments(core) != 0 || settle(core) != 0)
        return -1;
    if (core_evaluate_derivatives(core, core->state.time, core->state.x, core->dx) != 0)
        return -1;
    core->outputs_valid = 1;
    core->algebraics_valid = 0;
    return 0;
}

int core_evaluate_algebraics(Core *core)
{
    if (core_evaluate_outputs(core) != 0)
        return -1;
    if (core->algebraics_valid)
        return 0;
    core_pass(core, &core->state.time, core->state.x);
    core->res[0] = NULL;
    core->res[1] = core->z;
    if (core_call(core, model_rhs, "model equations") != 0)
        return -1;
    if (core_check_algebraics(core) != 0)
        return -1;
    core->algebraics_valid = 1;
    return 0;
}
