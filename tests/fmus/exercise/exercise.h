/* An instance's whole life, through every function of its interface; see main.c. */
#ifndef EXERCISE_H
#define EXERCISE_H

#include <stddef.h>

enum { MOST = 64 };

/* Value references, with the number of values of each. */
typedef struct {
    size_t count, values;
    unsigned reference[MOST];
} List;

/* What the driver has to know about the model. */
typedef struct {
    const char *token;
    size_t states, indicators;
    double step; /* s */
    List inputs, outputs, parameters;
} Model;

typedef struct {
    unsigned long long hash;
} Digest;

void digest_add(Digest *digest, const double *values, size_t count);

/* Ends the process with a message unless `good`. */
void insist(int good, const char *what);

/* Two lives, one for each interface type, with inputs that depend on `seed`; all values go into the digest. */
void live_co_simulation(const Model *model, unsigned seed, Digest *digest);
void live_model_exchange(const Model *model, unsigned seed, Digest *digest);

/* A value for input `i` at step `k`, between 0 and 1. */
double input_value(unsigned seed, size_t i, int k);

#endif
