/* Two tanks in cascade with Torricelli's outflow sqrt(2 g h), a leak and an overflow; Heun's method in small steps. */
#include <math.h>
#include "truth.h"

static void rates(const double *p, const double *h, double inflow, double *dh, double *outflow) {
  double up = h[0] > 0 ? p[V_a1] * sqrt(2 * p[V_g] * h[0]) : 0, down = h[1] > 0 ? p[V_a2] * sqrt(2 * p[V_g] * h[1]) : 0;
  double leak = h[0] > 0 ? p[V_leak] * sqrt(2 * p[V_g] * h[0]) : 0;
  double spilled = p[V_overflow] > 0 && h[0] > p[V_overflow] ? 1e-2 * (h[0] - p[V_overflow]) : 0;
  dh[0] = (inflow - up - leak - spilled) / p[V_A1];
  dh[1] = (up - down) / p[V_A2];
  *outflow = down;
}

/* u: (steps + 1,) inflow; out: (steps + 1, 3) both levels and the outflow; h0: (2,) first levels, replaced by the last. */
void simulate_tanks(const double *val, double step, int steps, const double *u, double *h0, double *out) {
  enum { PARTS = 20 };
  for (int n = 0; n <= steps; n++) {
    double k1[2], k2[2], flow;
    rates(val, h0, u[n], k1, &flow);
    out[3 * n] = h0[0];
    out[3 * n + 1] = h0[1];
    out[3 * n + 2] = flow;
    for (int k = 0; k < PARTS && n < steps; k++) {
      double s = step / PARTS, now = u[n] + (u[n + 1] - u[n]) * k / PARTS, then = u[n] + (u[n + 1] - u[n]) * (k + 1) / PARTS;
      rates(val, h0, now, k1, &flow);
      double moved[2] = {h0[0] + s * k1[0], h0[1] + s * k1[1]};
      rates(val, moved, then, k2, &flow);
      for (int j = 0; j < 2; j++) h0[j] += s / 2 * (k1[j] + k2[j]);
    }
  }
}
