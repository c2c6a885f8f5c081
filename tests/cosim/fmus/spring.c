/* A spring and damper between two points: f1 = k (x2 - x1) + d (v2 - v1) acts on point 1, f2 = -f1 on point 2. */
struct Model {
    double time, x1, v1, x2, v2, f1, f2, k, d;
};
static const Variable variables[] = {ONE(x1), ONE(v1), ONE(x2), ONE(v2), ONE(f1), ONE(f2), ONE(k), ONE(d)};

static void reset(Model *model) { *model = (Model){.k = 10.0}; }
static void begin(Model *model, const char *resources) {}
static void calculate(Model *model)
{
    model->f1 = model->k * (model->x2 - model->x1) + model->d * (model->v2 - model->v1);
    model->f2 = -model->f1;
}
static StepResult advance(Model *model, double end) { return STEP_DONE; }

#define HAS_DERIVATIVES
static bool derivative(Model *model, unsigned unknown, unsigned known, double *value)
{
    if (known > 3 || unknown < 4 || unknown > 5)
        return false;
    *value = (known % 2 ? model->d : model->k) * (known < 2 ? -1.0 : 1.0) * (unknown == 4 ? 1.0 : -1.0);
    return true;
}
