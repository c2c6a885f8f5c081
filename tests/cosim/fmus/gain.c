/* y = a u + b, at once. */
struct Model {
    double time, u, y, a, b;
};
static const Variable variables[] = {ONE(u), ONE(y), ONE(a), ONE(b)};

static void reset(Model *model) { *model = (Model){.a = 0.5, .b = 1.0}; }
static void begin(Model *model, const char *resources) {}
static void calculate(Model *model) { model->y = model->a * model->u + model->b; }
static StepResult advance(Model *model, double end) { return STEP_DONE; }

#define HAS_DERIVATIVES
static bool derivative(Model *model, unsigned unknown, unsigned known, double *value)
{
    *value = model->a;
    return unknown == 1 && known == 0;
}
