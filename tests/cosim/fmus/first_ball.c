/* An FMU of FMI 1.0 for model exchange: a ball falls from 1 m and keeps the share `e` of its speed at each bounce; at 1.5 s, a time event, it is let go from 1 m again. */
#include <stddef.h>

typedef void *Allocate(size_t, size_t);
typedef void Free(void *);
typedef struct {
    void *logger;
    Allocate *allocate;
    Free *release;
} Callbacks;
typedef struct {
    char converged, references, states, terminate, defined;
    double next;
} EventInfo;
typedef struct {
    Free *release;
    double t, x[2], e, z;
    int completed, again;
} Instance;

#define API(type, name) __attribute__((visibility("default"))) type ball_fmi##name

API(void *, InstantiateModel)(const char *name, const char *guid, Callbacks callbacks, char logging)
{
    (void)name, (void)guid, (void)logging;
    Instance *self = callbacks.allocate(1, sizeof *self);
    self->release = callbacks.release;
    self->x[0] = self->z = 1.0;
    self->e = 0.7;
    return self;
}
API(void, FreeModelInstance)(Instance *c) { c->release(c); }
API(int, SetTime)(Instance *c, double t) { return c->t = t, 0; }
static void plan(Instance *c, EventInfo *info)
{
    *info = (EventInfo){1, 0, 1, 0, !c->again, 1.5};
}
API(int, Initialize)(Instance *c, char controlled, double tolerance, EventInfo *info)
{
    (void)controlled, (void)tolerance;
    return plan(c, info), 0;
}
API(int, EventUpdate)(Instance *c, char intermediate, EventInfo *info)
{
    (void)intermediate;
    if (!c->again && c->t >= 1.5) {
        c->again = 1;
        c->x[0] = 1.0;
        c->x[1] = 0.0;
    } else if (c->x[0] <= 0.0 && c->x[1] < 0.0) {
        c->x[0] = 0.0;
        c->x[1] *= -c->e;
    }
    return plan(c, info), 0;
}
API(int, CompletedIntegratorStep)(Instance *c, char *event) { return c->completed++, *event = 0, 0; }
API(int, SetContinuousStates)(Instance *c, const double x[], size_t n)
{
    for (size_t k = 0; k < n; k++)
        c->x[k] = x[k];
    return 0;
}
API(int, GetContinuousStates)(Instance *c, double x[], size_t n)
{
    for (size_t k = 0; k < n; k++)
        x[k] = c->x[k];
    return 0;
}
API(int, GetNominalContinuousStates)(Instance *c, double x[], size_t n)
{
    (void)c;
    for (size_t k = 0; k < n; k++)
        x[k] = 1.0;
    return 0;
}
API(int, GetDerivatives)(Instance *c, double rates[], size_t n) { return rates[0] = c->x[1], rates[1] = -9.81, n != 2; }
API(int, GetEventIndicators)(Instance *c, double z[], size_t n) { return z[0] = c->x[0] + (c->x[0] == 0.0 && c->x[1] > 0.0 ? 1e-12 : 0.0), n != 1; }
API(int, GetReal)(Instance *c, const unsigned vr[], size_t n, double values[])
{
    for (size_t k = 0; k < n; k++)
        values[k] = vr[k] == 0 ? c->x[0] : vr[k] == 1 ? c->x[1] : vr[k] == 2 ? c->e : c->completed;
    return 0;
}
API(int, SetReal)(Instance *c, const unsigned vr[], size_t n, const double values[]) { return c->e = values[0], n != 1 || vr[0] != 2; }
API(int, Terminate)(Instance *c) { return c == NULL; }
