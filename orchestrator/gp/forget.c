/* Takes one datum out of a Cholesky factor, in one pass over it. */

#include <math.h>
#include <string.h>

/* One rotation: `to` becomes what is left of `column` and `carried` in the factor, `carried` what goes on to the next column. */
static void rotate(double *restrict to, const double *restrict column, double *restrict carried, long long count, double c,
                   double s) {
    for (long long i = 0; i < count; i++) {
        double a = column[i], b = carried[i];
        to[i] = c * a + s * b;
        carried[i] = c * b - s * a;
    }
}

/*
 * lower: factor of n rows in column order, columns `room` apart; row and column `place` go, those behind move up by one.
 * half: inv(lower) times residuals, `components` rows of `room`; they are rows of the factor too, and turn with it.
 * carried: room for `room` numbers.
 */
void misfit_forget(double *lower, double *half, double *carried, long long room, long long n, long long place,
                   long long components) {
    memcpy(carried + place + 1, lower + place * room + place + 1, (size_t)(n - place - 1) * sizeof *lower);
    for (long long j = 0; j < place; j++) {
        double *row = lower + j * room + place;
        memmove(row, row + 1, (size_t)(n - place - 1) * sizeof *row);
    }
    for (long long k = place + 1; k < n; k++) {
        const double *column = lower + k * room + k, *to = lower + (k - 1) * room + k - 1;
        double length = hypot(column[0], carried[k]), c = column[0] / length, s = carried[k] / length;
        rotate(to, column, carried + k, n - k, c, s);
        for (long long m = 0; m < components; m++) {
            double *row = half + m * room, a = row[k], b = row[k - 1];
            row[k - 1] = c * a + s * b;
            row[k] = c * b - s * a; /* carried on in the place that is read next */
        }
    }
    for (long long j = 0; j < n; j++)
        lower[j * room + n - 1] = 0.0;
    lower[(n - 1) * room + n - 1] = 1.0;
    for (long long m = 0; m < components; m++)
        half[m * room + n - 1] = 0.0;
}
