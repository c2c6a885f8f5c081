/* x' = -k x + u from x = 1. A co-simulation step is exact for constant u. Refuses steps longer than `longest`. */
struct Model {
    double time, x, k, u, longest;
};
static const Variable variables[] = {ONE(x), ONE(k), ONE(u), ONE(longest)};

static void reset(Model *model) { *model = (Model){.x = 1.0, .k = 1.0, .longest = 1e9}; }
static void begin(Model *model, const char *resources) {}
static void calculate(Model *model) {}
static StepResult advance(Model *model, double end)
{
    if (end - model->time > model->longest * (1.0 + 1e-9))
        return STEP_REFUSED;
    double rest = model->u / model->k;
    model->x = rest + (model->x - rest) * exp(-model->k * (end - model->time));
    return STEP_DONE;
}

#define N_STATES 1
static double *states(Model *model) { return &model->x; }
static void rates(Model *model, double *rate) { rate[0] = -model->k * model->x + model->u; }
