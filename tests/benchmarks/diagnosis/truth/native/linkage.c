/* Two links in a plane from Newton's second law for each body: M = sum of m J'J + I, with Jacobians of the bodies. */
#include <math.h>
#include "truth.h"

typedef struct { double jx[2], jy[2], cx, cy; } Point; /* Jacobian and centripetal acceleration of a point */

static Point point_at(const double *q, const double *v, double first, double second) {
  double p = q[0] + q[1], w = v[0] + v[1];
  Point r;
  r.jx[1] = -second * sin(p);
  r.jy[1] = second * cos(p);
  r.jx[0] = -first * sin(q[0]) + r.jx[1];
  r.jy[0] = first * cos(q[0]) + r.jy[1];
  r.cx = -first * cos(q[0]) * v[0] * v[0] - second * cos(p) * w * w;
  r.cy = -first * sin(q[0]) * v[0] * v[0] - second * sin(p) * w * w;
  return r;
}

static void add_mass(Point r, double m, const double *val, double *mass, double *rhs) {
  for (int i = 0; i < 2; i++) {
    for (int k = 0; k < 2; k++) mass[2 * i + k] += m * (r.jx[i] * r.jx[k] + r.jy[i] * r.jy[k]);
    rhs[i] += m * (r.jx[i] * (val[V_gx] - r.cx) + r.jy[i] * (val[V_gy] - r.cy));
  }
}

double push_size(const double *val, double t) {
  if (val[V_push] == 0) return 0;
  double phase = fmod(t + 100 * val[V_pushevery], val[V_pushevery]);
  return phase < val[V_pushlength] ? val[V_push] * sin(3.141592653589793 * phase / val[V_pushlength]) : 0;
}

void plain_linkage(const double *val, double t, const double *q, const double *v, const double *f, double *mass, double *rhs) {
  Point wrist = point_at(q, v, val[V_l1], val[V_l2]);
  mass[0] = val[V_I1] + val[V_I2];
  mass[1] = mass[2] = mass[3] = val[V_I2];
  rhs[0] = rhs[1] = 0;
  add_mass(point_at(q, v, val[V_cm1], 0), val[V_m1], val, mass, rhs);
  add_mass(point_at(q, v, val[V_l1], val[V_cm2]), val[V_m2], val, mass, rhs);
  add_mass(wrist, val[V_mw], val, mass, rhs);
  double vx = wrist.jx[0] * v[0] + wrist.jx[1] * v[1], vy = wrist.jy[0] * v[0] + wrist.jy[1] * v[1];
  double drag = val[V_dw] * sqrt(vx * vx + vy * vy), push = push_size(val, t);
  double px = f[0] + val[V_fx0] - drag * vx + push * cos(val[V_pushangle]);
  double py = f[1] + val[V_fy0] - drag * vy + push * sin(val[V_pushangle]);
  for (int i = 0; i < 2; i++) rhs[i] += wrist.jx[i] * px + wrist.jy[i] * py;
}
