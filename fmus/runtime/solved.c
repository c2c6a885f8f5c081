/* Equations that are solved by iteration: where they have no solution, the generated functions give NaN. */
#include "core.h"

#include <math.h>

/* The value reference of one unknown of each block, in the order of evaluation, and the names of all of them. */
static const unsigned int solved_references[] = MODEL_SOLVED_REFERENCES;
static const char *const solved_names[] = MODEL_SOLVED_NAMES;

static int report(Core *core, double time, const double *dx, const double *z)
{
    for (int i = 0; i < N_SOLVED; i++) {
        unsigned int reference = solved_references[i];
        double value = reference < VR_ALGEBRAICS ? dx[reference - VR_DERIVATIVES] : z[reference - VR_ALGEBRAICS];
        if (isnan(value)) {
            core->unsolved = 1;
            return core_fail(core, "no solution of the equations for %s was found at t = %.9g s from their start values",
                             solved_names[i], time);
        }
    }
    return 0;
}

int core_check_derivatives(Core *core, double time, const double *x, const double *dx)
{
    double all_dx[N_STATES + 1], z[N_ALGEBRAICS + 1];
    int finite = 1;
    core->unsolved = 0;
    for (int i = 0; i < N_STATES; i++)
        finite = finite && isfinite(dx[i]);
    if (N_SOLVED == 0 || finite)
        return 0;
    core_pass(core, &time, x);
    core->res[0] = all_dx;
    core->res[1] = z;
    return core_call(core, model_rhs, "model equations") != 0 ? -1 : report(core, time, all_dx, z);
}

int core_check_algebraics(Core *core) { return report(core, core->state.time, core->dx, core->z); }
