/* One component of a container: an FMU that is loaded from the resources, or a linear controller. */
#ifndef MISFIT_PART_H
#define MISFIT_PART_H

#include "system.h"

#include <stddef.h>

enum { PART_OK, PART_WARNING, PART_DISCARD, PART_ERROR, PART_FATAL };

typedef void PartListener(void *owner, const char *part, int status, const char *message);

typedef struct {
    void *logger, *allocate, *release, *finished, *environment;
} Callbacks2;

typedef struct {
    const PartData *data;
    PartListener *listener;
    void *owner;
    void *library, *instance;
    void *get[N_KINDS], *set[N_KINDS];
    void *do_step;
    Callbacks2 callbacks;
    int running, failed, dead;
    int rolled_back; /* a state has been saved, so that time may go back */
    char said[1024], problem[1400];
} Component;

/* How a step ended: early at `time`, or with the wish to end the run. */
typedef struct {
    int status, early, terminated;
    double time;
} PartStep;

/* Functions that return int give 0, or -1 with a line in `problem`. */
int part_open(Component *part, const char *resources);
int part_set_up(Component *part, const double *tolerance, double start, const double *stop);
int part_start(Component *part);
void part_end(Component *part);
void part_close(Component *part);
int part_get(Component *part, int kind, uint32_t reference, size_t n_values, void *raw);
int part_set(Component *part, int kind, uint32_t reference, size_t n_values, const void *raw);
int part_configure(Component *part, int enter);
int part_slopes(Component *part, const uint32_t *references, size_t n, const double *slopes);
int part_step(Component *part, double time, double size, PartStep *end);

/* The type that values of a kind have on their way into an FMU. */
int part_raw_kind(const Component *part, int kind);

int part_save(Component *part, void **state);
int part_restore(Component *part, void *state);
void part_forget(Component *part, void **state);
int part_state_size(Component *part, void *state, size_t *size);
int part_serialize(Component *part, void *state, char *bytes, size_t size);
int part_deserialize(Component *part, const char *bytes, size_t size, void **state);

#endif
