/* y is the code of the first character of resources/y.txt. */
struct Model {
    double time;
    int32_t y;
};
static const Variable variables[] = {ONE(y)};

static void reset(Model *model) { *model = (Model){0}; }
static void begin(Model *model, const char *resources)
{
    char path[1100];
    snprintf(path, sizeof path, "%s/y.txt", resources);
    FILE *file = fopen(path, "r");
    if (file == NULL)
        return;
    model->y = fgetc(file);
    fclose(file);
}
static void calculate(Model *model) {}
static StepResult advance(Model *model, double end) { return STEP_DONE; }
