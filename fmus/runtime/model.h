/* The model as the runtime sees it: sizes from model_config.h, functions from the generated model.c.
 *
 * Value references count through inputs, states, derivatives, algebraic variables, parameters,
 * dependent parameters, the time and event indicators, in this order and without gaps.
 */
#ifndef MISFIT_MODEL_H
#define MISFIT_MODEL_H

#include "model_config.h"

#define VR_STATES (N_INPUTS)
#define VR_DERIVATIVES (VR_STATES + N_STATES)
#define VR_ALGEBRAICS (VR_DERIVATIVES + N_STATES)
#define VR_PARAMETERS (VR_ALGEBRAICS + N_ALGEBRAICS)
#define VR_DEPENDENTS (VR_PARAMETERS + N_PARAMETERS)
#define VR_TIME (VR_DEPENDENTS + N_DEPENDENTS)
#define VR_INDICATORS (VR_TIME + 1)
#define VR_LAST (VR_TIME + N_INDICATORS)

/* Relations that make events: first those with an event indicator, then those that depend on nothing but the time. */
#define N_RELATIONS (N_INDICATORS + N_TIMED)
/* Values that are kept from event to event stand behind the sides of the relations. */
#define N_EVENT_VALUES (N_RELATIONS + N_MEMORIES)

/* CasADi's calling convention: zero on success, arrays of pointers to dense columns. */
typedef int ModelFunction(const double **arg, double **res, int *iw, double *w, int mem);

/* The sides of all relations are arguments, c: 1 where a relation holds, else 0; behind them the memories. */
ModelFunction model_rhs;         /* (t, x, u, d, p, c) -> (dx, z) */
ModelFunction model_derivatives; /* (t, x, u, d, p, c) -> dx, the same bits at less cost */
ModelFunction model_jacobian;    /* (t, x, u, d, p, c) -> derivatives of dx by x, column by column */
ModelFunction model_indicators;  /* (t, x, u, d, p, c) -> (indicators, sizes); a relation holds where it is positive */
ModelFunction model_event_times; /* (p) -> (times, rising): when the timed relations change, and whether to true */
ModelFunction model_memory_start; /* (t, p) -> what the memories begin with */
ModelFunction model_due;         /* (memories) -> when each clock ticks next */
ModelFunction model_update;      /* (t, x, u, d, p, c) -> (memories, x) after an event, from those before it */
ModelFunction model_history;     /* (t, u, p) -> (source, delay) */
ModelFunction model_dependent;   /* (p) -> values */
ModelFunction model_initial;     /* (p) -> s, the declared start values of the states */
ModelFunction model_consistent;  /* (t, u, p, s) -> x0, with MODEL_SOLVES_START; else s holds as it is */

/* Forward mode: the same arguments followed by one seed for each -> the change of each result. */
ModelFunction model_rhs_tangent;
ModelFunction model_indicators_tangent;
ModelFunction model_history_tangent;
ModelFunction model_dependent_tangent;
ModelFunction model_initial_tangent;
ModelFunction model_consistent_tangent;

#endif
