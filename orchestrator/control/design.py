"""Feedback of joint torques: gains that balance error and effort, and the margins of the sampled loop."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import control
import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from orchestrator.cosim.component import Component

Array = NDArray[Any]


def linearised(
    component: Component, states: Sequence[str], inputs: Sequence[str], at: Mapping[str, float]
) -> tuple[Array, Array]:
    """A (n, n) and B (n, m) of dx = A x + B u about the values `at` of states and inputs.

    The component is initialised there and has not begun to run: it is for this alone.

    Args:
        component: the plant.
        states: names of n states.
        inputs: names of m inputs.
        at: their values.

    Raises:
        ComponentError: if the FMU gives no directional derivatives.
    """
    component.set(list(at), list(at.values()))
    component.initialise(0.0, None, None)
    component.start()
    component.set([name for name in inputs if name in at], [at[name] for name in inputs if name in at])
    rates = [f"der({name})" for name in states]
    columns = [component.derivative(rates, [name], [1.0]) for name in (*states, *inputs)]
    component.terminate()
    found = np.array(columns).T
    return found[:, : len(states)], found[:, len(states) :]


@dataclass(frozen=True)
class Wanted:
    """How feedback weighs: `angle` rad and `speed` rad/s of error count as `torque` N.m of effort does."""

    angle: float = 0.1
    speed: float = 1.0
    torque: float = 2.0


@dataclass(frozen=True, eq=False)
class Margins:
    """How far a loop is from instability, broken at its torques.

    `modulus` is the least distance from -1 over all directions and frequencies (the least singular value of I + L).
    `gain` and `phase` (joints,) are factor and rad that the loop of one joint bears while the others are closed, a
    factor below 1 if less gain is what it does not bear; `delay` is the time in s that the worst of these phases stands
    for. `decay` is the slowest rate of the closed loop in 1/s, negative if it is unstable.
    """

    modulus: float
    gain: tuple[float, ...]
    phase: tuple[float, ...]
    delay: float
    decay: float


def gains(a: Array, b: Array, wanted: Wanted) -> Array:
    """State feedback K (p, n) for torques u = -K x that minimises weighed errors and torques (linear-quadratic regulator).

    Args:
        a, b: dx = a x + b u with angles, then speeds in x, and torques in u (N.m).

    Raises:
        MisfitError: if torques do not reach all that is unstable.
    """
    n, p = b.shape
    errors = np.diag(np.repeat([wanted.angle**-2, wanted.speed**-2], n // 2))
    try:
        found, _, _ = control.lqr(a, b, errors, np.eye(p) / wanted.torque**2)
    except np.linalg.LinAlgError as error:
        raise MisfitError(f"no feedback holds this posture: {error}; expected muscles that move every joint") from error
    return np.asarray(found)


def margins(a: Array, b: Array, feedback: Array, step: float, delay_steps: int = 1) -> Margins:
    """Margins of u = -K x, computed every `step` s and applied `delay_steps` later.

    Args:
        a: (n, n), of the plant.
        b: (n, p), of the plant.
        feedback: K, (p, n).
        step: in s.
        delay_steps: steps from a measurement to its effect.
    """
    n, p = b.shape
    plant = control.c2d(control.ss(a, b, feedback, np.zeros((p, p))), step)
    shift = control.ss(np.zeros((p, p)), np.eye(p), np.eye(p), np.zeros((p, p)), step)
    loop = plant
    for _ in range(delay_steps):
        loop = loop * shift
    closed = control.feedback(loop, control.ss([], [], [], np.eye(p), step))
    frequency = np.geomspace(1e-2, np.pi / step, 2000)
    answer = control.frequency_response(loop, frequency).frdata.transpose(2, 0, 1)
    modulus = float(np.linalg.svd(np.eye(p) + answer, compute_uv=False).min())
    each = [_alone(loop, k, frequency) for k in range(p)]
    phases = [phase for _, phase, _ in each]
    times = [phase / crossing if crossing > 0.0 else np.inf for _, phase, crossing in each]
    decay = -float(np.log(max(np.abs(closed.poles()).max(), 1e-12)) / step)
    return Margins(modulus, tuple(gain for gain, *_ in each), tuple(phases), min(times), decay)


def _alone(loop: control.StateSpace, joint: int, frequency: Array) -> tuple[float, float, float]:
    """Gain margin, phase margin in rad and its frequency in rad/s of one loop while the others are closed."""
    p = loop.ninputs
    if p > 1:
        others = np.eye(p)
        others[joint, joint] = 0.0
        loop = control.feedback(loop, control.ss([], [], [], others, loop.dt))
    gain, phase, _, _, crossing, _ = control.stability_margins(
        control.frequency_response(loop[joint, joint], frequency)
    )
    return float(gain), float(np.radians(phase)), float(crossing) if np.isfinite(crossing) else 0.0
