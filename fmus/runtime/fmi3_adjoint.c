/* FMI 3.0: adjoint derivatives, by reverse mode through the model equations, delays and start values. */
#include "fmi3.h"
#include "sensitivity.h"

#include <math.h>
#include <string.h>

/* Reverse mode: the same arguments followed by one seed for each result -> the share of each argument. */
ModelFunction model_rhs_adjoint;
ModelFunction model_history_adjoint;
ModelFunction model_dependent_adjoint;
ModelFunction model_initial_adjoint;
ModelFunction model_consistent_adjoint;

static int add_seed(Core *core, Sensitivity *weights, unsigned reference, double seed)
{
    if (!isfinite(seed))
        return core_fail(core, "the seed %g is not a finite number", seed);
    if (reference < VR_STATES || reference >= VR_TIME || (reference >= VR_PARAMETERS && reference < VR_DEPENDENTS))
        return core_fail(core, "value reference %u is not that of an unknown", reference);
    *sensitivity_of(weights, reference) += seed;
    return 0;
}

static void add(double *sum, const double *more, int n)
{
    for (int i = 0; i < n; i++)
        sum[i] += more[i];
}

static int through_equations(Core *core, Sensitivity *weights)
{
    Sensitivity share;
    core_pass(core, &core->state.time, core->state.x);
    core->arg[6] = weights->dx;
    core->arg[7] = weights->z;
    core->res[0] = &weights->time;
    core->res[1] = share.x;
    core->res[2] = weights->u;
    core->res[3] = weights->d;
    core->res[4] = weights->p;
    core->res[5] = NULL;
    if (core_call(core, model_rhs_adjoint, "derivatives of the model equations") != 0)
        return -1;
    add(weights->x, share.x, N_STATES);
    return 0;
}

static int through_delays(Core *core, Sensitivity *weights)
{
    double sources[N_DELAYS + 1], delays[N_DELAYS + 1];
    Sensitivity share;
    for (int i = 0; i < N_DELAYS; i++) {
        const DelaySensitivity *by = &core->d_sensitivity[i];
        sources[i] = by->source * weights->d[i];
        delays[i] = by->delay * weights->d[i];
        weights->time += by->time * weights->d[i];
    }
    core->arg[0] = &core->state.time;
    core->arg[1] = core->state.u;
    core->arg[2] = core->state.p;
    core->arg[3] = sources;
    core->arg[4] = delays;
    core->res[0] = &share.time;
    core->res[1] = share.u;
    core->res[2] = share.p;
    if (core_call(core, model_history_adjoint, "derivatives of the delayed values") != 0)
        return -1;
    weights->time += share.time;
    add(weights->u, share.u, N_INPUTS);
    add(weights->p, share.p, N_PARAMETERS);
    return 0;
}

/* A function of the parameters alone. */
static int through_parameters(Core *core, Sensitivity *weights, ModelFunction *function, const double *seed)
{
    double share[N_PARAMETERS + 1];
    core->arg[0] = core->state.p;
    core->arg[1] = seed;
    core->res[0] = share;
    if (core_call(core, function, "derivatives by the parameters") != 0)
        return -1;
    add(weights->p, share, N_PARAMETERS);
    return 0;
}

/* From the start values to those proposed for them, and to all else that the initial conditions contain. */
static int through_conditions(Core *core, Sensitivity *weights)
{
    double time, u[N_INPUTS + 1], p[N_PARAMETERS + 1], proposed[N_STATES + 1];
    core->arg[0] = &core->state.time;
    core->arg[1] = core->state.u;
    core->arg[2] = core->state.p;
    core->arg[3] = core->proposed;
    core->arg[4] = weights->x;
    core->res[0] = &time;
    core->res[1] = u;
    core->res[2] = p;
    core->res[3] = proposed;
    if (core_call(core, model_consistent_adjoint, "derivatives of the start values") != 0)
        return -1;
    add(&weights->time, &time, 1);
    add(weights->u, u, N_INPUTS);
    add(weights->p, p, N_PARAMETERS);
    memcpy(weights->x, proposed, N_STATES * sizeof(double));
    return 0;
}

/* Until the run has started, start values that nobody has set follow the parameters, and all initial conditions hold. */
static int through_starts(Core *core, Sensitivity *weights)
{
    double seed[N_STATES + 1];
    if (core->state.phase > PHASE_INITIALIZATION)
        return 0;
    if (MODEL_SOLVES_START && through_conditions(core, weights) != 0)
        return -1;
    for (int i = 0; i < N_STATES; i++)
        seed[i] = core->state.start_given[i] ? 0.0 : weights->x[i];
    return through_parameters(core, weights, model_initial_adjoint, seed);
}

static int read_weight(Core *core, Sensitivity *weights, unsigned reference, double *value)
{
    if (reference != VR_TIME && (reference >= VR_DEPENDENTS || (reference >= VR_DERIVATIVES && reference < VR_PARAMETERS)))
        return core_fail(core, "value reference %u is not that of a known", reference);
    *value = *sensitivity_of(weights, reference);
    return 0;
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                    size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity)
{
    Instance *self = instance;
    Sensitivity weights = {0};
    if (!layer_allowed(self, __func__, ANY_PHASE & ~PHASE_INSTANTIATED) ||
        !layer_present(self, __func__, unknowns, nUnknowns) || !layer_present(self, __func__, knowns, nKnowns) ||
        !layer_present(self, __func__, seed, nSeed) || !layer_present(self, __func__, sensitivity, nSensitivity) ||
        !fmi3_matching(self, __func__, unknowns, nUnknowns, nSeed) ||
        !fmi3_matching(self, __func__, knowns, nKnowns, nSensitivity))
        return fmi3Error;
    Core *core = &self->core;
    int failed = core_evaluate_outputs(core);
    for (size_t i = 0; i < nUnknowns && !failed; i++)
        for (size_t k = 0; k < fmi3_size(unknowns[i]) && !failed; k++)
            failed = add_seed(core, &weights, unknowns[i] + (unsigned)k, *seed++);
    failed = failed || through_equations(core, &weights) || (N_DELAYS > 0 && through_delays(core, &weights)) ||
             through_parameters(core, &weights, model_dependent_adjoint, weights.dependents) ||
             through_starts(core, &weights);
    for (size_t i = 0; i < nKnowns && !failed; i++)
        for (size_t k = 0; k < fmi3_size(knowns[i]) && !failed; k++)
            failed = read_weight(core, &weights, knowns[i] + (unsigned)k, sensitivity++);
    return layer_outcome(self, __func__, failed);
}
