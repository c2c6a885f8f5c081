/* Equations of motion of the machines; dry friction holds a stuck joint exactly. */
#include <math.h>
#include "truth.h"

/* Mass matrix and torques without dry friction. */
static void motion(Case *c, double t, const double *q, const double *v, const double *z, const double *u, double *mass,
                   double *rhs, double *dz) {
  const double *p = c->val;
  static const double none[2] = {0, 0};
  mass[1] = mass[2] = 0;
  mass[3] = 1;
  rhs[0] = rhs[1] = 0;
  switch (c->kind) {
    case ARM:
    case DOUBLE_PENDULUM: {
      const double *f = c->kind == ARM ? u + 6 : none;
      if (!c->use_mujoco || !mujoco_linkage(p, t, q, v, f, mass, rhs)) plain_linkage(p, t, q, v, f, mass, rhs);
      rhs[0] -= p[V_nb1] * v[0];
      rhs[1] -= p[V_nb2] * v[1];
      if (c->kind == ARM) muscle_torques(c, t, q, v, z, u, rhs, dz);
      break;
    }
    case PENDULUM:
      mass[0] = p[V_I] + p[V_m] * p[V_a] * p[V_a];
      rhs[0] = p[V_m] * p[V_g] * p[V_a] * sin(q[0]);
      break;
    case CART: { /* first the pole, whose hinge holds the effects, then the cart */
      double s = p[V_m] * p[V_a];
      mass[0] = p[V_I] + s * p[V_a];
      mass[1] = mass[2] = s * cos(q[0]);
      mass[3] = p[V_M] + p[V_m];
      rhs[0] = s * p[V_g] * sin(q[0]);
      rhs[1] = u[0] + s * sin(q[0]) * v[0] * v[0];
      break;
    }
    case DRIVE:
      mass[0] = p[V_J];
      rhs[0] = u[0];
      break;
    case TWO_MASS: {
      double twist = q[0] - q[1] - 0.5 * c->contact * p[V_gap], shaft = 0;
      if (p[V_gap] == 0 || c->contact) shaft = p[V_k] * twist + p[V_d] * (v[0] - v[1]);
      mass[0] = p[V_JMotor];
      mass[3] = p[V_JLoad];
      rhs[0] = u[0] - shaft;
      rhs[1] = shaft;
      break;
    }
  }
  mass[0] += p[V_j1];
  mass[3] += p[V_j2];
  joint_torques(c, t, q, v, z, rhs, dz);
}

void accelerations(Case *c, double t, const double *q, const double *v, const double *z, const double *u,
                   const int *mode, double *a, double *dz) {
  double mass[4], rhs[2];
  for (int i = 0; i < NZ; i++) dz[i] = 0;
  motion(c, t, q, v, z, u, mass, rhs, dz);
  int stuck[2] = {0, 0};
  for (int j = 0; j < c->dofs; j++) {
    c->level[j] = dry_friction(c, j, q, v);
    stuck[j] = c->level[j] > 0 && mode[j] == 0;
    if (c->level[j] > 0) rhs[j] -= mode[j] * c->level[j];
  }
  if (c->dofs == 1) {
    a[0] = stuck[0] ? 0 : rhs[0] / mass[0];
    c->need[0] = -rhs[0];
    return;
  }
  double det = mass[0] * mass[3] - mass[1] * mass[2];
  if (stuck[0] && stuck[1]) a[0] = a[1] = 0;
  else if (stuck[0]) a[0] = 0, a[1] = rhs[1] / mass[3];
  else if (stuck[1]) a[0] = rhs[0] / mass[0], a[1] = 0;
  else a[0] = (mass[3] * rhs[0] - mass[1] * rhs[1]) / det, a[1] = (mass[0] * rhs[1] - mass[2] * rhs[0]) / det;
  c->need[0] = mass[0] * a[0] + mass[1] * a[1] - rhs[0];
  c->need[1] = mass[2] * a[0] + mass[3] * a[1] - rhs[1];
}
