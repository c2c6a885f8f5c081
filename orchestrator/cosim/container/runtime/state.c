/* Saved states: values, the count of steps, and the states of all components. */
#include "container.h"

#include <stdlib.h>
#include <string.h>

static ContainerState *new_state(const Container *self)
{
    ContainerState *state = calloc(1, sizeof *state);
    if (state == NULL)
        return NULL;
    state->numbers = calloc(self->n_remembered + 1, sizeof(double));
    state->parts = calloc((size_t)self->system->n_parts + 1, sizeof(void *));
    if (state->numbers != NULL && state->parts != NULL)
        return state;
    free(state->numbers);
    free(state->parts);
    free(state);
    return NULL;
}

void container_forget(Container *self, ContainerState *state)
{
    for (int32_t i = 0; i < self->system->n_parts; i++)
        part_forget(&self->components[i], &state->parts[i]);
    free(state->numbers);
    free(state->parts);
    free(state);
}

int container_save(Container *self, ContainerState **state)
{
    ContainerState *saved = *state != NULL ? *state : new_state(self);
    if (saved == NULL)
        return container_fail(self, "out of memory");
    saved->clock = self->clock;
    memcpy(saved->numbers, self->signals, self->n_remembered * sizeof(double));
    for (int32_t i = 0; i < self->system->n_parts; i++)
        if (part_save(&self->components[i], &saved->parts[i]) != 0) {
            container_fail(self, "%s", self->components[i].problem);
            if (*state == NULL)
                container_forget(self, saved);
            return -1;
        }
    *state = saved;
    return 0;
}

int container_restore(Container *self, const ContainerState *state)
{
    for (int32_t i = 0; i < self->system->n_parts; i++) {
        Component *part = &self->components[i];
        if (part_restore(part, state->parts[i]) != 0)
            return container_fail(self, "%s", part->problem);
        part->failed = 0;
        part->running = state->clock.stage == RUNNING;
    }
    memcpy(self->signals, state->numbers, self->n_remembered * sizeof(double));
    self->clock = state->clock;
    return 0;
}

int container_state_size(Container *self, const ContainerState *state, size_t *size)
{
    *size = sizeof state->clock + self->n_remembered * sizeof(double);
    for (int32_t i = 0; i < self->system->n_parts; i++) {
        size_t part;
        if (part_state_size(&self->components[i], state->parts[i], &part) != 0)
            return container_fail(self, "%s", self->components[i].problem);
        *size += sizeof part + part;
    }
    return 0;
}

int container_serialize(Container *self, const ContainerState *state, char *bytes, size_t size)
{
    size_t needed = 0, numbers = self->n_remembered * sizeof(double);
    if (container_state_size(self, state, &needed) != 0)
        return -1;
    if (size < needed)
        return container_fail(self, "the state takes %lu bytes, there are %lu", (unsigned long)needed, (unsigned long)size);
    memcpy(bytes, &state->clock, sizeof state->clock);
    bytes += sizeof state->clock;
    memcpy(bytes, state->numbers, numbers);
    bytes += numbers;
    for (int32_t i = 0; i < self->system->n_parts; i++) {
        size_t part;
        if (part_state_size(&self->components[i], state->parts[i], &part) != 0)
            return container_fail(self, "%s", self->components[i].problem);
        memcpy(bytes, &part, sizeof part);
        if (part_serialize(&self->components[i], state->parts[i], bytes + sizeof part, part) != 0)
            return container_fail(self, "%s", self->components[i].problem);
        bytes += sizeof part + part;
    }
    return 0;
}

static int read_parts(Container *self, const char *bytes, size_t left, ContainerState *state)
{
    for (int32_t i = 0; i < self->system->n_parts; i++) {
        size_t part;
        if (left < sizeof part)
            return container_fail(self, "the bytes are no state of this FMU: they end too early");
        memcpy(&part, bytes, sizeof part);
        if (left - sizeof part < part)
            return container_fail(self, "the bytes are no state of this FMU: they end too early");
        if (part_deserialize(&self->components[i], bytes + sizeof part, part, &state->parts[i]) != 0)
            return container_fail(self, "%s", self->components[i].problem);
        bytes += sizeof part + part;
        left -= sizeof part + part;
    }
    return 0;
}

int container_deserialize(Container *self, const char *bytes, size_t size, ContainerState **state)
{
    size_t numbers = self->n_remembered * sizeof(double);
    ContainerState *made = new_state(self);
    if (made == NULL)
        return container_fail(self, "out of memory");
    if (size < sizeof made->clock + numbers) {
        container_forget(self, made);
        return container_fail(self, "the bytes are no state of this FMU: they end too early");
    }
    memcpy(&made->clock, bytes, sizeof made->clock);
    memcpy(made->numbers, bytes + sizeof made->clock, numbers);
    size_t used = sizeof made->clock + numbers;
    if (read_parts(self, bytes + used, size - used, made) != 0) {
        container_forget(self, made);
        return -1;
    }
    *state = made;
    return 0;
}
