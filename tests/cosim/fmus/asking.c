/* An FMU of FMI 3.0 for co-simulation, y' = u^2, by twenty steps of Heun's method in each communication step, at whose ends it asks for u. */
#include "fmi3Functions.h"

#include <stdlib.h>

enum { U = 1, Y = 2, ASKED = 3 };
typedef struct {
    fmi3InstanceEnvironment environment;
    fmi3IntermediateUpdateCallback update;
    double u, y;
    int asked, wanted;
} Instance;

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early,
                                         const fmi3ValueReference needed[], size_t n, fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback logger, fmi3IntermediateUpdateCallback update)
{
    Instance *self = calloc(1, sizeof *self);
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)event_mode, (void)early, (void)logger;
    self->environment = environment;
    self->update = update;
    self->wanted = n == 1 && needed[0] == U;
    return self;
}
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean a, fmi3Float64 b, fmi3Float64 d, fmi3Boolean e, fmi3Float64 f)
{
    (void)a, (void)b, (void)d, (void)e, (void)f;
    return c != NULL ? fmi3OK : fmi3Error;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return c != NULL ? fmi3OK : fmi3Error; }
fmi3Status fmi3Terminate(fmi3Instance c) { return c != NULL ? fmi3OK : fmi3Error; }
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 size, fmi3Boolean forward, fmi3Boolean *event,
                      fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last)
{
    Instance *self = c;
    (void)forward;
    for (int k = 1; k <= 20; k++) {
        double before = self->u, reached;
        fmi3Boolean wants = 0;
        if (self->update != NULL && self->wanted) {
            self->update(self->environment, time + k * size / 20.0, 1, 0, k == 20, 0, &wants, &reached);
            self->asked++;
        }
        self->y += size / 20.0 * 0.5 * (before * before + self->u * self->u);
    }
    *last = time + size;
    *event = *terminate = *early = 0;
    return fmi3OK;
}
fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 values[], size_t m)
{
    Instance *self = c;
    (void)m;
    for (size_t i = 0; i < n; i++)
        values[i] = vr[i] == U ? self->u : vr[i] == Y ? self->y : self->asked;
    return fmi3OK;
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 values[], size_t m)
{
    if (n != 1 || m != 1 || vr[0] != U || values[0] > 3.0)
        return fmi3Error;
    ((Instance *)c)->u = values[0];
    return fmi3OK;
}
