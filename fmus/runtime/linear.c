/* Gauss elimination with partial pivoting, column oriented: Golub, Van Loan, Matrix Computations, section 3.4. */
#include "linear.h"

#include <math.h>

static void exchange(double *one, double *other)
{
    double kept = *one;
    *one = *other;
    *other = kept;
}

int linear_factorize(double *matrix, size_t *pivots, size_t n)
{
    for (size_t k = 0; k < n; k++) {
        double *column = matrix + k * n;
        size_t best = k;
        for (size_t i = k + 1; i < n; i++)
            if (fabs(column[i]) > fabs(column[best]))
                best = i;
        pivots[k] = best;
        if (!(fabs(column[best]) > 0.0) || !isfinite(column[best]))
            return -1;
        if (best != k)
            for (size_t j = 0; j < n; j++)
                exchange(&matrix[j * n + k], &matrix[j * n + best]);
        for (size_t i = k + 1; i < n; i++)
            column[i] /= column[k];
        for (size_t j = k + 1; j < n; j++) {
            double *other = matrix + j * n, factor = other[k];
            if (factor != 0.0)
                for (size_t i = k + 1; i < n; i++)
                    other[i] -= column[i] * factor;
        }
    }
    return 0;
}

void linear_solve(const double *factors, const size_t *pivots, size_t n, double *right)
{
    for (size_t k = 0; k < n; k++)
        if (pivots[k] != k)
            exchange(&right[k], &right[pivots[k]]);
    for (size_t k = 0; k < n; k++)
        for (size_t i = k + 1; i < n; i++)
            right[i] -= factors[k * n + i] * right[k];
    for (size_t k = n; k-- > 0;) {
        right[k] /= factors[k * n + k];
        for (size_t i = 0; i < k; i++)
            right[i] -= factors[k * n + i] * right[k];
    }
}
