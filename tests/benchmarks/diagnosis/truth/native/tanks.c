/* Two tanks in cascade with Torricelli's outflow sqrt(2 g h), leaks, an overflow and an outlet that clogs; Heun's method
   in small steps. */
#include <math.h>
#include "truth.h"

static double drained(double g, double h) { return h > 0 ? sqrt(2 * g * h) : 0; }

static void rates(const double *p, double t, const double *h, double inflow, double *dh, double *outflow) {
  double fast[2] = {drained(p[V_g], h[0]), drained(p[V_g], h[1])};
  double open = p[V_clog] > 0 ? 1 - p[V_clog] * (1 - exp(-t / p[V_clogtime])) : 1;
  double up = p[V_a1] * open * fast[0], down = p[V_a2] * fast[1];
  double spilled = p[V_overflow] > 0 && h[0] > p[V_overflow] ? 1e-2 * (h[0] - p[V_overflow]) : 0;
  dh[0] = (inflow - up - p[V_leak1] * fast[0] - spilled) / p[V_A1];
  dh[1] = (up - down - p[V_leak2] * fast[1]) / p[V_A2];
  *outflow = down;
}

/* u: (steps + 1,) inflow; out: (steps + 1, 3) both levels and the outflow; h0: (2,) first levels, replaced by the last. */
void simulate_tanks(const double *val, double step, int steps, const double *u, double *h0, double *out) {
  enum { PARTS = 20 };
  for (int n = 0; n <= steps; n++) {
    double k1[2], k2[2], flow;
    rates(val, n * step, h0, u[n], k1, &flow);
    out[3 * n] = h0[0];
    out[3 * n + 1] = h0[1];
    out[3 * n + 2] = flow;
    for (int k = 0; k < PARTS && n < steps; k++) {
      double s = step / PARTS, t = n * step + k * s, now = u[n] + (u[n + 1] - u[n]) * k / PARTS, then = u[n] + (u[n + 1] - u[n]) * (k + 1) / PARTS;
      rates(val, t, h0, now, k1, &flow);
      double moved[2] = {h0[0] + s * k1[0], h0[1] + s * k1[1]};
      rates(val, t + s, moved, then, k2, &flow);
      for (int j = 0; j < 2; j++) h0[j] += s / 2 * (k1[j] + k2[j]);
    }
  }
}
