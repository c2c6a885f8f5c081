/* An FMI 2.0 co-simulation FMU that integrates its input, and does what FAULT says once t reaches 0.5 s (or while it
 * is initialised). y' = u. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "fmi2Functions.h"

enum { NONE, SEGFAULT, ABORT, HANG, EXIT, STACK, MEMORY, NAN_OUTPUT, DISCARD, INITIALISE, OPEN_FILE, ERROR_STATUS, FATAL_STATUS,
       BIG_OUTPUT, INITIALISE_SEGFAULT, INSTANTIATE_NULL, DIVIDE, CHATTER, CLOSE_ALL, PAST_STOP, FORK, APART };

typedef struct {
    double u, y, t, stop;
    fmi2CallbackLogger log;
    fmi2ComponentEnvironment environment;
    const char *name;
} Instance;

static volatile int zero = 0;

/* The address of a local variable leaves, so that no compiler makes a loop of it. */
static int deep(volatile char *above) {
    volatile char here[4096];
    here[0] = above ? above[0] : 1;
    return deep(here) + here[0];
}

static fmi2Status misbehave(Instance *c) {
    switch (FAULT) {
    case SEGFAULT: *(volatile int *)(size_t)zero = 1; break;
    case ABORT: fputs("solver: matrix is singular\n", stderr); abort();
    case HANG: while (!zero) {} break;
    case EXIT: exit(0);
    case STACK: return deep(0) ? fmi2OK : fmi2Error;
    case MEMORY: { size_t size = (size_t)10 << 30; volatile char *p = malloc(size); for (size_t k = 0; k < size; k += 4096) p[k] = 1; free((void *)p); break; }
    case NAN_OUTPUT: c->y = NAN; break;
    case BIG_OUTPUT: c->y = 1e6; break;
    case DISCARD: return fmi2Discard;
    case ERROR_STATUS: c->log(c->environment, c->name, fmi2Error, "logStatusError", "the tank at %d percent is empty", 3); return fmi2Error;
    case FATAL_STATUS: return fmi2Fatal;
    case OPEN_FILE: fopen("/dev/null", "r"); break;
    case DIVIDE: c->y = 7 / zero; break;
    case CHATTER: for (int k = 0; k < 20000; k++) printf("line %d of what nobody reads\n", k); fflush(stdout); break;
    case FORK: fork(); break;
    case CLOSE_ALL: for (int k = 3; k < 1024; k++) close(k); break;
    }
    return fmi2OK;
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String s[]) { return fmi2OK; }
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    if (FAULT == INSTANTIATE_NULL) return 0;
    Instance *c = calloc(1, sizeof(Instance));
    c->log = callbacks->logger;
    c->environment = callbacks->componentEnvironment;
    c->name = "faulty";
    c->u = 1.0;
    return c;
}
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean d, fmi2Real tol, fmi2Real t0, fmi2Boolean e, fmi2Real t1) {
    ((Instance *)c)->stop = e ? t1 : HUGE_VAL;
    return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    if (FAULT == INITIALISE_SEGFAULT) *(volatile int *)(size_t)zero = 1;
    return FAULT == INITIALISE ? fmi2Error : fmi2OK;
}
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2GetReal(fmi2Component v, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    Instance *c = v;
    for (size_t k = 0; k < n; k++) value[k] = vr[k] ? c->y : c->u;
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component v, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
    Instance *c = v;
    for (size_t k = 0; k < n; k++) { if (vr[k]) c->y = value[k]; else c->u = value[k]; }
    return fmi2OK;
}
#define NONE_OF(N) \
    fmi2Status fmi2Get##N(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2##N v[]) { return n ? fmi2Error : fmi2OK; } \
    fmi2Status fmi2Set##N(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2##N v[]) { return n ? fmi2Error : fmi2OK; }
NONE_OF(Integer) NONE_OF(Boolean) NONE_OF(String)
fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *s) { return fmi2Error; }
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate s) { return fmi2Error; }
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *s) { return fmi2Error; }
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate s, size_t *n) { return fmi2Error; }
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate s, fmi2Byte b[], size_t n) { return fmi2Error; }
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte b[], size_t n, fmi2FMUstate *s) { return fmi2Error; }
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference u[], size_t nu, const fmi2ValueReference k[],
                                        size_t nk, const fmi2Real dk[], fmi2Real du[]) { return fmi2Error; }
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2Integer o[],
                                       const fmi2Real d[]) { return fmi2Error; }
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2Integer o[],
                                        fmi2Real d[]) { return fmi2Error; }
fmi2Status fmi2DoStep(fmi2Component v, fmi2Real t, fmi2Real h, fmi2Boolean no) {
    Instance *c = v;
    if (FAULT == PAST_STOP && t + h > c->stop) return fmi2Error;
    if (FAULT == APART && c->t != 0.0 && t != c->t) return fmi2Error;
    /* The call that begins at 0.5 s; communication points may be off by rounding. */
    if (t > 0.5 - 1e-9) {
        fmi2Status status = misbehave(c);
        if (status != fmi2OK) return status;
    }
    c->y += h * c->u;
    c->t = t + h;
    return fmi2OK;
}
fmi2Status fmi2CancelStep(fmi2Component c) { return fmi2Error; }
fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind k, fmi2Status *v) { return fmi2Discard; }
fmi2Status fmi2GetRealStatus(fmi2Component v, const fmi2StatusKind k, fmi2Real *value) {
    if (k != fmi2LastSuccessfulTime) return fmi2Discard;
    *value = ((Instance *)v)->t;
    return fmi2OK;
}
fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind k, fmi2Integer *v) { return fmi2Discard; }
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind k, fmi2Boolean *v) {
    if (k != fmi2Terminated) return fmi2Discard;
    *v = fmi2False;
    return fmi2OK;
}
fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind k, fmi2String *v) { return fmi2Discard; }
