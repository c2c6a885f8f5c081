/* The limit: the same communication written by hand in C, all outputs recorded in memory.
 * usage: loop FOLDER PAIRS STEPS; prints {"cpu_us": ..., "x": ...} */
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include "fmi2Functions.h"

typedef struct {
    fmi2Component body;
    fmi2GetRealTYPE *get;
    fmi2SetRealTYPE *set;
    fmi2DoStepTYPE *step;
} Fmu;

static Fmu load(const char *folder, const char *name)
{
    static fmi2CallbackFunctions none;
    char path[4096];
    snprintf(path, sizeof path, "%s/%s.so", folder, name);
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library) {
        fprintf(stderr, "%s\n", dlerror());
        exit(1);
    }
    fmi2InstantiateTYPE *make = (fmi2InstantiateTYPE *)dlsym(library, "fmi2Instantiate");
    Fmu f = {make(name, fmi2CoSimulation, "", "", &none, 0, 0), (fmi2GetRealTYPE *)dlsym(library, "fmi2GetReal"),
             (fmi2SetRealTYPE *)dlsym(library, "fmi2SetReal"), (fmi2DoStepTYPE *)dlsym(library, "fmi2DoStep")};
    ((fmi2ExitInitializationModeTYPE *)dlsym(library, "fmi2ExitInitializationMode"))(f.body);
    return f;
}

static double cpu(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return now.tv_sec + 1e-9 * now.tv_nsec;
}

int main(int count, char **arguments)
{
    enum { MOST = 16 };
    static const fmi2ValueReference motion[] = {2, 3}, forces_in[] = {0, 1}, ends[] = {0, 1, 2, 3}, forces[] = {4, 5};
    int pairs = atoi(arguments[2]);
    long steps = atol(arguments[3]);
    Fmu mass[MOST], spring[MOST];
    for (int i = 0; i < pairs; i++) {
        mass[i] = load(arguments[1], "Mass");
        spring[i] = load(arguments[1], "Spring");
    }
    double *rows = malloc(sizeof(double) * 4 * pairs * (steps + 1)), h = 1e-4, m[MOST][2] = {{0}}, s[MOST][2] = {{0}};
    double began = cpu();
    for (long k = 0;; k++) {
        for (int i = 0; i < pairs; i++) mass[i].get(mass[i].body, motion, 2, m[i]);
        for (int i = 0; i < pairs; i++) {
            double at[4] = {i ? m[i - 1][0] : 0, i ? m[i - 1][1] : 0, m[i][0], m[i][1]};
            spring[i].set(spring[i].body, ends, 4, at);
            spring[i].get(spring[i].body, forces, 2, s[i]);
        }
        for (int i = 0; i < pairs; i++) {
            double on[2] = {s[i][1], i + 1 < pairs ? s[i + 1][0] : 0}, *row = rows + 4 * (k * pairs + i);
            mass[i].set(mass[i].body, forces_in, 2, on);
            row[0] = m[i][0], row[1] = m[i][1], row[2] = s[i][0], row[3] = s[i][1];
        }
        if (k == steps) break;
        for (int i = 0; i < pairs; i++) {
            mass[i].step(mass[i].body, k * h, h, 1);
            spring[i].step(spring[i].body, k * h, h, 1);
        }
    }
    printf("{\"cpu_us\": %.5f, \"x\": %.12g}\n", (cpu() - began) / steps * 1e6, m[0][0]);
    return 0;
}
