/* Copies of a running model, in memory and as bytes. Bytes are for the same binary on the same machine type. */
#include "core.h"

#include <stdlib.h>
#include <string.h>

typedef struct {
    char guid[sizeof MODEL_GUID];
    State state;
    size_t count;
} Header;

Snapshot *core_snapshot(Core *core, Snapshot *snapshot)
{
    Snapshot *target = snapshot != NULL ? snapshot : calloc(1, sizeof *target);
    if (target == NULL || history_copy(&target->history, &core->history) != 0) {
        core_fail(core, "out of memory");
        if (snapshot == NULL)
            core_free_snapshot(target);
        return NULL;
    }
    target->state = core->state;
    return target;
}

int core_restore(Core *core, const Snapshot *snapshot)
{
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

void core_free_snapshot(Snapshot *snapshot)
{
    if (snapshot != NULL)
        history_clear(&snapshot->history);
    free(snapshot);
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
}

Snapshot *core_deserialize(Core *core, const char *bytes, size_t size)
{
    Header header;
    const size_t row = (1 + N_DELAYS) * sizeof(double);
    if (size < sizeof header) {
        core_fail(core, "%zu bytes are too few for a state of this model", size);
        return NULL;
    }
    memcpy(&header, bytes, sizeof header);
    if (memcmp(header.guid, MODEL_GUID, sizeof header.guid) != 0) {
        core_fail(core, "the bytes are not a state of this model");
        return NULL;
    }
    if ((size - sizeof header) % row != 0 || (size - sizeof header) / row != header.count) {
        core_fail(core, "%zu bytes do not fit a state of this model", size);
        return NULL;
    }
    Snapshot *snapshot = calloc(1, sizeof *snapshot);
    if (snapshot == NULL) {
        core_fail(core, "out of memory");
        return NULL;
    }
    snapshot->state = header.state;
    snapshot->history.width = N_DELAYS;
    const char *times = bytes + sizeof header, *values = times + header.count * sizeof(double);
    for (size_t i = 0; i < header.count; i++) {
        double time, sources[N_DELAYS + 1];
        memcpy(&time, times + i * sizeof time, sizeof time);
        memcpy(sources, values + i * N_DELAYS * sizeof(double), N_DELAYS * sizeof(double));
        if (history_append(&snapshot->history, time, sources) != 0) {
            core_fail(core, "out of memory");
            core_free_snapshot(snapshot);
            return NULL;
        }
    }
    return snapshot;
}
