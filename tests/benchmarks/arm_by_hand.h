/* The nominal arm (physiological set) as somebody would write it who needs nothing else: the yardstick of step_cost.c. */
#ifndef ARM_BY_HAND_H
#define ARM_BY_HAND_H

typedef struct Arm Arm;

/* At rest at `q` (2 angles, rad); NULL when memory is exhausted. */
Arm *arm_create(const double *q, double tolerance);
void arm_free(Arm *arm);

/* Six activations, then the force on the wrist (N) and the torques at the joints (N.m). */
void arm_set_inputs(Arm *arm, const double *u);

/* Advances by `h` s with DOPRI5; returns 0, or -1 when the error cannot be kept. */
int arm_step(Arm *arm, double h);

/* Two angles in rad, two speeds in rad/s. */
const double *arm_state(const Arm *arm);

#endif
