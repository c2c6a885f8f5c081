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
