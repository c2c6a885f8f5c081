/* A point mass: m x'' = fa + fb. A co-simulation step is exact for forces that are constant or have a constant slope. */
struct Model {
    double time, fa, fb, x, v, m, x0, slope;
};
static const Variable variables[] = {ONE(fa), ONE(fb), ONE(x), ONE(v), ONE(m), ONE(x0)};

static void reset(Model *model) { *model = (Model){.m = 1.0, .x = 1.0, .x0 = 1.0}; }
static void begin(Model *model, const char *resources) { model->x = model->x0; }
static void calculate(Model *model) {}
static StepResult advance(Model *model, double end)
{
    double h = end - model->time, a = (model->fa + model->fb) / model->m;
    double jerk = model->slope / model->m;
    model->x += h * (model->v + h * (0.5 * a + h * jerk / 6.0));
    model->v += h * (a + 0.5 * h * jerk);
    model->slope = 0.0;
    return STEP_DONE;
}

#define HAS_SLOPES
static bool set_slope(Model *model, unsigned reference, double value)
{
    model->slope += value;
    return reference < 2;
}

#define N_STATES 2
static double *states(Model *model) { return &model->x; }
static void rates(Model *model, double *rate)
{
    rate[0] = model->v;
    rate[1] = (model->fa + model->fb) / model->m;
}
