/* x' = A x + B u, y = C x + D u with arrays whose sizes m, n, r are structural parameters; of FMI 3. */
#define MOST 5
struct Model {
    double time;
    uint64_t m, n, r;
    double a[MOST * MOST], b[MOST * MOST], c[MOST * MOST], d[MOST * MOST], x0[MOST], u[MOST], y[MOST], x[MOST];
};
static const Variable variables[] = {ONE(m),     ONE(n),     ONE(r),      MANY(a, 0), MANY(b, 0), MANY(c, 0),
                                     MANY(d, 0), MANY(x0, 0), MANY(u, 0), MANY(y, 0), MANY(x, 0)};
#define HAS_ARRAYS
static size_t count_of(const Model *s, unsigned reference)
{
    const size_t counts[] = {1, 1, 1, s->n * s->n, s->n * s->m, s->r * s->n, s->r * s->m, s->n, s->m, s->r, s->n};
    return counts[reference];
}

static void reset(Model *model)
{
    *model = (Model){.m = 3, .n = 3, .r = 3};
    for (int i = 0; i < 3; i++) {
        model->a[4 * i] = -1.0;
        model->b[4 * i] = model->c[4 * i] = 1.0;
        model->u[i] = i + 1.0;
    }
}
static void begin(Model *model, const char *resources) { memcpy(model->x, model->x0, sizeof model->x); }

/* result = p x + q u, row by row */
static void sum(const Model *s, size_t rows, const double *p, const double *q, double *result)
{
    for (size_t i = 0; i < rows; i++) {
        result[i] = 0.0;
        for (size_t k = 0; k < s->n; k++)
            result[i] += p[i * s->n + k] * s->x[k];
        for (size_t k = 0; k < s->m; k++)
            result[i] += q[i * s->m + k] * s->u[k];
    }
}
static void calculate(Model *model) { sum(model, model->r, model->c, model->d, model->y); }

/* Euler steps of 1 ms. */
static StepResult advance(Model *model, double end)
{
    long steps = lround((end - model->time) / 1e-3);
    for (long k = 0; k < steps; k++) {
        double rate[MOST];
        sum(model, model->n, model->a, model->b, rate);
        for (size_t i = 0; i < model->n; i++)
            model->x[i] += 1e-3 * rate[i];
    }
    return STEP_DONE;
}
