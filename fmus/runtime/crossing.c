/* Where within a step a relation changes: the margin of all relations as a function of the share of the step. */
#include "method.h"

#include <float.h>
#include <math.h>

/* Looked at for events that come and go within one step; a pair closer than a part may still be missed. */
#define PARTS 4
#define MAX_TURNS 100

typedef struct {
    double share, margin;
} Point;

static int look(Integration *run, const Method *method, double t, double h, const double *x, Point *point)
{
    const double *state = x;
    if (point->share > 0.0) {
        method->inside(run, h, x, point->share, work_inside(run));
        state = work_inside(run);
    }
    return run->margin(run->context, t + point->share * h, state, &point->margin) == 0 && !isnan(point->margin) ? 0 : -1;
}

/* Regula falsi with the Illinois rule; every third turn halves the interval, so that it always gets short. */
static int narrow(Integration *run, const Method *method, double t, double h, const double *x, Point *low, Point *high)
{
    int side = 0;
    for (int turn = 1; turn < MAX_TURNS; turn++) {
        double width = high->share - low->share;
        Point middle = {low->share + 0.5 * width, 0.0};
        if (width * h <= 2.0 * DBL_EPSILON * fmax(fabs(t), h))
            break;
        if (turn % 3 != 0)
            middle.share = high->share - high->margin * width / (high->margin - low->margin);
        if (!(middle.share > low->share && middle.share < high->share))
            middle.share = low->share + 0.5 * width;
        if (look(run, method, t, h, x, &middle) != 0)
            return -1;
        if (middle.margin <= 0.0) {
            *high = middle;
            low->margin *= side == 1 ? 0.5 : 1.0;
            side = 1;
        } else {
            *low = middle;
            high->margin *= side == -1 ? 0.5 : 1.0;
            side = -1;
        }
    }
    return 0;
}

double event_share(Integration *run, const Method *method, double t, double h, const double *x)
{
    Point low = {0.0, 0.0}, high;
    if (look(run, method, t, h, x, &low) != 0)
        return -1.0;
    if (low.margin <= 0.0)
        low.margin = DBL_MIN; /* has just changed; the search ends at the start of the step */
    for (int part = 1; part <= PARTS; part++, low = high) {
        high.share = part / (double)PARTS;
        if (look(run, method, t, h, x, &high) != 0)
            return -1.0;
        if (high.margin <= 0.0) {
            if (narrow(run, method, t, h, x, &low, &high) != 0)
                return -1.0;
            method->inside(run, h, x, high.share, work_inside(run));
            return high.share;
        }
    }
    return 2.0;
}
