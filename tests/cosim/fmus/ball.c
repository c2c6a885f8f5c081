/* A ball that falls from h = 1 m and bounces: h'' = -g, and at h = 0 its speed turns round, times e. It comes to rest. */
struct Model {
    double time, h, v, g, e, v_min;
    bool early;
};
static const Variable variables[] = {ONE(h), ONE(v), ONE(g), ONE(e), ONE(v_min)};

static void reset(Model *model) { *model = (Model){.h = 1.0, .g = 9.81, .e = 0.7, .v_min = 0.1}; }
static void begin(Model *model, const char *resources) {}
static void calculate(Model *model) {}

static void bounce(Model *model)
{
    model->h = 0.0;
    model->v *= -model->e;
    if (model->v < model->v_min) {
        model->v = 0.0;
        model->g = 0.0;
    }
}
#define HAS_EARLY_RETURN
static void allow_early_return(Model *model) { model->early = true; }

/* In closed form from bounce to bounce. */
static StepResult advance(Model *model, double end)
{
    double left = end - model->time;
    for (;;) {
        double fall = model->g > 0.0 ? (model->v + sqrt(model->v * model->v + 2.0 * model->g * model->h)) / model->g : INFINITY;
        double part = fmin(fall, left);
        model->h += part * (model->v - 0.5 * model->g * part);
        model->v -= model->g * part;
        left -= part;
        if (fall > part || left < 0.0)
            return STEP_DONE;
        bounce(model);
        if (model->early && left > 1e-9) {
            model->time = end - left;
            return STEP_EARLY;
        }
    }
}

#define N_STATES 2
static double *states(Model *model) { return &model->h; }
static void rates(Model *model, double *rate)
{
    rate[0] = model->v;
    rate[1] = -model->g;
}
#define N_INDICATORS 1
static void indicators(Model *model, double *value) { value[0] = model->h == 0.0 && model->v == 0.0 ? 1.0 : model->h; }
#define HAS_EVENTS
static double event(Model *model, bool *states_changed, bool *ends_run)
{
    if (model->h <= 0.0 && model->v < 0.0) {
        bounce(model);
        *states_changed = true;
    }
    return INFINITY;
}
