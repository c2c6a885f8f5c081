/* decay.c, by an FMU that sets its parameters back when a run is set up, as those of 20-sim do. */
#define FORGETS_WHAT_WAS_SET
#include "decay.c"
