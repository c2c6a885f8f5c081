/* Equations: two links in a plane, six Hill muscles on rigid tendons (FESArm.Arms.Arm); method and step-size control:
 * Dormand-Prince 5(4) as in Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, section II.5.
 * Constants follow from the parameters once, both sines come from two sincos, the muscles' structure is known. */
#include "arm_by_hand.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MUSCLES = 6, N = 4, STAGES = 7, INPUTS = 10 };

/* Parameters of one muscle, and what follows from them. */
typedef struct {
    double Fmax, d1, d2, Vmax, c;
    double centre; /* m, length of muscle and tendon at the optimum, from q = 0 */
    double narrow; /* 1/m, 1/(0.65 Lopt) */
} Muscle;

struct Arm {
    Muscle muscle[MUSCLES];
    double l1, l2, b1, b2, M11, M22, I2, coupling; /* M11 without its part in cos(q2); coupling = m2 l1 c2 */
    double u[INPUTS], x[N], k[STAGES][N], y[N];
    double tolerance, time, step, error;
    int slope_known;
};

static const double Kp = 7500.0;

static Muscle muscle(double Fmax, double Lslack, double Lopt, double Vmax, double a0, double d1, double d2)
{
    const double A = 0.25, gmax = 1.5;
    return (Muscle){Fmax, d1, d2, Vmax, Vmax * A * (gmax - 1.0) / (A + 1.0), a0 - Lslack - Lopt, 1.0 / (0.65 * Lopt)};
}

Arm *arm_create(const double *q, double tolerance)
{
    const double l1 = 0.33, m1 = 1.93, m2 = 1.52, c1 = 0.165, c2 = 0.19, I1 = 0.0141, I2 = 0.0188;
    Arm *arm = calloc(1, sizeof *arm);
    if (arm == NULL)
        return NULL;
    arm->muscle[0] = muscle(800, 0.0538, 0.1280, 1.280, 0.1840, 0.05, 0);
    arm->muscle[1] = muscle(800, 0.0538, 0.1280, 1.280, 0.1055, -0.05, 0);
    arm->muscle[2] = muscle(1000, 0.2298, 0.1422, 1.422, 0.4283, 0.03, 0.03);
    arm->muscle[3] = muscle(1000, 0.1905, 0.0877, 0.877, 0.1916, -0.03, -0.03);
    arm->muscle[4] = muscle(700, 0.1905, 0.0877, 0.877, 0.2387, 0, -0.03);
    arm->muscle[5] = muscle(700, 0.0175, 0.1028, 1.028, 0.1681, 0, 0.03);
    arm->l1 = l1, arm->l2 = 0.32, arm->b1 = 0.30, arm->b2 = 0.30, arm->I2 = I2;
    arm->M11 = I1 + I2 + m1 * c1 * c1 + m2 * (l1 * l1 + c2 * c2);
    arm->M22 = I2 + m2 * c2 * c2;
    arm->coupling = m2 * l1 * c2;
    arm->x[0] = q[0], arm->x[1] = q[1];
    arm->tolerance = tolerance;
    return arm;
}

void arm_free(Arm *arm) { free(arm); }

void arm_set_inputs(Arm *arm, const double *u)
{
    memcpy(arm->u, u, sizeof arm->u);
    arm->slope_known = 0;
}

const double *arm_state(const Arm *arm) { return arm->x; }

/* `stretch` is the length above the optimum, `V` the lengthening speed; both in m and m/s. */
static inline double force(const Muscle *m, double alpha, double stretch, double V)
{
    double e = stretch * m->narrow, speed;
    if (V <= 0.0)
        speed = V > -m->Vmax ? (m->Vmax + V) / (m->Vmax - 4.0 * V) : 0.0;
    else
        speed = (1.5 * V + m->c) / (V + m->c);
    double passive = stretch > 0.0 ? Kp * stretch * stretch : 0.0;
    return alpha * m->Fmax * exp(-e * e) * speed + passive;
}

static int slopes(const Arm *arm, const double *x, double *dx)
{
    double q1 = x[0], q2 = x[1], w1 = x[2], w2 = x[3];
    const double *u = arm->u;
    double tau1 = u[8] - arm->b1 * w1, tau2 = u[9] - arm->b2 * w2;
    for (int i = 0; i < 2; i++) { /* the deltoids cross the shoulder */
        const Muscle *m = &arm->muscle[i];
        tau1 += m->d1 * force(m, u[i], m->centre - m->d1 * q1, -m->d1 * w1);
    }
    for (int i = 2; i < 4; i++) { /* biceps and triceps long head cross both joints */
        const Muscle *m = &arm->muscle[i];
        double F = force(m, u[i], m->centre - m->d1 * q1 - m->d2 * q2, -m->d1 * w1 - m->d2 * w2);
        tau1 += m->d1 * F;
        tau2 += m->d2 * F;
    }
    for (int i = 4; i < 6; i++) { /* triceps short head and brachialis cross the elbow */
        const Muscle *m = &arm->muscle[i];
        tau2 += m->d2 * force(m, u[i], m->centre - m->d2 * q2, -m->d2 * w2);
    }
    double s1 = sin(q1), c1 = cos(q1), s2 = sin(q2), c2 = cos(q2);
    double x2 = arm->l2 * (c1 * c2 - s1 * s2), y2 = arm->l2 * (s1 * c2 + c1 * s2); /* the wrist from the elbow */
    tau1 += (arm->l1 * c1 + x2) * u[7] - (arm->l1 * s1 + y2) * u[6];
    tau2 += x2 * u[7] - y2 * u[6];
    double M12 = arm->M22 + arm->coupling * c2, M11 = arm->M11 + 2.0 * arm->coupling * c2;
    tau1 += arm->coupling * s2 * (2.0 * w1 + w2) * w2;
    tau2 -= arm->coupling * s2 * w1 * w1;
    double inverse = 1.0 / (M11 * arm->M22 - M12 * M12);
    dx[0] = w1;
    dx[1] = w2;
    dx[2] = (arm->M22 * tau1 - M12 * tau2) * inverse;
    dx[3] = (M11 * tau2 - M12 * tau1) * inverse;
    return isfinite(dx[2]) && isfinite(dx[3]);
}

#define COMBINE(...)                                                                                                  \
    for (int i = 0; i < N; i++)                                                                                       \
        y[i] = x[i] + h * (__VA_ARGS__);

/* All stages at once; the fifth-order result is in arm->y. Gives the scaled error, infinite where a slope is. */
static double try_step(Arm *arm, double h)
{
    const double *x = arm->x;
    double *y = arm->y, (*k)[N] = arm->k, sum = 0.0;
    COMBINE(0.2 * k[0][i])
    if (!slopes(arm, y, k[1]))
        return HUGE_VAL;
    COMBINE(3.0 / 40 * k[0][i] + 9.0 / 40 * k[1][i])
    if (!slopes(arm, y, k[2]))
        return HUGE_VAL;
    COMBINE(44.0 / 45 * k[0][i] - 56.0 / 15 * k[1][i] + 32.0 / 9 * k[2][i])
    if (!slopes(arm, y, k[3]))
        return HUGE_VAL;
    COMBINE(19372.0 / 6561 * k[0][i] - 25360.0 / 2187 * k[1][i] + 64448.0 / 6561 * k[2][i] - 212.0 / 729 * k[3][i])
    if (!slopes(arm, y, k[4]))
        return HUGE_VAL;
    COMBINE(9017.0 / 3168 * k[0][i] - 355.0 / 33 * k[1][i] + 46732.0 / 5247 * k[2][i] + 49.0 / 176 * k[3][i] -
            5103.0 / 18656 * k[4][i])
    if (!slopes(arm, y, k[5]))
        return HUGE_VAL;
    COMBINE(35.0 / 384 * k[0][i] + 500.0 / 1113 * k[2][i] + 125.0 / 192 * k[3][i] - 2187.0 / 6784 * k[4][i] +
            11.0 / 84 * k[5][i])
    if (!slopes(arm, y, k[6]))
        return HUGE_VAL;
    for (int i = 0; i < N; i++) {
        double error = h * (71.0 / 57600 * k[0][i] - 71.0 / 16695 * k[2][i] + 71.0 / 1920 * k[3][i] -
                            17253.0 / 339200 * k[4][i] + 22.0 / 525 * k[5][i] - 1.0 / 40 * k[6][i]);
        double scaled = error / (arm->tolerance * fmax(1.0, fmax(fabs(x[i]), fabs(y[i]))));
        sum += scaled * scaled;
    }
    return sqrt(sum / N);
}

int arm_step(Arm *arm, double h_total)
{
    double end = arm->time + h_total;
    if (!arm->slope_known && !slopes(arm, arm->x, arm->k[0]))
        return -1;
    while (arm->time < end) {
        double left = end - arm->time, h = arm->step > 0.0 ? arm->step : left;
        int last = 1.01 * h >= left;
        if (last)
            h = left;
        double error = try_step(arm, h);
        if (error <= 1.0) {
            double before = arm->error > 0.0 ? arm->error : 1e-4;
            double shrink = pow(error, 0.2 - 0.75 * 0.04) / pow(before, 0.04) / 0.9;
            double next = h / fmin(5.0, fmax(0.1, shrink));
            arm->step = last ? fmax(arm->step, next) : next;
            arm->error = fmax(error, 1e-4);
            arm->time = last ? end : arm->time + h;
            memcpy(arm->x, arm->y, sizeof arm->x);
            memcpy(arm->k[0], arm->k[6], sizeof arm->k[0]);
        } else {
            arm->step = h / fmin(5.0, fmax(1.1, isfinite(error) ? pow(error, 0.17) / 0.9 : 5.0));
            if (arm->step < 1e-15 * left)
                return -1;
        }
    }
    arm->slope_known = 1;
    return 0;
}
