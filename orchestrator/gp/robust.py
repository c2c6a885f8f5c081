"""Noise of data of which some are far worse than they are said to be."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from orchestrator.gp.covariance import Latents
from orchestrator.gp.observations import Observation
from orchestrator.gp.posterior import condition
from orchestrator.gp.triangle import inverse_from_factor, one_thread
from orchestrator.measurements.wording import listed

Array = NDArray[Any]
_TURNS, _SETTLED = 50, 1e-3


def trusted(
    latents: Latents, observations: Sequence[Observation], names: Collection[str], freedom: float = 3.0
) -> tuple[Observation, ...]:
    """The observations with the noise that their own errors show, where errors of some have Student's distribution.

    A datum that contradicts the others gets a larger standard deviation, so that it moves no function much; for a weak
    function beside strong ones that is the difference between learning and harm. Expectation maximisation (Lange,
    Little and Taylor 1989) for errors of the stated deviation times one factor, at least 1, which is found too.

    Args:
        names: observations whose errors may be larger than stated; others are believed.
        freedom: degrees of freedom; the fewer, the more outliers.

    Raises:
        MisfitError: if there is no observation of a name, or one has no noise.
    """
    chosen = np.concatenate([np.full(len(each.inputs), each.name in names) for each in observations])
    for name in names:
        if all(each.name != name for each in observations):
            raise MisfitError(f"there are no observations {name!r}; there are {listed([o.name for o in observations])}")
    stated = np.concatenate([each.deviation for each in observations]) ** 2
    if not np.all(stated[chosen] > 0.0):
        raise MisfitError(f"{listed(names)}: noise of 0; expected what an error is measured by")
    growth = np.ones(len(chosen))
    with one_thread():  # the same bits on any number of processors
        for _ in range(_TURNS):
            before = growth
            growth = _turn(latents, _with_growth(observations, growth), stated, chosen, freedom, growth)
            if np.max(np.abs(np.log(growth / before))) < _SETTLED:
                break
    return _with_growth(observations, growth)


def _turn(
    latents: Latents, now: Sequence[Observation], stated: Array, chosen: Array, freedom: float, growth: Array
) -> Array:
    """Growth of the variances after one step of expectation and maximisation."""
    posterior = condition(latents, now)
    p = posterior.weights.shape[1]
    noise = stated * growth
    precision = np.diagonal(inverse_from_factor(posterior.lower.copy(order="F")))
    # What is left of the errors given all data: noise times weights, with a variance for each component.
    squared = ((noise[:, None] * posterior.weights) ** 2).sum(axis=1) + p * (noise - noise**2 * precision)
    errors = squared[chosen] / stated[chosen]
    # growth = factor / trust, so the factor of the last turn is known from any datum: trust is made from it again.
    factor = 1.0
    for _ in range(_TURNS):
        trust = (freedom + p) / (freedom + errors / factor)
        last, factor = factor, max(float(np.mean(trust * errors)) / p, 1.0)
        if abs(factor - last) < _SETTLED * factor:
            break
    found = np.ones(len(stated))
    found[chosen] = np.maximum(factor / trust, 1.0)
    return found


def _with_growth(observations: Sequence[Observation], growth: Array) -> tuple[Observation, ...]:
    found, begin = [], 0
    for each in observations:
        part = growth[begin : begin + len(each.inputs)]
        begin += len(each.inputs)
        found.append(each if np.all(part == 1.0) else replace(each, noise=each.deviation * np.sqrt(part)))
    return tuple(found)
