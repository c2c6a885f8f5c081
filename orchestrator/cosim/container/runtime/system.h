/* A coupled system as constant tables; system.c, which is generated, defines them. Numbers in the tables count from 0.
 *
 * Signals are the values of all inputs and outputs of all components, and of the inputs of the system, as doubles. */
#ifndef MISFIT_SYSTEM_H
#define MISFIT_SYSTEM_H

#include <stdint.h>

/* Types of variables: those of loop.h, where enumerations are INT64, and texts. UINT64 is that of sizes of arrays, which are only set. */
enum { TEXT = 10, N_KINDS = 12 };

/* y = c x + d u with dx/dt = a x + b u, or x(t + sample_time) = a x + b u; matrices row by row. For a continuous one
 * `exact_a` and `exact_b` advance the state by `exact_size` s. */
typedef struct {
    int32_t n, m, p;
    const double *a, *b, *c, *d;
    double sample_time, exact_size;
    const double *exact_a, *exact_b;
} LinearData;

typedef struct {
    const char *name, *folder, *identifier, *token; /* folder below `resources` */
    int32_t version, early_return;                  /* of FMI */
    double tolerance;                               /* of its default experiment; 0 where it has none */
    const LinearData *linear;                       /* instead of an FMU */
} PartData;

/* A value that the system gives to a parameter or input, an array as a whole. */
typedef struct {
    int32_t part, kind, structural, n_values;
    uint32_t reference;
    const double *values;
    const char *text;
} StartData;

/* One call for variables of one type. */
typedef struct {
    int32_t is_set, part, kind, n_references, n_values;
    const uint32_t *references;
    const int32_t *places;
    const double *lower, *upper; /* NULL without declared ranges */
} RowData;

/* From one signal to another: by a table of values, else within limits, times a factor, plus an offset. */
typedef struct {
    int32_t source, target;
    double factor, offset, low, high; /* the source has to be in [low, high] */
    int32_t to_integer, keeps_others; /* a value that is not in the table stays as it is */
    int32_t first_pair, n_pairs;
} LinkData;

typedef struct {
    double from, to;
} PairData;

enum { OP_READ, OP_WRITE, OP_STEP, OP_SOLVE, OP_SHAPE };

typedef struct {
    int32_t kind, part;
    int32_t first_row, n_rows, first_link, n_links;
    int32_t every, pieces; /* OP_STEP: at every so-manyth step, in so many pieces */
    int32_t loop;          /* OP_SOLVE */
    int32_t slopes;        /* OP_SHAPE: the component takes slopes of its inputs */
} OpData;

typedef struct {
    const char *path;
    int32_t first_torn, n_torn, first_inside, n_inside; /* operations */
    int32_t is_real;
} AlgebraicLoop;

enum { OF_INPUT, OF_OUTPUT, OF_SYSTEM_OUTPUT, OF_COMPONENT, OF_TIME };

/* What the importer sees. */
typedef struct {
    int32_t access, kind;
    int32_t settable;                   /* 0 never, 1 until initialisation ends, 2 always */
    int32_t place;                      /* of an input or output */
    int32_t first_row, n_rows, first_link, n_links; /* what setting an input writes; of OF_SYSTEM_OUTPUT its link */
    int32_t part, element, n_elements;  /* of a variable of a component that is no signal, or may be set like a start value */
    uint32_t reference;
} VariableData;

typedef struct {
    const char *guid;
    double step, start, tolerance; /* s, s; tolerance 0 where the system gives none */
    int32_t fixed_step;            /* a component takes steps of one size only */
    int32_t extrapolate;
    double smoothing;              /* s */
    int32_t n_parts, n_signals, n_starts, n_rows, n_variables;
    int32_t first_initial, n_initial, first_advance, n_advance, first_evaluation, n_evaluation; /* operations */
    const PartData *parts;
    const StartData *starts;
    const RowData *rows;
    const LinkData *links;
    const PairData *pairs;
    const OpData *ops;
    const AlgebraicLoop *loops;
    const VariableData *variables;
    const double *signals, *nominals; /* first values; sizes that count as 1 */
    const char *const *names;         /* of signals, with their components */
    const char *const *units;
    const char *const *variable_names;
} SystemData;

extern const SystemData misfit_system;

#endif
