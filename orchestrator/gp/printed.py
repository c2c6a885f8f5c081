"""The single-muscle form that the study prints, with the readings of its damaged block, as variants of the observations.

The exact joint posterior takes all observations as they are. The printed form keeps, for one latent function, only its
own data and the observations of combinations that it takes part in; its block of the latter is read in three ways.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

from fmus.errors import MisfitError
from orchestrator.gp.covariance import Latents
from orchestrator.gp.observations import Observation
from orchestrator.gp.posterior import Posterior, condition

Reading = Literal["raw", "residual", "sum"]


def condition_printed(
    latents: Latents, observations: Sequence[Observation], latent: str, reading: Reading
) -> Posterior:
    """The posterior of one latent function in the printed form.

    `raw`: the block is a_i^2 k_i, combinations taken as if the latent function alone made them. `residual`: the same,
    of combinations less what the data of the other functions alone say about these. `sum`: the block is the sum over
    all functions.

    Args:
        latents: the latent functions.
        observations: the data.
        latent: name of the one that is wanted.
        reading: "raw", "residual" or "sum".

    Raises:
        MisfitError: if the latent function is in no observation or the reading is none of these.
    """
    own = [each for each in observations if latent in each.coefficients]
    if not own:
        raise MisfitError(f"no observation of {latent}; expected its own data or combinations with it")
    if reading == "sum":
        return condition(latents, own)
    if reading not in ("raw", "residual"):
        raise MisfitError(f"reading = {reading!r}; expected raw, residual or sum")
    alone = {name: [each for each in observations if set(each.coefficients) == {name}] for name in latents}
    return condition(latents, [_single(latents, each, latent, alone if reading == "residual" else {}) for each in own])


def _single(
    latents: Latents, observation: Observation, latent: str, alone: dict[str, list[Observation]]
) -> Observation:
    values = observation.values
    for name, coefficient in observation.coefficients.items():
        if name != latent and alone.get(name):
            values = values - coefficient[:, None] * condition(latents, alone[name]).mean(name, observation.inputs)
    return replace(observation, coefficients={latent: observation.coefficients[latent]}, values=values)
