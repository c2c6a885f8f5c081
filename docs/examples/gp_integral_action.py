"""Integral action beside a learned feed-forward: what the block does not know is left to the integrator.

A joint of 0.2 kg.m2 holds a posture against a spring that a Gaussian process has learned, and against a load that it has not. The learned torque is fed
forward, which takes the work off the feedback; the integrator takes the load's rest away.
"""

import casadi as ca
import numpy as np

from orchestrator.gp.covariance import Latent
from orchestrator.gp.kernels import SquaredExponential
from orchestrator.gp.observations import observe
from orchestrator.gp.posterior import condition
from orchestrator.gp.symbolic import mean_of

INERTIA, STEP, STOP, GOAL, LOAD = 0.2, 0.002, 6.0, 0.6, -0.4  # kg.m2, s, s, rad, N.m
PROPORTIONAL, DAMPING, INTEGRAL = 4.0, 1.2, 5.0  # N.m/rad, N.m.s/rad, N.m/(rad.s)


def spring(q: float) -> float:
    """The torque that was learned, N.m."""
    return float(-2.0 * np.sin(2.0 * q) - q)


def feed_forward() -> ca.Function:
    """The torque that holds the learned spring at q, as a compiled-ready CasADi function."""
    q = np.linspace(-1.0, 1.5, 25)
    posterior = condition({"spring": Latent(SquaredExponential(4.0, (0.8,)))},
                          [observe("bench", q, "spring", [spring(each) for each in q], 0.02)])  # fmt: skip
    x = ca.MX.sym("q")
    return ca.Function("feed_forward", [x], [-mean_of(posterior, "spring", x)])


def run(learned: bool, integral: float) -> np.ndarray:
    """Errors (rad) of the joint on its way to the goal, under the load."""
    forward, q, w, gathered, held, errors = feed_forward(), 0.0, 0.0, 0.0, 0.0, []
    for k in range(round(STOP / STEP)):
        error = GOAL - q
        gathered += STEP * error
        if learned and k % 5 == 0:  # the block at 100 Hz is enough
            held = float(forward(q))
        torque = held + PROPORTIONAL * error - DAMPING * w + integral * gathered
        w += STEP * (torque + spring(q) + LOAD) / INERTIA
        q += STEP * w
        errors.append(error)
    return np.array(errors)


if __name__ == "__main__":
    for learned, integral in ((False, 0.0), (True, 0.0), (True, INTEGRAL)):
        found = run(learned, integral)
        print(f"learned torque {learned}, integral {integral:g}: error at the end {found[-1]:+.4f} rad")
