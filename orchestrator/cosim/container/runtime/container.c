#include "container.h"

#include "library.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A step closer than that to a point, in steps, has arrived. */
#define ARRIVED 1e-9

int container_fail(Container *self, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(self->message, sizeof self->message, format, arguments);
    va_end(arguments);
    return -1;
}

static void hear(void *owner, const char *part, int status, const char *text)
{
    Container *self = owner;
    char line[1200];
    if (status == PART_OK && !self->talkative)
        return;
    snprintf(line, sizeof line, "%s: %s", part, text);
    self->listener(self->owner, status, line);
}

static int part_failed(Container *self, const Component *part) { return container_fail(self, "%s", part->problem); }

static int give(Container *self, const StartData *start)
{
    Component *part = &self->components[start->part];
    int n = start->n_values;
    if (start->kind == TEXT)
        return part_set(part, TEXT, start->reference, 1, &start->text);
    double *raw = calloc((size_t)n + 1, sizeof(double));
    if (raw == NULL)
        return -1;
    loop_pack(part_raw_kind(part, start->kind), 0, n, start->values, raw);
    int done = 0;
    if (part->data->linear != NULL)
        for (int i = 0; i < n && done == 0; i++)
            done = part_set(part, FLOAT64, start->reference + (uint32_t)i, 1, raw + i);
    else
        done = part_set(part, start->kind, start->reference, (size_t)n, raw);
    free(raw);
    return done;
}

/* Values that the system gives: structural parameters first, since they size the arrays. */
static int give_starts(Container *self)
{
    const SystemData *system = self->system;
    for (int structural = 1; structural >= 0; structural--)
        for (int32_t i = 0; i < system->n_starts; i++) {
            const StartData *start = &system->starts[i];
            Component *part = &self->components[start->part];
            if (start->structural != structural)
                continue;
            if ((structural && part_configure(part, 1) != 0) || give(self, start) != 0 ||
                (structural && part_configure(part, 0) != 0))
                return part_failed(self, part);
        }
    return 0;
}

static void prepare_rows(Container *self)
{
    double *memory = self->memory;
    for (int32_t i = 0; i < self->system->n_rows; i++) {
        const RowData *data = &self->system->rows[i];
        Component *part = &self->components[data->part];
        int raw = part_raw_kind(part, data->kind);
        self->rows[i] = (Operation){.kind = data->is_set ? SET : GET,
                                    .part = data->part,
                                    .type = raw,
                                    .n_references = data->n_references,
                                    .n_values = data->n_values,
                                    .function = data->is_set ? part->set[data->kind] : part->get[data->kind],
                                    .references = data->references,
                                    .values = memory,
                                    .raw = raw == FLOAT64 ? memory : memory + data->n_values,
                                    .places = data->places,
                                    .sources = data->places, /* links have been followed before */
                                    .lower = data->lower,
                                    .upper = data->upper};
        memory += 2 * data->n_values;
    }
}

/* Everything as it is before initialisation. */
static int make(Container *self)
{
    const SystemData *system = self->system;
    for (int32_t i = 0; i < system->n_parts; i++) {
        Component *part = &self->components[i];
        *part = (Component){.data = &system->parts[i], .listener = hear, .owner = self};
        if (part_open(part, self->resources) != 0)
            return part_failed(self, part);
        self->parts[i] = (Part){part->instance, (int32_t)part->data->version, i};
    }
    prepare_rows(self);
    memcpy(self->signals, system->signals, (size_t)system->n_signals * sizeof(double));
    for (int32_t i = 0; i < system->n_signals; i++) {
        self->before[i] = self->smooth[i] = 0.0;
        self->before_time[i] = HUGE_VAL;
    }
    self->clock = (Clockwork){.stage = MADE, .stale = 1, .start = system->start, .time = system->start,
                              .begin = system->start, .stop = HUGE_VAL};
    return give_starts(self);
}

static void close_all(Container *self)
{
    for (int32_t i = 0; i < self->system->n_parts; i++)
        if (self->components[i].data != NULL)
            part_close(&self->components[i]);
}

Container *container_new(const char *resources, Listener *listener, void *owner, int talkative, char *message, size_t size)
{
    const SystemData *system = &misfit_system;
    size_t n = (size_t)system->n_signals, values = 0;
    for (int32_t i = 0; i < system->n_rows; i++)
        values += 2 * (size_t)system->rows[i].n_values;
    Container *self = calloc(1, sizeof *self);
    if (self == NULL) {
        snprintf(message, size, "out of memory");
        return NULL;
    }
    self->system = system;
    self->listener = listener;
    self->owner = owner;
    self->talkative = talkative;
    self->resources = path_of(resources != NULL ? resources : "");
    self->components = calloc((size_t)system->n_parts + 1, sizeof(Component));
    self->parts = calloc((size_t)system->n_parts + 1, sizeof(Part));
    self->rows = calloc((size_t)system->n_rows + 1, sizeof(Operation));
    self->memory = calloc(values + 1, sizeof(double));
    self->n_remembered = 4 * n;
    self->signals = calloc(4 * n + 1, sizeof(double));
    int whole = self->resources != NULL && self->components != NULL && self->parts != NULL && self->rows != NULL &&
                self->memory != NULL && self->signals != NULL;
    if (whole) {
        self->before = self->signals + n;
        self->before_time = self->before + n;
        self->smooth = self->before_time + n;
    }
    if (!whole || make(self) != 0) {
        snprintf(message, size, "%s", whole ? self->message : "out of memory");
        container_free(self);
        return NULL;
    }
    return self;
}

void container_free(Container *self)
{
    if (self->components != NULL)
        close_all(self);
    free(self->resources);
    free(self->components);
    free(self->parts);
    free(self->rows);
    free(self->memory);
    free(self->signals);
    free(self);
}

int container_reset(Container *self)
{
    close_all(self);
    return make(self);
}

int container_set_up(Container *self, const double *tolerance, double start, const double *stop)
{
    Clockwork *clock = &self->clock;
    if (!isfinite(start) || (stop != NULL && !(*stop >= start)))
        return container_fail(self, "start time %g s and stop time %g s: expected a stop after the start", start,
                              stop != NULL ? *stop : HUGE_VAL);
    clock->start = clock->begin = clock->time = start;
    clock->has_stop = stop != NULL;
    clock->stop = stop != NULL ? *stop : HUGE_VAL;
    clock->tolerance = tolerance != NULL ? *tolerance : self->system->tolerance;
    clock->has_tolerance = clock->tolerance > 0.0;
    return 0;
}

int container_enter(Container *self)
{
    Clockwork *clock = &self->clock;
    for (int32_t i = 0; i < self->system->n_parts; i++)
        if (part_set_up(&self->components[i], clock->has_tolerance ? &clock->tolerance : NULL, clock->start,
                        clock->has_stop ? &clock->stop : NULL) != 0)
            return part_failed(self, &self->components[i]);
    clock->stage = INITIALISING;
    clock->stale = 1;
    return 0;
}

int bring_up_to_date(Container *self)
{
    const SystemData *system = self->system;
    Clockwork *clock = &self->clock;
    if (!clock->stale || (clock->stage != INITIALISING && clock->stage != RUNNING))
        return 0;
    int initial = clock->stage == INITIALISING;
    if (carry_out(self, initial ? system->first_initial : system->first_evaluation,
                  initial ? system->n_initial : system->n_evaluation, clock->time) != 0)
        return -1;
    clock->stale = 0;
    return 0;
}

int container_leave(Container *self)
{
    self->clock.stale = 1;
    if (bring_up_to_date(self) != 0)
        return -1;
    for (int32_t i = 0; i < self->system->n_parts; i++)
        if (part_start(&self->components[i]) != 0)
            return part_failed(self, &self->components[i]);
    self->clock.stage = RUNNING;
    self->clock.stale = 1;
    return bring_up_to_date(self);
}

/* One step of the system's own size, or a shorter one, from which its points are counted anew. */
static int step(Container *self, double size)
{
    Clockwork *clock = &self->clock;
    double own = self->system->step;
    if (size != own) {
        if (self->system->fixed_step)
            return container_fail(self, "a component takes steps of one size only, %g s; the step from t = %.9g s would be %.9g s",
                                  own, clock->time, size);
        clock->start = clock->time;
        clock->k = 0;
    }
    if (carry_out_step(self) != 0)
        return -1;
    if (size != own) {
        clock->start = clock->time;
        clock->k = 0;
    }
    return 0;
}

int container_advance(Container *self, double time)
{
    Clockwork *clock = &self->clock;
    double own = self->system->step;
    if (bring_up_to_date(self) != 0)
        return -1;
    for (double left = time - clock->time; !clock->ended && left > ARRIVED * own; left = time - clock->time) {
        double whole = floor((time - clock->start) / own + ARRIVED) - (double)clock->k;
        self->progress.last_good = clock->time;
        clock->step = whole >= 1.0 ? own : left;
        if (step(self, clock->step) != 0)
            return -1;
    }
    return 0;
}

void container_terminate(Container *self)
{
    self->clock.stage = OVER;
    for (int32_t i = 0; i < self->system->n_parts; i++)
        if (self->components[i].running && !self->components[i].failed)
            part_end(&self->components[i]);
}
