/* The lives of an FMI 2.0 instance. */
#include "exercise.h"
#include "fmi2Functions.h"

#include <math.h>
#include <stdlib.h>

enum { STEPS = 20 };

/* A logger that reads its message, as any importer would. */
static void listen(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                   fmi2String message, ...)
{
    volatile char last = 0;
    (void)environment, (void)name, (void)status, (void)category;
    for (; *message != '\0'; message++)
        last = *message;
    (void)last;
}

static const fmi2CallbackFunctions callbacks = {listen, calloc, free, NULL, NULL};

static fmi2Component create(const Model *model, fmi2Type type)
{
    fmi2Component c = fmi2Instantiate("one", type, model->token, NULL, &callbacks, fmi2False, fmi2True);
    insist(c != NULL, "fmi2Instantiate");
    return c;
}

static void set_inputs(fmi2Component c, const Model *model, unsigned seed, int k)
{
    double u[MOST];
    for (size_t i = 0; i < model->inputs.values; i++)
        u[i] = input_value(seed, i, k);
    insist(fmi2SetReal(c, model->inputs.reference, model->inputs.count, u) == fmi2OK, "fmi2SetReal of inputs");
}

static void read_values(fmi2Component c, const Model *model, Digest *digest)
{
    double values[MOST];
    const List *lists[] = {&model->inputs, &model->outputs, &model->parameters};
    for (int i = 0; i < 3; i++) {
        insist(fmi2GetReal(c, lists[i]->reference, lists[i]->count, values) == fmi2OK, "fmi2GetReal");
        digest_add(digest, values, lists[i]->values);
    }
}

static void initialize(fmi2Component c, const Model *model, unsigned seed)
{
    double p[MOST];
    insist(fmi2SetupExperiment(c, fmi2True, 1e-6, 0.0, fmi2False, 0.0) == fmi2OK, "fmi2SetupExperiment");
    insist(fmi2EnterInitializationMode(c) == fmi2OK, "fmi2EnterInitializationMode");
    insist(fmi2GetReal(c, model->parameters.reference, model->parameters.count, p) == fmi2OK, "fmi2GetReal");
    insist(fmi2SetReal(c, model->parameters.reference, model->parameters.count, p) == fmi2OK, "fmi2SetReal");
    set_inputs(c, model, seed, 0);
    insist(fmi2ExitInitializationMode(c) == fmi2OK, "fmi2ExitInitializationMode");
}

static void differentiate(fmi2Component c, const Model *model, Digest *digest)
{
    double seed[MOST], change[MOST];
    for (size_t i = 0; i < model->inputs.values; i++)
        seed[i] = 1.0;
    insist(fmi2GetDirectionalDerivative(c, model->outputs.reference, model->outputs.count, model->inputs.reference,
                                        model->inputs.count, seed, change) == fmi2OK,
           "fmi2GetDirectionalDerivative");
    digest_add(digest, change, model->outputs.values);
}

/* None of these may do more than say no. */
static void misuse(fmi2Component c, const Model *model)
{
    fmi2ValueReference unknown = 4000000000u;
    double value = NAN;
    insist(fmi2GetReal(c, &unknown, 1, &value) == fmi2Error, "an unknown reference is read");
    insist(fmi2SetReal(c, model->inputs.reference, model->inputs.count > 0, &value) != fmi2OK ||
               model->inputs.count == 0,
           "NaN is accepted");
    insist(fmi2GetReal(c, NULL, 1, NULL) == fmi2Error, "null is read");
    insist(fmi2GetString(c, &unknown, 1, NULL) == fmi2Error, "a string is read");
    insist(fmi2EnterInitializationMode(c) == fmi2Error, "initialization is entered twice");
    insist(fmi2GetReal(NULL, &unknown, 1, &value) == fmi2Error, "no instance is read");
    insist(fmi2DeSerializeFMUstate(c, "short", 5, &(fmi2FMUstate){NULL}) == fmi2Error, "a stump is a state");
}

static void steps(fmi2Component c, const Model *model, unsigned seed, int first, int count, Digest *digest)
{
    for (int k = first; k < first + count; k++) {
        set_inputs(c, model, seed, k);
        insist(fmi2DoStep(c, k * model->step, model->step, fmi2False) == fmi2OK, "fmi2DoStep");
        read_values(c, model, digest);
    }
}

/* From the same state the same future, whether it was kept in memory or as bytes. */
static void branch(fmi2Component c, const Model *model, unsigned seed, Digest *digest)
{
    fmi2FMUstate kept = NULL, read = NULL;
    Digest futures[3] = {{0}};
    size_t size = 0;
    insist(fmi2GetFMUstate(c, &kept) == fmi2OK && fmi2GetFMUstate(c, &kept) == fmi2OK, "fmi2GetFMUstate");
    insist(fmi2SerializedFMUstateSize(c, kept, &size) == fmi2OK, "fmi2SerializedFMUstateSize");
    char *bytes = malloc(size);
    insist(bytes != NULL && fmi2SerializeFMUstate(c, kept, bytes, size) == fmi2OK, "fmi2SerializeFMUstate");
    insist(fmi2DeSerializeFMUstate(c, bytes, size, &read) == fmi2OK, "fmi2DeSerializeFMUstate");
    for (size_t end = 0; end < size; end += 1 + size / 13) {
        fmi2FMUstate stump = NULL;
        insist(fmi2DeSerializeFMUstate(c, bytes, end, &stump) == fmi2Error, "a part is taken for a state");
    }
    free(bytes);
    for (int i = 0; i < 3; i++) {
        insist(fmi2SetFMUstate(c, i == 2 ? read : kept) == fmi2OK, "fmi2SetFMUstate");
        steps(c, model, seed, STEPS, 5, &futures[i]);
    }
    insist(futures[0].hash == futures[1].hash && futures[0].hash == futures[2].hash, "a restored state goes elsewhere");
    insist(fmi2FreeFMUstate(c, &kept) == fmi2OK && fmi2FreeFMUstate(c, &read) == fmi2OK, "fmi2FreeFMUstate");
    digest->hash ^= futures[0].hash;
}

void live_co_simulation(const Model *model, unsigned seed, Digest *digest)
{
    fmi2Component c = create(model, fmi2CoSimulation);
    for (int life = 0; life < 2; life++) {
        initialize(c, model, seed);
        read_values(c, model, digest);
        misuse(c, model);
        steps(c, model, seed, 0, STEPS, digest);
        insist(fmi2DoStep(c, 0.0, -1.0, fmi2False) != fmi2OK, "time runs backwards");
        differentiate(c, model, digest);
        branch(c, model, seed, digest);
        insist(fmi2Terminate(c) == fmi2OK && fmi2Reset(c) == fmi2OK, "fmi2Terminate or fmi2Reset");
    }
    fmi2FreeInstance(c);
}

static void settle(fmi2Component c)
{
    fmi2EventInfo event = {.newDiscreteStatesNeeded = fmi2True};
    for (int i = 0; event.newDiscreteStatesNeeded; i++)
        insist(i < 100 && fmi2NewDiscreteStates(c, &event) == fmi2OK, "fmi2NewDiscreteStates");
    insist(fmi2EnterContinuousTimeMode(c) == fmi2OK, "fmi2EnterContinuousTimeMode");
}

static void exchange(fmi2Component c, const Model *model, unsigned seed, int k, double h, Digest *digest)
{
    double x[MOST], dx[MOST], values[MOST];
    fmi2Boolean event, terminate;
    insist(fmi2SetTime(c, k * h) == fmi2OK, "fmi2SetTime");
    insist(fmi2GetContinuousStates(c, x, model->states) == fmi2OK, "fmi2GetContinuousStates");
    insist(fmi2GetDerivatives(c, dx, model->states) == fmi2OK, "fmi2GetDerivatives");
    insist(fmi2GetEventIndicators(c, values, model->indicators) == fmi2OK, "fmi2GetEventIndicators");
    digest_add(digest, values, model->indicators);
    for (size_t i = 0; i < model->states; i++)
        x[i] += h * dx[i];
    insist(fmi2SetTime(c, (k + 1) * h) == fmi2OK && fmi2SetContinuousStates(c, x, model->states) == fmi2OK,
           "fmi2SetContinuousStates");
    insist(fmi2CompletedIntegratorStep(c, fmi2True, &event, &terminate) == fmi2OK, "fmi2CompletedIntegratorStep");
    read_values(c, model, digest);
    if (event || k % 5 == 0) {
        insist(fmi2EnterEventMode(c) == fmi2OK, "fmi2EnterEventMode");
        set_inputs(c, model, seed, k);
        settle(c);
    }
}

void live_model_exchange(const Model *model, unsigned seed, Digest *digest)
{
    double nominals[MOST];
    fmi2Component c = create(model, fmi2ModelExchange);
    initialize(c, model, seed);
    settle(c);
    misuse(c, model);
    for (int k = 0; k < STEPS; k++)
        exchange(c, model, seed, k, model->step / 100.0, digest);
    insist(fmi2GetNominalsOfContinuousStates(c, nominals, model->states) == fmi2OK,
           "fmi2GetNominalsOfContinuousStates");
    differentiate(c, model, digest);
    fmi2FreeInstance(c); /* without fmi2Terminate, which is allowed */
}
