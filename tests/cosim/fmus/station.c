/* An FMU of FMI 3.0 for co-simulation with event mode that talks on a bus as FMI-LS-BUS has it; a call in the wrong mode is an error.
 *
 * `beat` ticks every 0.1 s and sends its number; what is received is added to `heard`, and 0.03 s later `reply` ticks, whose
 * message is the sum. `say` is sent when it changes. */
#include "fmi3Functions.h"

#include <stdlib.h>

enum { BEAT = 1, RX_CLOCK, TX_CLOCK, REPLY, RX, TX, ANSWER, SAY, HEARD, HEARD_AT, TICKED };
typedef enum { STEPPING, EVENT } Mode;
typedef struct {
    Mode mode;
    double time, heard, heard_at, say;
    int beats, beat_ticks, rx_ticks, reply_ticks, sends, counting, changed;
    unsigned char rx, tx, answer;
} Instance;

#define ONLY(wanted) \
    if (((Instance *)c)->mode != (wanted)) \
        return fmi3Error

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early,
                                         const fmi3ValueReference needed[], size_t n, fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback logger, fmi3IntermediateUpdateCallback update)
{
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)early, (void)needed, (void)n;
    (void)environment, (void)logger, (void)update;
    return event_mode ? calloc(1, sizeof(Instance)) : NULL;
}
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean a, fmi3Float64 b, fmi3Float64 d, fmi3Boolean e, fmi3Float64 f)
{
    (void)a, (void)b, (void)e, (void)f;
    ((Instance *)c)->time = d;
    return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c)
{
    ((Instance *)c)->mode = EVENT;
    return fmi3OK;
}
fmi3Status fmi3EnterEventMode(fmi3Instance c)
{
    ONLY(STEPPING);
    ((Instance *)c)->mode = EVENT;
    return fmi3OK;
}
fmi3Status fmi3EnterStepMode(fmi3Instance c)
{
    ONLY(EVENT);
    ((Instance *)c)->mode = STEPPING;
    return fmi3OK;
}
fmi3Status fmi3Terminate(fmi3Instance c) { return c != NULL ? fmi3OK : fmi3Error; }
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 size, fmi3Boolean forward, fmi3Boolean *event,
                      fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last)
{
    ONLY(STEPPING);
    (void)forward;
    ((Instance *)c)->time = *last = time + size;
    *event = *terminate = *early = 0;
    return fmi3OK;
}
fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Clock values[])
{
    Instance *self = c;
    ONLY(EVENT);
    for (size_t i = 0; i < n; i++) {
        if (vr[i] == BEAT && values[i]) {
            self->beat_ticks = self->sends = 1;
            self->tx = (unsigned char)++self->beats;
        } else if (vr[i] == RX_CLOCK)
            self->rx_ticks = values[i];
        else if (vr[i] == REPLY) {
            self->reply_ticks = values[i];
            self->answer = (unsigned char)self->heard;
        }
    }
    return fmi3OK;
}
fmi3Status fmi3GetClock(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Clock values[])
{
    Instance *self = c;
    ONLY(EVENT);
    for (size_t i = 0; i < n; i++) {
        values[i] = vr[i] == TX_CLOCK && self->sends;
        self->sends = 0;
    }
    return fmi3OK;
}
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals,
                                    fmi3Boolean *states, fmi3Boolean *defined, fmi3Float64 *next)
{
    Instance *self = c;
    ONLY(EVENT);
    if (self->rx_ticks) {
        self->heard += self->rx;
        self->heard_at = self->time;
        self->counting = 1;
    }
    *again = 0;
    if (self->changed) {
        self->tx = (unsigned char)self->say;
        self->sends = *again = 1;
    }
    self->changed = self->rx_ticks = self->reply_ticks = 0;
    *terminate = *nominals = *states = *defined = 0;
    *next = 0.0;
    return fmi3OK;
}
fmi3Status fmi3GetIntervalDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 intervals[],
                                  fmi3IntervalQualifier qualifiers[])
{
    Instance *self = c;
    if (n != 1 || vr[0] != REPLY || self->mode != EVENT)
        return fmi3Error;
    intervals[0] = 0.03;
    qualifiers[0] = self->counting ? fmi3IntervalChanged : fmi3IntervalUnchanged;
    self->counting = 0;
    return fmi3OK;
}
fmi3Status fmi3SetBinary(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const size_t sizes[], const fmi3Binary values[],
                         size_t m)
{
    Instance *self = c;
    if (n != 1 || m != 1 || vr[0] != RX || !self->rx_ticks || sizes[0] != 1)
        return fmi3Error;
    self->rx = values[0][0];
    return fmi3OK;
}
fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference vr[], size_t n, size_t sizes[], fmi3Binary values[], size_t m)
{
    Instance *self = c;
    if (n != 1 || m != 1 || self->mode != EVENT || (vr[0] == ANSWER && !self->reply_ticks))
        return fmi3Error;
    sizes[0] = 1;
    values[0] = vr[0] == TX ? &self->tx : &self->answer;
    return fmi3OK;
}
fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 values[], size_t m)
{
    Instance *self = c;
    (void)m;
    for (size_t i = 0; i < n; i++)
        values[i] = vr[i] == HEARD ? self->heard : vr[i] == HEARD_AT ? self->heard_at : self->beats;
    return fmi3OK;
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 values[], size_t m)
{
    Instance *self = c;
    ONLY(EVENT);
    if (n != 1 || m != 1 || vr[0] != SAY)
        return fmi3Error;
    self->say = values[0];
    self->changed = 1;
    return fmi3OK;
}
