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

static int advance(Core *core, double end)
{
    Integration run = {.n = N_STATES, .derivatives = derivatives, .jacobian = jacobian, .context = core,
                       .tolerance = core->state.tolerance, .nominal = core_nominals, .work = core->integrator_work,
                       .pivots = core->integrator_pivots};
    int first_known = N_DELAYS == 0 && core->outputs_valid;
    if (first_known)
        memcpy(run.work, core->dx, N_STATES * sizeof(double));
    for (double time = core->step_start; time < end;) {
        double piece_end = next_break(core, time, end);
        select_pieces(core, 0.5 * (time + piece_end));
        Outcome outcome = integrate(&run, &core->state.steps, time, piece_end, core->state.x, first_known);
        if (outcome != INTEGRATION_DONE)
            return explain(core, outcome, &run);
        time = piece_end;
        first_known = 0;
    }
    /* At a communication point a delayed jump counts from the right, within the step from the left. */
    core->outputs_valid = N_STATES > 0 && N_DELAYS == 0;
    core->algebraics_valid = 0;
    memcpy(core->dx, run.work, N_STATES * sizeof(double));
    return 0;
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
    double end = time + step;
    core->step_start = core->state.time;
    if ((N_DELAYS > 0 && record_sources(core, end) != 0) || advance(core, end) != 0) {
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
