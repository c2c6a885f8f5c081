/* The functions of FMI 2 that importers call, around `small.c`. */
typedef fmi2Component C;
typedef fmi2ValueReference VR;
typedef fmi2Status S;

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
S fmi2SetDebugLogging(C c, fmi2Boolean on, size_t n, const fmi2String names[]) { return fmi2OK; }

C fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String token, fmi2String resources,
                  const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    Instance *instance = create(resources);
    instance->logger = functions->logger;
    instance->environment = functions->componentEnvironment;
    return instance;
}

void fmi2FreeInstance(C c) { destroy(c); }
S fmi2SetupExperiment(C c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start, fmi2Boolean has_stop, fmi2Real stop)
{
#ifdef FORGETS_WHAT_WAS_SET
    reset(&((Instance *)c)->model);
#endif
    ((Instance *)c)->model.time = start;
    return fmi2OK;
}
S fmi2EnterInitializationMode(C c) { return fmi2OK; }
S fmi2ExitInitializationMode(C c)
{
    Instance *instance = c;
    begin(&instance->model, instance->resources);
    instance->running = true;
    return fmi2OK;
}
S fmi2Terminate(C c)
{
    terminate(c);
    return fmi2OK;
}
S fmi2Reset(C c)
{
    reset(&((Instance *)c)->model);
    return fmi2OK;
}

S fmi2GetReal(C c, const VR vr[], size_t n, fmi2Real v[]) { return get(c, vr, n, sizeof *v, v); }
S fmi2GetInteger(C c, const VR vr[], size_t n, fmi2Integer v[]) { return get(c, vr, n, sizeof *v, v); }
S fmi2GetBoolean(C c, const VR vr[], size_t n, fmi2Boolean v[]) { return get(c, vr, n, sizeof *v, v); }
S fmi2GetString(C c, const VR vr[], size_t n, fmi2String v[]) { return get_text(c, vr, n, v); }
S fmi2SetReal(C c, const VR vr[], size_t n, const fmi2Real v[]) { return set(c, vr, n, sizeof *v, v); }
S fmi2SetInteger(C c, const VR vr[], size_t n, const fmi2Integer v[]) { return set(c, vr, n, sizeof *v, v); }
S fmi2SetBoolean(C c, const VR vr[], size_t n, const fmi2Boolean v[]) { return set(c, vr, n, sizeof *v, v); }
S fmi2SetString(C c, const VR vr[], size_t n, const fmi2String v[]) { return set_text(c, vr, n, v); }

S fmi2GetFMUstate(C c, fmi2FMUstate *state)
{
    if (*state == NULL) {
        *state = malloc(sizeof(Model));
        small_living++;
    }
    memcpy(*state, &((Instance *)c)->model, sizeof(Model));
    return fmi2OK;
}
S fmi2SetFMUstate(C c, fmi2FMUstate state)
{
    memcpy(&((Instance *)c)->model, state, sizeof(Model));
    return fmi2OK;
}
S fmi2FreeFMUstate(C c, fmi2FMUstate *state)
{
    small_living -= *state != NULL;
    free(*state);
    *state = NULL;
    return fmi2OK;
}
/* Held for the next step. */
S fmi2SetRealInputDerivatives(C c, const VR vr[], size_t n, const fmi2Integer order[], const fmi2Real value[])
{
    for (size_t i = 0; i < n; i++)
        if (order[i] != 1 || !set_slope(&((Instance *)c)->model, vr[i], value[i]))
            return fmi2Error;
    return fmi2OK;
}
S fmi2GetDirectionalDerivative(C c, const VR unknowns[], size_t n, const VR knowns[], size_t m, const fmi2Real seed[], fmi2Real result[])
{
    return directional(c, unknowns, n, knowns, m, seed, result);
}

S fmi2DoStep(C c, fmi2Real time, fmi2Real size, fmi2Boolean forward)
{
    Instance *instance = c;
    StepResult result = advance(&instance->model, time + size);
    instance->ended = result == STEP_ENDS_RUN;
    if (result == STEP_REFUSED)
        say(instance, fmi2Discard, "the step does not suit me (%u)", 7);
    if (result != STEP_DONE)
        return fmi2Discard;
    instance->model.time = time + size;
    return fmi2OK;
}
S fmi2GetRealStatus(C c, const fmi2StatusKind kind, fmi2Real *value)
{
    *value = ((Instance *)c)->model.time;
    return kind == fmi2LastSuccessfulTime ? fmi2OK : fmi2Discard;
}
S fmi2GetBooleanStatus(C c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    *value = ((Instance *)c)->ended;
    return kind == fmi2Terminated ? fmi2OK : fmi2Discard;
}

S fmi2EnterEventMode(C c) { return fmi2OK; }
S fmi2EnterContinuousTimeMode(C c) { return fmi2OK; }
S fmi2NewDiscreteStates(C c, fmi2EventInfo *info)
{
    bool changed = false, ends = false;
    double next = event(&((Instance *)c)->model, &changed, &ends);
    *info = (fmi2EventInfo){0, ends, 0, changed, isfinite(next), next};
    return fmi2OK;
}
S fmi2CompletedIntegratorStep(C c, fmi2Boolean forward, fmi2Boolean *enter, fmi2Boolean *terminate)
{
    *enter = *terminate = fmi2False;
    return fmi2OK;
}
S fmi2SetTime(C c, fmi2Real time)
{
    ((Instance *)c)->model.time = time;
    return fmi2OK;
}
S fmi2SetContinuousStates(C c, const fmi2Real x[], size_t n)
{
    memcpy(states(&((Instance *)c)->model), x, n * sizeof *x);
    return fmi2OK;
}
S fmi2GetContinuousStates(C c, fmi2Real x[], size_t n)
{
    memcpy(x, states(&((Instance *)c)->model), n * sizeof *x);
    return fmi2OK;
}
S fmi2GetDerivatives(C c, fmi2Real dx[], size_t n)
{
    rates(&((Instance *)c)->model, dx);
    return fmi2OK;
}
S fmi2GetEventIndicators(C c, fmi2Real z[], size_t n)
{
    indicators(&((Instance *)c)->model, z);
    return fmi2OK;
}
S fmi2GetNominalsOfContinuousStates(C c, fmi2Real nominal[], size_t n)
{
    for (size_t i = 0; i < n; i++)
        nominal[i] = 1.0;
    return fmi2OK;
}

/* What a complete FMU has to offer, for importers that look for all of it. */
S fmi2CancelStep(C c) { return fmi2Error; }
S fmi2GetStatus(C c, const fmi2StatusKind kind, fmi2Status *value) { return fmi2Discard; }
S fmi2GetIntegerStatus(C c, const fmi2StatusKind kind, fmi2Integer *value) { return fmi2Discard; }
S fmi2GetStringStatus(C c, const fmi2StatusKind kind, fmi2String *value) { return fmi2Discard; }
S fmi2GetRealOutputDerivatives(C c, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[], fmi2Real value[])
{
    return fmi2Error;
}
S fmi2SerializedFMUstateSize(C c, fmi2FMUstate state, size_t *size) { return fmi2Error; }
S fmi2SerializeFMUstate(C c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) { return fmi2Error; }
S fmi2DeSerializeFMUstate(C c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) { return fmi2Error; }
