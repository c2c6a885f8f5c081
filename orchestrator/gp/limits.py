"""Bounds and priors of hyperparameters: from what the data can show, or from the user, with units."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from fmus.units import si_exponents
from orchestrator.gp.likelihood import Likelihood
from orchestrator.gp.observations import Observation, stacked
from orchestrator.measurements.wording import listed

Array = NDArray[Any]
# A length scale beyond this many times the range of an input says that the function is straight in it; data of that range
# cannot show more. Below the smaller share of it, neighbouring points would say nothing of each other.
REACH = (0.01, 10.0)
_VARIANCE = 1e6
_WEIGHT = 10.0
# A start farther than this factor from the scale of the data (its square for a variance) is a number in other units.
FAR = 30.0
_NOISE_SHARE = 0.1
# What is expected of a length scale, as a share of the range, and by what factor; of variances and of noise, by what factor.
_LENGTH, _LENGTH_BY = 0.25, 2.5
_VARIANCE_BY, _NOISE_BY = 10.0, 5.0
_LENGTH_SCALE = re.compile(r"^(.*?)\.(?:.*\.)?length_scales\[(\d+)\]$")


@dataclass(frozen=True)
class Limits:
    """Where a hyperparameter may lie, and where it is expected: a log-normal prior about `median` by a factor `spread`.

    Numbers are in `unit`; "" stands for the unit of the data. Weights of noise have a normal prior: `median` is its mean,
    `spread` its deviation.
    """

    low: float
    high: float
    unit: str = ""
    median: float | None = None
    spread: float = 2.0


@dataclass(frozen=True)
class Units:
    """Units of the inputs, (d,), and of the values; "" where nobody said."""

    inputs: Sequence[str] = ()
    values: str = ""


@dataclass(frozen=True, eq=False)
class Box:
    """Bounds and priors in the parameters of a `Likelihood`: low, high, prior mean and precision, each (k,); what is held."""

    low: Array
    high: Array
    mean: Array
    precision: Array
    held: tuple[str, ...]

    def prior(self, parameters: Array) -> tuple[float, Array]:
        """Negative logarithm of the prior but for a constant, and its gradient."""
        off = parameters - self.mean
        return 0.5 * float(self.precision @ (off * off)), self.precision * off


def box(likelihood: Likelihood, observations: Sequence[Observation], limits: Mapping[str, Limits], units: Units) -> Box:
    """Bounds of all parameters; those that `limits` does not name follow from the data.

    A length scale lies within `REACH` of the range of its input where the latent function is seen. Where the input never
    varies, the data say nothing about its length scale: it stays what the kernel has, and is named in `held`.

    Args:
        likelihood: the likelihood, with its parameters.
        observations: the data.
        limits: bounds by the parameters' names.
        units: units of inputs and outputs by name.

    Raises:
        MisfitError: if a limit names no parameter, is empty, or has a unit of another dimension.
    """
    for name in limits:
        if name not in likelihood.names:
            raise MisfitError(f"limits for {name!r}, which is no hyperparameter; there are {listed(likelihood.names)}")
    rows = stacked(observations)
    low, high, held = likelihood.start.copy(), likelihood.start.copy(), []
    mean, precision = np.zeros(len(low)), np.zeros(len(low))
    for k, name in enumerate(likelihood.names):
        if name in limits:
            low[k], high[k], mean[k], precision[k] = _given(name, limits[name], likelihood.logarithmic[k], units)
            continue
        scale = _LENGTH_SCALE.search(name)
        if scale is None:
            reach = np.log(_VARIANCE) if likelihood.logarithmic[k] else _WEIGHT
            at = np.array([low[k], *_shown(name, observations)])
            low[k], high[k] = at.min() - reach, at.max() + reach
            continue
        seen = rows.inputs[rows.coefficients[scale[1]] != 0.0, int(scale[2]) - 1]
        if np.ptp(seen) > 0.0:
            low[k], high[k] = np.log(np.ptp(seen) * np.array(REACH))
        else:
            held.append(name)
    return Box(low, high, mean, precision, tuple(held))


def begun(likelihood: Likelihood, observations: Sequence[Observation]) -> Array:
    """The parameters given, (k,), those of them moved to the scale of the data that are farther than a factor from it.

    A search from a variance of 1 for values of 1e4 ends in an optimum where all is noise. Variances and deviations of
    noise begin within `FAR` of what the values show, length scales within `FAR` of the range of their input.
    """
    start, rows = likelihood.start.copy(), stacked(observations)
    for k, name in enumerate(likelihood.names):
        scale = _LENGTH_SCALE.search(name)
        if scale is not None:
            seen = rows.inputs[rows.coefficients[scale[1]] != 0.0, int(scale[2]) - 1]
            shown = [float(np.log(np.ptp(seen)))] if np.ptp(seen) > 0.0 else []
        else:
            shown = _shown(name, observations)
        if shown and abs(start[k] - np.mean(shown)) > np.log(FAR) * (2.0 if name.endswith(".variance") else 1.0):
            start[k] = float(np.mean(shown)) + (np.log(_NOISE_SHARE) if name.endswith(".log deviation") else 0.0)
    return start


def weak_priors(likelihood: Likelihood, observations: Sequence[Observation], given: Box) -> Box:
    """The box with priors for parameters that have none: what is expected of a function before its size and shape are known.

    Log-normal: a variance about the mean square of the values by that of the function's coefficients, by a factor of 10;
    noise about a tenth of the values' root mean square, by a factor of 5; a length scale about a quarter of the range of
    its input (about four turns of the function within it), by a factor of 2.5. Each factor is one standard deviation.

    Args:
        likelihood: the likelihood, with its parameters.
        observations: the data.
        given: the box; what has a prior or is held keeps that.
    """
    mean, precision, rows = given.mean.copy(), given.precision.copy(), stacked(observations)
    for k, name in enumerate(likelihood.names):
        if precision[k] > 0.0 or given.low[k] == given.high[k]:
            continue
        scale, shown = _LENGTH_SCALE.search(name), _shown(name, observations)
        if scale is not None:
            seen = rows.inputs[rows.coefficients[scale[1]] != 0.0, int(scale[2]) - 1]
            mean[k], precision[k] = np.log(_LENGTH * np.ptp(seen)), np.log(_LENGTH_BY) ** -2
        elif shown:
            noise = name.endswith(".log deviation")
            share, factor = (np.log(_NOISE_SHARE), _NOISE_BY) if noise else (0.0, _VARIANCE_BY)
            mean[k], precision[k] = np.mean(shown) + share, np.log(factor) ** -2
    return Box(given.low, given.high, mean, precision, given.held)


def _shown(name: str, observations: Sequence[Observation]) -> list[float]:
    """Where the values themselves put a parameter: the logarithm of a variance or of a deviation of noise, if it is one."""
    first = name.split(".")[0]
    if name.endswith(".variance"):
        # A function's values are what is seen of it by its coefficients, whatever unit these have.
        seen = [(each.values, each.coefficients[first]) for each in observations if first in each.coefficients]
        power = 2.0
    elif name.endswith(".log deviation"):
        seen = [(each.values, np.ones(1)) for each in observations if name == f"{each.name}.log deviation"]
        power = 1.0
    else:
        return []
    squares = [(float(np.mean(values**2)), float(np.mean(by**2))) for values, by in seen]
    return [0.5 * power * float(np.log(square / by)) for square, by in squares if square > 0.0 and by > 0.0]


def _given(name: str, limits: Limits, logarithmic: bool, units: Units) -> tuple[float, float, float, float]:
    factor = _factor(name, limits.unit, units) if logarithmic else 1.0
    numbers = np.array([limits.low, limits.high, limits.low if limits.median is None else limits.median]) * factor
    if not limits.low <= limits.high or not np.isfinite(numbers).all() or (logarithmic and numbers.min() <= 0.0):
        raise MisfitError(
            f"{name}: limits from {limits.low:g} to {limits.high:g} {limits.unit}, median {limits.median}; "
            f"expected low <= high{', all positive' if logarithmic else ''}"
        )
    if limits.median is not None and not limits.spread > (1.0 if logarithmic else 0.0):
        raise MisfitError(f"{name}: a spread of {limits.spread:g}; expected a factor above 1 (a deviation for noise)")
    low, high, median = np.log(numbers) if logarithmic else numbers
    spread = np.log(limits.spread) if logarithmic else limits.spread
    return low, high, median, 0.0 if limits.median is None else 1.0 / spread**2


def _factor(name: str, unit: str, units: Units) -> float:
    """What turns a number in the limit's unit into one in the units of the data."""
    if not unit:
        return 1.0
    column = re.search(r"(?:length_scales|periods)\[(\d+)\]$", name)
    if column is not None and int(column[1]) <= len(units.inputs):
        target, power = units.inputs[int(column[1]) - 1], 1
    elif name.endswith(".variance"):
        target, power = units.values, 2
    else:
        raise MisfitError(f"{name}: a limit in {unit}, but the unit of the data is not known; give a plain number")
    from_unit, to_unit = si_exponents(unit), si_exponents(target)
    if from_unit.dimension != {base: power * each for base, each in to_unit.dimension.items()}:
        wanted = f"({target})^2" if power == 2 else target
        raise MisfitError(f"{name}: a limit in {unit}; expected a unit that converts to {wanted}")
    return from_unit.factor / to_unit.factor**power
