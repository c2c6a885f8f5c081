"""What was seen: linear combinations of latent functions, at points, with noise."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fmus.errors import MisfitError
from orchestrator.gp.noise import LearntNoise

Array = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Observation:
    """values_i = sum over latent functions f of coefficients[f]_i f(inputs_i) + noise_i.

    `inputs` is (n, d). `values` is (n,) or (n, p): p components, independent functions with the same kernel. A
    coefficient is a number or (n,), and holds for all components; where components mix, give each a latent function of
    its own. `noise` is the standard deviation in the unit of the values, a number or (n,), or noise to be learnt.
    """

    name: str
    inputs: Array
    coefficients: Mapping[str, Array]
    values: Array
    noise: Array | LearntNoise

    @property
    def deviation(self) -> Array:
        """Standard deviation of the noise, (n,)."""
        return self.noise.deviation if isinstance(self.noise, LearntNoise) else self.noise

    def rows(self, chosen: Array) -> "Observation":
        """Some of the observations, by number or by a mask."""
        noise = self.noise
        noise = noise.rows(chosen) if isinstance(noise, LearntNoise) else noise[chosen]
        parts = {name: each[chosen] for name, each in self.coefficients.items()}
        return replace(self, inputs=self.inputs[chosen], coefficients=parts, values=self.values[chosen], noise=noise)


def observe(
    name: str,
    inputs: ArrayLike,
    of: str | Mapping[str, ArrayLike],
    values: ArrayLike,
    noise: ArrayLike | LearntNoise,
) -> Observation:
    """Make an observation of one latent function by its name, or of a combination by coefficients; checks all of it.

    Args:
        name: name of the observation, for messages.
        inputs: (n, d), or (n,) for one input.
        of: name of a latent function, or coefficients, (n,) or one number, by name.
        values: (n, p), or (n,) for one component.
        noise: standard deviation of each value, (n,) or one number; or noise that is to be learnt.

    Raises:
        MisfitError: if shapes do not fit, a number is not finite or a standard deviation is negative.
    """
    x, y = _table(name, "inputs", inputs), _table(name, "values", values)
    if len(x) != len(y):
        raise MisfitError(f"{name}: {len(x)} rows of inputs and {len(y)} rows of values; expected one for each")
    parts = coefficients_of(of, len(x), name)
    if isinstance(noise, LearntNoise):
        if len(noise.features) != len(x):
            raise MisfitError(f"{name}: noise for {len(noise.features)} observations, there are {len(x)}")
        return Observation(name, x, parts, y, noise)
    spread = _column(name, "noise", noise, len(x))
    if (spread < 0.0).any():
        raise MisfitError(f"{name}: noise = {spread.min():g}; expected standard deviations, 0 or more")
    return Observation(name, x, parts, y, spread)


def coefficients_of(of: str | Mapping[str, ArrayLike], count: int, name: str) -> dict[str, Array]:
    """Coefficients by latent function, each (count,); a name alone means 1.

    Args:
        of: name of a latent function, or coefficients by name.
        count: number of rows.
        name: name of the observation, for messages.

    Raises:
        MisfitError: if there are none, or they are not one for each row.
    """
    given = {of: 1.0} if isinstance(of, str) else of
    if not given:
        raise MisfitError(f"{name}: no latent function; expected a name, or coefficients by name")
    return {latent: _column(name, f"coefficient of {latent}", each, count) for latent, each in given.items()}


@dataclass(frozen=True, eq=False)
class Rows:
    """Observations below each other: inputs (n, d), and for each latent function what it counts in each row, (n,)."""

    inputs: Array
    coefficients: Mapping[str, Array]


def stacked(observations: Sequence[Observation]) -> Rows:
    """Rows of all observations; a latent function that an observation does not name counts 0 there.

    Raises:
        MisfitError: if there are none, or they differ in the number of inputs or components.
    """
    if not observations:
        raise MisfitError("no observations; expected at least one")
    first = observations[0]
    for each in observations:
        for what, mine, theirs in (("inputs", first.inputs, each.inputs), ("components", first.values, each.values)):
            if mine.shape[1] != theirs.shape[1]:
                raise MisfitError(f"{each.name} has {theirs.shape[1]} {what}, {first.name} has {mine.shape[1]}")
    names = dict.fromkeys(name for each in observations for name in each.coefficients)
    parts = {
        name: np.concatenate([each.coefficients.get(name, np.zeros(len(each.inputs))) for each in observations])
        for name in names
    }
    return Rows(np.concatenate([each.inputs for each in observations]), parts)


def _table(name: str, what: str, given: ArrayLike) -> Array:
    table = np.array(given, dtype=float)
    if table.ndim == 1:
        table = table[:, None]
    if table.ndim != 2 or 0 in table.shape:
        raise MisfitError(f"{name}: {what} of shape {table.shape}; expected (n, columns) with at least one of each")
    _finite(name, what, table)
    return table


def _column(name: str, what: str, given: ArrayLike, count: int) -> Array:
    column = np.array(given, dtype=float)
    if column.shape not in ((), (count,)):
        raise MisfitError(f"{name}: {what} of shape {column.shape}; expected a number or ({count},)")
    _finite(name, what, column)
    return np.broadcast_to(column, (count,)).copy()


def _finite(name: str, what: str, numbers: Array) -> None:
    bad = np.argwhere(~np.isfinite(numbers))
    if len(bad):
        place = f" in row {bad[0][0] + 1}" if numbers.ndim else ""
        value = numbers[tuple(bad[0])]
        raise MisfitError(f"{name}: {what}{place} is {value}; leave out observations that are no numbers")
