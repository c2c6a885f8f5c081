/* Six Hill muscles of the arm, as spec'd in the project's arm data: physiological set, in SI units. */
#include <math.h>
#include "truth.h"

typedef struct { double fmax, slack, opt, vmax, a0, r1, r2; } Muscle;
static const Muscle MUSCLE[6] = {
  {800, 0.0538, 0.1280, 1.280, 0.1840, 0.05, 0},      {800, 0.0538, 0.1280, 1.280, 0.1055, -0.05, 0},
  {1000, 0.2298, 0.1422, 1.422, 0.4283, 0.03, 0.03},  {1000, 0.1905, 0.0877, 0.877, 0.1916, -0.03, -0.03},
  {700, 0.1905, 0.0877, 0.877, 0.2387, 0, -0.03},     {700, 0.0175, 0.1028, 1.028, 0.1681, 0, 0.03},
};
static const double KP = 7500, A = 0.25, GMAX = 1.5;

static double speed_factor(double v, double vmax) {
  if (v <= 0) {
    double g = (vmax + v) / (vmax - v / A);
    return g > 0 ? g : 0;
  }
  double c = vmax * A * (GMAX - 1) / (A + 1);
  return (GMAX * v + c) / (v + c);
}

static double fibre_force(const Muscle *m, double alpha, double fibre, double speed) {
  double x = (fibre - m->opt) / (0.65 * m->opt), stretch = fibre > m->opt ? fibre - m->opt : 0;
  return alpha * m->fmax * exp(-x * x) * speed_factor(speed, m->vmax) + KP * stretch * stretch;
}

static double tendon_force(const Muscle *m, double strain, double fibre, double whole) {
  double length = whole - fibre - m->slack;
  return length > 0 ? m->fmax * length / (strain * m->slack) : 0;
}

static const double LIGHT = 0.05; /* damping beside the fibre, in fmax/vmax */

static double surplus(const Muscle *m, double alpha, double fibre, double speed, double pull) {
  return fibre_force(m, alpha, fibre, speed) + LIGHT * m->fmax / m->vmax * speed - pull;
}

/* Fibre speed at which the fibre, with a light damper beside it, pulls as hard as its tendon; by the Illinois method. */
static double fibre_speed(const Muscle *m, double strain, double alpha, double fibre, double whole) {
  double pull = tendon_force(m, strain, fibre, whole);
  double low = -3 * m->vmax, high = 3 * m->vmax;
  double at_low = surplus(m, alpha, fibre, low, pull), at_high = surplus(m, alpha, fibre, high, pull);
  if (at_low >= 0) return low;
  if (at_high <= 0) return high;
  for (int i = 0; i < 60; i++) {
    double mid = (low * at_high - high * at_low) / (at_high - at_low), at = surplus(m, alpha, fibre, mid, pull);
    if (fabs(at) < 1e-9 * m->fmax) return mid;
    if (at > 0) high = mid, at_high = at, at_low *= 0.5;
    else low = mid, at_low = at, at_high *= 0.5;
  }
  return 0.5 * (low + high);
}

static double arm_factor(const Case *c, int i) { return c->val[V_ma1 + i] == 0 ? 1 : c->val[V_ma1 + i]; }

static double whole_length(const Case *c, int i, const double *q) {
  double r = arm_factor(c, i);
  return MUSCLE[i].a0 - r * (MUSCLE[i].r1 * q[0] + MUSCLE[i].r2 * q[1]);
}

/* Activation that a stretch reflex adds: gain times the speed of lengthening in optimum lengths, a delay ago. */
static double reflex(const Case *c, int i, double t) {
  double at = (t - c->val[V_rdelay]) / c->h, w[2];
  if (c->val[V_rgain] == 0 || c->steps == 0) return 0;
  int k = (int)floor(at);
  double part = at - k;
  if (k < 0) k = 0, part = 0;
  if (k > c->steps - 2) k = c->steps - 2, part = 1;
  if (k < 0) return 0;
  for (int j = 0; j < 2; j++) w[j] = (1 - part) * c->speeds[2 * k + j] + part * c->speeds[2 * k + 2 + j];
  double speed = -arm_factor(c, i) * (MUSCLE[i].r1 * w[0] + MUSCLE[i].r2 * w[1]) / MUSCLE[i].opt;
  return speed > 0 ? c->val[V_rgain] * speed : 0;
}

void muscle_torques(const Case *c, double t, const double *q, const double *w, const double *z, const double *u,
                    double *tau, double *dz) {
  for (int i = 0; i < 6; i++) {
    const Muscle *m = MUSCLE + i;
    double r = arm_factor(c, i), r1 = r * m->r1, r2 = r * m->r2, whole = whole_length(c, i, q), force;
    double alpha = u[i] + reflex(c, i, t);
    if (c->val[V_strain] > 0) {
      force = tendon_force(m, c->val[V_strain], z[2 + i], whole);
      dz[2 + i] = fibre_speed(m, c->val[V_strain], alpha, z[2 + i], whole);
    } else {
      force = fibre_force(m, alpha, whole - m->slack, -r1 * w[0] - r2 * w[1]);
    }
    tau[0] += r1 * force;
    tau[1] += r2 * force;
  }
}

/* Parts of a step h in which no tendon is too stiff for Runge and Kutta's formula, which is stable up to 2.78 time constants:
   that of a fibre without activation is its light damper over the tendon's stiffness. */
int tendon_parts(double strain, double h) {
  double fastest = 0;
  for (int i = 0; i < 6; i++) {
    double rate = MUSCLE[i].vmax / (strain * MUSCLE[i].slack * LIGHT);
    if (rate > fastest) fastest = rate;
  }
  return (int)ceil(fastest * h / 2.5);
}

/* Fibre lengths at rest: the fibre pulls as hard as its tendon. */
void tendon_start(const Case *c, const double *q, const double *u, double *z) {
  for (int i = 0; i < 6 && c->val[V_strain] > 0; i++) {
    double whole = whole_length(c, i, q), low = 0.2 * whole - 0.2 * MUSCLE[i].slack, high = whole - MUSCLE[i].slack;
    for (int n = 0; n < 60; n++) {
      double mid = 0.5 * (low + high);
      if (fibre_force(MUSCLE + i, u[i], mid, 0) > tendon_force(MUSCLE + i, c->val[V_strain], mid, whole)) high = mid;
      else low = mid;
    }
    z[2 + i] = 0.5 * (low + high);
  }
}
