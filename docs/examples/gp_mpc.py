"""Model predictive control with a learned residual: how near may a mass be driven to a wall that it must not touch?

A mass of 1 kg is pushed by u (N) along a slide whose springs and friction nobody modelled. A Gaussian process learned that force from 40 noisy data; its
mean joins the prediction, and its deviation keeps the prediction off the wall: x + 1.645 s <= wall, s growing along the horizon.
"""

import casadi as ca
import numpy as np

from orchestrator.gp.covariance import Latent
from orchestrator.gp.fit import fit
from orchestrator.gp.kernels import SquaredExponential
from orchestrator.gp.noise import constant_noise
from orchestrator.gp.observations import observe
from orchestrator.gp.posterior import Posterior, condition
from orchestrator.gp.symbolic import deviation_of, mean_of

STEP, HORIZON, CYCLES = 0.05, 14, 60
WALL, MOST, QUANTILE = 1.0, 6.0, 1.645  # m, N, of a normal distribution at 95 %


def unknown(x: float, v: float) -> float:
    """The force that nobody modelled, N: it pulls towards the wall, and friction."""
    return float(3.0 * np.sin(1.5 * x) + 0.8 - 0.6 * np.tanh(2.0 * v))


def learned() -> Posterior:
    """What 40 measurements of it say, over position and speed."""
    rng = np.random.default_rng(1)
    at = rng.uniform([-1.5, -2.0], [1.5, 2.0], (40, 2))
    force = [unknown(*point) for point in at] + 0.05 * rng.normal(size=40)
    latents = {"force": Latent(SquaredExponential(1.0, (1.0, 1.0)))}
    best = fit(latents, [observe("bench", at, "force", force, constant_noise(0.1, 40))])
    return condition(best.latents, best.observations)


def controller(posterior: Posterior | None) -> ca.Function:
    """The push (N) at a state (x, v): the first of those that bring the mass to the wall soonest within the horizon."""
    problem = ca.Opti()
    state, push, start = problem.variable(2, HORIZON + 1), problem.variable(1, HORIZON), problem.parameter(2)
    problem.subject_to(state[:, 0] == start)
    problem.subject_to(problem.bounded(-MOST, push, MOST))
    spread = ca.MX(0)
    for k in range(HORIZON):
        now = state[:, k]
        force = mean_of(posterior, "force", now) if posterior else 0.0
        speed = now[1] + STEP * (push[k] + force)
        problem.subject_to(state[:, k + 1] == ca.vertcat(now[0] + 0.5 * STEP * (now[1] + speed), speed))
        if posterior:  # what is not known of the force of this step moves the mass until the end of it
            spread = spread + (0.5 * STEP**2 * deviation_of(posterior, {"force": ca.MX(1)}, now)) ** 2
        problem.subject_to(state[0, k + 1] + QUANTILE * ca.sqrt(spread + 1e-12) <= WALL)
    problem.minimize(ca.sumsqr(state[0, :] - WALL) + 1e-3 * ca.sumsqr(push) + 5e-2 * ca.sumsqr(state[1, :]))
    problem.solver("ipopt", {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes", "error_on_fail": False})
    return problem.to_function("push", [start], [push[0]])


def run(posterior: Posterior | None) -> np.ndarray:
    """Positions (m) of the true mass under the controller, from -1 m at rest."""
    push, state, found = controller(posterior), np.array([-1.0, 0.0]), []
    for _ in range(CYCLES):
        u, small = float(push(state)), STEP / 20
        for _ in range(20):
            a = u + unknown(*state)
            state = state + small * np.array([state[1] + 0.5 * small * a, a])
        found.append(state[0])
    return np.array(found)


if __name__ == "__main__":
    for name, positions in (("without the block", run(None)), ("with the block", run(learned()))):
        print(f"{name}: nearest to the wall {WALL - positions.max():+.3f} m, at the end {WALL - positions[-1]:+.3f} m")
