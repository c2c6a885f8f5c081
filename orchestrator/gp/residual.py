"""Corrections to learn from: what a physics model lacks along measured trials, as observations."""

import numpy as np
from numpy.typing import ArrayLike

from fmus.errors import MisfitError
from orchestrator.gp.observations import Observation, observe
from orchestrator.models.missing_force import Force


def corrections(name: str, force: Force, inputs: ArrayLike, spacing: float | None = None) -> list[Observation]:
    """The missing force on each output as an observation of the latent function of that name, with its own standard deviations.

    Args:
        name: of the trial, for messages.
        inputs: (n, d) what the functions depend on, at the times of the force, such as positions and speeds from its `states`.
        spacing: s from one datum to the next, at most once in the duration of the force by itself: errors of neighbours
            are alike.

    Raises:
        MisfitError: if inputs do not fit the times, or spacing is not positive.
    """
    x = np.asarray(inputs, dtype=float)
    if len(x) != len(force.time):
        raise MisfitError(
            f"{name}: {len(x)} rows of inputs, the force has {len(force.time)} samples; give one for each"
        )
    found = []
    for k, output in enumerate(force.names):
        apart = float(force.duration[k]) if spacing is None else spacing
        if not apart > 0.0:
            raise MisfitError(f"{name}: data every {apart:g} s; expected a time above 0")
        steps = np.floor((force.time - force.time[0]) / apart)
        rows = np.flatnonzero(np.diff(steps, prepend=-1.0) > 0.0)
        found.append(observe(f"{name} {output}", x[rows], output, force.mean[rows, k], force.std[rows, k]))
    return found
