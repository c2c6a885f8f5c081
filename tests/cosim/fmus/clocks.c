/* An FMU of FMI 3.0 for scheduled execution: `log` is a number whose digits are the clocks that ticked, in their order.
 *
 * 1 ticks every 0.1 s and, at its third tick, lets 2 tick 0.05 s later; 3 is triggered from outside and adds the input. */
#include "fmi3Functions.h"

#include <stdlib.h>
#include <string.h>

enum { PERIODIC = 1, COUNTDOWN = 2, TRIGGERED = 3, LOG = 4, INPUT = 5, SUM = 6, LAST = 7 };
typedef struct {
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback logger;
    fmi3ClockUpdateCallback update;
    int ticks, counting;
    double log, input, sum, last;
} Instance;

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                               fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                               fmi3LogMessageCallback logger, fmi3ClockUpdateCallback update,
                                               fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock)
{
    Instance *self = calloc(1, sizeof *self);
    (void)name, (void)resources, (void)visible, (void)logging;
    if (strcmp(token, "{clocks}") != 0 || update == NULL || lock == NULL || unlock == NULL)
        return NULL;
    self->environment = environment;
    self->logger = logger;
    self->update = update;
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

fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clock, fmi3Float64 time)
{
    Instance *self = c;
    if (clock == TRIGGERED && self->input < 0.0) {
        self->logger(self->environment, fmi3Error, "error", "the input is below zero");
        return fmi3Error;
    }
    self->log = 10.0 * self->log + clock;
    self->last = time;
    if (clock == PERIODIC && ++self->ticks == 3) {
        self->counting = 1;
        self->update(self->environment);
    }
    if (clock == TRIGGERED)
        self->sum += self->input;
    return fmi3OK;
}
fmi3Status fmi3GetIntervalDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 intervals[],
                                  fmi3IntervalQualifier qualifiers[])
{
    Instance *self = c;
    if (n != 1 || vr[0] != COUNTDOWN)
        return fmi3Error;
    intervals[0] = 0.05;
    qualifiers[0] = self->counting ? fmi3IntervalChanged : fmi3IntervalNotYetKnown;
    self->counting = 0;
    return fmi3OK;
}
fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 values[], size_t m)
{
    Instance *self = c;
    (void)m;
    for (size_t i = 0; i < n; i++)
        values[i] = vr[i] == LOG ? self->log : vr[i] == INPUT ? self->input : vr[i] == SUM ? self->sum : self->last;
    return fmi3OK;
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 values[], size_t m)
{
    (void)vr;
    if (n == 1 && m == 1)
        ((Instance *)c)->input = values[0];
    return fmi3OK;
}
