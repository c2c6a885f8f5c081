/* Times the arm's FMUs (2.0 and 3.0) against arm_by_hand.c, all in one process and in turns.
 *
 * step_cost BINARY2 GUID2 REFERENCES2 BINARY3 TOKEN3 REFERENCES3: references are those of the ten inputs, of both
 * outputs and of one parameter, in decimal with blanks between them. Prints lines of "name value unit". */
#define _POSIX_C_SOURCE 200809L
#include "arm_by_hand.h"
#include "fmi2FunctionTypes.h"
#include "fmi3FunctionTypes.h"

#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { INPUTS = 10, OUTPUTS = 2, ROUNDS = 31, STEPS = 2000, CALLS = 20000 };
static const double H = 1e-3, TOLERANCE = 1e-6, START[2] = {0.8, 1.2};

typedef struct {
    void *library;
    const char *token;
    unsigned reference[INPUTS + OUTPUTS + 1];
    void *instance;
    fmi2DoStepTYPE *step2;
    fmi2SetRealTYPE *set2;
    fmi2GetRealTYPE *get2;
    fmi3DoStepTYPE *step3;
    fmi3SetFloat64TYPE *set3;
    fmi3GetFloat64TYPE *get3;
} Program;

/* One of the three programs that take turns. */
typedef struct {
    const char *name;
    void (*begin)(Program *);
    void (*end)(Program *);
    int (*set)(Program *, unsigned first, size_t count, const double *values);
    int (*step)(Program *, double time);
    int (*get)(Program *, unsigned first, size_t count, double *values);
} Kind;

static void insist(int good, const char *what)
{
    if (!good) {
        fprintf(stderr, "step_cost: %s failed\n", what);
        exit(1);
    }
}

static void *find(Program *p, const char *name)
{
    void *function = dlsym(p->library, name);
    insist(function != NULL, name);
    return function;
}

static void begin_hand(Program *p) { insist((p->instance = arm_create(START, TOLERANCE)) != NULL, "arm_create"); }
static void end_hand(Program *p) { arm_free(p->instance); }
static int set_hand(Program *p, unsigned first, size_t count, const double *u)
{
    (void)first, (void)count;
    arm_set_inputs(p->instance, u);
    return 0;
}
static int step_hand(Program *p, double time)
{
    (void)time;
    return arm_step(p->instance, H);
}
static int get_hand(Program *p, unsigned first, size_t count, double *y)
{
    (void)first;
    for (size_t i = 0; i < count; i++)
        y[i] = arm_state(p->instance)[i];
    return 0;
}

static void report2(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                    fmi2String message, ...)
{
    (void)environment, (void)status, (void)category;
    fprintf(stderr, "%s: %s\n", name, message);
}

static void begin2(Program *p)
{
    static fmi2CallbackFunctions callbacks = {report2, calloc, free, NULL, NULL};
    fmi2InstantiateTYPE *create = (fmi2InstantiateTYPE *)find(p, "fmi2Instantiate");
    fmi2SetupExperimentTYPE *set_up = (fmi2SetupExperimentTYPE *)find(p, "fmi2SetupExperiment");
    fmi2EnterInitializationModeTYPE *enter = (fmi2EnterInitializationModeTYPE *)find(p, "fmi2EnterInitializationMode");
    fmi2ExitInitializationModeTYPE *leave = (fmi2ExitInitializationModeTYPE *)find(p, "fmi2ExitInitializationMode");
    p->step2 = (fmi2DoStepTYPE *)find(p, "fmi2DoStep");
    p->set2 = (fmi2SetRealTYPE *)find(p, "fmi2SetReal");
    p->get2 = (fmi2GetRealTYPE *)find(p, "fmi2GetReal");
    p->instance = create("arm", fmi2CoSimulation, p->token, NULL, &callbacks, fmi2False, fmi2False);
    insist(p->instance != NULL, "fmi2Instantiate");
    insist(set_up(p->instance, fmi2True, TOLERANCE, 0.0, fmi2False, 0.0) == fmi2OK && enter(p->instance) == fmi2OK &&
               leave(p->instance) == fmi2OK,
           "initialization");
}
static void end2(Program *p) { ((fmi2FreeInstanceTYPE *)find(p, "fmi2FreeInstance"))(p->instance); }
static int set2(Program *p, unsigned first, size_t count, const double *u)
{
    return p->set2(p->instance, p->reference + first, count, u);
}
static int step2(Program *p, double time) { return p->step2(p->instance, time, H, fmi2True); }
static int get2(Program *p, unsigned first, size_t count, double *y)
{
    return p->get2(p->instance, p->reference + first, count, y);
}

static void report3(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message)
{
    (void)environment, (void)status, (void)category;
    fprintf(stderr, "%s\n", message);
}

static void begin3(Program *p)
{
    fmi3InstantiateCoSimulationTYPE *create =
        (fmi3InstantiateCoSimulationTYPE *)find(p, "fmi3InstantiateCoSimulation");
    fmi3EnterInitializationModeTYPE *enter = (fmi3EnterInitializationModeTYPE *)find(p, "fmi3EnterInitializationMode");
    fmi3ExitInitializationModeTYPE *leave = (fmi3ExitInitializationModeTYPE *)find(p, "fmi3ExitInitializationMode");
    p->step3 = (fmi3DoStepTYPE *)find(p, "fmi3DoStep");
    p->set3 = (fmi3SetFloat64TYPE *)find(p, "fmi3SetFloat64");
    p->get3 = (fmi3GetFloat64TYPE *)find(p, "fmi3GetFloat64");
    p->instance = create("arm", p->token, NULL, fmi3False, fmi3False, fmi3False, fmi3False, NULL, 0, NULL, report3, NULL);
    insist(p->instance != NULL, "fmi3InstantiateCoSimulation");
    insist(enter(p->instance, fmi3True, TOLERANCE, 0.0, fmi3False, 0.0) == fmi3OK && leave(p->instance) == fmi3OK,
           "initialization");
}
static void end3(Program *p) { ((fmi3FreeInstanceTYPE *)find(p, "fmi3FreeInstance"))(p->instance); }
static int set3(Program *p, unsigned first, size_t count, const double *u)
{
    return p->set3(p->instance, p->reference + first, count, u, count);
}
static int step3(Program *p, double time)
{
    fmi3Boolean event, terminate, early;
    double reached;
    return p->step3(p->instance, time, H, fmi3True, &event, &terminate, &early, &reached);
}
static int get3(Program *p, unsigned first, size_t count, double *y)
{
    return p->get3(p->instance, p->reference + first, count, y, count);
}

/* CPU time, ns: on a busy machine the wall clock counts the time slices of others. */
static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static void inputs(double time, double *u)
{
    for (int i = 0; i < 6; i++)
        u[i] = 0.3 + 0.2 * (1.0 - 2.0 * fabs(fmod(0.4 * time + i / 6.0, 2.0) - 1.0));
    u[6] = 5.0, u[7] = -3.0, u[8] = 0.1, u[9] = -0.1;
}

/* ns per step; with `coupled`, new inputs before each step and the outputs after it. `y` is the last output. */
static double steps(const Kind *kind, Program *p, int coupled, double *y)
{
    double u[INPUTS];
    kind->begin(p);
    inputs(0.0, u);
    insist(kind->set(p, 0, INPUTS, u) == 0, "setting inputs");
    double began = now();
    for (int i = 0; i < STEPS; i++) {
        if (coupled) {
            inputs(i * H, u);
            insist(kind->set(p, 0, INPUTS, u) == 0, "setting inputs");
        }
        insist(kind->step(p, i * H) == 0, "a step");
        if (coupled)
            insist(kind->get(p, INPUTS, OUTPUTS, y) == 0, "getting outputs");
    }
    double spent = now() - began;
    insist(kind->get(p, INPUTS, OUTPUTS, y) == 0, "getting outputs");
    kind->end(p);
    return spent / STEPS;
}

/* ns per call for one variable at position `which` of the references; set calls take turns between two values. */
static double calls(const Kind *kind, Program *p, unsigned which, int setting)
{
    double value[2], unused[OUTPUTS];
    kind->begin(p);
    insist(kind->step(p, 0.0) == 0 && kind->get(p, INPUTS, OUTPUTS, unused) == 0, "the first step");
    insist(kind->get(p, which, 1, value) == 0, "getting");
    value[1] = value[0] + 0.01;
    double began = now();
    for (int i = 0; i < CALLS; i++)
        insist((setting ? kind->set(p, which, 1, &value[i & 1]) : kind->get(p, which, 1, unused)) == 0, "a call");
    double spent = now() - began;
    kind->end(p);
    return spent / CALLS;
}

static int ascending(const void *a, const void *b)
{
    double left = *(const double *)a, right = *(const double *)b;
    return (left > right) - (left < right);
}

static double median(double *values)
{
    qsort(values, ROUNDS, sizeof *values, ascending);
    return values[ROUNDS / 2];
}

static const Kind kinds[] = {{"hand", begin_hand, end_hand, set_hand, step_hand, get_hand},
                             {"fmi2", begin2, end2, set2, step2, get2},
                             {"fmi3", begin3, end3, set3, step3, get3}};

static void compare_steps(Program programs[3], int coupled)
{
    const char *what = coupled ? "coupled_step" : "step";
    double spent[3][ROUNDS], ratio[3][ROUNDS], y[3][OUTPUTS], apart = 0.0;
    for (int round = 0; round < ROUNDS; round++) {
        for (int k = 0; k < 3; k++)
            spent[k][round] = steps(&kinds[k], &programs[k], coupled, y[k]);
        for (int k = 1; k < 3; k++) {
            ratio[k][round] = spent[k][round] / spent[0][round];
            for (int i = 0; i < OUTPUTS; i++)
                apart = fmax(apart, fabs(y[k][i] - y[0][i]));
        }
    }
    for (int k = 0; k < 3; k++)
        printf("%s_%s %.1f ns\n", what, kinds[k].name, median(spent[k]));
    for (int k = 1; k < 3; k++)
        printf("%s_%s_ratio %.3f 1\n", what, kinds[k].name, median(ratio[k]));
    printf("%s_apart %.3g rad\n", what, apart);
}

static void time_calls(Program programs[3])
{
    static const struct {
        const char *name;
        unsigned which;
        int setting;
    } work[] = {{"get_input", 0, 0}, {"get_output", INPUTS, 0}, {"get_parameter", INPUTS + OUTPUTS, 0},
                {"set_input", 0, 1}, {"set_parameter", INPUTS + OUTPUTS, 1}};
    for (size_t w = 0; w < sizeof work / sizeof *work; w++)
        for (int k = 1; k < 3; k++) {
            double spent[ROUNDS];
            for (int round = 0; round < ROUNDS; round++)
                spent[round] = calls(&kinds[k], &programs[k], work[w].which, work[w].setting);
            printf("%s_%s %.1f ns\n", work[w].name, kinds[k].name, median(spent));
        }
}

int main(int argc, char **argv)
{
    Program programs[3] = {{0}};
    insist(argc == 7, "reading the arguments (see the first comment of step_cost.c)");
    for (int k = 1; k < 3; k++) {
        char **arguments = &argv[3 * k - 2], *rest = arguments[2];
        programs[k].library = dlopen(arguments[0], RTLD_NOW | RTLD_LOCAL);
        insist(programs[k].library != NULL, "dlopen");
        programs[k].token = arguments[1];
        for (int i = 0; i < INPUTS + OUTPUTS + 1; i++)
            programs[k].reference[i] = (unsigned)strtoul(rest, &rest, 10);
    }
    compare_steps(programs, 0);
    compare_steps(programs, 1);
    time_calls(programs);
    return 0;
}
