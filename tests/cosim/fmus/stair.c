/* A counter that goes up every second, from 1 s on; at 10 it ends the run. */
struct Model {
    double time;
    int32_t counter;
};
static const Variable variables[] = {ONE(counter)};

static void reset(Model *model) { *model = (Model){.counter = 1}; }
static void begin(Model *model, const char *resources) {}
static void calculate(Model *model) {}
static int32_t stairs(double time) { return 1 + (int32_t)floor(time + 1e-9); }
static StepResult advance(Model *model, double end)
{
    int32_t reached = stairs(end);
    model->counter = reached > 10 ? 10 : reached;
    if (reached > 10)
        model->time = 10.0;
    return reached > 10 ? STEP_ENDS_RUN : STEP_DONE;
}

#define HAS_EVENTS
static double event(Model *model, bool *states_changed, bool *ends_run)
{
    model->counter = stairs(model->time);
    *ends_run = model->counter > 10;
    if (*ends_run)
        model->counter = 10;
    return (double)stairs(model->time);
}
