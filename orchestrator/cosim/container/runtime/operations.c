/* The operations of the system's table, as the masters of misfit define them. */
#include "container.h"

#include <math.h>
#include <stdio.h>

/* A step that is cut more often than that, by events, gets nowhere. */
#define MOST_PARTS 10000
/* Share of a step that is taken for rounding. */
#define ROUNDING 1e-6

/* A time, or the stop time where that is no further away than a rounding error of a step of `size` s. */
static double not_past_stop(const Clockwork *clock, double time, double size)
{
    return fabs(time - clock->stop) <= ROUNDING * size ? clock->stop : time;
}

/* Size of a step from `time` which, added to it as an FMU adds them, does not pass the stop by a rounding error. */
static double within_stop(const Clockwork *clock, double time, double size)
{
    double past = time + size - clock->stop;
    if (!(0.0 < past && past <= ROUNDING * size))
        return size;
    size = clock->stop - time;
    while (time + size > clock->stop)
        size = nextafter(size, 0.0);
    return size;
}

int convert(Container *self, const LinkData *link, double value, double *converted)
{
    const SystemData *system = self->system;
    for (int32_t i = 0; i < link->n_pairs; i++)
        if (system->pairs[link->first_pair + i].from == value) {
            *converted = system->pairs[link->first_pair + i].to;
            return 0;
        }
    if (link->n_pairs > 0 && !link->keeps_others)
        return container_fail(self, "%s = %.9g has no counterpart in %s", system->names[link->source], value,
                              system->names[link->target]);
    if (value < link->low || value > link->high)
        return container_fail(self, "%s = %.9g does not fit %s, which holds [%.0f, %.0f]", system->names[link->source], value,
                              system->names[link->target], link->low, link->high);
    /* Adding zero would turn -0 into 0. */
    int plain = (link->factor == 1.0 && link->offset == 0.0) || link->n_pairs > 0;
    double scaled = plain ? value : link->factor * value + link->offset;
    *converted = link->to_integer && !plain ? trunc(scaled) : scaled;
    return 0;
}

int copy_links(Container *self, int32_t first, int32_t count)
{
    for (int32_t i = first; i < first + count; i++) {
        const LinkData *link = &self->system->links[i];
        if (convert(self, link, self->signals[link->source], &self->signals[link->target]) != 0)
            return -1;
    }
    return 0;
}

static int outside(Container *self, const Operation *row, int index, double time)
{
    int32_t place = row->places[index];
    double value = row->values[index];
    const char *name = self->system->names[place], *unit = self->system->units[place];
    if (!isfinite(value))
        return container_fail(self, "%s = %g at t = %.9g s is not a finite number", name, value, time);
    return container_fail(self, "%s = %.9g%s%s at t = %.9g s is outside [%.9g, %.9g]%s%s", name, value, *unit ? " " : "", unit,
                          time, row->lower[index], row->upper[index], *unit ? " " : "", unit);
}

int carry_out_rows(Container *self, int32_t first, int32_t count, double time)
{
    if (count == 0)
        return 0;
    Loop loop = {.parts = self->parts, .operations = self->rows + first, .n_operations = count,
                 .signals = self->signals, .progress = &self->progress};
    for (int32_t i = first; i < first + count; i++)
        if (self->rows[i].function == NULL)
            return container_fail(self, "component '%s' lacks the function that gives or takes values of its type",
                                  self->components[self->rows[i].part].data->name);
    LoopOutcome outcome = loop_operations(&loop, time);
    if (outcome == LOOP_DONE)
        return 0;
    const Operation *row = &self->rows[first + loop.failed];
    if (outcome == LOOP_OUTSIDE)
        return outside(self, row, loop.index, time);
    Component *part = &self->components[row->part];
    part->failed |= loop.status >= PART_ERROR;
    part->dead |= loop.status == PART_FATAL;
    return container_fail(self, "component '%s' refused to %s %s at t = %.9g s: status %d%s%s", part->data->name,
                          row->kind == GET ? "give" : "take", self->system->names[row->places[0]], time, (int)loop.status,
                          *part->said ? "; it says: " : "", part->said);
}

/* Goes on where a step ended early, as far as `planned` s. */
static int finish_step(Container *self, Component *part, PartStep end, double planned)
{
    for (int turn = 0; turn < MOST_PARTS; turn++) {
        double left = planned - end.time;
        int arrived = left <= 1e-9 * fmax(1.0, fabs(planned));
        if (end.terminated) {
            self->clock.ended = 1;
            if (!arrived)
                self->clock.time = end.time;
            return arrived ? 0 : 1;
        }
        if (arrived || !end.early)
            return 0;
        double before = end.time;
        if (part_step(part, before, left, &end) != 0)
            return container_fail(self, "%s", part->problem);
        if (end.early && !(end.time > before))
            break;
    }
    return container_fail(self, "component '%s' ends every step early and gets no further than t = %.9g s", part->data->name,
                          end.time);
}

static int step_part(Container *self, const OpData *op)
{
    const Clockwork *clock = &self->clock;
    Component *part = &self->components[op->part];
    if ((clock->k + 1) % op->every != 0)
        return 0;
    /* A component with longer steps of its own is late rather than ahead: it steps when the others have arrived. */
    double first = clock->start + (double)(clock->k + 1 - op->every) * clock->step;
    double last = clock->start + (double)(clock->k + 1) * clock->step, piece = (double)op->every * clock->step / op->pieces;
    for (int32_t n = 0; n < op->pieces; n++) {
        /* Where a step ends the next one begins, to the last bit: some FMUs count their own steps up to there. */
        double from = first + n * piece, to = n + 1 == op->pieces ? last : first + (n + 1) * piece;
        double size = within_stop(clock, from, to - from);
        PartStep end;
        if (part_step(part, from, size, &end) != 0)
            return container_fail(self, "%s", part->problem);
        int done = end.early || end.terminated ? finish_step(self, part, end, from + size) : 0;
        if (done != 0)
            return done;
    }
    return 0;
}

static int carry_out_one(Container *self, const OpData *op, double time)
{
    switch (op->kind) {
    case OP_WRITE:
        if (copy_links(self, op->first_link, op->n_links) != 0)
            return -1;
        return carry_out_rows(self, op->first_row, op->n_rows, time);
    case OP_READ:
        return carry_out_rows(self, op->first_row, op->n_rows, time);
    case OP_SOLVE:
        return solve_loop(self, &self->system->loops[op->loop], time);
    case OP_SHAPE:
        return shape_inputs(self, op, self->clock.start + (double)self->clock.k * self->clock.step, self->clock.step);
    default:
        return step_part(self, op);
    }
}

int carry_out(Container *self, int32_t first, int32_t count, double time)
{
    for (int32_t i = first; i < first + count; i++) {
        int done = carry_out_one(self, &self->system->ops[i], time);
        if (done != 0)
            return done;
    }
    return 0;
}

/* From a communication point to the next; a component that ends the run before it leaves the time where it got. */
int carry_out_step(Container *self)
{
    Clockwork *clock = &self->clock;
    double next = not_past_stop(clock, clock->start + (double)(clock->k + 1) * clock->step, clock->step);
    int done = carry_out(self, self->system->first_advance, self->system->n_advance, next);
    if (done != 0)
        return done < 0 ? -1 : 0;
    clock->time = next;
    clock->k++;
    return 0;
}
