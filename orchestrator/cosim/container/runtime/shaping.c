/* Inputs over a step that are not held: extrapolated along a line, or smoothed. */
#include "container.h"

#include <math.h>
#include <stdlib.h>

/* The value of an input behind the lag, and its slope along the line through the last two points, in 1/s. */
static double shaped(Container *self, int32_t place, double time, double size, double *slope)
{
    const SystemData *system = self->system;
    double value = self->signals[place];
    int first = !isfinite(self->before_time[place]);
    if (system->smoothing > 0.0) {
        double last = first ? value : self->smooth[place];
        value = self->smooth[place] = last + (value - last) * -expm1(-size / system->smoothing);
    }
    double last_time = first ? time : self->before_time[place], last = first ? value : self->before[place];
    *slope = system->extrapolate && time > last_time ? (value - last) / (time - last_time) : 0.0;
    self->before_time[place] = time;
    self->before[place] = value;
    return value;
}

int shape_inputs(Container *self, const OpData *op, double time, double size)
{
    const RowData *rows = self->system->rows + op->first_row;
    size_t n = 0;
    for (int32_t r = 0; r < op->n_rows; r++)
        n += (size_t)rows[r].n_values;
    double *kept = calloc(2 * n + 1, sizeof(double)), *slopes = kept + n;
    if (kept == NULL)
        return container_fail(self, "out of memory");
    size_t i = 0;
    for (int32_t r = 0; r < op->n_rows; r++)
        for (int32_t k = 0; k < rows[r].n_values; k++, i++) {
            int32_t place = rows[r].places[k];
            kept[i] = self->signals[place];
            self->signals[place] = shaped(self, place, time, size, &slopes[i]);
            /* What holds its inputs gets their value in the middle of the step, which serves order two as well. */
            if (!op->slopes)
                self->signals[place] += 0.5 * size * slopes[i];
        }
    int done = carry_out_rows(self, op->first_row, op->n_rows, time);
    if (done == 0 && op->slopes && self->system->extrapolate)
        for (int32_t r = 0, from = 0; r < op->n_rows && done == 0; from += rows[r++].n_values) {
            Component *part = &self->components[op->part];
            if (part_slopes(part, rows[r].references, (size_t)rows[r].n_references, slopes + from) != 0)
                done = container_fail(self, "%s", part->problem);
        }
    i = 0;
    for (int32_t r = 0; r < op->n_rows; r++)
        for (int32_t k = 0; k < rows[r].n_values; k++, i++)
            self->signals[rows[r].places[k]] = kept[i];
    free(kept);
    return done;
}
