"""Which latent functions the missing force on an output needs: each is judged by what the data lose without it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from orchestrator.gp.covariance import Latent, Latents
from orchestrator.gp.fit import Fit, fit
from orchestrator.gp.kernels import SquaredExponential
from orchestrator.gp.limits import Limits
from orchestrator.gp.observations import Observation

# A length scale is expected about twice the deviation of its input, by a factor of 3: functions of muscles and joints
# bend once or twice over a range of motion, and a bound that is reached says that an input does not count.
_SCALE, _SPREAD, _REACH = 2.0, 3.0, (0.05, 30.0)
# Of the mean square of what is missing, how much the variance of one function may be: functions that are much larger
# than their sum cancel each other along the learning trials, and nowhere else.
_VARIANCE = (1e-8, 4.0)
# A function that contributes less than this share of what is missing is left out before the others are judged.
_NEGLIGIBLE = 0.02
# Starts where there are few functions; with many of them their variances begin alike and the data choose.
_STARTS, _FEW = 2, 2
# Nats: what decides are tens of them.
_ENOUGH = 0.01


@dataclass(frozen=True)
class Verdict:
    """What is said of a latent function: `factor` it is multiplied by ("": none), and whether the data need it.

    `size` is the root mean square of what it contributes, in the unit of the output, `gain` by how many nats the data
    are more probable with it, `price` how many its hyperparameters must gain (half the logarithm of the number of data
    for each).
    """

    function: str
    output: str
    factor: str
    size: float
    gain: float
    price: float

    @property
    def needed(self) -> bool:
        """Whether the data need it."""
        return self.gain > self.price


def needed_functions(observation: Observation, output: str) -> tuple[Fit, tuple[Verdict, ...]]:
    """Fit all functions that an observation names, and again those that it needs.

    Returns:
        The last fit, whose observation names what is left, and a verdict on each function.
    """
    # Short pulses may lie between all data that were taken: nothing is said of a function that is never seen.
    seen = [name for name, a in observation.coefficients.items() if np.any(a != 0.0)]
    whole = _fitted(_with(observation, seen))
    sizes = dict.fromkeys(observation.coefficients, 0.0) | _sizes(whole)
    scale = float(np.sqrt(np.mean(observation.values**2)))
    counts = [name for name, size in sizes.items() if size > _NEGLIGIBLE * scale]
    best = whole if len(counts) == len(seen) else _fitted(_with(observation, counts), whole.latents)
    price = 0.5 * (1 + observation.inputs.shape[1]) * float(np.log(len(observation.inputs)))
    gains: dict[str, float] = {}
    for name in counts:
        rest = [other for other in counts if other != name]
        gains[name] = float(_fitted(_with(observation, rest), best.latents).value - best.value)
    kept = [name for name in counts if gains[name] > price]
    most = best
    if len(kept) < len(counts):
        best = _fitted(_with(observation, kept), most.latents)
    # Functions that stand in for each other, such as one alone and one times an input that hardly moves: each can be spared, all cannot.
    # The largest are tried again first, at the price of one of so many (extended BIC).
    spared = sorted((name for name in counts if name not in kept), key=lambda name: -sizes[name])
    for name in spared:
        if not best.value - most.value > price:
            break
        more = _fitted(_with(observation, [*kept, name]), most.latents)
        gain = float(best.value - more.value)
        if gain > price + np.log(len(spared)):
            gains[name], best, kept = gain, more, [*kept, name]
    verdicts = tuple(
        Verdict(name, output, name.removeprefix(output).removeprefix(":"), sizes[name], gains.get(name, 0.0), price)
        for name in sizes
    )
    return best, verdicts


def _with(observation: Observation, names: Sequence[str]) -> Observation:
    return replace(observation, coefficients={n: a for n, a in observation.coefficients.items() if n in names})


def _fitted(observation: Observation, begin: Latents | None = None) -> Fit:
    """All hyperparameters of an observation's functions, from those given or from the size of the data."""
    spread = np.std(observation.inputs, axis=0)
    spread = np.where(spread > 0.0, spread, 1.0)
    square = max(float(np.mean(observation.values**2)), 1e-24)
    latents, limits = {}, {}
    for name, a in observation.coefficients.items():
        unit = square / float(np.mean(a**2))
        kernel = SquaredExponential(0.3 * unit, tuple(map(float, _SCALE * spread)))
        limits[f"{name}.variance"] = Limits(_VARIANCE[0] * unit, _VARIANCE[1] * unit)
        latents[name] = begin[name] if begin and name in begin else Latent(kernel)
        for k, s in enumerate(map(float, spread)):
            limits[f"{name}.length_scales[{k + 1}]"] = Limits(
                _REACH[0] * s, _REACH[1] * s, median=_SCALE * s, spread=_SPREAD
            )
    starts = 1 if begin is not None or len(latents) > _FEW else _STARTS
    return fit(latents, [observation], limits, starts=starts, promise=_ENOUGH)


def _sizes(found: Fit) -> dict[str, float]:
    """Root mean square of what each function contributes at the data."""
    from orchestrator.gp.posterior import condition

    posterior, (observation,) = condition(found.latents, found.observations), found.observations
    return {
        name: float(np.sqrt(np.mean((a * posterior.mean(name, observation.inputs)[:, 0]) ** 2)))
        for name, a in observation.coefficients.items()
    }
