/* An FMU around a small model: cc -DFMI=2 (or 3) -DMODEL='"mass.c"' small.c
 *
 * The model file defines the struct Model with `double time` first, the table `variables`, and the functions declared
 * below; N_STATES and N_INDICATORS with theirs where it has any. */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#if FMI == 2
#include "fmi2Functions.h"
#else
#include "fmi3Functions.h"
#endif

#define TEXT 64
typedef struct {
    size_t size;
    uint8_t data[TEXT];
} Bytes;

/* A variable: its place in the model, the bytes of an element (0: text, 1: a Boolean of FMI 3), how many elements
 * (0: `count_of` knows), whether it is an array of Bytes. */
typedef struct {
    size_t offset, bytes, count;
    bool binary;
} Variable;
#define ONE(member) {offsetof(Model, member), sizeof(((Model *)0)->member), 1, false}
#define WORDS(member) {offsetof(Model, member), 0, 1, false}
#define BINARY(member) {offsetof(Model, member), sizeof(Bytes), 1, true}
#define MANY(member, n) {offsetof(Model, member), sizeof(((Model *)0)->member[0]), n, false}

typedef struct Model Model;
/* STEP_EARLY: the step ended at model->time, which only those do that are allowed to. */
typedef enum { STEP_DONE, STEP_REFUSED, STEP_ENDS_RUN, STEP_EARLY } StepResult;
static void reset(Model *model);
static void begin(Model *model, const char *resources); /* at the end of initialisation */
static void calculate(Model *model);                    /* outputs from inputs, states and time */
static StepResult advance(Model *model, double end);    /* co-simulation */
#include MODEL
#ifndef N_STATES
#define N_STATES 0
static double *states(Model *model) { (void)model; return NULL; }
static void rates(Model *model, double *rate) { (void)model; (void)rate; }
#endif
#ifndef N_INDICATORS
#define N_INDICATORS 0
static void indicators(Model *model, double *value) { (void)model; (void)value; }
#endif
#ifndef HAS_EVENTS
/* Handles an event; gives the time of the next one. */
static double event(Model *model, bool *states_changed, bool *ends_run) { (void)model; (void)states_changed; (void)ends_run; return INFINITY; }
#endif
#ifndef HAS_EARLY_RETURN
static void allow_early_return(Model *model) { (void)model; }
#endif
#ifndef HAS_SLOPES
/* The derivative of an input by time, over the next step. */
static bool set_slope(Model *model, unsigned reference, double value) { (void)model; (void)reference; (void)value; return false; }
#endif
#ifndef HAS_ARRAYS
static size_t count_of(const Model *model, unsigned reference) { (void)model; (void)reference; return 1; }
#endif
#ifndef HAS_DERIVATIVES
static bool derivative(Model *model, unsigned unknown, unsigned known, double *value) { (void)model; (void)unknown; (void)known; (void)value; return false; }
#endif

typedef struct {
    Model model;
    char resources[1024];
    bool ended, running, failed;
    void *environment;
#if FMI == 2
    fmi2CallbackLogger logger;
#else
    fmi3LogMessageCallback logger;
#endif
} Instance;

static void say(Instance *instance, int status, const char *format, unsigned number)
{
    if (instance->logger == NULL)
        return;
#if FMI == 2
    instance->logger(instance->environment, "small", (fmi2Status)status, "error", format, number);
#else
    char words[200];
    snprintf(words, sizeof words, format, number);
    instance->logger(instance->environment, (fmi3Status)status, "error", words);
#endif
}

static const Variable *find(Instance *instance, unsigned reference)
{
    if (reference < sizeof variables / sizeof *variables && (variables[reference].bytes > 0 || variables[reference].count > 0))
        return &variables[reference];
    instance->failed = true;
    say(instance, 3, "there is no variable %u", reference);
    return NULL;
}

static size_t elements(Instance *instance, unsigned reference)
{
    size_t count = variables[reference].count;
    return count > 0 ? count : count_of(&instance->model, reference);
}

static int get(Instance *instance, const unsigned *references, size_t n, size_t bytes, void *values)
{
    calculate(&instance->model);
    char *to = values;
    for (size_t i = 0; i < n; i++) {
        const Variable *v = find(instance, references[i]);
        if (v == NULL || v->bytes != bytes)
            return 3;
        size_t size = bytes * elements(instance, references[i]);
        memcpy(to, (char *)&instance->model + v->offset, size);
        to += size;
    }
    return 0;
}

static int set(Instance *instance, const unsigned *references, size_t n, size_t bytes, const void *values)
{
    const char *from = values;
    for (size_t i = 0; i < n; i++) {
        const Variable *v = find(instance, references[i]);
        if (v == NULL || v->bytes != bytes)
            return 3;
        size_t size = bytes * elements(instance, references[i]);
        memcpy((char *)&instance->model + v->offset, from, size);
        from += size;
    }
    return 0;
}

static int get_text(Instance *instance, const unsigned *references, size_t n, const char **values)
{
    calculate(&instance->model);
    for (size_t i = 0; i < n; i++) {
        const Variable *v = find(instance, references[i]);
        if (v == NULL || v->bytes != 0)
            return 3;
        values[i] = (char *)&instance->model + v->offset;
    }
    return 0;
}

static int set_text(Instance *instance, const unsigned *references, size_t n, const char *const *values)
{
    for (size_t i = 0; i < n; i++) {
        const Variable *v = find(instance, references[i]);
        if (v == NULL || v->bytes != 0)
            return 3;
        snprintf((char *)&instance->model + v->offset, TEXT, "%s", values[i]);
    }
    return 0;
}

/* For tests: what was not freed, and calls of Terminate where there is nothing to end. */
int small_living, small_misplaced;

static void destroy(Instance *instance)
{
    small_living--;
    free(instance);
}

static void terminate(Instance *instance)
{
    if (!instance->running || instance->failed)
        small_misplaced++;
}

static Instance *create(const char *resources)
{
    Instance *instance = calloc(1, sizeof(Instance));
    small_living++;
    reset(&instance->model);
    calculate(&instance->model);
    if (resources != NULL)
        snprintf(instance->resources, sizeof instance->resources, "%s", strncmp(resources, "file://", 7) ? resources : resources + 7);
    return instance;
}

static int directional(Instance *instance, const unsigned *unknowns, size_t n, const unsigned *knowns, size_t m, const double *seed, double *result)
{
    for (size_t i = 0; i < n; i++) {
        result[i] = 0.0;
        for (size_t k = 0; k < m; k++) {
            double value;
            if (!derivative(&instance->model, unknowns[i], knowns[k], &value))
                return 3;
            result[i] += value * seed[k];
        }
    }
    return 0;
}

#if FMI == 2
#include "small2.h"
#else
#include "small3.h"
#endif
