/* Algebraic loops: Newton's method on the inputs where a loop is cut open, with slopes by differences. */
#include "container.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MOST_TURNS 30
/* A value may differ by that much from what comes back around the loop, relative to its size. */
#define TOLERANCE 1e-10
/* Below that share of the sizes involved, 1 - gain is rounding. */
#define SINGULAR 1e-9
#define NUDGE 1e-6

typedef struct {
    Container *container;
    const AlgebraicLoop *loop;
    double time;
    int32_t n;
    const LinkData **links; /* whose targets are the unknowns */
    double *x, *back, *moved, *slopes, *rest;
} Search;

/* What comes back around the loop when the torn inputs are x; they keep x. */
static int around(Search *search, const double *x, double *back)
{
    Container *self = search->container;
    const OpData *ops = self->system->ops;
    for (int32_t i = 0; i < search->n; i++)
        self->signals[search->links[i]->target] = x[i];
    for (int32_t i = 0; i < search->loop->n_torn; i++) {
        const OpData *op = &ops[search->loop->first_torn + i];
        if (carry_out_rows(self, op->first_row, op->n_rows, search->time) != 0)
            return -1;
    }
    if (carry_out(self, search->loop->first_inside, search->loop->n_inside, search->time) != 0)
        return -1;
    for (int32_t i = 0; i < search->n; i++)
        if (convert(self, search->links[i], self->signals[search->links[i]->source], &back[i]) != 0)
            return -1;
    return 0;
}

static double nominal(const Search *search, int32_t i)
{
    return search->container->system->nominals[search->links[i]->target];
}

/* 1 - g', column by column; `back` is g(x). */
static int find_slopes(Search *search)
{
    int32_t n = search->n;
    for (int32_t k = 0; k < n; k++) {
        memcpy(search->moved, search->x, (size_t)n * sizeof(double));
        search->moved[k] += NUDGE * fmax(fabs(search->x[k]), nominal(search, k));
        double *column = search->slopes + k * n;
        if (around(search, search->moved, column) != 0)
            return -1;
        for (int32_t i = 0; i < n; i++)
            column[i] = (i == k ? 1.0 : 0.0) - (column[i] - search->back[i]) / (search->moved[k] - search->x[k]);
    }
    return 0;
}

static int refuse(Search *search, const char *why)
{
    return container_fail(search->container, "the algebraic loop %s %s at t = %.9g s", search->loop->path, why, search->time);
}

/* Solves (1 - g') d = rest by elimination with pivots, in place of the rest. */
static int solve(Search *search)
{
    int32_t n = search->n;
    double *a = search->moved, *d = search->rest, largest = 0.0; /* the matrix is needed again */
    a = search->slopes + n * n;
    memcpy(a, search->slopes, (size_t)(n * n) * sizeof(double));
    for (int32_t i = 0; i < n * n; i++)
        largest = fmax(largest, fabs(a[i]));
    if (!isfinite(largest))
        return refuse(search, "has no finite gain");
    for (int32_t k = 0; k < n; k++) {
        int32_t pivot = k;
        for (int32_t i = k + 1; i < n; i++)
            if (fabs(a[k * n + i]) > fabs(a[k * n + pivot]))
                pivot = i;
        if (!(fabs(a[k * n + pivot]) > SINGULAR * (1.0 + largest)))
            return refuse(search, "has no unique solution (put a delay or a dynamic part into it)");
        for (int32_t j = 0; j < n && pivot != k; j++) {
            double kept = a[j * n + k];
            a[j * n + k] = a[j * n + pivot];
            a[j * n + pivot] = kept;
        }
        double kept = d[k];
        d[k] = d[pivot];
        d[pivot] = kept;
        for (int32_t i = k + 1; i < n; i++) {
            double share = a[k * n + i] / a[k * n + k];
            for (int32_t j = k; j < n; j++)
                a[j * n + i] -= share * a[j * n + k];
            d[i] -= share * d[k];
        }
    }
    for (int32_t i = n - 1; i >= 0; i--) {
        for (int32_t j = i + 1; j < n; j++)
            d[i] -= a[j * n + i] * d[j];
        d[i] /= a[i * n + i];
    }
    return 0;
}

static int newton(Search *search)
{
    double before = HUGE_VAL;
    int known = 0;
    for (int turn = 0; turn < MOST_TURNS; turn++) {
        double size = 0.0;
        if (around(search, search->x, search->back) != 0)
            return -1;
        for (int32_t i = 0; i < search->n; i++) {
            search->rest[i] = search->back[i] - search->x[i];
            size = fmax(size, fabs(search->rest[i]) / fmax(fabs(search->x[i]), nominal(search, i)));
        }
        /* Rounding is reached when it gets no better. */
        if (size == 0.0 || (size <= TOLERANCE && size >= 0.5 * before))
            return 0;
        if (!known || size > 0.1 * before) {
            known = 1;
            if (find_slopes(search) != 0)
                return -1;
        }
        if (solve(search) != 0)
            return -1;
        for (int32_t i = 0; i < search->n; i++)
            search->x[i] += search->rest[i];
        before = size;
    }
    return refuse(search, "has no solution that Newton's method finds");
}

/* For what is no real number: go around until nothing changes. */
static int repeat(Search *search)
{
    Container *self = search->container;
    for (int turn = 0; turn < MOST_TURNS; turn++) {
        for (int32_t i = 0; i < search->n; i++)
            search->x[i] = self->signals[search->links[i]->target];
        if (around(search, search->x, search->back) != 0)
            return -1;
        for (int32_t i = 0; i < search->n; i++)
            self->signals[search->links[i]->target] = search->back[i];
        if (memcmp(search->x, search->back, (size_t)search->n * sizeof(double)) == 0)
            return 0;
    }
    return refuse(search, "of discrete values does not settle");
}

int solve_loop(Container *self, const AlgebraicLoop *loop, double time)
{
    const SystemData *system = self->system;
    Search search = {.container = self, .loop = loop, .time = time};
    for (int32_t i = 0; i < loop->n_torn; i++)
        search.n += system->ops[loop->first_torn + i].n_links;
    size_t n = (size_t)search.n;
    search.links = calloc(n + 1, sizeof *search.links);
    search.x = calloc(4 * n + 2 * n * n + 1, sizeof(double));
    int done = -1;
    if (search.links == NULL || search.x == NULL)
        container_fail(self, "out of memory");
    else {
        search.back = search.x + n;
        search.moved = search.back + n;
        search.rest = search.moved + n;
        search.slopes = search.rest + n;
        size_t filled = 0;
        for (int32_t i = 0; i < loop->n_torn; i++) {
            const OpData *op = &system->ops[loop->first_torn + i];
            for (int32_t k = 0; k < op->n_links; k++)
                search.links[filled++] = &system->links[op->first_link + k];
        }
        for (size_t i = 0; i < n; i++)
            search.x[i] = self->signals[search.links[i]->target];
        done = loop->is_real ? newton(&search) : repeat(&search);
    }
    free(search.links);
    free(search.x);
    return done;
}
