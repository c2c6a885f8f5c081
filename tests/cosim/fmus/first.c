/* An FMU of FMI 1.0 for co-simulation: dx/dt = u, with an integer, a Boolean and a text that come back. */
#include <stddef.h>
#include <string.h>

typedef void Logger(void *, const char *, int, const char *, const char *, ...);
typedef void *Allocate(size_t, size_t);
typedef void Free(void *);
typedef struct {
    Logger *logger;
    Allocate *allocate;
    Free *release;
    void *finished;
} Callbacks;
typedef struct {
    Callbacks callbacks;
    double x, u;
    int count;
    char on, text[40], name[40];
} Instance;

#define API(type, name) __attribute__((visibility("default"))) type first_fmi##name

API(void *, InstantiateSlave)(const char *name, const char *guid, const char *location, const char *mime, double timeout,
                              char visible, char interactive, Callbacks callbacks, char logging)
{
    (void)location, (void)timeout, (void)visible, (void)interactive, (void)logging;
    if (strcmp(guid, "{first}") != 0 || strcmp(mime, "application/x-fmu-sharedlibrary") != 0)
        return NULL;
    Instance *self = callbacks.allocate(1, sizeof *self);
    self->callbacks = callbacks;
    self->x = 1.0;
    strncpy(self->name, name, sizeof self->name - 1);
    return self;
}
API(int, InitializeSlave)(void *c, double start, char has_stop, double stop)
{
    (void)c, (void)start, (void)has_stop, (void)stop;
    return 0;
}
API(int, DoStep)(void *c, double time, double size, char fresh)
{
    Instance *self = c;
    (void)time;
    if (self->u < -5.0) {
        self->callbacks.logger(self, self->name, 3, "error", "u = %g is below %d", self->u, -5);
        return 3;
    }
    self->x += size * self->u;
    return fresh ? 0 : 3;
}
API(int, TerminateSlave)(void *c) { return c == NULL; }
API(void, FreeSlaveInstance)(void *c) { ((Instance *)c)->callbacks.release(c); }

#define GET_AND_SET(Name, type, member)                                                                 \
    API(int, Get##Name)(void *c, const unsigned *vr, size_t n, type *values)                            \
    {                                                                                                   \
        (void)vr;                                                                                       \
        for (size_t i = 0; i < n; i++)                                                                  \
            values[i] = ((Instance *)c)->member;                                                        \
        return 0;                                                                                       \
    }                                                                                                   \
    API(int, Set##Name)(void *c, const unsigned *vr, size_t n, const type *values)                      \
    {                                                                                                   \
        (void)vr;                                                                                       \
        for (size_t i = 0; i < n; i++)                                                                  \
            ((Instance *)c)->member = values[i];                                                        \
        return 0;                                                                                       \
    }
GET_AND_SET(Integer, int, count)
GET_AND_SET(Boolean, char, on)

API(int, GetReal)(void *c, const unsigned *vr, size_t n, double *values)
{
    for (size_t i = 0; i < n; i++)
        values[i] = vr[i] == 0 ? ((Instance *)c)->u : ((Instance *)c)->x;
    return 0;
}
API(int, SetReal)(void *c, const unsigned *vr, size_t n, const double *values)
{
    for (size_t i = 0; i < n; i++)
        *(vr[i] == 0 ? &((Instance *)c)->u : &((Instance *)c)->x) = values[i];
    return 0;
}
API(int, GetString)(void *c, const unsigned *vr, size_t n, const char **values)
{
    (void)vr;
    for (size_t i = 0; i < n; i++)
        values[i] = ((Instance *)c)->text;
    return 0;
}
API(int, SetString)(void *c, const unsigned *vr, size_t n, const char *const *values)
{
    (void)vr;
    for (size_t i = 0; i < n; i++)
        strncpy(((Instance *)c)->text, values[i], sizeof((Instance *)c)->text - 1);
    return 0;
}

/* Functions that are there to be found only. */
#define ABSENT(name) \
    API(int, name)(void) { return 3; }
ABSENT(GetVersion)
ABSENT(GetTypesPlatform)
ABSENT(SetDebugLogging)
ABSENT(ResetSlave)
ABSENT(SetRealInputDerivatives)
ABSENT(GetRealOutputDerivatives)
ABSENT(CancelStep)
ABSENT(GetStatus)
ABSENT(GetRealStatus)
ABSENT(GetIntegerStatus)
ABSENT(GetBooleanStatus)
ABSENT(GetStringStatus)
