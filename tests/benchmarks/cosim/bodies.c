/* Two FMI 2.0 co-simulation FMUs that cost a few ns a call, so that timing shows what calls them.
 * -DMASS: a point mass, m x'' = Fa + Fb. -DSPRING: a spring with a damper between points 1 and 2. All variables are reals
 * whose value reference is their place in `value`. */
#include <stdlib.h>
#include <string.h>
#include "fmi2Functions.h"

#ifdef MASS
enum { FA, FB, X, V, M, X0, COUNT };
static const double starts[COUNT] = {[X] = 1.0, [M] = 1.0, [X0] = 1.0};
#else
enum { X1, V1, X2, V2, F1, F2, K, D, COUNT };
static const double starts[COUNT] = {[K] = 10.0};
#endif

typedef struct {
    double value[COUNT], time;
} Body;

static void evaluate(Body *b)
{
#ifdef SPRING
    double force = b->value[K] * (b->value[X2] - b->value[X1]) + b->value[D] * (b->value[V2] - b->value[V1]);
    b->value[F1] = force;
    b->value[F2] = -force;
#endif
}

static void advance(Body *b, double h)
{
#ifdef MASS
    double a = (b->value[FA] + b->value[FB]) / b->value[M];
    b->value[X] += h * (b->value[V] + 0.5 * h * a);
    b->value[V] += h * a;
#endif
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    Body *b = calloc(1, sizeof *b);
    memcpy(b->value, starts, sizeof starts);
    return b;
}
void fmi2FreeInstance(fmi2Component b) { free(b); }
fmi2Status fmi2SetupExperiment(fmi2Component b, fmi2Boolean d, fmi2Real tol, fmi2Real t0, fmi2Boolean e, fmi2Real t1)
{
    ((Body *)b)->time = t0;
    return fmi2OK;
}
fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
#ifdef MASS
    Body *b = c;
    b->value[X] = b->value[X0];
#endif
    return fmi2OK;
}
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference refs[], size_t n, fmi2Real values[])
{
    Body *b = c;
    evaluate(b);
    for (size_t k = 0; k < n; k++) {
        if (refs[k] >= COUNT) return fmi2Error;
        values[k] = b->value[refs[k]];
    }
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference refs[], size_t n, const fmi2Real values[])
{
    Body *b = c;
    for (size_t k = 0; k < n; k++) {
        if (refs[k] >= COUNT) return fmi2Error;
        b->value[refs[k]] = values[k];
    }
    return fmi2OK;
}
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean keep)
{
    advance(c, h);
    ((Body *)c)->time = t + h;
    return fmi2OK;
}
fmi2Status fmi2Reset(fmi2Component c)
{
    memcpy(((Body *)c)->value, starts, sizeof starts);
    return fmi2OK;
}
fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    if (!*state) *state = malloc(sizeof(Body));
    memcpy(*state, c, sizeof(Body));
    return fmi2OK;
}
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    memcpy(c, state, sizeof(Body));
    return fmi2OK;
}
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    free(*state);
    *state = 0;
    return fmi2OK;
}

#define EMPTY(NAME, ...) \
    fmi2Status fmi2##NAME(__VA_ARGS__) { return fmi2OK; }
#define NONE(NAME, ...) \
    fmi2Status fmi2##NAME(__VA_ARGS__) { return fmi2Error; }
#define REFS fmi2Component c, const fmi2ValueReference refs[], size_t n
EMPTY(SetDebugLogging, fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[])
EMPTY(EnterInitializationMode, fmi2Component c)
EMPTY(Terminate, fmi2Component c)
EMPTY(GetInteger, REFS, fmi2Integer v[])
EMPTY(GetBoolean, REFS, fmi2Boolean v[])
EMPTY(GetString, REFS, fmi2String v[])
EMPTY(SetInteger, REFS, const fmi2Integer v[])
EMPTY(SetBoolean, REFS, const fmi2Boolean v[])
EMPTY(SetString, REFS, const fmi2String v[])
NONE(SerializedFMUstateSize, fmi2Component c, fmi2FMUstate s, size_t *n)
NONE(SerializeFMUstate, fmi2Component c, fmi2FMUstate s, fmi2Byte b[], size_t n)
NONE(DeSerializeFMUstate, fmi2Component c, const fmi2Byte b[], size_t n, fmi2FMUstate *s)
NONE(GetDirectionalDerivative, fmi2Component c, const fmi2ValueReference u[], size_t nu, const fmi2ValueReference k[],
     size_t nk, const fmi2Real dk[], fmi2Real du[])
NONE(SetRealInputDerivatives, REFS, const fmi2Integer order[], const fmi2Real v[])
NONE(GetRealOutputDerivatives, REFS, const fmi2Integer order[], fmi2Real v[])
NONE(CancelStep, fmi2Component c)
NONE(GetStatus, fmi2Component c, const fmi2StatusKind kind, fmi2Status *v)
NONE(GetIntegerStatus, fmi2Component c, const fmi2StatusKind kind, fmi2Integer *v)
NONE(GetStringStatus, fmi2Component c, const fmi2StatusKind kind, fmi2String *v)
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *v)
{
    *v = ((Body *)c)->time;
    return fmi2OK;
}
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *v)
{
    *v = fmi2False;
    return fmi2OK;
}
