/* Small dense linear systems; matrices are stored column by column. */
#ifndef MISFIT_LINEAR_H
#define MISFIT_LINEAR_H

#include <stddef.h>

/* Replaces the n x n `matrix` by its factors, with row exchanges in `pivots`; 0, or -1 when it is singular. */
int linear_factorize(double *matrix, size_t *pivots, size_t n);

/* Solves with the factors; the right-hand side becomes the solution. */
void linear_solve(const double *factors, const size_t *pivots, size_t n, double *right);

#endif
