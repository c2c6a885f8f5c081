"""A Gaussian process as a block: fit it to data, give it more, save it, export it as an FMU."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fmus.errors import MisfitError

if TYPE_CHECKING:
    from orchestrator.gp.block import Block as Learned
    from orchestrator.gp.observations import Observation
    from orchestrator.shown import Shown


@dataclass(frozen=True, eq=False)
class Block:
    """Outputs as learned functions of inputs, with their uncertainty; never changed: `condition` gives a new one.

    Make one with `Block.fit` or `Block.read`.
    """

    learned: "Learned"

    @staticmethod
    def fit(
        inputs: Mapping[str, Any],
        outputs: Mapping[str, Any],
        *,
        units: Mapping[str, str] | None = None,
        noise: Mapping[str, float] | None = None,
        kernel: str = "squared_exponential",
        outliers: bool = False,
        seed: int = 0,
    ) -> "Block":
        """Learn each output as a smooth function of the inputs.

        The kernel has a length for each input; its size, lengths and unknown noise are those that make the data most probable (exact marginal likelihood). Up to 200 data, which leave them open, they are those
        that come nearest to all sets that the data allow, so that 90 % intervals hold about 90 %. More than 5000 data
        are taken in through 500 of their rows (`orchestrator.gp.sparse`).

        Args:
            inputs: (n,) arrays by name.
            outputs: (n,) arrays by name.
            units: by name of inputs and outputs; "1" where one is missing.
            noise: standard deviation of the measurement of an output, in its unit; learned where it is not given.
            kernel: squared_exponential for smooth functions, matern52 or matern32 for rougher ones.
            outliers: whether some data may be far worse than that: what contradicts the others is given the noise that
                it shows (errors of Student's distribution).
            seed: of the random starts of the search.

        Raises:
            MisfitError: if lengths differ, a number is not finite, there is no such kernel, or the data give no likelihood.
        """
        from orchestrator.gp.learned import learned_block

        x, known = _points(inputs), units or {}
        if not outputs:
            raise MisfitError("Block.fit: there are no outputs to learn")
        learned = learned_block(
            dict(zip(inputs, x.T, strict=True)),
            {name: _array(name, values, len(x)) for name, values in outputs.items()},
            {name: known.get(name, "1") for name in (*inputs, *outputs)},
            kernel,
            noise or {},
            outliers,
            seed,
        )
        return Block(learned)

    @staticmethod
    def read(path: "str | Path") -> "Block":
        """Read a block that `save` or `misfit learn` wrote.

        Raises:
            MisfitError: if the file is no block.
        """
        from orchestrator.gp.saved import read_block

        return Block(read_block(Path(path)))

    @property
    def inputs(self) -> dict[str, str]:
        """Units of the inputs, by name."""
        return dict(self.learned.inputs)

    @property
    def outputs(self) -> dict[str, str]:
        """Units of the outputs, by name."""
        return {output.name: output.unit for output in self.learned.outputs}

    def condition(
        self, inputs: Mapping[str, Any], outputs: Mapping[str, Any], noise: Mapping[str, float] | None = None
    ) -> "Block":
        """Give the block with further data in it, with the hyperparameters that it has.

        Args:
            inputs: (n,) arrays by name, all inputs of the block.
            outputs: (n,) arrays by name, some of its outputs.
            noise: standard deviation of an output's measurement in its unit; without it that of the data in the block.

        Raises:
            MisfitError: if a name is none of the block, or lengths differ.
        """
        from orchestrator.gp.observations import observe
        from orchestrator.gp.sparse import conditioned

        x = _points({name: _named(inputs, name) for name in self.learned.inputs})
        found = list(self.learned.observations)
        for name, values in outputs.items():
            given = next((output for output in self.learned.outputs if output.name == name), None)
            if given is None:
                raise MisfitError(f"the block has no output {name!r}; it has {', '.join(self.outputs)}")
            if given.component or any(term.input for term in given.terms):
                raise MisfitError(f"{name} is a product of inputs and latent functions; make it with orchestrator.gp")
            deviation = (noise or {}).get(name, self._noise_of(found, given.terms[0].latent))
            factors = {term.latent: term.factor for term in given.terms}
            found.append(observe(f"{name} {len(found)}", x, factors, _array(name, values, len(x)), deviation))
        posterior = conditioned(self.learned.posterior.latents, found)
        return Block(replace(self.learned, posterior=posterior, observations=tuple(found)))

    def predict(self, inputs: Mapping[str, Any], output: str | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Mean and standard deviation (without noise of a measurement), each (n,), in the unit of the output.

        Args:
            inputs: (n,) arrays or numbers by name, all inputs of the block.
            output: which one; the first without it.

        Raises:
            MisfitError: if an input is missing or there is no such output.
        """
        wanted = output or next(iter(self.outputs))
        found = next((each for each in self.learned.outputs if each.name == wanted), None)
        if found is None:
            raise MisfitError(f"the block has no output {wanted!r}; it has {', '.join(self.outputs)}")
        names = [*self.learned.inputs, *self.learned.factors]
        columns = [np.atleast_1d(np.asarray(_named(inputs, name), dtype=float)) for name in names]
        return self.learned.predict(found, dict(zip(names, np.broadcast_arrays(*columns), strict=True)))

    def coverage(
        self, inputs: Mapping[str, Any], outputs: Mapping[str, Any], noise: Mapping[str, float]
    ) -> dict[str, float]:
        """Which share of data that were not learned lies inside the 90 % intervals, by output: near 0.9 for a sound block.

        Args:
            inputs: (n,) arrays by name, all inputs of the block.
            outputs: (n,) arrays by name, some of its outputs.
            noise: standard deviation of the measurement of each of them, in its unit.

        Raises:
            MisfitError: if a name is none of the block, or lengths differ.
        """
        from orchestrator.gp.check import coverage

        found = {}
        for name, values in outputs.items():
            mean, deviation = self.predict(inputs, name)
            y = _array(name, values, len(mean))
            if name not in noise:
                raise MisfitError(f"Block.coverage: noise of {name} is missing; expected its standard deviation")
            found[name] = coverage((y - mean) / np.hypot(deviation, noise[name]))
        return found

    def left_out(self) -> float:
        """The same share of the data in the block, each against all others, without learning again."""
        from orchestrator.gp.check import coverage, left_out

        count = sum(len(each.inputs) for each in self.learned.observations)
        if len(self.learned.posterior.lower) < count:
            raise MisfitError(
                f"left_out: {count} data were taken in through fewer rows; use coverage with data that were not learned"
            )

        return coverage(left_out(self.learned.posterior))

    def save(self, path: "str | Path") -> Path:
        """Write the block with its data as JSON; returns the path.

        Raises:
            MisfitError: if a latent function has a prior mean that is code and no physics model.
        """
        from orchestrator.gp.saved import write_block

        return write_block(self.learned, Path(path))

    def to_fmu(self, path: "str | Path", *, fmi_version: str = "2.0") -> Path:
        """Write the block as an FMU with its data baked in: expected values and standard deviations; returns the path.

        Args:
            path: the file, `NAME.fmu`.
            fmi_version: `"2.0"` or `"3.0"`.

        Raises:
            MisfitError: if there is no C compiler, or the file cannot be written.
        """
        from orchestrator.gp.export import block_fmu

        target = Path(path)
        if target.suffix != ".fmu":
            raise MisfitError(f"{target}: expected a file NAME.fmu")
        return block_fmu(self.learned, target, fmi_version)

    def plot(self) -> "Shown":
        """Mean and 90 % band of each output over each input, for a notebook."""
        return self.learned.plot()

    def _repr_html_(self) -> str:
        return self.learned._repr_html_()

    def _noise_of(self, observations: "list[Observation]", latent: str) -> float:
        """Median standard deviation of the observations of a latent function."""
        seen = [each.deviation for each in observations if latent in each.coefficients]
        return float(np.median(np.concatenate(seen)))


def _points(inputs: Mapping[str, Any]) -> np.ndarray:
    if not isinstance(inputs, Mapping) or not inputs:
        raise MisfitError("inputs of a block: expected a mapping from name to array (n,)")
    first = next(iter(inputs.values()))
    return np.column_stack([_array(name, values, len(first)) for name, values in inputs.items()])


def _array(name: str, values: Any, count: int) -> np.ndarray:
    try:
        found = np.array(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise MisfitError(f"{name} holds values that are no numbers") from error
    if found.shape != (count,):
        raise MisfitError(f"{name} has the shape {found.shape}; expected ({count},), as the first input has")
    if not np.isfinite(found).all():
        raise MisfitError(f"{name} holds numbers that are not finite")
    return found


def _named(inputs: Mapping[str, Any], name: str) -> Any:
    if name not in inputs:
        raise MisfitError(f"the input {name!r} of the block is missing; given were {', '.join(inputs)}")
    return inputs[name]
