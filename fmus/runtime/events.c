/* Relations such as x > 1: each keeps its side while states move, and changes it at events only. */
#include "core.h"

#include <math.h>
#include <string.h>

static const char *const relation_names[] = MODEL_RELATION_NAMES;
static const unsigned char holds_at_zero[] = MODEL_HOLDS_AT_ZERO; /* >= and <=, as against > and < */

/* A relation changes only this far beyond zero, in units of 1 + |left side| + |right side|: rounding does not count. */
#define DEAD_BAND 1e-13

static double beyond(const Core *core, int i)
{
    double band = DEAD_BAND * (1.0 + core->indicator_sizes[i]);
    return core->indicators[i] + (core->state.relations[i] != 0.0 ? band : -band);
}

/* How far relation i keeps its side; zero or less once it has changed. */
static double margin_of(const Core *core, int i)
{
    return core->state.relations[i] != 0.0 ? beyond(core, i) : -beyond(core, i);
}

static int compare(Core *core, double time, const double *x)
{
    core_pass(core, &time, x);
    core->res[0] = core->indicators;
    core->res[1] = core->indicator_sizes;
    return core_call(core, model_indicators, "relations");
}

static int check_decided(Core *core, double time)
{
    for (int i = 0; i < N_INDICATORS; i++)
        if (isnan(core->indicators[i]))
            return core_fail(core, "the relation %s cannot be decided at t = %.9g s", relation_names[i], time);
    return 0;
}

static int evaluate(Core *core, double time, const double *x)
{
    return compare(core, time, x) != 0 ? -1 : check_decided(core, time);
}

int core_relation_margin(Core *core, double time, const double *x, double *margin)
{
    *margin = HUGE_VAL;
    if (evaluate(core, time, x) != 0)
        return -1;
    for (int i = 0; i < N_INDICATORS; i++)
        *margin = fmin(*margin, margin_of(core, i));
    return 0;
}

int core_evaluate_indicators(Core *core, double *indicators)
{
    if (core_evaluate_arguments(core) != 0 || evaluate(core, core->state.time, core->state.x) != 0)
        return -1;
    for (int i = 0; i < N_INDICATORS; i++)
        indicators[i] = beyond(core, i);
    return 0;
}

static int evaluate_event_times(Core *core, double *times, double *rising)
{
    core->arg[0] = core->state.p;
    core->res[0] = times;
    core->res[1] = rising;
    return core_call(core, model_event_times, "event times");
}

static int next_tick(Core *core, double time, double *next)
{
    double due[N_CLOCKS + 1];
    core->arg[0] = core->state.relations + N_RELATIONS;
    core->res[0] = due;
    if (core_call(core, model_due, "clocks") != 0)
        return -1;
    for (int i = 0; i < N_CLOCKS; i++)
        if (due[i] > time && due[i] < *next)
            *next = due[i];
    return 0;
}

int core_next_time_event(Core *core, double time, double *next)
{
    double times[N_TIMED + 1], rising[N_TIMED + 1];
    *next = HUGE_VAL;
    if (N_CLOCKS > 0 && next_tick(core, time, next) != 0)
        return -1;
    if (N_TIMED == 0)
        return 0;
    if (evaluate_event_times(core, times, rising) != 0)
        return -1;
    for (int i = 0; i < N_TIMED; i++)
        if (times[i] > time && times[i] < *next)
            *next = times[i];
    return 0;
}

static int turn(Core *core, int i, int holds, double time)
{
    if ((core->state.relations[i] != 0.0) == holds)
        return 0;
    core->state.relations[i] = holds;
    core->last_changed = i;
    if (core->state.phase > PHASE_INITIALIZATION)
        core_tell(core, LOG_EVENTS, "the relation %s becomes %s at t = %.9g s", relation_names[i],
                  holds ? "true" : "false", time);
    return 1;
}

/* At its time a relation takes the side that it has afterwards. */
static int turn_timed(Core *core, double time, int *changed)
{
    double times[N_TIMED + 1], rising[N_TIMED + 1];
    if (N_TIMED == 0)
        return 0;
    if (evaluate_event_times(core, times, rising) != 0)
        return -1;
    for (int i = 0; i < N_TIMED; i++)
        *changed |= turn(core, N_INDICATORS + i, (time >= times[i]) == (rising[i] != 0.0), time);
    return 0;
}

static int start_memories(Core *core, double time)
{
    core->arg[0] = &time;
    core->arg[1] = core->state.p;
    core->res[0] = core->state.relations + N_RELATIONS;
    return core_call(core, model_memory_start, "start values of what is remembered");
}

/* One round of Modelica's event iteration; *again tells whether anything changed. */
static int update_memories(Core *core, double time, double *x, int *again)
{
    double memories[N_MEMORIES + 1], states[N_STATES + 1], *before = core->state.relations + N_RELATIONS;
    if (N_MEMORIES == 0)
        return 0;
    core_pass(core, &time, x);
    core->res[0] = memories;
    core->res[1] = states;
    if (core_call(core, model_update, "events") != 0)
        return -1;
    for (int i = 0; i < N_MEMORIES; i++)
        if (isnan(memories[i]))
            return core_fail(core, "what is remembered at the event at t = %.9g s is no number", time);
    for (int i = 0; i < N_MEMORIES; i++)
        *again |= before[i] != memories[i];
    memcpy(before, memories, N_MEMORIES * sizeof(double));
    if (MODEL_RESETS && memcmp(x, states, N_STATES * sizeof(double)) != 0) {
        memcpy(x, states, N_STATES * sizeof(double));
        core->states_reset = *again = 1;
    }
    return 0;
}

/* Whether relation i is on the wrong side now. */
static int is_wrong(const Core *core, int i, Settling settling)
{
    double g = core->indicators[i];
    int holds = core->state.relations[i] != 0.0, fresh = g > 0.0 || (g == 0.0 && holds_at_zero[i]);
    return !isnan(g) && (settling == SETTLE_FRESH ? fresh != holds : margin_of(core, i) <= 0.0);
}

/* Turn all relations that are wrong, or one of them that chance picks; *again tells whether there were any. Where none is, but the
   equations have no solution with these sides, as with two brakes that both stick, chance picks one that cannot be decided. */
static void turn_wrong(Core *core, double time, Settling settling, int together, unsigned *chance, int *again)
{
    int wrong = 0, open = 0, picked;
    for (int i = 0; i < N_INDICATORS; i++) {
        wrong += is_wrong(core, i, settling);
        open += isnan(core->indicators[i]) != 0;
    }
    if (wrong == 0 && open == 0)
        return;
    together &= wrong > 0;
    *again = 1;
    *chance = *chance * 1664525u + 1013904223u;
    picked = (int)((*chance >> 16) % (unsigned)(wrong > 0 ? wrong : open));
    for (int i = 0; i < N_INDICATORS; i++)
        if ((wrong > 0 ? is_wrong(core, i, settling) : isnan(core->indicators[i])) && (together || picked-- == 0))
            turn(core, i, core->state.relations[i] == 0.0, time);
}

int core_settle_relations(Core *core, double time, double *x, Settling settling, int *changed)
{
    /* Where the relations of a clutch that sticks turn all at once they may do so for ever; one by one they find their sides. */
    enum { TOGETHER = 4 + N_RELATIONS, MAX_TURNS = 100 + 20 * N_RELATIONS + 20 * N_MEMORIES };
    unsigned chance = 1;
    *changed = 0;
    if (turn_timed(core, time, changed) != 0)
        return -1;
    if (N_MEMORIES > 0 && settling == SETTLE_FRESH && start_memories(core, time) != 0)
        return -1;
    for (int count = 0, turns = 0; count < MAX_TURNS; count++) {
        int again = 0;
        if (compare(core, time, x) != 0)
            return -1;
        turn_wrong(core, time, settling, turns++ < TOGETHER, &chance, &again);
        if (!again) {
            turns = 0;
            if (update_memories(core, time, x, &again) != 0)
                return -1;
        }
        if (!again)
            return 0;
        *changed = 1;
    }
    if (check_decided(core, time) != 0)
        return -1;
    return core_fail(core, "the relation %s has no consistent side at t = %.9g s: each one makes the other true",
                     relation_names[core->last_changed], time);
}

int core_count_event(Core *core, double time, double close)
{
    enum { MAX_REPETITIONS = 100 };
    State *state = &core->state;
    state->repetitions = fabs(time - state->last_event) <= close ? state->repetitions + 1 : 0;
    state->last_event = time;
    if (state->repetitions < MAX_REPETITIONS)
        return 0;
    return core_fail(core, "the relation %s changes over and over at t = %.9g s; the model slides along it",
                     relation_names[core->last_changed], time);
}
