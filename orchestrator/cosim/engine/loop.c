/* Goes through the table of operations until the end, a full buffer, or something that only the caller can handle. */
#include "loop.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>

#define WARNING 1

typedef int Values2(void *, const uint32_t *, size_t, void *);
typedef int Values3(void *, const uint32_t *, size_t, void *, size_t);
typedef int Step2(void *, double, double, int);
typedef int Step3(void *, double, double, bool, bool *, bool *, bool *, double *);

/* Plain stores, in order, for whoever looks on from another process while the FMU runs. */
static void enter(volatile Progress *progress, int component, int call, double time)
{
    progress->component = component;
    progress->call = call;
    progress->time = time;
    progress->calls++;
}

static LoopOutcome check(Loop *loop, const Operation *op)
{
    double sum = 0.0;
    int outside = 0;
    for (int i = 0; i < op->n_values; i++)
        sum += 0.0 * op->values[i]; /* not a number as soon as one value is not finite */
    if (op->lower != NULL)
        for (int i = 0; i < op->n_values; i++)
            outside |= op->values[i] < op->lower[i] || op->values[i] > op->upper[i];
    if (sum == 0.0 && !outside)
        return LOOP_DONE;
    for (int i = 0; i < op->n_values; i++)
        if (!isfinite(op->values[i]) ||
            (op->lower != NULL && (op->values[i] < op->lower[i] || op->values[i] > op->upper[i]))) {
            loop->index = i;
            break;
        }
    return LOOP_OUTSIDE;
}

#define UNPACK(type)            \
    for (int i = 0; i < n; i++) \
        values[i] = (double)((const type *)raw)[first + i]; \
    break
#define PACK(type)              \
    for (int i = 0; i < n; i++) \
        ((type *)raw)[first + i] = (type)values[i]; \
    break

void loop_unpack(int type, int first, int n, const void *raw, double *values)
{
    switch (type) {
    case FLOAT64: UNPACK(double);
    case FLOAT32: UNPACK(float);
    case INT8: UNPACK(int8_t);
    case UINT8: UNPACK(uint8_t);
    case INT16: UNPACK(int16_t);
    case UINT16: UNPACK(uint16_t);
    case INT32: UNPACK(int32_t);
    case UINT32: UNPACK(uint32_t);
    case INT64: UNPACK(int64_t);
    case BOOLEAN: UNPACK(bool);
    }
}

void loop_pack(int type, int first, int n, const double *values, void *raw)
{
    switch (type) {
    case FLOAT64: PACK(double);
    case FLOAT32: PACK(float);
    case INT8: PACK(int8_t);
    case UINT8: PACK(uint8_t);
    case INT16: PACK(int16_t);
    case UINT16: PACK(uint16_t);
    case INT32: PACK(int32_t);
    case UINT32: PACK(uint32_t);
    case INT64: PACK(int64_t);
    case UINT64: PACK(uint64_t);
    case BOOLEAN: PACK(bool);
    }
}

static LoopOutcome call(Loop *loop, const Operation *op, const Part *part)
{
    size_t n = (size_t)op->n_references;
    loop->status = part->version == 2
                       ? ((Values2 *)op->function)(part->instance, op->references, n, op->raw)
                       : ((Values3 *)op->function)(part->instance, op->references, n, op->raw, (size_t)op->n_values);
    return loop->status > WARNING ? LOOP_REFUSED : LOOP_DONE;
}

static void store(Loop *loop, const Operation *op)
{
    for (int i = 0; i < op->n_values; i++)
        loop->signals[op->places[i]] = op->values[i];
}

static LoopOutcome read(Loop *loop, const Operation *op, const Part *part, double time)
{
    enter(loop->progress, part->number, CALL_GET, time);
    LoopOutcome outcome = call(loop, op, part);
    if (outcome != LOOP_DONE)
        return outcome;
    if (op->type != FLOAT64)
        loop_unpack(op->type, 0, op->n_values, op->raw, op->values);
    store(loop, op);
    return check(loop, op);
}

static LoopOutcome write(Loop *loop, const Operation *op, const Part *part, double time)
{
    if (op->factors == NULL)
        for (int i = 0; i < op->n_values; i++)
            op->values[i] = loop->signals[op->sources[i]];
    else
        for (int i = 0; i < op->n_values; i++) {
            double value = loop->signals[op->sources[i]];
            /* Adding zero would turn -0 into 0. */
            int plain = op->factors[i] == 1.0 && op->offsets[i] == 0.0;
            op->values[i] = plain ? value : op->factors[i] * value + op->offsets[i];
        }
    store(loop, op);
    LoopOutcome outcome = check(loop, op);
    if (outcome != LOOP_DONE)
        return outcome;
    if (op->type != FLOAT64)
        loop_pack(op->type, 0, op->n_values, op->values, op->raw);
    enter(loop->progress, part->number, CALL_SET, time);
    return call(loop, op, part);
}

static LoopOutcome step_once(Loop *loop, const Operation *op, const Part *part, double time, double size)
{
    enter(loop->progress, part->number, CALL_STEP, time);
    if (part->version == 2) {
        loop->status = ((Step2 *)op->function)(part->instance, time, size, 1);
        return loop->status > WARNING ? LOOP_REFUSED : LOOP_DONE;
    }
    bool event = false, terminate = false, early = false;
    double last = time + size;
    loop->status = ((Step3 *)op->function)(part->instance, time, size, true, &event, &terminate, &early, &last);
    if (loop->status > WARNING)
        return LOOP_REFUSED;
    loop->terminated = terminate;
    loop->reached = last;
    return terminate || (early && last < time + size) ? LOOP_EARLY : LOOP_DONE;
}

static LoopOutcome step(Loop *loop, const Operation *op, const Part *part)
{
    if ((loop->k + 1) % op->every != 0)
        return LOOP_DONE;
    /* A component with longer steps of its own is late rather than ahead: it steps when the others have arrived. */
    double first = loop->start + (double)(loop->k + 1 - op->every) * loop->size;
    double last = loop->start + (double)(loop->k + 1) * loop->size, piece = (double)op->every * loop->size / op->pieces;
    for (; loop->piece < op->pieces; loop->piece++) {
        /* Where a step ends the next one begins, to the last bit: some FMUs count their own steps up to there. */
        double from = first + loop->piece * piece;
        double to = loop->piece + 1 == op->pieces ? last : first + (loop->piece + 1) * piece;
        LoopOutcome outcome = step_once(loop, op, part, from, to - from);
        if (outcome != LOOP_DONE)
            return outcome;
    }
    loop->piece = 0;
    return LOOP_DONE;
}

static void record(Loop *loop, double time)
{
    double *row = loop->rows + loop->filled * (1 + loop->n_columns);
    row[0] = time;
    for (int i = 0; i < loop->n_columns; i++)
        row[1 + i] = loop->signals[loop->columns[i]];
    loop->filled++;
    *(volatile uint64_t *)&loop->progress->rows = (uint64_t)loop->filled;
}

LoopOutcome loop_operations(Loop *loop, double time)
{
    for (; loop->next < loop->n_operations; loop->next++) {
        const Operation *op = &loop->operations[loop->next];
        if (op->kind == HOST) {
            loop->failed = loop->next;
            return LOOP_HOST;
        }
        const Part *part = &loop->parts[op->part];
        LoopOutcome outcome = op->kind == GET   ? read(loop, op, part, time)
                          : op->kind == SET ? write(loop, op, part, time)
                                            : step(loop, op, part);
        if (outcome != LOOP_DONE) {
            loop->failed = loop->next;
            return outcome;
        }
    }
    loop->next = 0;
    return LOOP_DONE;
}

LoopOutcome loop_run(Loop *loop)
{
    volatile Progress *progress = loop->progress;
    while (loop->k < loop->k_end) {
        if (loop->ours != NULL && !*loop->ours)
            _Exit(0); /* a copy that an FMU made of this process has nothing to do here */
        if (loop->filled >= loop->capacity)
            return LOOP_FULL;
        if (progress->stop)
            return LOOP_STOPPED;
        double time = loop->start + (double)(loop->k + 1) * loop->size;
        LoopOutcome outcome = loop_operations(loop, time);
        if (outcome != LOOP_DONE)
            return outcome;
        loop->k++;
        progress->last_good = time;
        if (loop->k % loop->every == 0)
            record(loop, time);
    }
    progress->component = -1;
    progress->call = CALL_NOTHING;
    return LOOP_DONE;
}
