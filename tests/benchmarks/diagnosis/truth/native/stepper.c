/* Runge-Kutta steps of fourth order between the events of dry friction (stopping, sticking, breaking away) and of play. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "truth.h"

typedef struct { double q[2], v[2], z[NZ]; } State;
typedef struct { const double *u; int rows, width; double h; } Inputs;

/* Inputs are straight between the samples of their grid. */
static void inputs_at(const Inputs *in, double t, double *u) {
  double at = t / in->h;
  int k = (int)floor(at + 1e-9);
  if (k < 0) k = 0;
  if (k > in->rows - 2) k = in->rows - 2;
  double part = at - k;
  for (int i = 0; i < in->width; i++) u[i] = (1 - part) * in->u[k * in->width + i] + part * in->u[(k + 1) * in->width + i];
}

static State shifted(const State *s, const State *slope, double h, int dofs) {
  State r = *s;
  for (int j = 0; j < dofs; j++) r.q[j] += h * slope->q[j], r.v[j] += h * slope->v[j];
  for (int i = 0; i < NZ; i++) r.z[i] += h * slope->z[i];
  return r;
}

static State slope_of(Case *c, const Inputs *in, double t, const State *s, const int *mode) {
  State d;
  double u[MOST_INPUTS] = {0};
  memset(&d, 0, sizeof d);
  if (in->width) inputs_at(in, t, u);
  for (int j = 0; j < c->dofs; j++) d.q[j] = s->v[j];
  accelerations(c, t, s->q, s->v, s->z, u, mode, d.v, d.z);
  return d;
}

static State runge_kutta(Case *c, const Inputs *in, double t, double h, const State *s, const int *mode) {
  State k1 = slope_of(c, in, t, s, mode), a = shifted(s, &k1, h / 2, c->dofs);
  State k2 = slope_of(c, in, t + h / 2, &a, mode), b = shifted(s, &k2, h / 2, c->dofs);
  State k3 = slope_of(c, in, t + h / 2, &b, mode), e = shifted(s, &k3, h, c->dofs);
  State k4 = slope_of(c, in, t + h, &e, mode), r = *s;
  for (int j = 0; j < c->dofs; j++) {
    r.q[j] += h / 6 * (k1.q[j] + 2 * k2.q[j] + 2 * k3.q[j] + k4.q[j]);
    r.v[j] += h / 6 * (k1.v[j] + 2 * k2.v[j] + 2 * k3.v[j] + k4.v[j]);
  }
  for (int i = 0; i < NZ; i++) r.z[i] += h / 6 * (k1.z[i] + 2 * k2.z[i] + 2 * k3.z[i] + k4.z[i]);
  return r;
}

/* A joint at rest stays stuck while friction can hold it, else it starts against the friction. */
static void choose_modes(Case *c, const Inputs *in, double t, const State *s, int *mode) {
  for (int round = 0; round < 2; round++) {
    slope_of(c, in, t, s, mode);
    for (int j = 0; j < c->dofs; j++)
      if (c->level[j] > 0 && mode[j] == 0 && fabs(c->need[j]) > c->level[j]) mode[j] = c->need[j] > 0 ? -1 : 1;
  }
}

/* Side on which a shaft with play touches. */
static int touching(const Case *c, const State *s) {
  double twist = s->q[0] - s->q[1], half = 0.5 * c->val[V_gap];
  return c->kind == TWO_MASS && half > 0 ? (twist > half) - (twist < -half) : 0;
}

/* Share of a step after which the shaft first touches or lets go, by bisection; 1 if it does neither. */
static double until_contact(Case *c, const Inputs *in, double t, double h, const State *s, const int *mode, const State *end) {
  if (touching(c, end) == c->contact) return 1;
  double low = 0, high = 1;
  for (int i = 0; i < 45; i++) {
    double mid = 0.5 * (low + high);
    State there = runge_kutta(c, in, t, mid * h, s, mode);
    if (touching(c, &there) == c->contact) low = mid;
    else high = mid;
  }
  return high;
}

/* Whether a joint no longer turns by its mode, or dry friction no longer holds it. */
static int is_over(Case *c, const Inputs *in, double t, const State *s, const int *mode, int joint) {
  if (mode[joint]) return mode[joint] * s->v[joint] < 0;
  slope_of(c, in, t, s, mode);
  return fabs(c->need[joint]) > c->level[joint];
}

/* Share of a step after which a joint with dry friction stops or breaks away, by bisection; 1 if it does neither. Were its
   speed straight within the step, what is left of it when it stops would be a jolt at every reversal, and those of a fast
   machine would be more than a small friction does. */
static double until_over(Case *c, const Inputs *in, double t, double h, const State *s, const int *mode, const State *end,
                         int joint) {
  if (c->level[joint] <= 0 || !is_over(c, in, t + h, end, mode, joint)) return 1;
  double low = 0, high = 1;
  for (int i = 0; i < 45; i++) {
    double mid = 0.5 * (low + high);
    State there = runge_kutta(c, in, t, mid * h, s, mode);
    if (is_over(c, in, t + mid * h, &there, mode, joint)) high = mid;
    else low = mid;
  }
  return high;
}

static State advance(Case *c, const Inputs *in, double t, double h, State s, int *mode) {
  double done = 0;
  for (int event = 0; event < 12 && h - done > 1e-12; event++) {
    choose_modes(c, in, t + done, &s, mode);
    State next = runge_kutta(c, in, t + done, h - done, &s, mode);
    double first = 1;
    int which = -1;
    for (int j = 0; j < c->dofs; j++) {
      double share = until_over(c, in, t + done, h - done, &s, mode, &next, j);
      if (share < first) first = share, which = j;
    }
    double meeting = until_contact(c, in, t + done, h - done, &s, mode, &next);
    if (meeting < first) {
      s = runge_kutta(c, in, t + done, meeting * (h - done), &s, mode);
      c->contact = touching(c, &s);
      done += meeting * (h - done);
      continue;
    }
    if (which < 0) return next;
    double part = first * (h - done);
    s = runge_kutta(c, in, t + done, part, &s, mode);
    s.v[which] = 0;
    mode[which] = 0;
    done += part;
  }
  return h - done > 1e-12 ? runge_kutta(c, in, t + done, h - done, &s, mode) : s;
}

int n_values(void) { return N_VALUES; }

static const char *const NAMES[] = {
#define NAME(name) #name,
  VALUES(NAME)
#undef NAME
};
const char *value_name(int i) { return NAMES[i]; }

/* Run from rest of all hidden states. q0, v0: (dofs,), replaced by the last; u: (steps + 1, width) at the steps; out:
   (steps + 1, 2 dofs) positions and speeds. Returns 0, or the step at which the motion left all bounds. */
int simulate(int kind, int use_mujoco, const double *val, double start, double h, int steps, int width, const double *u,
             double *q0, double *v0, double *out) {
  Case c = {kind, kind == PENDULUM || kind == DRIVE ? 1 : 2, use_mujoco, val, NULL, 0, h, {0, 0}, {0, 0}, 0};
  Inputs in = {u, steps + 1, width, h};
  double *speeds = malloc(sizeof(double) * 2 * (steps + 1)), *shifted_val = malloc(sizeof(double) * N_VALUES);
  int mode[2] = {0, 0}, failed = 0;
  State s;
  memset(&s, 0, sizeof s);
  memcpy(shifted_val, val, sizeof(double) * N_VALUES);
  shifted_val[V_trp] += 2 * 3.141592653589793 * val[V_trf] * start;
  c.val = shifted_val;
  c.speeds = speeds;
  for (int j = 0; j < c.dofs; j++) s.q[j] = q0[j], s.v[j] = v0[j], mode[j] = (s.v[j] > 0) - (s.v[j] < 0);
  c.contact = touching(&c, &s);
  if (kind == ARM) tendon_start(&c, s.q, u, s.z);
  /* tendons are stiff, and play repeats errors of a step */
  int parts = val[V_strain] > 0 ? tendon_parts(val[V_strain], h) : val[V_gap] > 0 ? 4 : 1;
  for (int n = 0; n <= steps && !failed; n++) {
    for (int j = 0; j < c.dofs; j++) {
      out[n * 2 * c.dofs + j] = s.q[j];
      out[n * 2 * c.dofs + c.dofs + j] = s.v[j];
      speeds[2 * n + j] = s.v[j];
      if (!(fabs(s.q[j]) < 1e4)) failed = n;
    }
    c.steps = n + 1;
    for (int k = 0; k < parts && n < steps; k++) s = advance(&c, &in, (n + (double)k / parts) * h, h / parts, s, mode);
  }
  for (int j = 0; j < c.dofs; j++) q0[j] = s.q[j], v0[j] = s.v[j];
  free(speeds);
  free(shifted_val);
  return failed;
}
