"""A Gaussian process in the loop of a co-simulation: predicts an effect from signals of the same instant."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fmus.errors import ComponentError, MisfitError
from orchestrator.cosim.component import Port, Timed
from orchestrator.gp.block import DEVIATION, Block
from orchestrator.gp.export import block_fmu


class GpComponent(Timed):
    """Means and standard deviations of a block, for the inputs of the same instant; time does not count."""

    kind = "gp"
    can_differentiate = True

    def __init__(self, block: Block) -> None:
        self.block = block
        units = {**block.inputs, **dict.fromkeys(block.factors, "1")}
        self._outputs = {output.name: output for output in block.outputs}
        self._values: dict[str, float] = dict.fromkeys(units, 0.0)
        ports = [Port(name, "input", unit=unit, start=0.0) for name, unit in units.items()]
        self.feedthrough: dict[str, tuple[str, ...]] = {}
        for name, output in self._outputs.items():
            for port, text in ((name, "expected value"), (name + DEVIATION, "standard deviation")):
                ports.append(Port(port, "output", unit=output.unit, description=text))
                self.feedthrough[port] = tuple(units)
        names = [port.name for port in ports]
        if len(set(names)) < len(names):
            raise MisfitError(f"inputs and outputs repeat a name: {', '.join(names)}; expected each once")
        self.ports = tuple(ports)

    def set(self, names: Sequence[str], values: Sequence[Any]) -> None:
        """Keep inputs."""
        for name, value in zip(names, values, strict=True):
            if not np.isfinite(value):
                raise ComponentError(f"input {name} = {value}; expected a finite number")
            self._values[name] = float(value)

    def get(self, names: Sequence[str]) -> list[Any]:
        """Inputs, means and standard deviations."""
        return [self._value(name) for name in names]

    def save(self) -> object:
        """The inputs."""
        return dict(self._values)

    def restore(self, state: object) -> None:
        """Go back to inputs."""
        assert isinstance(state, dict)
        self._values = dict(state)

    def derivative(self, outputs: Sequence[str], inputs: Sequence[str], seed: Sequence[float]) -> list[float]:
        """Exact slopes of means and standard deviations."""
        direction = dict(zip(inputs, seed, strict=True))
        return [self._slope(name, direction) for name in outputs]

    def write_fmu(self, path: Path) -> None:
        """The block with its data baked in."""
        block_fmu(self.block, path)

    def _slope(self, name: str, direction: Mapping[str, float]) -> float:
        if name in self._outputs:
            return self.block.slope(self._outputs[name], self._values, direction)
        return self.block.deviation_slope(self._outputs[name.removesuffix(DEVIATION)], self._values, direction)

    def _value(self, name: str) -> float:
        if name in self._values:
            return self._values[name]
        if name in self._outputs:
            return self.block.mean(self._outputs[name], self._values)
        return self.block.deviation(self._outputs[name.removesuffix(DEVIATION)], self._values)
