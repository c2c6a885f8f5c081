/* One running model, independent of any FMI version: values, evaluation, steps, snapshots.
 *
 * Functions that return int give 0 on success and -1 after writing a line for the user to `message`.
 */
#ifndef MISFIT_CORE_H
#define MISFIT_CORE_H

#include "history.h"
#include "integrator.h"
#include "logging.h"
#include "model.h"

typedef enum {
    PHASE_INSTANTIATED = 1,
    PHASE_INITIALIZATION = 2,
    PHASE_STEPPING = 4,
    PHASE_TERMINATED = 8,
    PHASE_EVENT = 16,      /* model exchange: values may jump */
    PHASE_CONTINUOUS = 32, /* model exchange: the importer integrates */
} Phase;

/* All that a snapshot holds beside the history. Arrays are one longer: C has no empty arrays. */
typedef struct {
    Phase phase;
    int exchange;      /* model exchange: the importer integrates, not core_step */
    int event_mode;    /* co-simulation: the importer handles events */
    int early_return;  /* co-simulation: steps end at events */
    double event_time; /* s, end of the last event mode; model exchange only */
    double time;       /* s, the current communication point, or what the importer has set */
    double stop_time;  /* s, HUGE_VAL when open */
    double tolerance;  /* relative */
    StepMemory steps;
    double relations[N_EVENT_VALUES + 1]; /* the side of each, 0 or 1; then the memories */
    double last_event;                 /* s, where a relation changed last within a step */
    int repetitions;                   /* events in a row that left no time between them */
    int event_pending;                 /* co-simulation with event mode: the last step ended in an event */
    double u[N_INPUTS + 1];
    double u_slope[N_INPUTS + 1]; /* 1/s, valid for the next step only */
    double x[N_STATES + 1];
    double p[N_PARAMETERS + 1];
    double start[N_STATES + 1];              /* start values set from outside, where given */
    unsigned char start_given[N_STATES + 1];
} State;

/* How the present value of a delay operator changes, as seen from outside the recorded past. */
typedef struct {
    double source; /* with the present value of its source */
    double time;   /* 1/s */
    double delay;  /* 1/s */
} DelaySensitivity;

/* Snapshots own their memory; each belongs to one running model, in a list. */
typedef struct Snapshot Snapshot;
struct Snapshot {
    State state;
    History history;
    Snapshot *next;
};

/* Takes a message on behalf of an importer. */
typedef void Listener(void *owner, unsigned category, const char *message);

typedef struct {
    State state;
    History history;
    Snapshot *snapshots;
    unsigned categories; /* of messages that are wanted */
    Listener *listener;  /* of the FMI layer, with its instance */
    void *owner;

    double proposed[N_STATES + 1]; /* start values declared or set, before they are made consistent */
    int starts_valid, outputs_valid, dependents_valid; /* what follows from `state`, computed on demand */
    int algebraics_valid;                              /* z too belongs to the outputs, while those are valid */
    double dx[N_STATES + 1];
    double z[N_ALGEBRAICS + 1];
    double dependents[N_DEPENDENTS + 1];
    double indicators[N_INDICATORS + 1];
    double indicator_sizes[N_INDICATORS + 1]; /* the size of the numbers that a relation compares */
    int last_changed;                         /* relation */
    int states_reset;                         /* an event has set states since this was cleared */

    double step_start;            /* s; u is u + u_slope * (t - step_start) */
    double delay[N_DELAYS + 1];   /* s */
    Line pieces[N_DELAYS + 1];    /* the sources, shifted by their delays, over the current piece of a step */
    double u_now[N_INPUTS + 1];   /* inputs, delayed values: arguments of the evaluation in progress */
    double d_now[N_DELAYS + 1];
    DelaySensitivity d_sensitivity[N_DELAYS + 1]; /* of d_now, when outputs are valid */

    const double *arg[MODEL_SZ_ARG + 1]; /* CasADi's work space */
    double *res[MODEL_SZ_RES + 1];
    int iw[MODEL_SZ_IW + 1];
    double w[MODEL_SZ_W + 1];
    double integrator_work[INTEGRATOR_WORK(N_STATES) + 1];
    size_t integrator_pivots[N_STATES + 1];
    int unsolved; /* the last message is about equations without a solution */

    char message[512];
} Core;

extern const char *const core_names[]; /* by value reference */

int core_fail(Core *core, const char *format, ...);

/* Passes a message on if its category is wanted. */
void core_tell(Core *core, unsigned category, const char *format, ...);

/* Back to the state after creation, with the values of the model description; the interface type stays. */
void core_reset(Core *core);
void core_release(Core *core);

/* The words for the present phase, as in "not allowed while the FMU is ...". */
const char *core_phase_name(const Core *core);

/* Tolerance and stop time may be NULL; times are in s. */
int core_set_up(Core *core, const double *tolerance, double start_time, const double *stop_time);

int core_get(Core *core, unsigned int reference, double *value);
int core_set(Core *core, unsigned int reference, double value);
int core_set_input_slope(Core *core, unsigned int reference, double slope);

/* Change of the unknowns (states, derivatives, algebraic variables, dependent parameters) when the knowns
 * (inputs, states, parameters, time) change by `seed`. */
int core_directional(Core *core, const unsigned int *unknowns, size_t n_unknowns, const unsigned int *knowns,
                     size_t n_knowns, const double *seed, double *sensitivity);

/* Fixes the start values and begins the record of the delay operators. */
int core_finish_initialization(Core *core);

/* Advances by `step` s; on failure the state is the one before the call. */
int core_step(Core *core, double time, double step);

/* Model exchange. Arrays have N_STATES elements; `next` is in s, HUGE_VAL when no event is to come. */
extern const double core_nominals[];
int core_set_time(Core *core, double time);
int core_set_states(Core *core, const double *x);
int core_finite_derivatives(Core *core); /* for the importer's integrator to avoid what is not */
int core_complete_step(Core *core);
int core_update_events(Core *core, double *next);
int core_leave_events(Core *core);

/* Passes the arguments that all functions of the equations begin with; inputs and delayed values are u_now and d_now. */
static inline void core_pass(Core *core, const double *time, const double *x)
{
    core->arg[0] = time;
    core->arg[1] = x;
    core->arg[2] = core->u_now;
    core->arg[3] = core->d_now;
    core->arg[4] = core->state.p;
    core->arg[5] = core->state.relations;
}

int core_call(Core *core, ModelFunction *function, const char *what);
int core_evaluate_starts(Core *core);
int core_evaluate_outputs(Core *core);    /* dx, and what the delay operators give */
int core_evaluate_algebraics(Core *core); /* z as well */
int core_evaluate_dependents(Core *core);

/* Fail with the names of unknowns when equations that are solved by iteration had no solution. */
int core_check_derivatives(Core *core, double time, const double *x, const double *dx);
int core_check_algebraics(Core *core);

int core_evaluate_sources(Core *core, double time, const double *u, double *sources);
int core_evaluate_derivatives(Core *core, double time, const double *x, double *dx);
/* Of dx within a step, where inputs and delayed values change with time too. */
int core_evaluate_jacobian(Core *core, double time, const double *x, double *by_x, double *by_t);

/* Whether relations keep to their side within the dead band, as while running, or start afresh. */
typedef enum { SETTLE_FROM_HERE, SETTLE_FRESH } Settling;

/* Lets all relations take the side that they have now, those of the time just after it, and updates the memories, and the
 * states x by reinit(); inputs and delayed values are u_now and d_now. Fails when they cannot agree. */
int core_settle_relations(Core *core, double time, double *x, Settling settling, int *changed);
int core_relation_margin(Core *core, double time, const double *x, double *margin);
int core_evaluate_arguments(Core *core); /* start values, u_now and d_now at the present time */
int core_evaluate_indicators(Core *core, double *indicators);
int core_next_time_event(Core *core, double time, double *next); /* HUGE_VAL when none is to come */
/* Fails when too many events in a row come within `close` s of the last one. */
int core_count_event(Core *core, double time, double close);

/* core_snapshot reuses `snapshot` unless it is NULL, and gives NULL on failure. Snapshots of others are refused; freeing
 * NULL does nothing. */
int core_owns(Core *core, const Snapshot *snapshot);
Snapshot *core_snapshot(Core *core, Snapshot *snapshot);
int core_restore(Core *core, const Snapshot *snapshot);
int core_free_snapshot(Core *core, Snapshot *snapshot);
size_t core_serialized_size(const Snapshot *snapshot);
void core_serialize(const Snapshot *snapshot, char *bytes);
Snapshot *core_deserialize(Core *core, const char *bytes, size_t size);

#endif
