/* Torques that effects add at the joints. */
#include <math.h>
#include "truth.h"

void joint_torques(const Case *c, double t, const double *q, const double *v, const double *z, double *tau, double *dz) {
  const double *p = c->val;
  double cool = p[V_warmtime] > 0 ? 1 - p[V_warm] * (1 - exp(-(t > 0 ? t : 0) / p[V_warmtime])) : 1;
  for (int j = 0; j < c->dofs; j++) {
    double beyond = p[V_side] * (q[j] - p[V_stopat]);
    tau[j] -= (p[V_b1 + j] * cool + p[V_d1 + j] * fabs(v[j])) * v[j];
    tau[j] += p[V_t1 + j] - p[V_k1 + j] * q[j] - p[V_cube1 + j] * q[j] * q[j] * q[j];
    tau[j] += p[V_g1 + j] * sin(p[V_gn] * q[j] + p[V_gphase]);
    tau[j] += p[V_tr1 + j] * sin(2 * 3.141592653589793 * p[V_trf] * t + p[V_trp]);
    if (beyond > 0) tau[j] -= p[V_side] * p[V_stop1 + j] * beyond;
    if (p[V_h1 + j] > 0) {
      dz[j] = (v[j] - p[V_hsigma] * fabs(v[j]) * z[j] - (1 - p[V_hsigma]) * v[j] * fabs(z[j])) / p[V_hx];
      tau[j] -= p[V_h1 + j] * z[j];
    }
  }
}

/* Size of the dry friction of a joint. */
double dry_friction(const Case *c, int j, const double *q, const double *v) {
  const double *p = c->val;
  double ratio = p[V_vs] > 0 ? v[j] / p[V_vs] : 0;
  double size = p[V_c1 + j] + p[V_s1 + j] * exp(-ratio * ratio);
  size *= 1 + p[V_fpos] * sin(p[V_fwave] * q[j]);
  if (c->dofs == 2) size += p[V_fother] * fabs(v[1 - j]);
  return size;
}
