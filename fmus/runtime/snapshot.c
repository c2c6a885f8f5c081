/* Copies of a running model, in memory and as bytes. Bytes are for the same binary on the same machine type. */
#include "core.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    char guid[sizeof MODEL_GUID];
    unsigned long long checksum; /* of all bytes that follow it */
    State state;
    size_t count;
} Header;

#define CHECKED offsetof(Header, state)

/* FNV-1a, 64 bits: bytes that were damaged on their way are told from a state. */
static unsigned long long checksum_of(const char *bytes, size_t size)
{
    unsigned long long sum = 14695981039346656037ull;
    for (size_t i = 0; i < size; i++)
        sum = (sum ^ (unsigned char)bytes[i]) * 1099511628211ull;
    return sum;
}

int core_owns(Core *core, const Snapshot *snapshot)
{
    for (const Snapshot *own = core->snapshots; own != NULL; own = own->next)
        if (own == snapshot)
            return 1;
    core_fail(core, "the pointer is not a state of this instance, or one that was freed");
    return 0;
}

static Snapshot *create(Core *core)
{
    Snapshot *snapshot = calloc(1, sizeof *snapshot);
    if (snapshot == NULL) {
        core_fail(core, "out of memory");
        return NULL;
    }
    snapshot->next = core->snapshots;
    core->snapshots = snapshot;
    return snapshot;
}

Snapshot *core_snapshot(Core *core, Snapshot *snapshot)
{
    if (snapshot != NULL && !core_owns(core, snapshot))
        return NULL;
    Snapshot *target = snapshot != NULL ? snapshot : create(core);
    if (target == NULL)
        return NULL;
    if (history_copy(&target->history, &core->history) != 0) {
        core_fail(core, "out of memory");
        if (snapshot == NULL)
            core_free_snapshot(core, target);
        return NULL;
    }
    target->state = core->state;
    return target;
}

int core_restore(Core *core, const Snapshot *snapshot)
{
    if (!core_owns(core, snapshot))
        return -1;
    if (snapshot->state.exchange != core->state.exchange)
        return core_fail(core, "the state is one of %s, this instance is not",
                         core->state.exchange ? "co-simulation" : "model exchange");
    if (snapshot->state.event_mode != core->state.event_mode)
        return core_fail(core, "the state is one %s event mode, this instance is not",
                         core->state.event_mode ? "without" : "with");
    if (history_copy(&core->history, &snapshot->history) != 0)
        return core_fail(core, "out of memory");
    int early_return = core->state.early_return;
    core->state = snapshot->state;
    core->state.early_return = early_return;
    core->starts_valid = core->outputs_valid = core->dependents_valid = 0;
    return 0;
}

int core_free_snapshot(Core *core, Snapshot *snapshot)
{
    if (snapshot == NULL)
        return 0;
    for (Snapshot **link = &core->snapshots; *link != NULL; link = &(*link)->next)
        if (*link == snapshot) {
            *link = snapshot->next;
            history_clear(&snapshot->history);
            free(snapshot);
            return 0;
        }
    return core_owns(core, snapshot) ? 0 : -1;
}

size_t core_serialized_size(const Snapshot *snapshot)
{
    return sizeof(Header) + snapshot->history.count * (1 + N_DELAYS) * sizeof(double);
}

void core_serialize(const Snapshot *snapshot, char *bytes)
{
    Header header;
    size_t count = snapshot->history.count;
    memset(&header, 0, sizeof header);
    memcpy(header.guid, MODEL_GUID, sizeof header.guid);
    header.state = snapshot->state;
    header.count = count;
    memcpy(bytes, &header, sizeof header);
    if (count > 0) {
        memcpy(bytes + sizeof header, snapshot->history.time, count * sizeof(double));
        memcpy(bytes + sizeof header + count * sizeof(double), snapshot->history.values,
               count * N_DELAYS * sizeof(double));
    }
    unsigned long long sum = checksum_of(bytes + CHECKED, core_serialized_size(snapshot) - CHECKED);
    memcpy(bytes + offsetof(Header, checksum), &sum, sizeof sum);
}

static int check_bytes(Core *core, const Header *header, const char *bytes, size_t size)
{
    const size_t row = (1 + N_DELAYS) * sizeof(double), rest = size - sizeof *header;
    if (memcmp(header->guid, MODEL_GUID, sizeof header->guid) != 0)
        return core_fail(core, "the bytes are not a state of this model");
    if (rest % row != 0 || rest / row != header->count)
        return core_fail(core, "%zu bytes do not fit a state of this model", size);
    if (checksum_of(bytes + CHECKED, size - CHECKED) != header->checksum)
        return core_fail(core, "the bytes of the state are damaged");
    return 0;
}

Snapshot *core_deserialize(Core *core, const char *bytes, size_t size)
{
    Header header;
    if (size < sizeof header) {
        core_fail(core, "%zu bytes are too few for a state of this model", size);
        return NULL;
    }
    memcpy(&header, bytes, sizeof header);
    Snapshot *snapshot = check_bytes(core, &header, bytes, size) == 0 ? create(core) : NULL;
    if (snapshot == NULL)
        return NULL;
    snapshot->state = header.state;
    snapshot->history.width = N_DELAYS;
    const char *times = bytes + sizeof header, *values = times + header.count * sizeof(double);
    for (size_t i = 0; i < header.count; i++) {
        double time, sources[N_DELAYS + 1];
        memcpy(&time, times + i * sizeof time, sizeof time);
        memcpy(sources, values + i * N_DELAYS * sizeof(double), N_DELAYS * sizeof(double));
        if (history_append(&snapshot->history, time, sources) != 0) {
            core_fail(core, "out of memory");
            core_free_snapshot(core, snapshot);
            return NULL;
        }
    }
    return snapshot;
}
