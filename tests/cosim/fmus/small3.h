/* The functions of FMI 3 that importers call, around `small.c`. */
typedef fmi3Instance C;
typedef fmi3ValueReference VR;
typedef fmi3Status S;

const char *fmi3GetVersion(void) { return fmi3Version; }
S fmi3SetDebugLogging(C c, fmi3Boolean on, size_t n, const fmi3String names[]) { return fmi3OK; }

static C instantiate(fmi3String resources, void *environment, fmi3LogMessageCallback logger)
{
    Instance *instance = create(resources);
    instance->logger = logger;
    instance->environment = environment;
    return instance;
}
C fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
                              fmi3Boolean events, fmi3Boolean early, const VR required[], size_t n, fmi3InstanceEnvironment e,
                              fmi3LogMessageCallback logger, fmi3IntermediateUpdateCallback update)
{
    Instance *instance = instantiate(resources, e, logger);
    if (early)
        allow_early_return(&instance->model);
    return instance;
}
C fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
                               fmi3InstanceEnvironment e, fmi3LogMessageCallback logger)
{
    return instantiate(resources, e, logger);
}
void fmi3FreeInstance(C c) { destroy(c); }
S fmi3EnterInitializationMode(C c, fmi3Boolean has_tolerance, fmi3Float64 tolerance, fmi3Float64 start, fmi3Boolean has_stop, fmi3Float64 stop)
{
    ((Instance *)c)->model.time = start;
    return fmi3OK;
}
S fmi3ExitInitializationMode(C c)
{
    Instance *instance = c;
    begin(&instance->model, instance->resources);
    instance->running = true;
    return fmi3OK;
}
S fmi3EnterConfigurationMode(C c) { return fmi3OK; }
S fmi3ExitConfigurationMode(C c) { return fmi3OK; }
S fmi3Terminate(C c)
{
    terminate(c);
    return fmi3OK;
}

#define BOTH(name, type)                                                                                        \
    S fmi3Get##name(C c, const VR vr[], size_t n, type v[], size_t k) { return get(c, vr, n, sizeof *v, v); }   \
    S fmi3Set##name(C c, const VR vr[], size_t n, const type v[], size_t k) { return set(c, vr, n, sizeof *v, v); }
BOTH(Float32, fmi3Float32)
BOTH(Float64, fmi3Float64)
BOTH(Int8, fmi3Int8)
BOTH(UInt8, fmi3UInt8)
BOTH(Int16, fmi3Int16)
BOTH(UInt16, fmi3UInt16)
BOTH(Int32, fmi3Int32)
BOTH(UInt32, fmi3UInt32)
BOTH(Int64, fmi3Int64)
BOTH(UInt64, fmi3UInt64)
BOTH(Boolean, fmi3Boolean)
S fmi3GetString(C c, const VR vr[], size_t n, fmi3String v[], size_t k) { return get_text(c, vr, n, v); }
S fmi3SetString(C c, const VR vr[], size_t n, const fmi3String v[], size_t k) { return set_text(c, vr, n, v); }
S fmi3GetBinary(C c, const VR vr[], size_t n, size_t sizes[], fmi3Binary v[], size_t k)
{
    Instance *instance = c;
    calculate(&instance->model);
    for (size_t i = 0; i < n; i++) {
        const Variable *variable = find(instance, vr[i]);
        if (variable == NULL || !variable->binary)
            return fmi3Error;
        Bytes *bytes = (Bytes *)((char *)&instance->model + variable->offset);
        sizes[i] = bytes->size;
        v[i] = bytes->data;
    }
    return fmi3OK;
}
S fmi3SetBinary(C c, const VR vr[], size_t n, const size_t sizes[], const fmi3Binary v[], size_t k)
{
    Instance *instance = c;
    for (size_t i = 0; i < n; i++) {
        const Variable *variable = find(instance, vr[i]);
        if (variable == NULL || !variable->binary || sizes[i] > TEXT)
            return fmi3Error;
        Bytes *bytes = (Bytes *)((char *)&instance->model + variable->offset);
        bytes->size = sizes[i];
        memcpy(bytes->data, v[i], sizes[i]);
    }
    return fmi3OK;
}

S fmi3GetFMUState(C c, fmi3FMUState *state)
{
    if (*state == NULL) {
        *state = malloc(sizeof(Model));
        small_living++;
    }
    memcpy(*state, &((Instance *)c)->model, sizeof(Model));
    return fmi3OK;
}
S fmi3SetFMUState(C c, fmi3FMUState state)
{
    memcpy(&((Instance *)c)->model, state, sizeof(Model));
    return fmi3OK;
}
S fmi3FreeFMUState(C c, fmi3FMUState *state)
{
    small_living -= *state != NULL;
    free(*state);
    *state = NULL;
    return fmi3OK;
}
S fmi3GetDirectionalDerivative(C c, const VR unknowns[], size_t n, const VR knowns[], size_t m, const fmi3Float64 seed[], size_t n_seed,
                               fmi3Float64 result[], size_t n_result)
{
    return directional(c, unknowns, n, knowns, m, seed, result);
}

S fmi3DoStep(C c, fmi3Float64 time, fmi3Float64 size, fmi3Boolean forward, fmi3Boolean *events, fmi3Boolean *terminate,
             fmi3Boolean *early, fmi3Float64 *last)
{
    Instance *instance = c;
    StepResult result = advance(&instance->model, time + size);
    *events = false;
    *early = result == STEP_EARLY;
    *terminate = result == STEP_ENDS_RUN;
    *last = instance->model.time;
    if (result == STEP_REFUSED) {
        say(instance, fmi3Discard, "the step does not suit me (%u)", 7);
        return fmi3Discard;
    }
    if (result == STEP_DONE)
        *last = instance->model.time = time + size;
    return fmi3OK;
}

S fmi3EnterEventMode(C c) { return fmi3OK; }
S fmi3EnterContinuousTimeMode(C c) { return fmi3OK; }
S fmi3UpdateDiscreteStates(C c, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals, fmi3Boolean *values,
                           fmi3Boolean *defined, fmi3Float64 *next)
{
    bool changed = false, ends = false;
    *next = event(&((Instance *)c)->model, &changed, &ends);
    *again = *nominals = false;
    *terminate = ends;
    *values = changed;
    *defined = isfinite(*next);
    return fmi3OK;
}
S fmi3CompletedIntegratorStep(C c, fmi3Boolean forward, fmi3Boolean *enter, fmi3Boolean *terminate)
{
    *enter = *terminate = false;
    return fmi3OK;
}
S fmi3SetTime(C c, fmi3Float64 time)
{
    ((Instance *)c)->model.time = time;
    return fmi3OK;
}
S fmi3SetContinuousStates(C c, const fmi3Float64 x[], size_t n)
{
    memcpy(states(&((Instance *)c)->model), x, n * sizeof *x);
    return fmi3OK;
}
S fmi3GetContinuousStates(C c, fmi3Float64 x[], size_t n)
{
    memcpy(x, states(&((Instance *)c)->model), n * sizeof *x);
    return fmi3OK;
}
S fmi3GetContinuousStateDerivatives(C c, fmi3Float64 dx[], size_t n)
{
    rates(&((Instance *)c)->model, dx);
    return fmi3OK;
}
S fmi3GetEventIndicators(C c, fmi3Float64 z[], size_t n)
{
    indicators(&((Instance *)c)->model, z);
    return fmi3OK;
}
S fmi3GetNominalsOfContinuousStates(C c, fmi3Float64 nominal[], size_t n)
{
    for (size_t i = 0; i < n; i++)
        nominal[i] = 1.0;
    return fmi3OK;
}
