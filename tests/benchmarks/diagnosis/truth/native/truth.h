/* The truth simulator of the diagnosis benchmark. It shares no code and no equations with modelica/ or orchestrator/. */
#ifndef TRUTH_H
#define TRUTH_H

/* Every number that describes a machine or an effect, by name; all are 0 unless set. Python reads the names from here. */
#define VALUES(X) \
  /* two-link arm and double pendulum: length, mass, centre of mass, inertia, damping; plane field */ \
  X(l1) X(l2) X(m1) X(m2) X(cm1) X(cm2) X(I1) X(I2) X(nb1) X(nb2) X(gx) X(gy) \
  /* pendulum and cart: mass, distance and inertia of the swinging body, gravity, cart; drive and two-mass drive */ \
  X(m) X(a) X(I) X(g) X(M) X(J) X(JMotor) X(JLoad) X(k) X(d) X(gap) \
  /* joint torques: viscous, Coulomb, Stribeck extra and its speed, square drag, spring, constant, cubic spring */ \
  X(b1) X(b2) X(c1) X(c2) X(s1) X(s2) X(vs) X(d1) X(d2) X(k1) X(k2) X(t1) X(t2) X(cube1) X(cube2) \
  /* Bouc-Wen loop, cogging, rotor inertia, one-sided stop (above: side 1, below: -1), tremor */ \
  X(h1) X(h2) X(hx) X(hsigma) X(g1) X(g2) X(gn) X(gphase) X(j1) X(j2) X(stop1) X(stop2) X(stopat) X(side) \
  X(tr1) X(tr2) X(trf) X(trp) \
  /* wrist: point mass, square drag, constant force, unknown pushes (size, direction, period, length) */ \
  X(mw) X(dw) X(fx0) X(fy0) X(push) X(pushangle) X(pushevery) X(pushlength) \
  /* friction outside the library: varying with position, with the other joint's speed, warming up */ \
  X(fpos) X(fwave) X(fother) X(warm) X(warmtime) \
  /* muscles: factors on moment arms, stretch reflex, tendon strain at the largest force (0: rigid) */ \
  X(ma1) X(ma2) X(ma3) X(ma4) X(ma5) X(ma6) X(rgain) X(rdelay) X(strain) \
  /* tanks: cross sections, outlets, leaks, height of an overflow, share of the first outlet that clogs and its time */ \
  X(A1) X(A2) X(a1) X(a2) X(leak1) X(leak2) X(overflow) X(clog) X(clogtime)

#define NAME(name) V_##name,
enum { VALUES(NAME) N_VALUES };
#undef NAME

enum { ARM, DOUBLE_PENDULUM, PENDULUM, CART, DRIVE, TWO_MASS };
enum { NZ = 8 };           /* hidden states: loops of two joints (0, 1), fibre lengths of six muscles (2..7) */
enum { MOST_INPUTS = 8 };

typedef struct {
  int kind, dofs, use_mujoco;
  const double *val;
  const double *speeds;    /* joint speeds so far, 2 a step, for the reflex */
  int steps;               /* how many */
  double h;                /* step, s */
  double need[2];          /* friction torque that would hold a stuck joint, set by accelerations() */
  double level[2];         /* size of the dry friction of each joint, set by accelerations() */
  int contact;             /* side on which a shaft with play pulls: 1, -1, or 0 within the play */
} Case;

/* Accelerations `a` and rates `dz` of hidden states; mode[j] is the sign of motion against dry friction, 0: stuck. */
void accelerations(Case *c, double t, const double *q, const double *v, const double *z, const double *u,
                   const int *mode, double *a, double *dz);
/* Smooth torques of the effects at the joints, all but dry friction. */
void joint_torques(const Case *c, double t, const double *q, const double *v, const double *z, double *tau, double *dz);
double dry_friction(const Case *c, int joint, const double *q, const double *v);
/* Torques of six muscles at activations u; `w` (2,) are joint speeds. */
void muscle_torques(const Case *c, double t, const double *q, const double *w, const double *z, const double *u,
                    double *tau, double *dz);
void tendon_start(const Case *c, const double *q, const double *u, double *z);
int tendon_parts(double strain, double h);
/* Mass matrix (row by row) and the right-hand side without applied torques: centripetal, weight and wrist forces. */
void plain_linkage(const double *val, double t, const double *q, const double *v, const double *f, double *mass, double *rhs);
#ifdef NO_MUJOCO
#define mujoco_linkage(...) 0
#else
int mujoco_linkage(const double *val, double t, const double *q, const double *v, const double *f, double *mass, double *rhs);
#endif
double push_size(const double *val, double t);
#endif
