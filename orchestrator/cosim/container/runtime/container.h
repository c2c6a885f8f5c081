/* A coupled system that runs: its components, the values of their inputs and outputs, and the time.
 *
 * Functions that return int give 0, or -1 with a line for the user in `message`. */
#ifndef MISFIT_CONTAINER_H
#define MISFIT_CONTAINER_H

#include "loop.h"
#include "part.h"
#include "system.h"

typedef enum { MADE, INITIALISING, RUNNING, OVER, BROKEN } Stage;

/* What goes on from one communication point to the next beside values and components. */
typedef struct {
    Stage stage;
    int32_t stale;          /* something was set from outside and is not carried through the connections yet */
    int32_t ended;          /* a component wants the run to end */
    int32_t has_stop, has_tolerance;
    int64_t k;              /* the communication point is at start + k * step */
    double start, time, stop, tolerance, begin, step; /* s; `step` is the size of the step in progress */
} Clockwork;

typedef void Listener(void *owner, int status, const char *message);

typedef struct {
    const SystemData *system;
    char *resources;
    Component *components;
    Part *parts;      /* the same, for loop.c */
    Operation *rows;
    double *memory;   /* of the rows' values */
    Clockwork clock;
    double *signals;  /* then, for each signal: */
    double *before, *before_time, *smooth; /* what extrapolation and smoothing remember; before_time is HUGE_VAL at first */
    size_t n_remembered; /* numbers from `signals` on */
    Progress progress;
    Listener *listener;
    void *owner;
    int talkative;
    char message[1600];
} Container;

Container *container_new(const char *resources, Listener *listener, void *owner, int talkative, char *message, size_t size);
void container_free(Container *self);
int container_reset(Container *self);
int container_set_up(Container *self, const double *tolerance, double start, const double *stop);
int container_enter(Container *self);
int container_leave(Container *self);
/* Up to `time` s, at the communication points of the system. */
int container_advance(Container *self, double time);
void container_terminate(Container *self);

int container_fail(Container *self, const char *format, ...);

/* Operations.c */
int carry_out(Container *self, int32_t first, int32_t count, double time);
int carry_out_step(Container *self);
int carry_out_rows(Container *self, int32_t first, int32_t count, double time);
int copy_links(Container *self, int32_t first, int32_t count);
int convert(Container *self, const LinkData *link, double value, double *converted);
/* Loops.c */
int solve_loop(Container *self, const AlgebraicLoop *loop, double time);
/* Shaping.c */
int shape_inputs(Container *self, const OpData *op, double time, double size);
/* Carries what was set from outside through all connections. */
int bring_up_to_date(Container *self);

/* Variables, by their number; a number as a double, a text as itself. */
int container_get(Container *self, uint32_t variable, double *value);
int container_set(Container *self, uint32_t variable, double value);
int container_get_text(Container *self, uint32_t variable, const char **value);
int container_set_text(Container *self, uint32_t variable, const char *value);

typedef struct {
    Clockwork clock;
    double *numbers;
    void **parts;
} ContainerState;

int container_save(Container *self, ContainerState **state);
int container_restore(Container *self, const ContainerState *state);
void container_forget(Container *self, ContainerState *state);
int container_state_size(Container *self, const ContainerState *state, size_t *size);
int container_serialize(Container *self, const ContainerState *state, char *bytes, size_t size);
int container_deserialize(Container *self, const char *bytes, size_t size, ContainerState **state);

#endif
