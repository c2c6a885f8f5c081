#include "linear.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A step this close to a whole number of samples is one. */
#define SAME 1e-6
/* Terms of the exponential series of a matrix with a norm of at most 1/2: the rest is below 1e-18. */
#define TERMS 15

typedef struct {
    const LinearData *data;
    double *state; /* x, then u */
    double *next;
    double size;   /* s, that `advance` is for */
    double *advance;
} Linear;

void *linear_new(const LinearData *data)
{
    size_t whole = (size_t)(data->n + data->m);
    Linear *self = calloc(1, sizeof *self);
    if (self == NULL)
        return NULL;
    self->data = data;
    self->state = calloc(whole + 1, sizeof(double));
    self->next = calloc(whole + 1, sizeof(double));
    self->advance = calloc(3 * whole * whole + 1, sizeof(double));
    if (self->state == NULL || self->next == NULL || self->advance == NULL) {
        linear_free(self);
        return NULL;
    }
    return self;
}

void linear_free(void *instance)
{
    Linear *self = instance;
    free(self->state);
    free(self->next);
    free(self->advance);
    free(self);
}

int linear_get(void *instance, const uint32_t *references, size_t n, double *values)
{
    Linear *self = instance;
    const LinearData *data = self->data;
    const double *x = self->state, *u = self->state + data->n;
    for (size_t i = 0; i < n; i++) {
        int32_t k = (int32_t)references[i];
        if (k < data->m)
            values[i] = u[k];
        else if (k >= data->m + data->p)
            values[i] = x[k - data->m - data->p];
        else {
            int32_t row = k - data->m;
            double by_x = 0.0, by_u = 0.0;
            for (int32_t j = 0; j < data->n; j++)
                by_x += data->c[row * data->n + j] * x[j];
            for (int32_t j = 0; j < data->m; j++)
                by_u += data->d[row * data->m + j] * u[j];
            values[i] = by_x + by_u;
        }
    }
    return 0;
}

int linear_set(void *instance, const uint32_t *references, size_t n, const double *values)
{
    Linear *self = instance;
    const LinearData *data = self->data;
    for (size_t i = 0; i < n; i++) {
        int32_t k = (int32_t)references[i];
        if (k < data->m)
            self->state[data->n + k] = values[i];
        else if (k >= data->m + data->p)
            self->state[k - data->m - data->p] = values[i];
    }
    return 0;
}

static void times(const double *a, const double *b, double *product, int32_t n)
{
    for (int32_t i = 0; i < n; i++)
        for (int32_t j = 0; j < n; j++) {
            double sum = 0.0;
            for (int32_t k = 0; k < n; k++)
                sum += a[i * n + k] * b[k * n + j];
            product[i * n + j] = sum;
        }
}

/* exp([[a, b], [0, 0]] size), whose upper rows advance the state for inputs that are held (van Loan 1978): a series for
 * the matrix divided by a power of 2, which is squared as often. */
static void prepare(Linear *self, double size)
{
    const LinearData *data = self->data;
    int32_t n = data->n + data->m;
    double *sum = self->advance, *block = sum + n * n, *work = block + n * n, norm = 0.0;
    memset(block, 0, (size_t)(n * n) * sizeof(double));
    for (int32_t i = 0; i < data->n; i++) {
        double row = 0.0;
        for (int32_t j = 0; j < n; j++) {
            double value = j < data->n ? data->a[i * data->n + j] : data->b[i * data->m + j - data->n];
            block[i * n + j] = value * size;
            row += fabs(block[i * n + j]);
        }
        norm = fmax(norm, row);
    }
    int squarings = 0;
    while (ldexp(norm, -squarings) > 0.5 && squarings < 1000)
        squarings++;
    for (int32_t i = 0; i < n * n; i++)
        block[i] = ldexp(block[i], -squarings);
    /* 1 + block (1 + block / 2 (1 + block / 3 (...))) */
    memset(sum, 0, (size_t)(n * n) * sizeof(double));
    for (int32_t i = 0; i < n; i++)
        sum[i * n + i] = 1.0;
    for (int term = TERMS; term > 0; term--) {
        times(block, sum, work, n);
        for (int32_t i = 0; i < n * n; i++)
            sum[i] = work[i] / term + (i % (n + 1) == 0 ? 1.0 : 0.0);
    }
    for (int k = 0; k < squarings; k++) {
        times(sum, sum, work, n);
        memcpy(sum, work, (size_t)(n * n) * sizeof(double));
    }
    self->size = size;
}

static void advance(Linear *self, const double *a, const double *b, int32_t stride_a, int32_t stride_b)
{
    const LinearData *data = self->data;
    const double *x = self->state, *u = self->state + data->n;
    for (int32_t i = 0; i < data->n; i++) {
        double by_x = 0.0, by_u = 0.0;
        for (int32_t j = 0; j < data->n; j++)
            by_x += a[i * stride_a + j] * x[j];
        for (int32_t j = 0; j < data->m; j++)
            by_u += b[i * stride_b + j] * u[j];
        self->next[i] = by_x + by_u;
    }
    memcpy(self->state, self->next, (size_t)data->n * sizeof(double));
}

int linear_step(void *instance, double time, double size, int forward)
{
    Linear *self = instance;
    const LinearData *data = self->data;
    (void)time, (void)forward;
    if (data->sample_time > 0.0) {
        double samples = size / data->sample_time, whole = floor(samples + 0.5);
        if (fabs(samples - whole) > SAME || whole < 1.0)
            return 3;
        for (double k = 0.0; k < whole; k += 1.0)
            advance(self, data->a, data->b, data->n, data->m);
    } else if (size == data->exact_size)
        advance(self, data->exact_a, data->exact_b, data->n, data->m);
    else {
        int32_t whole = data->n + data->m;
        if (self->size != size)
            prepare(self, size);
        advance(self, self->advance, self->advance + data->n, whole, whole);
    }
    return 0;
}

size_t linear_state_size(const void *instance)
{
    const Linear *self = instance;
    return (size_t)(self->data->n + self->data->m) * sizeof(double);
}

double *linear_state(void *instance) { return ((Linear *)instance)->state; }
