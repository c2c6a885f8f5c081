#include "part.h"

#include "library.h"
#include "linear.h"
#include "loop.h"

#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef void *Instantiate2(const char *, int, const char *, const char *, const void *, int, int);
typedef void *Instantiate3(const char *, const char *, const char *, bool, bool, bool, bool, const uint32_t *, size_t, void *,
                           void *, void *);
typedef int SetUp2(void *, int, double, double, int, double);
typedef int Begin3(void *, bool, double, double, bool, double);
typedef int Call(void *);
typedef void Free(void *);
typedef int Values2(void *, const uint32_t *, size_t, void *);
typedef int Values3(void *, const uint32_t *, size_t, void *, size_t);
typedef int Step2(void *, double, double, int);
typedef int Step3(void *, double, double, bool, bool *, bool *, bool *, double *);
typedef int Slopes2(void *, const uint32_t *, size_t, const int *, const double *);
typedef int StateOf(void *, void **);
typedef int SetState(void *, void *);
typedef int StateSize(void *, void *, size_t *);
typedef int Serialize2(void *, void *, char *, size_t);
typedef int Deserialize2(void *, const char *, size_t, void **);
typedef int Boolean2(void *, int, int *);
typedef int Real2(void *, int, double *);

static const char *const endings2[N_KINDS] = {[FLOAT64] = "Real", [INT32] = "Integer", [INT64] = "Integer",
                                              [BOOLEAN] = "Boolean", [TEXT] = "String"};
static const char *const endings3[N_KINDS] = {"Float64", "Float32", "Int8",  "UInt8", "Int16",  "UInt16",
                                              "Int32",   "UInt32",  "Int64", "Boolean", "String", "UInt64"};

static int problem(Component *part, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    int used = snprintf(part->problem, sizeof part->problem, "component '%s' ", part->data->name);
    vsnprintf(part->problem + used, sizeof part->problem - (size_t)used, format, arguments);
    va_end(arguments);
    size_t length = strlen(part->problem);
    if (part->said[0] != '\0')
        snprintf(part->problem + length, sizeof part->problem - length, "; it says: %s", part->said);
    part->said[0] = '\0';
    return -1;
}

static void hear(Component *part, int status, const char *text)
{
    if (status > PART_OK)
        snprintf(part->said, sizeof part->said, "%s", text);
    part->listener(part->owner, part->data->name, status, text);
}

static void listen2(void *environment, const char *name, int status, const char *category, const char *format, ...)
{
    char text[1024];
    (void)name, (void)category;
    if (environment == NULL || format == NULL)
        return;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    hear(environment, status, text);
}

static void listen3(void *environment, int status, const char *category, const char *text)
{
    (void)category;
    if (environment != NULL && text != NULL)
        hear(environment, status, text);
}

static void *find(Component *part, const char *name)
{
    char full[256];
    snprintf(full, sizeof full, "fmi%d%s", (int)part->data->version, name);
    void *found = library_function(part->library, full);
    if (found == NULL) { /* sources for static linking may carry the identifier in front */
        snprintf(full, sizeof full, "%s_fmi%d%s", part->data->identifier, (int)part->data->version, name);
        found = library_function(part->library, full);
    }
    return found;
}

static int answer(Component *part, int status, const char *what)
{
    part->failed |= status >= PART_ERROR;
    part->dead |= status == PART_FATAL;
    return status <= PART_WARNING ? 0 : problem(part, "refused %s (status %d)", what, status);
}

static int call(Component *part, const char *name)
{
    if (part->data->linear != NULL)
        return 0;
    Call *function = (Call *)find(part, name);
    return function == NULL ? problem(part, "lacks the function %s", name) : answer(part, function(part->instance), name);
}

int part_raw_kind(const Component *part, int kind)
{
    return part->data->version == 2 && (kind == INT64 || kind == BOOLEAN) ? INT32 : kind;
}

static void open_linear(Component *part)
{
    part->instance = linear_new(part->data->linear);
    part->get[FLOAT64] = (void *)linear_get;
    part->set[FLOAT64] = (void *)linear_set;
    part->do_step = (void *)linear_step;
}

static void instantiate(Component *part, const char *resources)
{
    const PartData *data = part->data;
    if (data->version == 2) {
        part->callbacks = (Callbacks2){(void *)listen2, (void *)calloc, (void *)free, NULL, part};
        char *address = address_of(resources);
        Instantiate2 *make = (Instantiate2 *)find(part, "Instantiate");
        if (make != NULL && address != NULL)
            part->instance = make(data->name, 1, data->token, address, &part->callbacks, 0, 0);
        free(address);
        return;
    }
    Instantiate3 *make = (Instantiate3 *)find(part, "InstantiateCoSimulation");
    char *folder = joined(resources, ""); /* FMI 3 wants the separator at the end */
    if (make != NULL)
        part->instance = make(data->name, data->token, folder, false, false, false, data->early_return != 0, NULL, 0, part,
                              (void *)listen3, NULL);
    free(folder);
}

int part_open(Component *part, const char *resources)
{
    const PartData *data = part->data;
    if (data->linear != NULL) {
        open_linear(part);
        return part->instance != NULL ? 0 : problem(part, "has no memory");
    }
    char reason[600] = "out of memory", *folder = joined(resources, data->folder);
    char *own = folder != NULL ? joined(folder, "resources") : NULL;
    if (own != NULL)
        part->library = library_open(folder, data->identifier, (int)data->version, reason, (int)sizeof reason);
    if (part->library != NULL) {
        const char *const *endings = data->version == 2 ? endings2 : endings3;
        for (int kind = 0; kind < N_KINDS; kind++)
            if (endings[kind] != NULL) {
                char name[32];
                snprintf(name, sizeof name, "Get%s", endings[kind]);
                part->get[kind] = find(part, name);
                snprintf(name, sizeof name, "Set%s", endings[kind]);
                part->set[kind] = find(part, name);
            }
        part->do_step = find(part, "DoStep");
        instantiate(part, own);
    }
    int done = part->library == NULL ? problem(part, "cannot be loaded: %s", reason)
               : part->instance == NULL || part->do_step == NULL ? problem(part, "could not be instantiated") : 0;
    free(own);
    free(folder);
    return done;
}

int part_set_up(Component *part, const double *tolerance, double start, const double *stop)
{
    if (part->data->linear != NULL)
        return 0;
    if (tolerance == NULL && part->data->tolerance > 0.0)
        tolerance = &part->data->tolerance;
    double relative = tolerance != NULL ? *tolerance : 0.0, end = stop != NULL ? *stop : 0.0;
    if (part->data->version == 3) {
        Begin3 *begin = (Begin3 *)find(part, "EnterInitializationMode");
        return begin == NULL ? problem(part, "lacks the function fmi3EnterInitializationMode")
                             : answer(part, begin(part->instance, tolerance != NULL, relative, start, stop != NULL, end),
                                      "to enter initialisation");
    }
    SetUp2 *set_up = (SetUp2 *)find(part, "SetupExperiment");
    if (set_up == NULL)
        return problem(part, "lacks the function fmi2SetupExperiment");
    int status = set_up(part->instance, tolerance != NULL, relative, start, stop != NULL, end);
    return answer(part, status, "to be set up") != 0 ? -1 : call(part, "EnterInitializationMode");
}

int part_start(Component *part)
{
    part->running = 1;
    return call(part, "ExitInitializationMode");
}

int part_configure(Component *part, int enter)
{
    return call(part, enter ? "EnterConfigurationMode" : "ExitConfigurationMode");
}

void part_end(Component *part)
{
    if (part->running && !part->failed)
        call(part, "Terminate");
    part->running = 0;
}

void part_close(Component *part)
{
    if (part->instance != NULL && part->data->linear != NULL)
        linear_free(part->instance);
    else if (part->instance != NULL && !part->dead) {
        part_end(part);
        Free *release = (Free *)find(part, "FreeInstance");
        if (release != NULL)
            release(part->instance);
    }
    if (!part->dead)
        library_close(part->library);
    part->instance = part->library = NULL;
    part->running = part->failed = 0;
}

static int exchange(Component *part, void *function, int kind, const uint32_t *references, size_t n, void *raw, size_t n_values,
                    const char *verb)
{
    if (function == NULL)
        return problem(part, "cannot %s variables of its type %d", verb, kind);
    int status = part->data->version == 2 ? ((Values2 *)function)(part->instance, references, n, raw)
                                          : ((Values3 *)function)(part->instance, references, n, raw, n_values);
    return answer(part, status, verb);
}

int part_get(Component *part, int kind, uint32_t reference, size_t n_values, void *raw)
{
    return exchange(part, part->get[kind], kind, &reference, 1, raw, n_values, "to give a value");
}

int part_set(Component *part, int kind, uint32_t reference, size_t n_values, const void *raw)
{
    return exchange(part, part->set[kind], kind, &reference, 1, (void *)raw, n_values, "to take a value");
}

int part_slopes(Component *part, const uint32_t *references, size_t n, const double *slopes)
{
    Slopes2 *function = (Slopes2 *)find(part, "SetRealInputDerivatives");
    int *orders = malloc((n + 1) * sizeof(int));
    if (function == NULL || orders == NULL) {
        free(orders);
        return problem(part, "takes no slopes of inputs");
    }
    for (size_t i = 0; i < n; i++)
        orders[i] = 1;
    int status = function(part->instance, references, n, orders, slopes);
    free(orders);
    return answer(part, status, "to take slopes of inputs");
}

/* A discarded step may mean that the FMU got some of the way, or wants to end the run. */
static int discarded(Component *part, double time, PartStep *end)
{
    enum { LAST_TIME = 2, TERMINATED = 3 };
    int terminated = 0;
    double last = time;
    Boolean2 *ends = (Boolean2 *)find(part, "GetBooleanStatus");
    Real2 *reached = (Real2 *)find(part, "GetRealStatus");
    int told = ends != NULL && ends(part->instance, TERMINATED, &terminated) == PART_OK && terminated;
    int known = reached != NULL && reached(part->instance, LAST_TIME, &last) == PART_OK;
    if (!told && !(known && last > time))
        return -1;
    *end = (PartStep){PART_OK, 1, told, known ? last : time};
    return 0;
}

int part_step(Component *part, double time, double size, PartStep *end)
{
    *end = (PartStep){PART_OK, 0, 0, time + size};
    int status;
    if (part->data->version == 2) {
        status = ((Step2 *)part->do_step)(part->instance, time, size, !part->rolled_back);
        if (status == PART_DISCARD && part->data->linear == NULL && discarded(part, time, end) == 0)
            return 0;
    } else {
        bool event = false, terminate = false, early = false;
        double last = time;
        status = ((Step3 *)part->do_step)(part->instance, time, size, !part->rolled_back, &event, &terminate, &early, &last);
        int shorter = early && last < time + size;
        if (shorter || terminate)
            *end = (PartStep){PART_OK, shorter, terminate, last};
        if (status == PART_DISCARD && terminate)
            return 0;
    }
    if (status <= PART_WARNING)
        return 0;
    part->failed |= status >= PART_ERROR;
    part->dead |= status == PART_FATAL;
    return problem(part, "refused the step at t = %.9g s (step %.9g s): status %d", time, size, status);
}

#define STATE(part, two, three) ((part)->data->version == 2 ? (two) : (three))

int part_save(Component *part, void **state)
{
    if (part->data->linear != NULL) {
        size_t size = linear_state_size(part->instance);
        if (*state == NULL)
            *state = malloc(size + 1);
        if (*state == NULL)
            return problem(part, "has no memory");
        memcpy(*state, linear_state(part->instance), size);
        return 0;
    }
    part->rolled_back = 1;
    StateOf *get = (StateOf *)find(part, STATE(part, "GetFMUstate", "GetFMUState"));
    return get == NULL ? problem(part, "cannot save its state") : answer(part, get(part->instance, state), "to save its state");
}

int part_restore(Component *part, void *state)
{
    if (part->data->linear != NULL) {
        memcpy(linear_state(part->instance), state, linear_state_size(part->instance));
        return 0;
    }
    SetState *set = (SetState *)find(part, STATE(part, "SetFMUstate", "SetFMUState"));
    return set == NULL ? problem(part, "cannot go back") : answer(part, set(part->instance, state), "to go back to a state");
}

void part_forget(Component *part, void **state)
{
    if (part->data->linear != NULL)
        free(*state);
    else if (*state != NULL && part->instance != NULL && !part->dead) {
        StateOf *release = (StateOf *)find(part, STATE(part, "FreeFMUstate", "FreeFMUState"));
        if (release != NULL)
            release(part->instance, state);
    }
    *state = NULL;
}

int part_state_size(Component *part, void *state, size_t *size)
{
    if (part->data->linear != NULL) {
        *size = linear_state_size(part->instance);
        return 0;
    }
    StateSize *function = (StateSize *)find(part, STATE(part, "SerializedFMUstateSize", "SerializedFMUStateSize"));
    return function == NULL ? problem(part, "cannot serialise its state")
                            : answer(part, function(part->instance, state, size), "to serialise its state");
}

int part_serialize(Component *part, void *state, char *bytes, size_t size)
{
    if (part->data->linear != NULL) {
        memcpy(bytes, state, size);
        return 0;
    }
    Serialize2 *function = (Serialize2 *)find(part, STATE(part, "SerializeFMUstate", "SerializeFMUState"));
    return function == NULL ? problem(part, "cannot serialise its state")
                            : answer(part, function(part->instance, state, bytes, size), "to serialise its state");
}

int part_deserialize(Component *part, const char *bytes, size_t size, void **state)
{
    if (part->data->linear != NULL) {
        if (size != linear_state_size(part->instance))
            return problem(part, "has a state of another size");
        *state = malloc(size + 1);
        if (*state == NULL)
            return problem(part, "has no memory");
        memcpy(*state, bytes, size);
        return 0;
    }
    Deserialize2 *function = (Deserialize2 *)find(part, STATE(part, "DeSerializeFMUstate", "DeserializeFMUState"));
    return function == NULL ? problem(part, "cannot read a state")
                            : answer(part, function(part->instance, bytes, size, state), "to read a state");
}
