/* The lives of an FMI 3.0 instance. */
#include "exercise.h"
#include "fmi3Functions.h"

#include <math.h>
#include <stdlib.h>

enum { STEPS = 20 };

/* A logger that reads its message, as any importer would. */
static void listen(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message)
{
    volatile char last = 0;
    (void)environment, (void)status, (void)category;
    for (; *message != '\0'; message++)
        last = *message;
    (void)last;
}

static void get(fmi3Instance c, const List *list, double *values)
{
    insist(fmi3GetFloat64(c, list->reference, list->count, values, list->values) == fmi3OK, "fmi3GetFloat64");
}

static void set(fmi3Instance c, const List *list, const double *values)
{
    insist(fmi3SetFloat64(c, list->reference, list->count, values, list->values) == fmi3OK, "fmi3SetFloat64");
}

static void set_inputs(fmi3Instance c, const Model *model, unsigned seed, int k)
{
    double u[MOST];
    for (size_t i = 0; i < model->inputs.values; i++)
        u[i] = input_value(seed, i, k);
    set(c, &model->inputs, u);
}

static void read_values(fmi3Instance c, const Model *model, Digest *digest)
{
    double values[MOST];
    const List *lists[] = {&model->inputs, &model->outputs, &model->parameters};
    for (int i = 0; i < 3; i++) {
        get(c, lists[i], values);
        digest_add(digest, values, lists[i]->values);
    }
}

static void initialize(fmi3Instance c, const Model *model, unsigned seed)
{
    double p[MOST];
    insist(fmi3EnterInitializationMode(c, fmi3True, 1e-6, 0.0, fmi3False, 0.0) == fmi3OK,
           "fmi3EnterInitializationMode");
    get(c, &model->parameters, p);
    set(c, &model->parameters, p);
    set_inputs(c, model, seed, 0);
    insist(fmi3ExitInitializationMode(c) == fmi3OK, "fmi3ExitInitializationMode");
}

/* With J the derivative of the outputs by the inputs: w'(J s) from the directional, (J'w)'s from the adjoint one. */
static void differentiate(fmi3Instance c, const Model *model, Digest *digest)
{
    const List *y = &model->outputs, *u = &model->inputs;
    double seed[MOST], weight[MOST], change[MOST], share[MOST], forward = 0.0, backward = 0.0, size = 1.0;
    for (size_t i = 0; i < MOST; i++)
        seed[i] = 1.0 + (double)i, weight[i] = 2.0 - 0.1 * (double)i;
    insist(fmi3GetDirectionalDerivative(c, y->reference, y->count, u->reference, u->count, seed, u->values, change,
                                        y->values) == fmi3OK,
           "fmi3GetDirectionalDerivative");
    insist(fmi3GetAdjointDerivative(c, y->reference, y->count, u->reference, u->count, weight, y->values, share,
                                    u->values) == fmi3OK,
           "fmi3GetAdjointDerivative");
    for (size_t i = 0; i < y->values; i++)
        forward += weight[i] * change[i], size += fabs(weight[i] * change[i]);
    for (size_t i = 0; i < u->values; i++)
        backward += share[i] * seed[i], size += fabs(share[i] * seed[i]);
    insist(fabs(forward - backward) <= 1e-12 * size, "the adjoint derivative is not the transpose");
    digest_add(digest, change, y->values);
    digest_add(digest, share, u->values);
}

/* None of these may do more than say no. */
static void misuse(fmi3Instance c, const Model *model)
{
    fmi3ValueReference unknown = 4000000000u;
    double value[MOST];
    for (size_t i = 0; i < MOST; i++)
        value[i] = NAN;
    insist(fmi3GetFloat64(c, &unknown, 1, value, 1) == fmi3Error, "an unknown reference is read");
    insist(fmi3SetFloat64(c, model->inputs.reference, model->inputs.count, value, model->inputs.values) != fmi3OK ||
               model->inputs.count == 0,
           "NaN is accepted");
    insist(fmi3GetFloat64(c, model->outputs.reference, model->outputs.count, value, model->outputs.values - 1) ==
               fmi3Error,
           "a buffer that is too small is filled");
    insist(fmi3GetFloat64(c, NULL, 1, NULL, 1) == fmi3Error, "null is read");
    insist(fmi3GetString(c, &unknown, 1, NULL, 1) == fmi3Error, "a string is read");
    insist(fmi3EnterInitializationMode(c, fmi3False, 0.0, 0.0, fmi3False, 0.0) == fmi3Error,
           "initialization is entered twice");
    insist(fmi3GetFloat64(NULL, &unknown, 1, value, 1) == fmi3Error, "no instance is read");
    insist(fmi3DeserializeFMUState(c, (const fmi3Byte *)"short", 5, &(fmi3FMUState){NULL}) == fmi3Error,
           "a stump is a state");
}

static fmi3Status step(fmi3Instance c, double time, double size)
{
    fmi3Boolean event, terminate, early;
    double reached;
    return fmi3DoStep(c, time, size, fmi3False, &event, &terminate, &early, &reached);
}

static void steps(fmi3Instance c, const Model *model, unsigned seed, int first, int count, Digest *digest)
{
    for (int k = first; k < first + count; k++) {
        set_inputs(c, model, seed, k);
        insist(step(c, k * model->step, model->step) == fmi3OK, "fmi3DoStep");
        read_values(c, model, digest);
    }
}

/* From the same state the same future, whether it was kept in memory or as bytes. */
static void branch(fmi3Instance c, const Model *model, unsigned seed, Digest *digest)
{
    fmi3FMUState kept = NULL, read = NULL;
    Digest futures[3] = {{0}};
    size_t size = 0;
    insist(fmi3GetFMUState(c, &kept) == fmi3OK && fmi3GetFMUState(c, &kept) == fmi3OK, "fmi3GetFMUState");
    insist(fmi3SerializedFMUStateSize(c, kept, &size) == fmi3OK, "fmi3SerializedFMUStateSize");
    fmi3Byte *bytes = malloc(size);
    insist(bytes != NULL && fmi3SerializeFMUState(c, kept, bytes, size - 1) == fmi3Error, "too few bytes suffice");
    insist(fmi3SerializeFMUState(c, kept, bytes, size) == fmi3OK, "fmi3SerializeFMUState");
    insist(fmi3DeserializeFMUState(c, bytes, size, &read) == fmi3OK, "fmi3DeserializeFMUState");
    for (size_t end = 0; end < size; end += 1 + size / 13) {
        fmi3FMUState stump = NULL;
        insist(fmi3DeserializeFMUState(c, bytes, end, &stump) == fmi3Error, "a part is taken for a state");
    }
    free(bytes);
    for (int i = 0; i < 3; i++) {
        insist(fmi3SetFMUState(c, i == 2 ? read : kept) == fmi3OK, "fmi3SetFMUState");
        steps(c, model, seed, STEPS, 5, &futures[i]);
    }
    insist(futures[0].hash == futures[1].hash && futures[0].hash == futures[2].hash, "a restored state goes elsewhere");
    insist(fmi3FreeFMUState(c, &kept) == fmi3OK && fmi3FreeFMUState(c, &read) == fmi3OK, "fmi3FreeFMUState");
    digest->hash ^= futures[0].hash;
}

void live_co_simulation(const Model *model, unsigned seed, Digest *digest)
{
    fmi3Instance c = fmi3InstantiateCoSimulation("one", model->token, NULL, fmi3False, fmi3True, fmi3False, fmi3False,
                                                 NULL, 0, NULL, listen, NULL);
    insist(c != NULL, "fmi3InstantiateCoSimulation");
    for (int life = 0; life < 2; life++) {
        initialize(c, model, seed);
        read_values(c, model, digest);
        misuse(c, model);
        steps(c, model, seed, 0, STEPS, digest);
        insist(step(c, STEPS * model->step, -1.0) != fmi3OK, "time runs backwards");
        differentiate(c, model, digest);
        branch(c, model, seed, digest);
        insist(fmi3Terminate(c) == fmi3OK && fmi3Reset(c) == fmi3OK, "fmi3Terminate or fmi3Reset");
    }
    fmi3FreeInstance(c);
}

static void settle(fmi3Instance c)
{
    fmi3Boolean again = fmi3True, terminate, nominals, states, timed;
    double next;
    for (int i = 0; again; i++)
        insist(i < 100 && fmi3UpdateDiscreteStates(c, &again, &terminate, &nominals, &states, &timed, &next) == fmi3OK,
               "fmi3UpdateDiscreteStates");
    insist(fmi3EnterContinuousTimeMode(c) == fmi3OK, "fmi3EnterContinuousTimeMode");
}

static void exchange(fmi3Instance c, const Model *model, unsigned seed, int k, double h, Digest *digest)
{
    double x[MOST], dx[MOST], values[MOST];
    fmi3Boolean event, terminate;
    insist(fmi3SetTime(c, k * h) == fmi3OK, "fmi3SetTime");
    insist(fmi3GetContinuousStates(c, x, model->states) == fmi3OK, "fmi3GetContinuousStates");
    insist(fmi3GetContinuousStateDerivatives(c, dx, model->states) == fmi3OK, "fmi3GetContinuousStateDerivatives");
    insist(fmi3GetEventIndicators(c, values, model->indicators) == fmi3OK, "fmi3GetEventIndicators");
    digest_add(digest, values, model->indicators);
    for (size_t i = 0; i < model->states; i++)
        x[i] += h * dx[i];
    insist(fmi3SetTime(c, (k + 1) * h) == fmi3OK && fmi3SetContinuousStates(c, x, model->states) == fmi3OK,
           "fmi3SetContinuousStates");
    insist(fmi3CompletedIntegratorStep(c, fmi3True, &event, &terminate) == fmi3OK, "fmi3CompletedIntegratorStep");
    read_values(c, model, digest);
    if (event || k % 5 == 0) {
        insist(fmi3EnterEventMode(c) == fmi3OK, "fmi3EnterEventMode");
        set_inputs(c, model, seed, k);
        settle(c);
    }
}

void live_model_exchange(const Model *model, unsigned seed, Digest *digest)
{
    double nominals[MOST];
    size_t count = 0;
    fmi3Instance c =
        fmi3InstantiateModelExchange("one", model->token, NULL, fmi3False, fmi3True, NULL, listen);
    insist(c != NULL, "fmi3InstantiateModelExchange");
    initialize(c, model, seed);
    settle(c);
    misuse(c, model);
    insist(fmi3GetNumberOfContinuousStates(c, &count) == fmi3OK && count == model->states, "number of states");
    insist(fmi3GetNumberOfEventIndicators(c, &count) == fmi3OK && count == model->indicators, "number of indicators");
    for (int k = 0; k < STEPS; k++)
        exchange(c, model, seed, k, model->step / 100.0, digest);
    insist(fmi3GetNominalsOfContinuousStates(c, nominals, model->states) == fmi3OK,
           "fmi3GetNominalsOfContinuousStates");
    differentiate(c, model, digest);
    fmi3FreeInstance(c); /* without fmi3Terminate, which is allowed */
}
