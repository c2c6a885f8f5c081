/* Kalman filter of a linear time-varying system, measurements of an instant one after the other; arrays row by row. */

#include <math.h>
#include <string.h>

/* to = a b, or a b' if `transposed`; all (m, m). */
static void multiply(double *restrict to, const double *restrict a, const double *restrict b, long long m, int transposed) {
    for (long long i = 0; i < m; i++)
        for (long long j = 0; j < m; j++) {
            double sum = 0.0;
            for (long long k = 0; k < m; k++)
                sum += a[i * m + k] * (transposed ? b[j * m + k] : b[k * m + j]);
            to[i * m + j] = sum;
        }
}

/*
 * sizes: n, m, ny. measured: (n, ny), less what is shown at the state 0. work: 2 m m + m.
 * Writes means (n, m) and covariances (n, m, m) after each instant, of which the first are given before it, and those ahead of each
 * measurement but the first, (n - 1, ...). Gives the log likelihood.
 */
double misfit_filter(const long long *sizes, const double *step, const double *offset, const double *disturbance,
                     const double *show, const double *measured, const double *noise, double *means,
                     double *covariances, double *ahead_means, double *ahead_covariances, double *work) {
    long long n = sizes[0], m = sizes[1], ny = sizes[2];
    double *half = work, *shared = work + m * m, total = 0.0;
    for (long long k = 0; k < n; k++) {
        double *mean = means + k * m, *p = covariances + k * m * m;
        if (k) {
            const double *a = step + (k - 1) * m * m, *before = mean - m, *q = disturbance + (k - 1) * m * m;
            double *ahead_mean = ahead_means + (k - 1) * m, *ahead = ahead_covariances + (k - 1) * m * m;
            multiply(half, a, p - m * m, m, 0);
            multiply(ahead, half, a, m, 1);
            for (long long i = 0; i < m; i++) {
                ahead_mean[i] = offset[(k - 1) * m + i];
                for (long long j = 0; j < m; j++) {
                    ahead_mean[i] += a[i * m + j] * before[j];
                    ahead[i * m + j] += q[i * m + j];
                }
            }
            memcpy(mean, ahead_mean, (size_t)m * sizeof *mean);
            memcpy(p, ahead, (size_t)(m * m) * sizeof *p);
        }
        for (long long c = 0; c < ny; c++) {
            const double *h = show + (k * ny + c) * m;
            double variance = noise[c], surprise = measured[k * ny + c];
            for (long long i = 0; i < m; i++) {
                shared[i] = 0.0;
                for (long long j = 0; j < m; j++)
                    shared[i] += p[i * m + j] * h[j];
            }
            for (long long i = 0; i < m; i++) {
                variance += h[i] * shared[i];
                surprise -= h[i] * mean[i];
            }
            for (long long i = 0; i < m; i++) {
                mean[i] += shared[i] * (surprise / variance);
                for (long long j = 0; j < m; j++)
                    p[i * m + j] -= shared[i] * shared[j] / variance;
            }
            total -= 0.5 * (surprise * surprise / variance + log(2.0 * acos(-1.0) * variance));
        }
    }
    return total;
}
