/* What the delay operators remember: breakpoints of all sources, linear in between. */
#ifndef MISFIT_HISTORY_H
#define MISFIT_HISTORY_H

#include <stddef.h>

/* Times never decrease; two equal times are a jump. Zero-initialise and set `width`. */
typedef struct {
    size_t width; /* number of sources */
    size_t count;
    size_t capacity;
    double *time;   /* s, one per breakpoint */
    double *values; /* `width` per breakpoint */
} History;

/* A source near some time: value + slope * (t - time). */
typedef struct {
    double time;
    double value;
    double slope;
} Line;

/* Appends one breakpoint; returns 0, or -1 when memory is exhausted. */
int history_append(History *history, double time, const double *values);

/* Appends a jump at the last time, unless the values agree with the last ones to 12 digits. */
int history_jump(History *history, const double *values);

/* Drops breakpoints that no lookup at or after `time` needs; cheap when there is little to drop. */
void history_forget(History *history, double time);

/* The piece of `column` that holds at `time`, from the right at a jump; constant outside the record. */
Line history_line(const History *history, size_t column, double time);

/* First jump or kink of `column` in (after, before), or HUGE_VAL. */
double history_next_break(const History *history, size_t column, double after, double before);

/* First jump of `column` after `after`, or HUGE_VAL. */
double history_next_jump(const History *history, size_t column, double after);

/* Makes `target` equal to `source`; returns 0, or -1 when memory is exhausted. */
int history_copy(History *target, const History *source);

void history_clear(History *history);

#endif
