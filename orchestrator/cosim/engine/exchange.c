/* Model exchange FMUs as one system of equations, coupled by the operations of a loop, advanced by the integrator that the
 * FMUs of this project have inside. Mirrored by fmu/equations.py. */
#include "integrator.h"
#include "loop.h"

#include <float.h>
#include <math.h>
#include <string.h>

typedef int SetTime(void *, double);
typedef int SetStates(void *, const double *, size_t);
typedef int GetNumbers(void *, double *, size_t);

typedef struct {
    void *instance;
    void *set_time, *set_states, *get_rates, *get_indicators;
    int64_t n_states, n_indicators;
    int32_t number, unused; /* of the component in its system */
} Member;

typedef enum { IN_TIME, IN_STATES, IN_RATES, IN_INDICATORS, IN_LINKS } Function;

typedef struct {
    const Member *members;
    int64_t n_members, n; /* of all states; one that never moves where there is none */
    Loop *links;          /* what one member takes from another */
    double *x, *indicators, *work, *at;
    const double *nominal;
    size_t *pivots;
    int8_t *positive; /* on which side each indicator was when the present equations began */
    int64_t n_indicators;
    double tolerance, time;
    StepMemory memory;
    int64_t culprit;
    int32_t failed, function, status, outcome; /* which member refused what; the outcome of the links' operations */
} Group;

static int refused(Group *group, int64_t member, Function function, int status)
{
    if (status <= 1)
        return 0;
    group->failed = (int32_t)member;
    group->function = function;
    group->status = status;
    return -1;
}

/* Puts all members at a time and state, with the inputs that follow from it. */
static int place(Group *group, double t, const double *x)
{
    Progress *progress = group->links->progress;
    for (int64_t k = 0; k < group->n_members; k++) {
        const Member *m = &group->members[k];
        progress->component = m->number;
        progress->call = CALL_STEP;
        progress->time = t;
        progress->calls++;
        if (refused(group, k, IN_TIME, ((SetTime *)m->set_time)(m->instance, t)) != 0)
            return -1;
        if (m->n_states > 0 &&
            refused(group, k, IN_STATES, ((SetStates *)m->set_states)(m->instance, x, (size_t)m->n_states)) != 0)
            return -1;
        x += m->n_states;
    }
    group->links->next = 0;
    group->outcome = (int32_t)loop_operations(group->links, t);
    if (group->outcome == LOOP_DONE)
        return 0;
    group->function = IN_LINKS;
    return -1;
}

static int derivatives(void *context, double t, const double *x, double *dx)
{
    Group *group = context;
    if (place(group, t, x) != 0)
        return -1;
    memset(dx, 0, (size_t)group->n * sizeof(double));
    for (int64_t k = 0; k < group->n_members; k++) {
        const Member *m = &group->members[k];
        group->links->progress->component = m->number;
        if (m->n_states > 0 &&
            refused(group, k, IN_RATES, ((GetNumbers *)m->get_rates)(m->instance, dx, (size_t)m->n_states)) != 0)
            return -1;
        dx += m->n_states;
    }
    return 0;
}

/* By differences; only stiff phases need it. */
static int jacobian(void *context, double t, const double *x, double *by_x, double *by_t)
{
    Group *group = context;
    size_t n = (size_t)group->n;
    double *moved = group->at, *here = group->at + n;
    memcpy(moved, x, n * sizeof(double));
    if (derivatives(group, t, x, here) != 0)
        return -1;
    for (size_t k = 0; k < n; k++) {
        double nudge = sqrt(DBL_EPSILON) * fmax(fabs(x[k]), group->nominal[k]);
        moved[k] = x[k] + nudge;
        if (derivatives(group, t, moved, by_x + k * n) != 0)
            return -1;
        for (size_t i = 0; i < n; i++)
            by_x[k * n + i] = (by_x[k * n + i] - here[i]) / (moved[k] - x[k]);
        moved[k] = x[k];
    }
    double later = t + sqrt(DBL_EPSILON) * fmax(fabs(t), 1.0);
    if (derivatives(group, later, x, by_t) != 0)
        return -1;
    for (size_t i = 0; i < n; i++)
        by_t[i] = (by_t[i] - here[i]) / (later - t);
    return 0;
}

static int read_indicators(Group *group, double t, const double *x)
{
    if (place(group, t, x) != 0)
        return -1;
    double *z = group->indicators;
    for (int64_t k = 0; k < group->n_members; k++) {
        const Member *m = &group->members[k];
        if (m->n_indicators > 0 &&
            refused(group, k, IN_INDICATORS, ((GetNumbers *)m->get_indicators)(m->instance, z, (size_t)m->n_indicators)) != 0)
            return -1;
        z += m->n_indicators;
    }
    return 0;
}

/* An indicator changes between z > 0 and z <= 0 (FMI 2.0.4, 3.1). */
static int margin(void *context, double t, const double *x, double *least)
{
    Group *group = context;
    if (read_indicators(group, t, x) != 0)
        return -1;
    *least = HUGE_VAL;
    for (int64_t i = 0; i < group->n_indicators; i++) {
        double z = group->indicators[i];
        double left = group->positive[i] ? z : z <= 0.0 ? fmax(-z, DBL_MIN) : -z;
        *least = isnan(z) ? z : fmin(*least, left);
    }
    return 0;
}

int exchange_place(Group *group, double t) { return place(group, t, group->x); }

/* Notes the sides of the indicators. */
int exchange_begin(Group *group, double t)
{
    if (read_indicators(group, t, group->x) != 0)
        return -1;
    for (int64_t i = 0; i < group->n_indicators; i++)
        group->positive[i] = group->indicators[i] > 0.0;
    group->memory.step = group->memory.error = 0.0;
    return 0;
}

/* Whether an indicator has changed its side without time passing, as inputs can make it. */
int exchange_changed(Group *group, double t)
{
    double least;
    if (margin(group, t, group->x, &least) != 0)
        return -1;
    return least <= 0.0;
}

/* An Outcome of the integrator; `group->time` is how far it got, and all members are there. */
int exchange_integrate(Group *group, double t, double t_end)
{
    Integration run = {.n = (size_t)group->n, .derivatives = derivatives, .jacobian = jacobian, .context = group,
                       .margin = group->n_indicators > 0 ? margin : NULL, .choice = INTEGRATION_AUTOMATIC,
                       .tolerance = group->tolerance, .nominal = group->nominal, .work = group->work,
                       .pivots = group->pivots};
    group->status = 0;
    group->outcome = LOOP_DONE;
    Outcome outcome = integrate(&run, &group->memory, t, t_end, group->x, 0);
    group->time = outcome == INTEGRATION_DONE ? t_end : run.time;
    group->culprit = (int64_t)run.culprit;
    if (outcome != INTEGRATION_DONE && outcome != INTEGRATION_EVENT)
        return (int)outcome;
    return place(group, group->time, group->x) != 0 ? (int)INTEGRATION_NOT_FINITE : (int)outcome;
}
