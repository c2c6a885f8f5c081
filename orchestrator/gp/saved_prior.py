"""Physics models in files of blocks: named, with their version and what they expect, so that no other one takes their place."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from orchestrator.gp.covariance import Latent
from orchestrator.gp.observations import Observation
from orchestrator.gp.physics import PriorMean, physics_of, prior_from

# What a model expects is kept at so many of the data; another version that says the same there, up to this, is the same.
_POINTS, _SAME = 20, 1e-6


def expected_of(name: str, latent: Latent, observations: Sequence[Observation]) -> dict[str, Any]:
    """What a file says of a prior mean: its model with the version, and what it expects at some of the data.

    Args:
        name: name of the latent function, for messages.
        latent: the function.
        observations: the data.

    Raises:
        MisfitError: if the mean is code and names no model.
    """
    physics = physics_of(latent)
    if physics is None or physics.origin is None:
        raise MisfitError(
            f"{name} has a prior mean that names no model and cannot be saved; make it by prior_means_of, or let another "
            "component add it"
        )
    return {**asdict(physics.origin), "expected": physics.mean(_places(observations)).tolist()}


def same_as_saved(name: str, given: Mapping[str, Any], observations: Sequence[Observation]) -> PriorMean:
    """The prior mean that a file names, if its model still says what it said when the block was made.

    Args:
        name: name of the latent function, for messages.
        given: what the file says of its mean.
        observations: the data in the file.

    Raises:
        MisfitError: if there is no such model, or it says something else: the block was learned as what another lacks.
    """
    prior = prior_from(given)
    if "expected" not in given or given.get("version") == prior.version:
        return prior
    then, now = np.array(given["expected"], dtype=float), prior.mean(_places(observations))
    off = np.abs(then - now).max() if then.shape == now.shape else np.inf
    if not off <= _SAME * max(float(np.abs(then).max()), 1e-300):
        raise MisfitError(
            f"{name} was learned beside version {str(given.get('version'))[:8]} of {given['model']}; this one, {prior.version[:8]}, "
            f"says something else (off by up to {off:.3g}): learn the block again, or use the model of then"
        )
    return prior


def _places(observations: Sequence[Observation]) -> NDArray[np.float64]:
    """Points of some of the data, (at most 20, d)."""
    points = np.concatenate([each.inputs for each in observations])
    return points[np.unique(np.linspace(0, len(points) - 1, _POINTS).astype(int))]
