#include "history.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static double value(const History *history, size_t column, size_t row)
{
    return history->values[row * history->width + column];
}

static int reserve(History *history, size_t capacity)
{
    if (capacity <= history->capacity)
        return 0;
    double *time = realloc(history->time, capacity * sizeof(double));
    if (time == NULL)
        return -1;
    history->time = time;
    double *values = realloc(history->values, capacity * history->width * sizeof(double));
    if (values == NULL)
        return -1;
    history->values = values;
    history->capacity = capacity;
    return 0;
}

int history_append(History *history, double time, const double *values)
{
    if (history->count == history->capacity && reserve(history, 2 * history->capacity + 16) != 0)
        return -1;
    history->time[history->count] = time;
    memcpy(history->values + history->count * history->width, values, history->width * sizeof(double));
    history->count++;
    return 0;
}

int history_jump(History *history, const double *values)
{
    size_t last = history->count - 1;
    for (size_t i = 0; i < history->width; i++) {
        double before = value(history, i, last);
        if (fabs(values[i] - before) > 1e-12 * (fabs(values[i]) + fabs(before)))
            return history_append(history, history->time[last], values);
    }
    return 0;
}

/* Last breakpoint at or before `time`; the record must start at or before it. */
static size_t row_at(const History *history, double time)
{
    size_t low = 0, high = history->count;
    while (high - low > 1) {
        size_t middle = low + (high - low) / 2;
        if (history->time[middle] <= time)
            low = middle;
        else
            high = middle;
    }
    return low;
}

void history_forget(History *history, double time)
{
    if (history->count == 0 || time < history->time[0])
        return;
    size_t row = row_at(history, time);
    /* Two rows more than a lookup needs: a kink is recognised from the rows around it. */
    size_t unused = row > 2 ? row - 2 : 0;
    if (2 * unused < history->count)
        return;
    history->count -= unused;
    memmove(history->time, history->time + unused, history->count * sizeof(double));
    memmove(history->values, history->values + unused * history->width,
            history->count * history->width * sizeof(double));
}

Line history_line(const History *history, size_t column, double time)
{
    size_t row = time < history->time[0] ? 0 : row_at(history, time);
    Line line = {history->time[row], value(history, column, row), 0.0};
    if (time >= history->time[0] && row + 1 < history->count)
        line.slope = (value(history, column, row + 1) - line.value) / (history->time[row + 1] - line.time);
    return line;
}

static int is_break(const History *history, size_t column, size_t row)
{
    const double *time = history->time;
    double here = value(history, column, row), next = value(history, column, row + 1);
    double before = row > 0 ? value(history, column, row - 1) : here;
    if (time[row + 1] == time[row] || (row > 0 && time[row - 1] == time[row]))
        return 1;
    double slope = row > 0 ? (here - before) / (time[row] - time[row - 1]) : 0.0;
    double straight = here + slope * (time[row + 1] - time[row]);
    return fabs(next - straight) > 1e-9 * (fabs(before) + fabs(here) + fabs(next));
}

double history_next_break(const History *history, size_t column, double after, double before)
{
    size_t row = after < history->time[0] ? 0 : row_at(history, after) + 1;
    for (; row + 1 < history->count && history->time[row] < before; row++)
        if (is_break(history, column, row))
            return history->time[row];
    return HUGE_VAL;
}

double history_next_jump(const History *history, size_t column, double after)
{
    size_t row = after < history->time[0] ? 0 : row_at(history, after) + 1;
    for (; row + 1 < history->count; row++)
        if (history->time[row] == history->time[row + 1] &&
            value(history, column, row) != value(history, column, row + 1))
            return history->time[row];
    return HUGE_VAL;
}

int history_copy(History *target, const History *source)
{
    target->width = source->width;
    if (reserve(target, source->count) != 0)
        return -1;
    target->count = source->count;
    if (source->count > 0) {
        memcpy(target->time, source->time, source->count * sizeof(double));
        memcpy(target->values, source->values, source->count * source->width * sizeof(double));
    }
    return 0;
}

void history_clear(History *history)
{
    free(history->time);
    free(history->values);
    *history = (History){.width = history->width};
}
