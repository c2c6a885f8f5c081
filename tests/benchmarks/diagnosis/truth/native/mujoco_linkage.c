/* The same two links in MuJoCo, which derives their dynamics itself; compiled where MuJoCo is installed. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <mujoco/mujoco.h>
#include "truth.h"

static mjModel *model = NULL;
static mjData *data = NULL;
static double built[N_VALUES];

static int build(const double *val) {
  char xml[2048], error[500] = "";
  double load = val[V_mw] > 0 ? val[V_mw] : 0;
  snprintf(xml, sizeof xml,
    "<mujoco><option gravity='%.17g %.17g 0'/><compiler boundmass='0' boundinertia='0' balanceinertia='true' inertiafromgeom='false'/><worldbody>"
    "<body><inertial pos='%.17g 0 0' mass='%.17g' diaginertia='%.17g %.17g %.17g'/><joint axis='0 0 1'/>"
    "<body pos='%.17g 0 0'><inertial pos='%.17g 0 0' mass='%.17g' diaginertia='%.17g %.17g %.17g'/><joint axis='0 0 1'/>"
    "<site name='wrist' pos='%.17g 0 0'/>"
    "<body pos='%.17g 0 0'><inertial pos='0 0 0' mass='%.17g' diaginertia='1e-12 1e-12 1e-12'/></body>"
    "</body></body></worldbody></mujoco>",
    val[V_gx], val[V_gy], val[V_cm1], val[V_m1], val[V_I1], val[V_I1], val[V_I1],
    val[V_l1], val[V_cm2], val[V_m2], val[V_I2], val[V_I2], val[V_I2], val[V_l2], val[V_l2], load + 1e-12);
  if (data) mj_deleteData(data);
  if (model) mj_deleteModel(model);
  mjSpec *spec = mj_parseXMLString(xml, NULL, error, sizeof error);
  model = spec ? mj_compile(spec, NULL) : NULL;
  if (spec) mj_deleteSpec(spec);
  data = model ? mj_makeData(model) : NULL;
  memcpy(built, val, sizeof built);
  return data != NULL;
}

int mujoco_linkage(const double *val, double t, const double *q, const double *v, const double *f, double *mass, double *rhs) {
  if ((!data || memcmp(built, val, sizeof built)) && !build(val)) return 0;
  memcpy(data->qpos, q, 2 * sizeof *q);
  memcpy(data->qvel, v, 2 * sizeof *v);
  mj_fwdPosition(model, data);
  mj_fwdVelocity(model, data);
  mjtNum jacobian[6], full[4];
  mj_jacSite(model, data, jacobian, NULL, 0);
  mj_fullM(model, data, full);
  double vx = jacobian[0] * v[0] + jacobian[1] * v[1], vy = jacobian[2] * v[0] + jacobian[3] * v[1];
  double drag = val[V_dw] * sqrt(vx * vx + vy * vy), push = push_size(val, t);
  double px = f[0] + val[V_fx0] - drag * vx + push * cos(val[V_pushangle]);
  double py = f[1] + val[V_fy0] - drag * vy + push * sin(val[V_pushangle]);
  for (int i = 0; i < 2; i++) {
    mass[2 * i] = full[2 * i];
    mass[2 * i + 1] = full[2 * i + 1];
    rhs[i] = data->qfrc_passive[i] - data->qfrc_bias[i] + jacobian[i] * px + jacobian[2 + i] * py;
  }
  return 1;
}
