"""Blocks as JSON files: kernels, the data they were conditioned on, names and units, the models that are expected."""

import hashlib
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from fmus.files import write_atomically
from orchestrator.gp import kernels
from orchestrator.gp.block import Block, Output, Term
from orchestrator.gp.check import coverage, left_out
from orchestrator.gp.covariance import Latent
from orchestrator.gp.kernels import Kernel
from orchestrator.gp.observations import Observation, observe
from orchestrator.gp.physics import PriorMean, physics_of, prior_from
from orchestrator.gp.sparse import conditioned
from orchestrator.measurements.wording import listed, shown

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


SCHEMA = "misfit.gp/1"
MOST_ROWS = 100_000
# Beyond so many rows the inverse of the covariance takes too long for a file.
_MOST_SCORED = 1500
_KINDS: dict[str, Callable[..., Kernel]] = {
    kind.__name__: kind
    for kind in (
        kernels.SquaredExponential,
        kernels.Matern32,
        kernels.Matern52,
        kernels.Constant,
        kernels.Linear,
        kernels.Periodic,
        kernels.Sum,
        kernels.Product,
        kernels.OnInputs,
    )
}


def write_block(block: Block, path: Path) -> Path:
    """Write a block with the observations that its posterior is conditioned on; numbers come back as the same bits.

    Raises:
        MisfitError: if a latent function has a prior mean that is code; a physics model is named instead
            (`physics.prior_means_of`).
    """
    priors = {
        name: expected_of(name, latent, block.observations)
        for name, latent in block.posterior.latents.items()
        if latent.mean is not None
    }
    if (rows := sum(len(each.inputs) for each in block.observations)) > MOST_ROWS:
        raise MisfitError(
            f"{rows} data; a file holds at most {MOST_ROWS}: export the block as an FMU, or learn from fewer"
        )
    seen = [
        {
            "name": each.name,
            "inputs": each.inputs.tolist(),
            "coefficients": {name: parts.tolist() for name, parts in each.coefficients.items()},
            "values": each.values.tolist(),
            "noise": each.deviation.tolist(),
        }
        for each in block.observations
    ]
    content = {
        "schema": SCHEMA,
        "about": {"data_hash": hashlib.sha256(json.dumps(seen).encode()).hexdigest(), **_score(block), **block.about},
        "inputs": dict(block.inputs),
        "outputs": [
            {"name": o.name, "unit": o.unit, "component": o.component, "terms": [vars(term) for term in o.terms]}
            for o in block.outputs
        ],
        "latents": {name: _kernel_out(latent.kernel) for name, latent in block.posterior.latents.items()},
        "priors": priors,
        "observations": seen,
    }
    write_atomically(path, (json.dumps(content, indent=1) + "\n").encode())
    return path


def read_block(path: Path) -> Block:
    """Read a block and condition it again.

    Raises:
        MisfitError: if the file cannot be read or is not what `write_block` writes; the message names the file.
    """
    try:
        content = json.loads(path.read_bytes())
        if content["schema"] != SCHEMA:
            raise MisfitError(f"schema = {shown(content['schema'])}; expected {SCHEMA!r}")
        latents = {name: Latent(_kernel_in(each)) for name, each in content["latents"].items()}
        observations = tuple(
            observe(each["name"], each["inputs"], each["coefficients"], each["values"], each["noise"])
            for each in content["observations"]
        )
        for name, each in content.get("priors", {}).items():
            prior = same_as_saved(name, each, observations)
            latents[name] = Latent(latents[name].kernel, prior.mean, prior.gradient)
        outputs = [
            Output(str(each["name"]), str(each["unit"]), tuple(map(_term, each["terms"])), int(each["component"]))
            for each in content["outputs"]
        ]
        if (rows := sum(len(each.inputs) for each in observations)) > MOST_ROWS:
            raise MisfitError(f"{rows} observations; expected at most {MOST_ROWS}")
        inputs = {name: str(unit) for name, unit in content["inputs"].items()}
        posterior = conditioned(latents, observations)
        return Block(posterior, inputs, outputs, observations, _about(content.get("about", {})))
    except OSError as error:
        raise MisfitError(f"{path} cannot be read: {error.strerror}; expected a saved block") from error
    except MisfitError as error:
        raise MisfitError(f"{path}: {error}") from error
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise MisfitError(f"{path} is not a saved block: {type(error).__name__} {error}; write it again") from error


def _score(block: Block) -> dict[str, float]:
    """How a block does on data that it has not seen, where no trials were held out: each datum against all others."""
    if "held_out_after" in block.about or len(block.posterior.lower) > _MOST_SCORED:
        return {}
    if len(block.posterior.lower) < sum(len(each.inputs) for each in block.observations):
        return {}
    return {"left_out_inside_90": coverage(left_out(block.posterior))}


def _about(given: Mapping[str, Any]) -> dict[str, str | float]:
    """Texts and numbers alone; files of before have none."""
    return {str(key): value if isinstance(value, float) else str(value) for key, value in given.items()}


def _term(given: Mapping[str, Any]) -> Term:
    factor = float(given["factor"])
    if not math.isfinite(factor):
        raise MisfitError(f"a term has the factor {factor}; expected a number")
    return Term(str(given["latent"]), factor, str(given["input"]))


def _kernel_out(kernel: Kernel) -> dict[str, Any]:
    found: dict[str, Any] = {"kind": type(kernel).__name__}
    for field in fields(kernel):  # type: ignore[arg-type]
        value = getattr(kernel, field.name)
        found[field.name] = _kernel_out(value) if isinstance(value, Kernel) else value
    return found


def _kernel_in(given: Mapping[str, Any]) -> Kernel:
    if given.get("kind") not in _KINDS:
        raise MisfitError(f"a kernel of the kind {shown(given.get('kind'))}; expected one of {listed(_KINDS)}")
    values: dict[str, Any] = {
        key: _kernel_in(value) if isinstance(value, dict) else tuple(value) if isinstance(value, list) else value
        for key, value in given.items()
        if key != "kind"
    }
    return _KINDS[given["kind"]](**values)
