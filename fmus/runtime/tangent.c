/* Directional derivatives: tangents of the generated functions, chained through start values and delays. */
#include "sensitivity.h"

#include <math.h>
#include <string.h>

static int is_start(const State *state) { return state->phase <= PHASE_INITIALIZATION; }

double *sensitivity_of(Sensitivity *all, unsigned int reference)
{
    if (reference < VR_STATES)
        return &all->u[reference];
    if (reference < VR_DERIVATIVES)
        return &all->x[reference - VR_STATES];
    if (reference < VR_ALGEBRAICS)
        return &all->dx[reference - VR_DERIVATIVES];
    if (reference < VR_PARAMETERS)
        return &all->z[reference - VR_ALGEBRAICS];
    if (reference < VR_DEPENDENTS)
        return &all->p[reference - VR_PARAMETERS];
    if (reference < VR_TIME)
        return &all->dependents[reference - VR_DEPENDENTS];
    return reference == VR_TIME ? &all->time : &all->indicators[reference - VR_INDICATORS];
}

static int is_state(unsigned int reference) { return reference >= VR_STATES && reference < VR_DERIVATIVES; }

/* Whether a variable is given, not computed by the model. */
static int is_given(unsigned int reference)
{
    return reference < VR_STATES || (reference >= VR_PARAMETERS && reference < VR_DEPENDENTS) || reference == VR_TIME;
}

static int check(Core *core, unsigned int reference, int allowed, const char *instead)
{
    if (reference > VR_LAST)
        return core_fail(core, "value reference %u is unknown; this model has 0 to %u", reference, (unsigned)VR_LAST);
    return allowed ? 0 : core_fail(core, "'%s' is %s", core_names[reference], instead);
}

/* Until the run has started, start values that nobody has set follow the parameters, and all initial conditions hold. */
static int change_starts(Core *core, Sensitivity *change)
{
    double x0[N_STATES + 1];
    core->arg[0] = core->state.p;
    core->arg[1] = change->p;
    core->res[0] = x0;
    if (core_call(core, model_initial_tangent, "derivatives of the start values") != 0)
        return -1;
    for (int i = 0; i < N_STATES; i++)
        if (!core->state.start_given[i])
            change->x[i] += x0[i];
    if (!MODEL_SOLVES_START)
        return 0;
    core->arg[0] = &core->state.time;
    core->arg[1] = core->state.u;
    core->arg[2] = core->state.p;
    core->arg[3] = core->proposed;
    core->arg[4] = &change->time;
    core->arg[5] = change->u;
    core->arg[6] = change->p;
    core->arg[7] = change->x;
    core->res[0] = x0;
    if (core_call(core, model_consistent_tangent, "derivatives of the start values") != 0)
        return -1;
    memcpy(change->x, x0, sizeof x0);
    return 0;
}

static int change_delayed(Core *core, Sensitivity *change)
{
    double sources[N_DELAYS + 1], delays[N_DELAYS + 1];
    core->arg[0] = &core->state.time;
    core->arg[1] = core->state.u;
    core->arg[2] = core->state.p;
    core->arg[3] = &change->time;
    core->arg[4] = change->u;
    core->arg[5] = change->p;
    core->res[0] = sources;
    core->res[1] = delays;
    if (core_call(core, model_history_tangent, "derivatives of the delayed values") != 0)
        return -1;
    for (int i = 0; i < N_DELAYS; i++) {
        const DelaySensitivity *by = &core->d_sensitivity[i];
        change->d[i] = by->source * sources[i] + by->time * change->time + by->delay * delays[i];
    }
    return 0;
}

/* Arguments of a function of time, states, inputs, delayed values and parameters; relations keep their side. */
static void pass_change(Core *core, const Sensitivity *change)
{
    static const double none[N_EVENT_VALUES + 1];
    core_pass(core, &core->state.time, core->state.x);
    core->arg[6] = &change->time;
    core->arg[7] = change->x;
    core->arg[8] = change->u;
    core->arg[9] = change->d;
    core->arg[10] = change->p;
    core->arg[11] = none;
}

static int change_outputs(Core *core, Sensitivity *change)
{
    pass_change(core, change);
    core->res[0] = change->dx;
    core->res[1] = change->z;
    return core_call(core, model_rhs_tangent, "derivatives of the model equations");
}

static int change_indicators(Core *core, Sensitivity *change)
{
    if (N_INDICATORS == 0)
        return 0;
    pass_change(core, change);
    core->res[0] = change->indicators;
    core->res[1] = NULL;
    return core_call(core, model_indicators_tangent, "derivatives of the event indicators");
}

static int change_dependents(Core *core, Sensitivity *change)
{
    core->arg[0] = core->state.p;
    core->arg[1] = change->p;
    core->res[0] = change->dependents;
    return core_call(core, model_dependent_tangent, "derivatives of the dependent parameters");
}

int core_directional(Core *core, const unsigned int *unknowns, size_t n_unknowns, const unsigned int *knowns,
                     size_t n_knowns, const double *seed, double *sensitivity)
{
    Sensitivity change = {0};
    for (size_t i = 0; i < n_knowns; i++) {
        if (!isfinite(seed[i]))
            return core_fail(core, "the seed %g is not a finite number", seed[i]);
        const int allowed = is_given(knowns[i]) || is_state(knowns[i]);
        if (check(core, knowns[i], allowed, "computed by the model and cannot be a known") != 0)
            return -1;
        *sensitivity_of(&change, knowns[i]) += seed[i];
    }
    if (core_evaluate_outputs(core) != 0 || (is_start(&core->state) && change_starts(core, &change) != 0) ||
        (N_DELAYS > 0 && change_delayed(core, &change) != 0) || change_outputs(core, &change) != 0 ||
        change_indicators(core, &change) != 0 || change_dependents(core, &change) != 0)
        return -1;
    for (size_t i = 0; i < n_unknowns; i++) {
        if (check(core, unknowns[i], !is_given(unknowns[i]), "not computed by the model and cannot be an unknown") != 0)
            return -1;
        sensitivity[i] = *sensitivity_of(&change, unknowns[i]);
    }
    return 0;
}
