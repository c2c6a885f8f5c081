/* The inner loop of a run: a table of operations on FMUs, gone through at every communication step.
 * Mirrored by `table.py`. */
#ifndef MISFIT_LOOP_H
#define MISFIT_LOOP_H

#include <stdint.h>

/* Who is called at what time; the same 64 bytes as `ProgressWord` in progress.py. */
typedef struct {
    int32_t component, call;
    double time, last_good;
    uint64_t calls, rows;
    int32_t stop, unused[5];
} Progress;

enum { CALL_NOTHING = 0, CALL_SET = 5, CALL_GET = 6, CALL_STEP = 7 };

typedef struct {
    void *instance;
    int32_t version, number; /* of FMI; of the component in its system */
} Part;

enum { GET, SET, STEP, HOST };
enum { FLOAT64, FLOAT32, INT8, UINT8, INT16, UINT16, INT32, UINT32, INT64, BOOLEAN, UINT64 = 11 };

typedef struct {
    int32_t kind, part, type;
    int32_t n_references, n_values, unused;
    void *function;
    const uint32_t *references;
    void *raw;                       /* in the type that the FMU uses; the same as `values` for FLOAT64 */
    double *values;                  /* outputs that are read, or inputs that are written */
    const int32_t *places;           /* of the values among the signals */
    const int32_t *sources;          /* SET: for each value the signal that it takes */
    const double *factors, *offsets; /* SET: conversions; NULL without any */
    const double *lower, *upper;     /* NULL without declared ranges */
    int32_t every, pieces;           /* STEP: once in so many steps, in so many pieces */
} Operation;

typedef enum {
    LOOP_DONE,
    LOOP_FULL,       /* no room for another row */
    LOOP_STOPPED,    /* somebody outside wishes to end */
    LOOP_REFUSED,    /* an FMU answered with `status` */
    LOOP_OUTSIDE,    /* value `index` of an operation is not finite or outside its range */
    LOOP_EARLY,      /* an FMU ended its step early, at `reached`, or wants to end the run */
    LOOP_HOST,       /* it is the caller's turn to carry out an operation */
} LoopOutcome;

typedef struct {
    const Part *parts;
    const Operation *operations; /* those that advance, then those at a communication point */
    int32_t n_operations, next; /* `next` is where to go on; 0 at a communication point */
    double *signals;
    const int32_t *columns; /* signals that are recorded */
    int32_t n_columns, every;
    double *rows; /* capacity x (1 + n_columns), time first */
    int64_t capacity, filled;
    double start, size; /* s; point k is at start + k * size */
    int64_t k, k_end;
    Progress *progress;
    int32_t failed, index, status, terminated; /* about the end, see LoopOutcome */
    int32_t piece, unused;
    double reached;
    const volatile int32_t *ours; /* 1, and 0 in a process that an FMU has forked off; may be NULL */
} Loop;

/* Values that an FMU has in its own type, from place `first` of `raw` on, as numbers, and the other way. */
void loop_unpack(int type, int first, int n, const void *raw, double *values);
void loop_pack(int type, int first, int n, const double *values, void *raw);

LoopOutcome loop_run(Loop *loop);

/* Goes through the operations once, from `next` on; reads and writes are noted as being at `time`. */
LoopOutcome loop_operations(Loop *loop, double time);

#endif
