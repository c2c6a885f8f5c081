/* What the importer reads and sets. */
#include "container.h"

#include <math.h>
#include <stdlib.h>

static int part_failed(Container *self, const Component *part) { return container_fail(self, "%s", part->problem); }

/* Reads a variable from its component, an array as a whole, and sets one element where a value is given. */
static int reach(Container *self, const VariableData *data, double *value, const double *to)
{
    Component *part = &self->components[data->part];
    int kind = part_raw_kind(part, data->kind), done = 0;
    size_t n = (size_t)data->n_elements;
    double *raw = calloc(n + 1, sizeof(double));
    if (raw == NULL)
        return container_fail(self, "out of memory");
    if (to == NULL || n > 1)
        done = part_get(part, data->kind, data->reference, n, raw);
    if (done == 0 && to != NULL) {
        loop_pack(kind, data->element, 1, to, raw);
        done = part_set(part, data->kind, data->reference, n, raw);
    }
    if (done == 0 && value != NULL)
        loop_unpack(kind, data->element, 1, raw, value);
    free(raw);
    return done != 0 ? part_failed(self, part) : 0;
}

int container_get(Container *self, uint32_t variable, double *value)
{
    const VariableData *data = &self->system->variables[variable];
    if (data->access == OF_TIME)
        *value = self->clock.time;
    else if (data->access == OF_INPUT)
        *value = self->signals[data->place];
    else if (data->access == OF_COMPONENT)
        return reach(self, data, value, NULL);
    else if (bring_up_to_date(self) != 0)
        return -1;
    else if (data->access == OF_OUTPUT)
        *value = self->signals[data->place];
    else {
        const LinkData *link = &self->system->links[data->first_link];
        return convert(self, link, self->signals[link->source], value);
    }
    return 0;
}

static int refuse_to_set(Container *self, uint32_t variable)
{
    const VariableData *data = &self->system->variables[variable];
    return container_fail(self, "%s cannot be set %s", self->system->variable_names[variable],
                          data->settable == 0 ? "from outside" : "any more: the run has begun");
}

int container_set(Container *self, uint32_t variable, double value)
{
    const VariableData *data = &self->system->variables[variable];
    if (data->settable == 0 || (data->settable == 1 && self->clock.stage >= RUNNING))
        return refuse_to_set(self, variable);
    if (!isfinite(value))
        return container_fail(self, "%s = %g is not a finite number", self->system->variable_names[variable], value);
    self->clock.stale = 1;
    if (data->access != OF_INPUT)
        return reach(self, data, NULL, &value);
    self->signals[data->place] = value;
    if (copy_links(self, data->first_link, data->n_links) != 0)
        return -1;
    return carry_out_rows(self, data->first_row, data->n_rows, self->clock.time);
}

int container_get_text(Container *self, uint32_t variable, const char **value)
{
    const VariableData *data = &self->system->variables[variable];
    Component *part = &self->components[data->part];
    if (bring_up_to_date(self) != 0)
        return -1;
    return part_get(part, TEXT, data->reference, 1, value) != 0 ? part_failed(self, part) : 0;
}

int container_set_text(Container *self, uint32_t variable, const char *value)
{
    const VariableData *data = &self->system->variables[variable];
    Component *part = &self->components[data->part];
    if (data->settable == 0 || (data->settable == 1 && self->clock.stage >= RUNNING))
        return refuse_to_set(self, variable);
    self->clock.stale = 1;
    return part_set(part, TEXT, data->reference, 1, &value) != 0 ? part_failed(self, part) : 0;
}
