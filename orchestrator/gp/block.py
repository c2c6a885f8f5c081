"""Learned effects as a block: named inputs with units in, named outputs with units and uncertainty out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from orchestrator.gp.observations import Observation
from orchestrator.gp.posterior import Posterior
from orchestrator.gp.predictor import Predictor
from orchestrator.measurements.wording import listed
from orchestrator.shown import Shown, drawing_of

Array = NDArray[Any]
# What the standard deviation of an output is called: its name and this.
DEVIATION = "_sd"


@dataclass(frozen=True)
class Term:
    """What a latent function counts in an output: `factor`, times an input such as an activation where one is named."""

    latent: str
    factor: float = 1.0
    input: str = ""


@dataclass(frozen=True)
class Output:
    """A sum of terms, of one component (from 0) of the latent functions, in `unit`."""

    name: str
    unit: str
    terms: tuple[Term, ...]
    component: int = 0


@dataclass(frozen=True, eq=False)
class Block:
    """A posterior with names: `inputs` are names and units of the points' columns, in order.

    Inputs that only terms name come behind them and bear no unit. `observations` are those of the posterior. `about`
    says where the block comes from: the model and its version, the data and their hash, free-run errors along held-out
    trials.

    Raises:
        MisfitError: if names repeat, or a term or component is not there.
    """

    posterior: Posterior
    inputs: Mapping[str, str]
    outputs: Sequence[Output]
    observations: tuple[Observation, ...]
    about: Mapping[str, str | float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        d, p = self.posterior.rows.inputs.shape[1], self.posterior.weights.shape[1]
        if len(self.inputs) != d:
            raise MisfitError(f"{len(self.inputs)} names of inputs ({listed(self.inputs)}), the data have {d} inputs")
        names = [*self.inputs, *self.factors, *(output.name for output in self.outputs)]
        twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
        if twice or not self.outputs:
            raise MisfitError(
                f"the names of inputs and outputs repeat {listed(twice)}; expected outputs, each name once"
            )
        for output in self.outputs:
            if not 0 <= output.component < p:
                raise MisfitError(f"{output.name} is component {output.component + 1}; the data have {p}")
            for term in output.terms:
                if term.latent not in self.posterior.latents:
                    raise MisfitError(
                        f"{output.name} has the term {term.latent!r}; there are {listed(self.posterior.latents)}"
                    )

    @property
    def factors(self) -> tuple[str, ...]:
        """Inputs that only factors of terms name."""
        named = (term.input for output in self.outputs for term in output.terms if term.input)
        return tuple(name for name in dict.fromkeys(named) if name not in self.inputs)

    @cached_property
    def predictor(self) -> Predictor:
        """Predictions of the latent functions that outputs are made of."""
        return Predictor(self.posterior, list(dict.fromkeys(t.latent for o in self.outputs for t in o.terms)))

    def mean(self, output: Output, values: Mapping[str, float]) -> float:
        """Expected value of an output at values of all inputs."""
        mean, _ = self.predictor.combined(self.coefficients(output, values), self.point(values)[0])
        return float(mean[output.component])

    def deviation(self, output: Output, values: Mapping[str, float]) -> float:
        """Standard deviation of what is known of an output, without noise of a measurement of it."""
        _, variance = self.predictor.combined(self.coefficients(output, values), self.point(values)[0])
        return float(np.sqrt(variance))

    def predict(self, output: Output, columns: Mapping[str, Array]) -> tuple[Array, Array]:
        """Expected values and standard deviations, (n,) each, at (n,) values of all inputs."""
        of: dict[str, Array] = {}
        for term in output.terms:
            factor = term.factor * (
                columns[term.input] if term.input else np.ones(len(columns[next(iter(self.inputs))]))
            )
            of[term.latent] = of.get(term.latent, 0.0) + factor
        points = np.column_stack([columns[name] for name in self.inputs])
        mean, variance = self.posterior.predict(of, points)
        return mean[:, output.component], np.sqrt(variance)

    def slope(self, output: Output, values: Mapping[str, float], direction: Mapping[str, float]) -> float:
        """Directional derivative of the mean; inputs that the direction does not name do not move.

        Args:
            output: the output.
            values: inputs and factors by name, in their units.
            direction: how each of them moves, in its unit.

        Returns:
            In the output's unit, for a move by `direction`.
        """
        point, k = self.point(values), output.component
        seed = np.array([direction.get(name, 0.0) for name in self.inputs])
        total = float(self.posterior.gradient(self.coefficients(output, values), point)[0, k] @ seed)
        for term in output.terms:
            if direction.get(term.input, 0.0):
                total += term.factor * direction[term.input] * float(self.posterior.mean(term.latent, point)[0, k])
        return total

    def deviation_slope(self, output: Output, values: Mapping[str, float], direction: Mapping[str, float]) -> float:
        """Directional derivative of the standard deviation; 0 where it is 0, since there it has none.

        Args:
            output: the output.
            values: inputs and factors by name, in their units.
            direction: how each of them moves, in its unit.

        Returns:
            In the output's unit, for a move by `direction`.
        """
        deviation = self.deviation(output, values)
        if deviation == 0.0:
            return 0.0
        point, of = self.point(values), self.coefficients(output, values)
        seed = np.array([direction.get(name, 0.0) for name in self.inputs])
        total = float(self.posterior.variance_gradient(of, point)[0] @ seed)
        for term in output.terms:
            if direction.get(term.input, 0.0):
                shared = float(self.posterior.covariance(term.latent, point, of, point)[0, 0])
                total += 2.0 * term.factor * direction[term.input] * shared
        return total / (2.0 * deviation)

    def plot(self) -> Shown:
        """Mean and 90 % band of each output over each input, for a notebook."""
        return drawing_of("block").plot(self)

    def _repr_html_(self) -> str:
        return drawing_of("block").html(self)

    def point(self, values: Mapping[str, float]) -> Array:
        """The inputs of the latent functions, (1, d)."""
        return np.array([[values[name] for name in self.inputs]])

    def coefficients(self, output: Output, values: Mapping[str, float]) -> dict[str, float]:
        """What each latent function counts in an output."""
        found: dict[str, float] = {}
        for term in output.terms:
            factor = term.factor * (values[term.input] if term.input else 1.0)
            found[term.latent] = found.get(term.latent, 0.0) + factor
        return found
