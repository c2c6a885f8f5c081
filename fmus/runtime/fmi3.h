/* The FMI 3.0 side of what all versions share, see layer.h, and what the FMI 3.0 files share beside that. */
#ifndef MISFIT_FMI3_H
#define MISFIT_FMI3_H

#include "core.h"
#include "fmi3_names.h"

/* Who gets the messages. */
typedef struct {
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback logger;
} Importer;

typedef struct {
    Core core; /* with the categories of messages that are wanted */
    Importer importer;
} Instance;

#include "layer.h"

/* Number of elements of the variable with this value reference; 0 where there is none. */
size_t fmi3_size(fmi3ValueReference reference);

/* True when the references are known and their variables have `n_values` elements in all. */
int fmi3_matching(Instance *instance, const char *call, const fmi3ValueReference *references, size_t n_references,
                  size_t n_values);

#endif
